"""What does a log look like before anybody fits anything?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.readers.inspection import Column, Inspection
from upright.records import Record
from upright.report.drawing import CYCLE, GREY, decimated, figure, hide_inner_times, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_PANELS = 8


def worth_drawing(seen: Inspection) -> tuple[Column, ...]:
    """Columns that move and are neither time nor sample index, at most `MOST_PANELS`; drives come last."""
    kept = [c for c in seen.columns if not c.constant and not any("the time" in s or "index" in s for s in c.lies)]
    return tuple(sorted(kept, key=lambda c: c.drive)[:MOST_PANELS])


@styled
def draw_columns(record: Record, seen: Inspection) -> Figure:
    """One panel per column over time [s]; spans at rest are grey, gaps are marked."""
    columns = worth_drawing(seen)
    drawing = figure(1.1 + 1.15 * max(len(columns), 1))
    panels: list[Any] = drawing.subplots(max(len(columns), 1), 1, sharex=True, squeeze=False)[:, 0].tolist()
    for i, (axes, column) in enumerate(zip(panels, columns, strict=False)):
        colour, _ = CYCLE[i % len(CYCLE)]
        for start, stop in seen.rests:
            axes.axvspan(start, stop, color="#f0f0f0", linewidth=0)
        for gap in seen.time.gaps[:20]:
            axes.axvline(gap.start, color=GREY, linewidth=0.6, linestyle=":")
        t, y = decimated(record.t, record[column.name], buckets=800)
        axes.plot(t, y, color=colour, linewidth=1.0, drawstyle="steps-post" if column.stepwise else "default")
        unit = column.unit or (f"{column.guess}?" if column.guess else "")
        name = column.name if len(column.name) <= 30 else "…" + column.name[-29:]
        label = axes.set_ylabel(f"{name}\n[{unit}]" if unit else name, rotation=0, ha="right", va="center")
        label.set_parse_math(False)  # names of columns are shown as the log spells them
        if column.lies:
            told = axes.set_title(column.lies[0], fontsize=8, color=GREY)
            told.set_parse_math(False)
    hide_inner_times(panels)
    drawing.align_ylabels(panels)
    title = drawing.suptitle(f"{Path(seen.file).name}, {seen.time.samples} samples, grey: at rest", fontsize=10)
    title.set_parse_math(False)
    return drawing


@styled
def save_columns(record: Record, seen: Inspection, path: Path) -> None:
    """Write the figure of a log as SVG, PNG or PDF, by the suffix of `path`."""
    drawing = draw_columns(record, seen)
    drawing.savefig(path, dpi=130, metadata={"Date": None} if path.suffix == ".svg" else None)
