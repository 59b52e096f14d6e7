"""Does the logged law give the logged commands again, bit by bit, from the logged measurements?"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.laws import Law, Rule, as_values, at_work, of_values
from upright.laws.at_work import RECENT, AtWork
from upright.logs.whole import RunLog

Array = NDArray[np.float64]

PATIENCE = (20.0, 2e-3)
"""Longest time that a logged rule may take, by itself and for each row [s]; a rule takes some 20 us for a row."""

MEMORY = 4 << 30
"""Most that it may take besides, where the system holds a process to that: not on Windows and macOS [bytes]."""


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
    are any: somebody may have changed them meanwhile. A rule that a log holds is anybody's function: it runs in a
    process of its own, for as long as `PATIENCE` says.

    Parameters
    ----------
    law : Law or Rule, optional
        Instead of the logged one.

    Raises
    ------
    BadInput
        When the log has no law, its law fails or does not end, or there is nothing to compare.
    """
    of_log = law is None
    law = law or _logged(log)
    t, logged = log.columns["t"], log.columns[log.header.command]
    readings = np.column_stack([log.columns[name] for name, _ in log.header.coordinates])
    if isinstance(law, Law) and law.readings != readings.shape[1]:
        raise BadInput(
            f"the law of '{log.file}' reads {law.readings} signals, and the log has"
            f" {', '.join(name for name, _ in log.header.coordinates)}."
        )
    stretches = list(_stretches(log))
    rows = np.concatenate([np.arange(begin, known) for begin, known, _ in stretches] or [[]]).astype(np.intp)
    if not rows.size:
        raise BadInput(f"there is no row in '{log.file}' in which its law gave the command.")
    recomputed = [
        Stretch(
            first=begin,
            t=t[begin:known],
            readings=readings[begin:known],
            references=_references(law, log, begin, known),
            changes=_changes(log, t[begin:known]) if of_log and isinstance(law, Law) else {},
        )
        for begin, known, _ in stretches
        if known > begin  # rows were dropped before its first one
    ]
    commands = (_in_a_process if of_log and isinstance(law, Rule) else _commands)(law, recomputed, log.file)
    there = logged[rows]
    other = np.flatnonzero(commands.view(np.int64) != there.view(np.int64))
    first = None
    if other.size:
        k = int(other[0])
        first = Difference(
            row=int(rows[k]) + 1, t=float(t[rows[k]]), logged=float(there[k]), replayed=float(commands[k])
        )
    return Replay(
        rows=rows, commands=commands, starts=len(stretches), differing=int(other.size),
        largest=float(np.nanmax(np.abs(commands - there)[other], initial=0.0)), first=first,
        passed_over=sum(end - known for _, known, end in stretches),
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class Stretch:
    """Rows from one start of the law on: number of the first, times [s], readings, references where they are logged,
    and at which of them it went on by other gains.
    """

    first: int
    t: Array
    readings: Array
    references: Array | None
    changes: Mapping[int, Mapping[str, Array]]


def _commands(law: Law | Rule, stretches: Sequence[Stretch], file: str) -> Array:
    """What the law gives, begun anew with every stretch."""
    commands: list[float] = []
    for rows in stretches:
        step, running, times, all_readings = _from(law, rows, 0), law, rows.t.tolist(), rows.readings.tolist()
        for k, (t, readings) in enumerate(zip(times, all_readings, strict=True)):
            if k in rows.changes:
                running = replace(running, **rows.changes[k])  # type: ignore[arg-type]
                step = _from(running, rows, before := max(0, k - RECENT))
                for j in range(before, k):
                    step(times[j] - times[0], tuple(all_readings[j]))
            try:
                u = step(t - times[0], tuple(readings))
            except Exception as error:  # whatever a function of somebody's may raise
                raise BadInput(f"the law of '{file}' fails at row {rows.first + k + 1}, {t:.6g} s: {error}.") from None
            if len(u) != 1:
                raise BadInput(f"the law of '{file}' gives {len(u)} commands, and the log has one.")
            commands.append(u[0])
    return np.array(commands, dtype=np.float64)


def _from(law: Law | Rule, rows: Stretch, first: int) -> AtWork:
    """The law from one row of a stretch on."""
    return at_work(law if rows.references is None else replace(law, references=rows.references[first:]))


def _in_a_process(law: Law | Rule, stretches: Sequence[Stretch], file: str) -> Array:
    """The same, by a process that is stopped when it does not end: nothing else stops a loop without an end."""
    once, each = PATIENCE
    rows = sum(part.t.size for part in stretches)
    deadline = once + each * rows
    try:
        process = subprocess.run(
            [sys.executable, "-P", "-c", "from upright.logs.replay import answer; answer()"],
            input=pickle.dumps((MEMORY, as_values(law), stretches, file)),
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}, timeout=deadline, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise BadInput(
            f"the rule of '{file}' was stopped: it gave no commands for {rows} rows within {deadline:.3g} s, as a loop"
            " without an end does not; read its text with `upright log show --json`."
        ) from None
    verdict, content = process.stdout[:1], process.stdout[1:]
    if verdict == _REFUSED:
        raise BadInput(content.decode())
    if verdict != _COMMANDS or len(content) != 8 * rows:
        raise BadInput(f"the rule of '{file}' ended the process that it ran in, so that there is nothing to compare.")
    return np.frombuffer(content, dtype=np.float64)


_COMMANDS, _REFUSED = b"=", b"!"


def answer() -> None:
    """In the process of a logged rule: its commands, or why there are none, for what comes in."""
    memory, law, stretches, file = pickle.load(sys.stdin.buffer)
    if sys.platform == "linux":
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    try:
        content = _COMMANDS + _commands(of_values(law), stretches, file).tobytes()
    except BadInput as refusal:
        content = _REFUSED + str(refusal).encode()
    sys.stdout.buffer.write(content)


def _references(law: Law | Rule, log: RunLog, begin: int, end: int) -> Array | None:
    """Logged references of some rows, where they are the law's."""
    names = [name for name, _ in log.header.references]
    if not names or law.signal().shape[1] != len(names):
        return None
    return np.column_stack([log.columns[name][begin:end] for name in names])


def other_gains(law: Law) -> tuple[str, str]:
    """Kind and text of the event with which a run goes on by C and D of a law."""
    return "law", f"other gains: {json.dumps({'C': law.C.tolist(), 'D': law.D.tolist()})}"


def _changes(log: RunLog, t: Array) -> dict[int, dict[str, Array]]:
    """Gains by the row, among those with times t, that is the first behind the event that tells of them."""
    changes: dict[int, dict[str, Array]] = {}
    for event in log.events:
        if event.kind == "law" and t[0] <= event.t < t[-1]:
            try:
                stated = json.loads(event.text.partition(": ")[2])
                gains = {name: np.array(stated[name], dtype=np.float64) for name in ("C", "D")}
            except (ValueError, KeyError, TypeError, RecursionError):
                raise BadInput(
                    f"'{log.file}' goes on by other gains at {event.t:.6g} s, and does not say which."
                ) from None
            changes[int(np.searchsorted(t, event.t, side="right"))] = gains
    return changes


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
