"""What was measured when, if every topic of a ROS bag wrote rows of its own?

One row per message, so most cells are empty. The topic with the most sample stamps (``.../header/stamp``)
gives the time base; every other topic is held from its last message, as the receiving controller held it.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.readers.source import Source
from upright.readers.table import cell
from upright.readers.timebase import exact_seconds
from upright.records import LARGEST, Array, Record

RECEIVED = "__time"
STAMP = "/header/stamp"


@dataclass(frozen=True, kw_only=True)
class Topic:
    """Columns that are filled on the same rows, and the column that dates them."""

    clock: int
    columns: tuple[int, ...]
    rows: NDArray[np.intp]  # where it wrote


def recognise(names: tuple[str, ...]) -> bool:
    """Whether names look like a bag's: a receive time, or slashes and a stamp."""
    return RECEIVED in names or any(name.endswith(STAMP) for name in names)


def read(source: Source) -> Record:
    """Record on the stamps of the busiest topic; times from its first stamp, exact to a nanosecond."""
    names, cells = _cells(source)
    filled = np.array([[bool(entry) for entry in column] for column in cells])
    notes = [
        f"Empty column '{name}' left out."
        for name, any_ in zip(names, map(any, filled.tolist()), strict=True)
        if not any_
    ]
    topics = _topics(source, names, filled)
    if not topics:
        raise source.bad("expected columns beside the time, got none with a value", line=1)
    base = max(topics, key=lambda topic: (names[topic.clock].endswith(STAMP), topic.rows.size))
    if base.rows.size < 2:
        raise source.bad("expected at least 2 messages of one topic; the bag is cut short", line=2)
    t, epoch = _clock(source, names, cells, base)
    _increasing(source, t, base, names, strictly=True)
    signals: dict[str, Array] = {}
    units: dict[str, str] = {}
    held: list[str] = []
    for j, name in enumerate(names):
        topic = next((topic for topic in topics if j in topic.columns), None)
        if j == base.clock:
            continue
        if name == RECEIVED:
            signals[name], _ = _seconds(source, names, cells, j, base.rows, epoch)
            units[name] = "s"
        elif topic is None:
            continue
        elif topic is base:
            signals[name] = _numbers(source, cells[j], base.rows, j, name)
        elif j != topic.clock:
            signals[name] = _held(source, names, cells, j, topic, t, epoch)
            held.append(name)
    notes.append(f"Time is '{names[base.clock]}' counted from its first message, epoch {epoch * 1e-9:.6f} s.")
    if held:
        notes += _moves_before(t, signals, units, held)
        notes.append(f"Held from message to message, 0 before the first: {', '.join(held)}.")
    return Record(t=t, signals=signals, units=units, provenance=source.provenance("ros-bag", *notes))


