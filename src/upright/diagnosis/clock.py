"""Faults of the time base: gaps, jitter, doubled rows, rounded stamps, a clock that starts again."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from upright.diagnosis.case import Case
from upright.diagnosis.findings import Curve, Finding, Panel
from upright.errors import BadInput
from upright.readers import read_source, reader_of
from upright.readers.formats.delimited import layout
from upright.readers.source import Source, load
from upright.records import Array, PathLike, Record
from upright.records.columns import time_scale
from upright.signals.stretches import pieces

LOOSE = 0.05
"""Jitter, as part of the period, from which straight lines between samples replace the samples."""


def examine_clock(case: Case) -> list[Finding]:
    """Findings about the time base."""
    return [*_rounding(case), *_gaps(case), *_jitter(case), *_doubled(case)]


def steps_panel(t: Array) -> Panel:
    """Time between samples, over time."""
    return Panel(label="time since last sample [ms]",
                 curves=(Curve(name="steps", t=t[1:], y=np.diff(t) * 1e3, style="points"),))  # fmt: skip


def _rounding(case: Case) -> Iterator[Finding]:
    time = case.inspection.time
    if not time.rebuilt:
        coarse = time.rounding > 0.1 * time.period and time.jitter > LOOSE * time.period
        if not coarse:
            return
        yield Finding(
            kind="clock",
            columns=("time",),
            severity="warning",
            sentence=f"The time stamps are rounded to {time.rounding * 1e3:g} ms, which is coarse beside the"
            f" period of {time.period * 1e3:.4g} ms, and do not follow a uniform clock.",
            evidence={"rounding [ms]": time.rounding * 1e3, "period [ms]": time.period * 1e3},
            advice="Log the sample index, or the time with more digits.",
            panels=(steps_panel(case.record.t),),
        )
        return
    note = next(n for n in case.inspection.notes if "rebuilt from the sample index" in n)
    wander = re.search(r"wander up to ([\d.e-]+) ms", note)
    yield Finding(
        kind="clock",
        columns=("time",),
        severity="note",
        sentence=f"The time stamps are rounded to {time.rounding * 1e3:g} ms and wander up to"
        f" {wander[1] if wander else '?'} ms from a uniform clock of {time.period * 1e3:.6g} ms.",
        evidence={"rounding [ms]": time.rounding * 1e3, "wander [ms]": float(wander[1]) if wander else 0.0},
        advice="Nothing: the reader rebuilds the time from the sample index.",
    )


def _gaps(case: Case) -> Iterator[Finding]:
    time = case.inspection.time
    if not time.gaps:
        return
    largest = max(time.gaps, key=lambda gap: gap.length)
    missing = sum(gap.missing for gap in time.gaps)
    many = len(time.gaps)
    yield Finding(
        kind="gap",
        columns=("time",),
        severity="warning" if missing > 1 or many > 1 else "note",
        sentence=f"{many} gap{'s' if many > 1 else ''} in time: about {missing} samples are missing, the longest"
        f" silence lasts {largest.length * 1e3:.4g} ms from {largest.start:.5g} s on.",
        spoils=missing > 0.1 * time.samples,
        evidence={"gaps [1]": float(many), "missing samples [1]": float(missing),
                  "longest [ms]": largest.length * 1e3},
        advice="Choose a window without the gap, or make one run of each side of it.",
        key=f"window = [{largest.start + largest.length:.6g}, \"end\"]",
        panels=(steps_panel(case.record.t),),
        marks=tuple(gap.start for gap in time.gaps[:20]),
    )  # fmt: skip


def _jitter(case: Case) -> Iterator[Finding]:
    time = case.inspection.time
    share = time.jitter / time.period
    if share < LOOSE or (time.rounding > 0 and time.jitter <= time.rounding and time.rounding > LOOSE * time.period):
        return
    yield Finding(
        kind="jitter",
        columns=("time",),
        severity="warning",
        sentence=f"The samples jitter: 1 % of the steps differ from the period of {time.period * 1e3:.4g} ms by"
        f" more than {time.jitter * 1e3:.3g} ms ({100 * share:.0f} %).",
        spoils=share > 0.5,
        evidence={"jitter [ms]": time.jitter * 1e3, "period [ms]": time.period * 1e3},
        advice="A fit resamples by straight lines; set a period, or log from a loop with a fixed rate.",
        key=f'period = "{time.period * 1e3:.4g} ms"',
        panels=(steps_panel(case.record.t),),
    )


def _doubled(case: Case) -> Iterator[Finding]:
    named = {c.name: case.record[c.name] for c in case.measured if not c.constant}
    rows = doubled_rows([(x, case.inspection.column(name).resolution.step) for name, x in named.items()])
    if rows.size < 3:
        return
    t = case.record.t
    moved = [
        (float(np.ptp(x[j - 3 : j + 4])) / float(np.ptp(x)), name, j)
        for name, x in named.items()
        for j in rows.tolist()
    ]
    _, name, i = max(moved)
    near = slice(max(i - 15, 0), i + 16)
    curve = Curve(name=name, t=t[near], y=case.record[name][near], style="points")
    yield Finding(
        kind="doubled",
        columns=tuple(c.name for c in case.measured if not c.constant),
        severity="warning",
        sentence=f"{rows.size} rows repeat the row before in every measured column while the rig moves"
        f" (the first at {t[rows[0]]:.5g} s): rows were written twice, or samples were missed.",
        spoils=rows.size > 0.03 * t.size,
        evidence={"doubled rows [1]": float(rows.size), "share [%]": 100 * rows.size / t.size},
        advice="Drop the doubled rows before reading; if their time goes on, each hides a missed sample.",
        panels=(Panel(label=name, curves=(curve,)),),
        marks=tuple(float(t[j]) for j in rows if near.start <= j < near.stop),
    )  # fmt: skip


def doubled_rows(columns: Sequence[tuple[Array, float]]) -> NDArray[np.int64]:
    """Rows in which every moving column (values, resolution) repeats the row before although all were on their way."""
    repeats: NDArray[np.bool_] | None = None
    on_the_way: NDArray[np.bool_] | None = None
    for x, resolution in columns:
        d = np.diff(x)
        if d.size < 6 or not d.any():
            continue
        same = d == 0
        going = np.zeros(d.size, bool)
        least = max(3.5 * resolution, 3 * float(np.median(np.abs(np.diff(d)))))
        for side in (d > least, d < -least):  # byte by byte: a log may have ten million rows
            going[2:-2] |= side[:-4] & side[1:-3] & side[3:-1] & side[4:]
        repeats = same if repeats is None else repeats & same
        on_the_way = going if on_the_way is None else on_the_way | going
    if repeats is None or on_the_way is None:
        return np.zeros(0, np.int64)
    return np.flatnonzero(repeats & on_the_way) + 1


def read_mended(path: PathLike, *, reader: str = "") -> tuple[Record, tuple[Finding, ...]]:
    """Record of a log, and what had to be mended to read it.

    Readers refuse a time that does not increase. Here rows that repeat an instant are dropped, and of the pieces
    between two resets of the clock the longest is kept, so that the rest can be looked at; both are findings.

    Raises
    ------
    BadInput
        When the log cannot be read, and not because of its clock.
    """
    source = load(path)
    try:
        return read_source(source, reader=reader or None), ()
    except BadInput as error:
        if "time must increase" not in str(error) or (reader or reader_of(source)) != "table":
            raise
    text = layout(source)
    table = text.numbers()
    at = next((j for j, name in enumerate(text.names) if text.named and time_scale(name)), 0)
    t = table[:, at] * ((text.named and time_scale(text.names[at])) or 1.0)
    step = np.diff(t)
    first, after = pieces(step < 0)[0]
    rows = first + np.flatnonzero(np.concatenate([[True], np.diff(t[first:after]) > 0]))
    findings = _restarts(t, step, table, first, after, text.names)
    return read_source(_rows(source, text.first_line, rows), reader="table"), findings


def _rows(source: Source, first_line: int, rows: np.ndarray) -> Source:
    """The same log with some of its rows."""
    lines = source.text.split("\n")
    filled = [i for i in range(first_line - 1, len(lines)) if lines[i].strip()]
    remaining = [*lines[: first_line - 1], *(lines[filled[i]] for i in rows.tolist())]
    return Source(file=source.file, data=("\n".join(remaining) + "\n").encode())


def _restarts(
    t: np.ndarray, step: np.ndarray, table: np.ndarray, first: int, after: int, names: tuple[str, ...]
) -> tuple[Finding, ...]:
    out: list[Finding] = []
    resets, repeats = np.flatnonzero(step < 0), np.flatnonzero(step == 0)
    order = np.arange(t.size, dtype=np.float64)
    panel = Panel(label="logged time [s] by row", curves=(Curve(name="time", t=order, y=t),))
    if resets.size:
        i = int(resets[0])
        out.append(
            Finding(
                kind="clock",
                columns=("time",),
                severity="fault",
                sentence=f"The clock starts again {resets.size} time{'s' if resets.size > 1 else ''}: row {i + 2} is at"
                f" {t[i + 1]:.6g} s after {t[i]:.6g} s. Only rows {first + 1} to {after} are looked at below.",
                evidence={"resets [1]": float(resets.size), "back by [s]": float(t[i] - t[i + 1])},
                advice="Split the log there; each piece is a run of its own.",
                panels=(panel,),
            )
        )
    if repeats.size:
        same = int(np.sum((table[repeats + 1] == table[repeats]).all(axis=1)))
        out.append(
            Finding(
                kind="doubled",
                columns=("time",),
                severity="warning",
                sentence=f"{repeats.size} rows repeat the instant of the row before (first at {t[repeats[0]]:.6g} s),"
                f" {same} of them with the same values.",
                evidence={"repeated instants [1]": float(repeats.size), "equal rows [1]": float(same)},
                advice="Drop them; they are left out below." if same else "Which row holds? The first was kept below.",
                spoils=False,
                panels=(steps_panel(t),),
            )
        )
    return tuple(out)
