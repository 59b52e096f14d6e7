"""Can a log be read whose clock starts again, or whose rows were written twice?

Readers refuse a time that does not increase. Here rows that repeat an instant are dropped, and of the pieces between
two resets of the clock the longest is kept, so that the rest can be looked at; both are findings.
"""

from __future__ import annotations

import numpy as np

from upright.doctor.clock import steps_panel
from upright.doctor.findings import Curve, Finding, Panel
from upright.errors import BadInput
from upright.readers import read_source, recognise
from upright.readers.delimited import layout
from upright.readers.source import Source, load
from upright.readers.timebase import time_scale
from upright.records import PathLike, Record


def read_mended(path: PathLike, *, reader: str = "") -> tuple[Record, tuple[Finding, ...]]:
    """Record of a log, and what had to be mended to read it.

    Raises
    ------
    BadInput
        When the log cannot be read, and not because of its clock.
    """
    source = load(path)
    try:
        return read_source(source, reader=reader or None), ()
    except BadInput as error:
        if "time must increase" not in str(error) or (reader or recognise(source)) != "table":
            raise
    found = layout(source)
    table = found.numbers()
    at = next((j for j, name in enumerate(found.names) if found.named and time_scale(name)), 0)
    t = table[:, at] * ((found.named and time_scale(found.names[at])) or 1.0)
    step = np.diff(t)
    cuts = np.concatenate([[0], np.flatnonzero(step < 0) + 1, [t.size]])
    longest = int(np.argmax(np.diff(cuts)))
    first, after = int(cuts[longest]), int(cuts[longest + 1])
    rows = first + np.flatnonzero(np.concatenate([[True], np.diff(t[first:after]) > 0]))
    findings = _findings(t, step, table, first, after, found.names)
    return read_source(_rows(source, found.first_line, rows), reader="table"), findings


def _rows(source: Source, first_line: int, rows: np.ndarray) -> Source:
    """The same log with some of its rows."""
    lines = source.text.split("\n")
    filled = [i for i in range(first_line - 1, len(lines)) if lines[i].strip()]
    kept = [*lines[: first_line - 1], *(lines[filled[i]] for i in rows.tolist())]
    return Source(file=source.file, data=("\n".join(kept) + "\n").encode())


def _findings(
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
