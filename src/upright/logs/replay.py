"""Does the logged law give the logged commands again, bit by bit, from the logged measurements?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.laws import Law, Rule, at_work, of_values
from upright.logs.whole import RunLog

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Difference:
    """A row, counted from 1, whose command is another one."""

    row: int
    t: float
    logged: float
    replayed: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Replay:
    """A logged law on the logged measurements.

    Attributes
    ----------
    rows : array of int, shape (compared,)
        Which rows of the log were compared, counted from 0.
    commands : array, shape (compared,)
        What the law gives there.
    starts : int
        How often the law began anew: wherever the mode changes to one in which it commands.
    differing : int
        Commands that are not the logged ones to the last bit.
    largest : float
        Of their distances, in the command's unit.
    first : Difference or None
    passed_over : int
        Rows in which the law commanded, behind rows that were dropped: what it remembered there is not known.
    """

    rows: NDArray[np.intp]
    commands: Array
    starts: int
    differing: int
    largest: float
    first: Difference | None
    passed_over: int

    @property
    def identical(self) -> bool:
        """Whether every command that was compared is the logged one, to the last bit."""
        return self.differing == 0


def replay(log: RunLog, law: Law | Rule | None = None) -> Replay:
    """The logged law on the logged measurements, called as the loop calls it.

    That is `upright.laws.at_work`, made anew where the law begins to command, and called once for each row with the
    time since the first of them, the readings in the header's order, and the references that were logged, where there
    are any: somebody may have changed them meanwhile.

    Parameters
    ----------
    log : RunLog
    law : Law or Rule, optional
        Instead of the logged one.

    Raises
    ------
    BadInput
        When the log has no law, or there is nothing to compare.
    """
    law = law or _logged(log)
    t, logged = log.columns["t"], log.columns[log.header.command]
    readings = np.column_stack([log.columns[name] for name, _ in log.header.coordinates])
    if isinstance(law, Law) and law.readings != readings.shape[1]:
        raise BadInput(
            f"the law of '{log.file}' reads {law.readings} signals, and the log has"
            f" {', '.join(name for name, _ in log.header.coordinates)}."
        )
    rows: list[int] = []
    commands: list[float] = []
    starts = over = 0
    for begin, known, end in _stretches(log):
        step, starts, over = at_work(_following(law, log, begin, known)), starts + 1, over + end - known
        for k in range(begin, known):
            try:
                u = step(float(t[k]) - float(t[begin]), tuple(readings[k].tolist()))
            except (ArithmeticError, ValueError, TypeError, IndexError) as error:
                raise BadInput(f"the law of '{log.file}' fails at row {k + 1}, {t[k]:.6g} s: {error}.") from None
            if len(u) != 1:
                raise BadInput(f"the law of '{log.file}' gives {len(u)} commands, and the log has one.")
            rows.append(k)
            commands.append(u[0])
    if not rows:
        raise BadInput(f"there is no row in '{log.file}' in which its law gave the command.")
    given = np.array(commands, dtype=np.float64)
    there = logged[rows]
    other = np.flatnonzero(given.view(np.int64) != there.view(np.int64))
    first = None
    if other.size:
        k = int(other[0])
        first = Difference(row=rows[k] + 1, t=float(t[rows[k]]), logged=float(there[k]), replayed=float(given[k]))
    return Replay(
        rows=np.array(rows, dtype=np.intp), commands=given, starts=starts, differing=int(other.size),
        largest=float(np.nanmax(np.abs(given - there)[other], initial=0.0)), first=first, passed_over=over,
    )  # fmt: skip


def _following(law: Law | Rule, log: RunLog, begin: int, end: int) -> Law | Rule:
    """The law with the logged references of some rows for its own."""
    names = [name for name, _ in log.header.references]
    if not names or law.signal().shape[1] != len(names):
        return law
    return replace(law, references=np.column_stack([log.columns[name][begin:end] for name in names]))


def _logged(log: RunLog) -> Law | Rule:
    if "kind" not in log.header.law:
        raise BadInput(f"'{log.file}' says nothing of its law, so that it cannot be replayed.")
    return of_values(log.header.law)


def _stretches(log: RunLog) -> Iterator[tuple[int, int, int]]:
    """First row of each time that the law commands, the row up to which nothing is missing, and the one behind it."""
    driven = log.header.driven
    on = np.isin(log.columns["mode"], driven) if driven else np.ones(len(log), dtype=bool)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(np.int8)))
    gaps = [event.row for event in log.events if event.dropped]
    for begin, end in edges.reshape(-1, 2).tolist():
        yield begin, min([gap for gap in gaps if begin <= gap < end], default=end), end
