"""A log as a chapter before anybody fits anything: its time, its columns and what they look like."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.quantities import two_figures
from upright.readers.inspection import Column, Inspection
from upright.records import Record
from upright.report.drawing import CYCLE, GREY, decimated, figure, hide_inner_times, styled
from upright.report.page import Chapter, Part, Picture, Points, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_PANELS = 8


def chapter(record: Record, inspection: Inspection) -> Chapter:
    """What a log holds."""
    drawn = Picture(
        name="columns",
        draw=lambda: draw_columns(record, inspection),
        caption="The columns over time; grey: at rest, dotted: gaps.",
        description="; ".join(f"{c.name} from {c.low:.5g} to {c.high:.5g}" for c in inspection.columns),
    )
    notes = (Points(tuple(f"Note: {note}" for note in inspection.notes)),) if inspection.notes else ()
    name = f"{inspection.file} ({inspection.reader})" if inspection.file else f"A log of a {inspection.reader}"
    content = (Points(tuple(_time_lines(inspection))), _table(inspection), *notes, drawn)
    return Chapter(title=name, verdict="", parts=(Part(name, content),))


def _table(inspection: Inspection) -> Table:
    rows = tuple(
        (
            c.name, c.unit or (f"{c.guess}?" if c.guess else ""), f"{c.low:.5g}", f"{c.high:.5g}", str(c.resolution),
            "; ".join(_remarks(c)),
        )
        for c in inspection.columns
    )  # fmt: skip
    return Table(
        caption="Columns", headings=("column", "unit", "lowest", "highest", "resolution", "remarks"), rows=rows,
        numbers=(2, 3),
    )  # fmt: skip


def _time_lines(inspection: Inspection) -> list[str]:
    """Sentences about the time base."""
    time = inspection.time
    lines = [
        f"{time.samples} samples over {time.duration:.6g} s, period {time.period * 1e3:.6g} ms"
        + f" ({1 / time.period:.5g} Hz)"
        + (f", rebuilt from stamps rounded to {time.rounding * 1e3:g} ms" if time.rebuilt else "")
        + (f", jitter {time.jitter * 1e3:.3g} ms (99 %)" if time.jitter > 0.01 * time.period else "")
        + "."
    ]
    if abs(time.late) > 1.5 * time.period:
        lines.append(f"The first sample is at {time.late:.6g} s, not at 0.")
    if time.gaps:
        largest = max(time.gaps, key=lambda gap: gap.length)
        lines.append(
            f"{len(time.gaps)} gap{'s' if len(time.gaps) > 1 else ''}, the largest {largest.length * 1e3:.4g} ms"
            f" at {largest.start:.5g} s ({largest.missing} sample{'s' if largest.missing > 1 else ''} missing)."
        )
    if inspection.rests:
        spans = ", ".join(f"{start:.4g} to {stop:.4g} s" for start, stop in inspection.rests[:6])
        lines.append(f"Nothing moves: {spans}.")
    return lines


def _remarks(column: Column) -> list[str]:
    """Short remarks on one column."""
    if column.constant:
        return ["idle, always 0" if column.idle else f"constant {column.low:g}"]
    remarks = list(column.remarks)
    if column.drive and not remarks:
        remarks.append("drives?")
    if column.switches and not column.stepwise:
        remarks.append(
            ", ".join(f"{'back at' if value == 0 else 'leaves'} 0 at {t:.4g} s" for t, value in column.switches)
        )
    elif column.switches and len(column.switches) <= 6:
        remarks.append("switches " + ", ".join(f"to {value:.4g} at {t:.4g} s" for t, value in column.switches))
    if column.drive:
        for share, level in ((column.low_share, column.low), (column.high_share, column.high)):
            if share and not column.stepwise:
                remarks.append(f"at {level:.4g} for {two_figures(100 * share)} % of the samples (saturated?)")
    if column.turns:
        remarks.append(f"offset of {column.turns} turns (2 pi each)")
    return remarks


@styled
def draw_columns(record: Record, inspection: Inspection) -> Figure:
    """One panel per column over time [s]; spans at rest are grey, gaps are marked.

    Left out are columns that do not move, time and sample index; drives come last, and what two columns show alike is
    drawn once. Where nothing moves, the constant columns are drawn, so that no axis is empty.
    """
    signals = [c for c in inspection.columns if not any("the time" in s or "index" in s for s in c.remarks)] or [
        *inspection.columns
    ]
    moving = [c for c in signals if not c.constant]
    alike: dict[str, list[str]] = {}
    columns: list[Column] = []
    for column in sorted(moving or signals, key=lambda c: c.drive):
        same = next((c.name for c in columns if f"the same as '{c.name}'" in column.remarks), None)
        if same is None:
            columns.append(column)
        alike.setdefault(same or column.name, []).append(column.name)
    columns = columns[:MOST_PANELS]
    drawing = figure(1.1 + 1.15 * len(columns))
    panels: list[Any] = drawing.subplots(len(columns), 1, sharex=True, squeeze=False)[:, 0].tolist()
    for i, (axes, column) in enumerate(zip(panels, columns, strict=True)):
        colour, _ = CYCLE[i % len(CYCLE)]
        for start, stop in inspection.rests if moving else ():
            axes.axvspan(start, stop, color="#f0f0f0", linewidth=0)
        for gap in inspection.time.gaps[:20]:
            axes.axvline(gap.start, color=GREY, linewidth=0.6, linestyle=":")
        t, y = decimated(record.t, record[column.name], buckets=800)
        axes.plot(t, y, color=colour, linewidth=1.0, drawstyle="steps-post" if column.stepwise else "default")
        if column.constant:
            reach = max(abs(column.low), 1.0)  # the line in the middle, and a scale that can be read
            axes.set_ylim(column.low - reach, column.low + reach)
            axes.text(
                0.01, 0.9, f"constant {column.low:g}", transform=axes.transAxes, fontsize=8.5, color=GREY, va="top"
            )
        unit = column.unit or (f"{column.guess}?" if column.guess else "")
        name = column.name if len(column.name) <= 30 else "…" + column.name[-29:]
        name = " =\n".join([name, *alike[column.name][1:]])  # shown as the log spells it
        name = f"{name}\n[{unit}]" if unit else name
        axes.set_ylabel(name, rotation=0, ha="right", va="center", parse_math=False)
        if column.remarks and not (len(alike[column.name]) > 1 and column.remarks[0].startswith("the same as")):
            axes.set_title(column.remarks[0], fontsize=8.5, color=GREY, parse_math=False)
    hide_inner_times(panels)
    drawing.align_ylabels(panels)
    state = "grey: at rest" if moving else "nothing moves"
    drawing.suptitle(
        ", ".join(filter(None, (Path(inspection.file).name, f"{inspection.time.samples} samples", state))),
        fontsize=10,
        parse_math=False,
    )
    return drawing
