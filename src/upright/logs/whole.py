"""A run read back: header, rows, events, and whether that is all of it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.files import PathLike, read_bytes
from upright.logs.container import MAGIC, Container, Damaged, Message, summary_fault
from upright.logs.header import LogColumn, LogHeader
from upright.logs.layout import EVENTS, SAMPLES, columns_of_schema
from upright.records import Provenance, Record
from upright.records.record import SIMULATED_NOTE

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True, kw_only=True)
class RunEvent:
    """Something that happened at a time [s], behind so many rows; so many were `dropped` there."""

    t: float
    kind: str
    text: str
    row: int
    dropped: int = 0


@dataclass(frozen=True, kw_only=True, eq=False)
class RunLog:
    """A run as its log has it.

    Attributes
    ----------
    columns : dict of str to array, shape (rows,)
        int64 where numbers are whole, float64 else; NaN where the loop's number was none, such as an infinite command.
    complaint : str
        Why this is not all that was handed over or written, as a sentence; empty for a file that its writer finished.
    size, readable : int
        Bytes of the file, and those of them that hold what is here.
    """

    file: str
    header: LogHeader
    columns: Columns
    events: tuple[RunEvent, ...]
    complaint: str
    size: int
    readable: int

    def __len__(self) -> int:
        return self.columns["t"].size

    @property
    def dropped(self) -> int:
        """Rows of the loop that found no place."""
        return sum(event.dropped for event in self.events)

    def row(self, k: int) -> tuple[float, ...]:
        """Numbers of a row, as the loop handed them over."""
        return tuple(column[k].item() for column in self.columns.values())

    def record(self, provenance: Provenance | None = None, *, counts: bool = False) -> Record:
        """The rows as a record: the applied command is its input, the measured coordinates its outputs.

        Left out, unless `counts` are requested, are the encoders' counts, of which the coordinates are multiples.

        Raises
        ------
        BadInput
            When there are fewer than two rows, or the time does not increase.
        """
        raw = {"t"} if counts else {"t", *(f"{name}_counts" for name, _ in self.header.coordinates)}
        t, signals = self.columns["t"], {name: x for name, x in self.columns.items() if name not in raw}
        finite = np.isfinite(np.array([np.asarray(x, dtype=np.float64) for x in self.columns.values()])).all(axis=0)
        notes = list(filter(None, [self.complaint]))
        if not finite.all():
            notes.append(f"{int((~finite).sum())} rows left out that hold a number which is none, such as infinity.")
            t, signals = t[finite], {name: x[finite] for name, x in signals.items()}
        if re.search(r'^\s*kind\s*=\s*["\']twin["\']', self.header.rig, re.MULTILINE):
            notes.append(SIMULATED_NOTE)
        if self.dropped:
            notes.append(f"{self.dropped} rows of the loop were dropped while it ran.")
        if t.size < 2:
            raise BadInput(f"'{self.file}' holds {t.size} whole rows, and a record needs 2. {self.complaint}".strip())
        if (np.diff(t) <= 0).any():
            k = int(np.argmax(np.diff(t) <= 0)) + 1
            raise BadInput(
                f"'{self.file}', row {k + 1}: time must increase from row to row, got {t[k]:.9g} s after"
                f" {t[k - 1]:.9g} s; convert it with `upright log convert` and mend the table."
            )
        applied = f"{self.header.command}_applied"
        return Record(
            t=t, signals=signals, units={c.name: c.unit for c in self.header.columns if c.name in signals},
            inputs=(applied,), outputs=tuple(name for name, _ in self.header.coordinates),
            provenance=(provenance or Provenance(file=self.file, reader="mcap")).note(*notes),
        )  # fmt: skip


def read_log(path: PathLike) -> RunLog:
    """What a log holds, up to its first error.

    Raises
    ------
    BadInput
        When it is no log of a run, or nothing of it can be read.
    """
    try:
        return log_of(read_bytes(path), str(path))
    except FileNotFoundError:
        raise BadInput(f"There is no file '{path}'; check the path.") from None


def log_of(data: bytes, file: str) -> RunLog:
    """The same of content already in memory."""
    if not data.startswith(MAGIC):
        raise BadInput(f"'{file}' is no log of a run (MCAP); `upright show` reads other logs.")
    container, rows, complaint = Container(), Rows(), ""
    try:
        for messages in container.read(data):
            rows.add(container, messages)
    except Damaged as damage:
        complaint = f"Damaged at byte {damage.at}: {damage}."
    readable = container.at
    if container.ended and not complaint:
        fault = summary_fault(data, container.at, container.count())
        readable, complaint = (readable, f"Every chunk was read, but {fault}.") if fault else (len(data), "")
    elif not complaint:
        torn = len(data) - container.at
        complaint = f"Its writer was stopped, or is still at work: it ends at byte {container.at}" + (
            f", and {torn} bytes of a torn record follow." if torn else "."
        )
    if container.lost:
        complaint = " ".join([complaint, f"Damaged: the text of {', '.join(container.lost)}."]).strip()
    header = header_of(container, file, complaint)
    return RunLog(
        file=file, header=header, columns=rows.columns(header.columns), events=tuple(rows.events), complaint=complaint,
        size=len(data), readable=readable,
    )  # fmt: skip


def header_of(container: Container, file: str, complaint: str = "") -> LogHeader:
    """Header of a log, from what has been read of it.

    Raises
    ------
    BadInput
        When it has none.
    """
    inside = container.channel_texts.get(SAMPLES)  # in a chunk with its checksum
    try:
        return LogHeader.of_metadata(container.texts | ({"log": inside} if inside else {}))
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        reason = f" ({error})" if type(error) is ValueError else ""
        raise BadInput(
            f"'{file}' says nothing of its columns{reason}, so that no row can be read. {complaint}".strip()
        ) from None


class Rows:
    """Rows and events of messages, gathered."""

    def __init__(self) -> None:
        self.events: list[RunEvent] = []
        self._parts: list[Columns] = []

    def add(self, container: Container, messages: Iterable[Message]) -> Columns:
        """Take the messages of a chunk; answers its rows.

        Raises
        ------
        Damaged
            When they are not what their schema says, whatever wrote them.
        """
        rows: list[bytes] = []
        try:
            for message in messages:
                if message.topic == SAMPLES:
                    rows.append(message.content)
                elif message.topic == EVENTS:
                    self.events.append(RunEvent(**json.loads(message.content)))
            columns = columns_of_schema(container.schemas[SAMPLES])
            part = _columns(columns, json.loads(b"[%s]" % b",".join(rows)))
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as error:
            raise Damaged(container.at, f"a row or an event does not follow its schema ({error})") from None
        if rows:
            self._parts.append(part)
        return part

    def columns(self, columns: Iterable[LogColumn]) -> Columns:
        """All rows so far."""
        empty = _columns(columns, [])
        return {name: np.concatenate([none, *(part[name] for part in self._parts)]) for name, none in empty.items()}


def _columns(columns: Iterable[LogColumn], rows: list[Mapping[str, Any]]) -> Columns:
    made: Columns = {}
    for column in columns:
        values = np.array([row[column.name] for row in rows], dtype=np.int64 if column.whole else np.float64)
        if values.ndim != 1:
            raise ValueError(f"{column.name} is a list, where a number is needed")
        made[column.name] = values
    return made