def _cells(source: Source) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Names, and the stripped text of each column."""
    lines = source.text.split("\n")
    while lines and not lines[-1].strip():
        lines.pop()
    try:
        rows = list(csv.reader(lines, strict=True)) if '"' in source.text else [line.split(",") for line in lines]
    except csv.Error as error:
        raise source.bad(
            f"expected comma-separated text, got a broken quotation ({error}); export the bag again"
        ) from None
    names = tuple(name.strip() for name in rows[0])
    for j, name in enumerate(names):
        if name in names[:j] or not name:
            raise source.bad("expected a different name for each column", line=1, column=j + 1, name=name)
    for number, row in enumerate(rows, start=1):
        if len(row) != len(names):
            torn = (
                "; the last row is torn, export the bag again or delete it" if number == len(rows) else "; mend the row"
            )
            raise source.bad(f"expected {len(names)} cells, got {len(row)}{torn}", line=number)
    if len(rows) < 3:
        raise source.bad("expected at least 2 messages under the line of names; export the bag again", line=len(rows))
    return names, [tuple(entry.strip() for entry in column) for column in zip(*rows[1:], strict=True)]


def _topics(source: Source, names: tuple[str, ...], filled: np.ndarray) -> list[Topic]:
    """Columns with a stamp above them, then the rest by the rows they are filled on."""
    topics: list[Topic] = []
    taken: set[int] = set()
    for clock, name in enumerate(names):
        if name.endswith(STAMP) and filled[clock].any():
            prefix = name.removesuffix(STAMP) + "/"
            columns = [
                j for j, other in enumerate(names) if other.startswith(prefix) and filled[j].any() and j not in taken
            ]
            for j in columns:
                uneven = np.flatnonzero(filled[j] != filled[clock])
                if uneven.size:
                    row = int(uneven[0])
                    empty = j if filled[clock][row] else clock
                    raise source.bad(
                        "expected a value, the message has others but this cell is empty; mend or delete the row",
                        line=row + 2,
                        column=empty + 1,
                        name=names[empty],
                    )
            taken.update(columns)
            topics.append(Topic(clock=clock, columns=tuple(columns), rows=np.flatnonzero(filled[clock])))
    if RECEIVED not in names:
        return topics
    received = names.index(RECEIVED)
    if not filled[received].all():
        row = int(np.argmin(filled[received]))
        raise source.bad(
            "expected a receive time on every row, got an empty cell", line=row + 2, column=received + 1, name=RECEIVED
        )
    groups: dict[bytes, list[int]] = {}
    for j in range(len(names)):
        if j not in taken and j != received and filled[j].any():
            groups.setdefault(filled[j].tobytes(), []).append(j)
    for columns in groups.values():
        rows = np.flatnonzero(filled[columns[0]])
        topics.append(Topic(clock=received, columns=tuple(columns), rows=rows))
    return topics


def _seconds(
    source: Source,
    names: tuple[str, ...],
    cells: list[tuple[str, ...]],
    column: int,
    rows: np.ndarray,
    epoch: int | None,
) -> tuple[Array, int]:
    picked = rows.tolist()
    t, first = exact_seconds(
        source, [cells[column][i] for i in picked], [i + 2 for i in picked], name=names[column], column=column + 1
    )
    return (t, first) if epoch is None else (t + (first - epoch) * 1e-9, epoch)


def _clock(source: Source, names: tuple[str, ...], cells: list[tuple[str, ...]], topic: Topic) -> tuple[Array, int]:
    return _seconds(source, names, cells, topic.clock, topic.rows, None)


def _numbers(source: Source, column: tuple[str, ...], rows: np.ndarray, j: int, name: str) -> Array:
    try:
        out = np.array(list(map(float, [column[row] for row in rows.tolist()])), dtype=np.float64)
    except ValueError:
        out = np.array([np.nan])
    if (np.abs(out) <= LARGEST).all():
        return out
    return np.array(
        [cell(source, column[row], line=row + 2, column=j + 1, name=name) for row in rows.tolist()], dtype=np.float64
    )


def _held(
    source: Source, names: tuple[str, ...], cells: list[tuple[str, ...]], j: int, topic: Topic, t: Array, epoch: int
) -> Array:
    """Last message before each time in `t` (N,); 0 before the first, because nothing was commanded yet."""
    when, _ = _seconds(source, names, cells, topic.clock, topic.rows, epoch)
    _increasing(source, when, topic, names, strictly=False)
    values = _numbers(source, cells[j], topic.rows, j, names[j])
    last = np.searchsorted(when, t, side="right") - 1
    return np.where(last >= 0, values[np.maximum(last, 0)], 0.0)


def _moves_before(t: Array, signals: dict[str, Array], units: dict[str, str], held: list[str]) -> list[str]:
    """Warning when the rig moves before its first command: an earlier one was not recorded."""
    moves = [
        np.abs(x - x[0]) > 0.02 * np.ptp(x) for name, x in signals.items() if name not in held and name not in units
    ]
    first_motion = min((int(np.argmax(far)) for far in moves if far.any()), default=t.size)
    notes: list[str] = []
    for name in held:
        commanded = np.flatnonzero(signals[name])
        if commanded.size and first_motion < commanded[0] and t[commanded[0]] - t[first_motion] > 0.05:
            notes.append(
                f"The rig moves at {t[first_motion]:.4g} s, before the first command of '{name}' at"
                f" {t[commanded[0]]:.4g} s: an earlier command was not recorded; use a window after the first."
            )
    return notes


def _increasing(source: Source, t: Array, topic: Topic, names: tuple[str, ...], *, strictly: bool) -> None:
    step = np.diff(t)
    bad = np.flatnonzero(~(step > 0) if strictly else step < 0)
    if bad.size:
        row = int(bad[0]) + 1
        raise source.bad(
            f"time must increase from message to message, got {t[row]:.9g} s after {t[row - 1]:.9g} s;"
            " mend or delete the row",
            line=int(topic.rows[row]) + 2,
            column=topic.clock + 1,
            name=names[topic.clock],
        )
