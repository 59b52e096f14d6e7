"""Record of a ROS bag exported as CSV, where every topic wrote rows of its own.

One row per message, so most cells are empty. The topic with the most sample stamps (``.../header/stamp``)
gives the time base; every other topic is held from its last message, as the receiving controller held it.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.readers.formats.delimited import begins_with_number
from upright.readers.reader import Reader
from upright.readers.resolution import exact_seconds
from upright.readers.source import Source, cell
from upright.records import LARGEST, Array, Record

RECEIVED = "__time"
STAMP = "/header/stamp"
_HEAD = 1 << 20  # characters in which the line of names ends


@dataclass(frozen=True, kw_only=True)
class Topic:
    """Columns that are filled on the same rows, and the column that dates them."""

    clock: int
    columns: tuple[int, ...]
    rows: NDArray[np.intp]  # where it wrote


def _recognises(source: Source) -> bool:
    """Whether names above the rows look like a bag's: a receive time, or slashes and a stamp."""
    names = [name.strip() for name in source.text[:_HEAD].lstrip().split("\n", 1)[0].split(",")]
    bag = RECEIVED in names or any(name.endswith(STAMP) for name in names)
    return bag and not begins_with_number(source.text)


def read(source: Source) -> Record:
    """Record on the stamps of the busiest topic; times from its first stamp, exact to a nanosecond."""
    bag = _bag(source)
    empty = [name for name, column in zip(bag.names, bag.cells, strict=True) if not any(column)]
    notes = [f"Empty column '{name}' left out." for name in empty]
    topics = bag.topics()
    if not topics:
        raise source.bad("expected columns beside the time, got none with a value", line=1)
    base = max(topics, key=lambda topic: (bag.names[topic.clock].endswith(STAMP), topic.rows.size))
    if base.rows.size < 2:
        raise source.bad("expected at least 2 messages of one topic; the bag is cut short", line=2)
    t, epoch = bag.seconds(base.clock, base.rows)
    bag.must_increase(t, base, strictly=True)
    signals: dict[str, Array] = {}
    units: dict[str, str] = {}
    held: list[str] = []
    for j, name in enumerate(bag.names):
        topic = next((topic for topic in topics if j in topic.columns), None)
        if j == base.clock:
            continue
        if name == RECEIVED:
            signals[name], _ = bag.seconds(j, base.rows, epoch)
            units[name] = "s"
        elif topic is base:
            signals[name] = bag.numbers(j, base.rows)
        elif topic is not None and j != topic.clock:
            signals[name] = bag.held(j, topic, t, epoch)
            held.append(name)
    notes.append(f"Time is '{bag.names[base.clock]}' counted from its first message, epoch {epoch * 1e-9:.6f} s.")
    if held:
        notes += _moves_before(t, signals, units, held)
        notes.append(f"Held from message to message, 0 before the first: {', '.join(held)}.")
    return Record(t=t, signals=signals, units=units, provenance=source.provenance("ros-bag", *notes))


@dataclass(frozen=True)
class _Bag:
    """Names, and the stripped text of each column; row i stands in line i + 2."""

    source: Source
    names: tuple[str, ...]
    cells: list[tuple[str, ...]]

    def topics(self) -> list[Topic]:
        """Columns with a stamp above them, then the rest by the rows they are filled on."""
        filled = np.array([[bool(entry) for entry in column] for column in self.cells])
        topics: list[Topic] = []
        used: set[int] = set()
        for clock, name in enumerate(self.names):
            if not (name.endswith(STAMP) and filled[clock].any()):
                continue
            prefix = name.removesuffix(STAMP) + "/"
            columns = [
                j for j, n in enumerate(self.names) if n.startswith(prefix) and filled[j].any() and j not in used
            ]
            for j in columns:
                uneven = np.flatnonzero(filled[j] != filled[clock])
                if uneven.size:
                    row = int(uneven[0])
                    empty = j if filled[clock][row] else clock
                    sentence = "expected a value, the message has others but this cell is empty; mend or delete the row"
                    raise self.source.bad(sentence, line=row + 2, column=empty + 1, name=self.names[empty])
            used.update(columns)
            topics.append(Topic(clock=clock, columns=tuple(columns), rows=np.flatnonzero(filled[clock])))
        if RECEIVED not in self.names:
            return topics
        received = self.names.index(RECEIVED)
        if not filled[received].all():
            sentence, row = "expected a receive time on every row, got an empty cell", int(np.argmin(filled[received]))
            raise self.source.bad(sentence, line=row + 2, column=received + 1, name=RECEIVED)
        groups: dict[bytes, list[int]] = {}
        for j in range(len(self.names)):
            if j not in used and j != received and filled[j].any():
                groups.setdefault(filled[j].tobytes(), []).append(j)
        rest = (
            Topic(clock=received, columns=tuple(columns), rows=np.flatnonzero(filled[columns[0]]))
            for columns in groups.values()
        )
        return [*topics, *rest]

    def seconds(self, column: int, rows: NDArray[np.intp], epoch: int | None = None) -> tuple[Array, int]:
        """Times [s] of these rows since `epoch` [ns], and that; without it, since the first of them."""
        texts, lines = [self.cells[column][i] for i in rows.tolist()], (rows + 2).tolist()
        t, first = exact_seconds(self.source, texts, lines, name=self.names[column], column=column + 1)
        return (t, first) if epoch is None else (t + (first - epoch) * 1e-9, epoch)

    def must_increase(self, t: Array, topic: Topic, *, strictly: bool) -> None:
        """Refuse stamps of a topic that fall, or repeat themselves."""
        at = topic.clock
        self.source.must_increase(
            t,
            lambda row: {"line": int(topic.rows[row]) + 2, "column": at + 1, "name": self.names[at]},
            each="message",
            strictly=strictly,
        )

    def numbers(self, column: int, rows: NDArray[np.intp]) -> Array:
        """Values on these rows."""
        texts = [self.cells[column][row] for row in rows.tolist()]
        try:
            out = np.array(list(map(float, texts)), dtype=np.float64)
        except ValueError:
            out = np.array([np.nan])
        if (np.abs(out) <= LARGEST).all():
            return out
        name = self.names[column]
        each = zip(texts, rows.tolist(), strict=True)
        return np.array([cell(self.source, text, line=row + 2, column=column + 1, name=name) for text, row in each])

    def held(self, column: int, topic: Topic, t: Array, epoch: int) -> Array:
        """Last message before each time in `t` (N,); 0 before the first, because nothing was commanded yet."""
        when, _ = self.seconds(topic.clock, topic.rows, epoch)
        self.must_increase(when, topic, strictly=False)
        values = self.numbers(column, topic.rows)
        last = np.searchsorted(when, t, side="right") - 1
        return np.where(last >= 0, values[np.maximum(last, 0)], 0.0)


def _bag(source: Source) -> _Bag:
    """Table of a bag's messages."""
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
            last = number == len(rows)
            advice = "the last row is torn, export the bag again or delete it" if last else "mend the row"
            raise source.bad(f"expected {len(names)} cells, got {len(row)}; {advice}", line=number)
    if len(rows) < 3:
        raise source.bad("expected at least 2 messages under the line of names; export the bag again", line=len(rows))
    return _Bag(source, names, [tuple(entry.strip() for entry in column) for column in zip(*rows[1:], strict=True)])


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


READER = Reader(name="ros-bag", files="ROS bags as CSV", recognises=_recognises, read=read, order=60)
