"""How is a run laid out in an MCAP file? Two channels of JSON, and metadata with checksums of their own.

``/samples`` has one message for each row, ``/events`` one for each event; their schemas (JSON Schema) give every
field's unit. MCAP has a checksum for each chunk but none for metadata, so that ours carry one. Messages of a channel
are counted from 0: a number that is missing tells of a chunk that was lost in between.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import Any

from upright.errors import BadInput
from upright.logs.header import LogColumn, LogHeader

PROFILE = "upright"
SAMPLES, EVENTS = "/samples", "/events"
CHECK = "crc32"
FAULT, DROPPED = "fault", "dropped"
"""Kinds of events that mean something here: the first is put on the disk at once, the second is the writer's own."""


def library() -> tuple[Any, Any]:
    """The modules `mcap.writer` and `zstandard`.

    Raises
    ------
    BadInput
        When one of them is not installed.
    """
    try:
        import mcap.writer
        import zstandard
    except ImportError as error:
        raise BadInput(
            f"logs of runs need the rig extra ({error.name or error} is not installed): pip install 'upright[rig]'."
        ) from None
    return mcap.writer, zstandard


def row_schema(header: LogHeader) -> bytes:
    """JSON Schema of a row; a number that JSON cannot hold, such as an infinite command, is null all the same.

    Viewers take one type for each field, not a choice.
    """
    notes = {
        "mode": _numbered(header.modes, "one of"), "faults": _numbered(header.faults, "sum of"),
        f"{header.command}_applied": "what the converter really put out", header.command: "what the law requested",
        **{name: "what the law followed" for name, _ in header.references},
    }  # fmt: skip
    fields = {
        column.name: {"type": "integer" if column.whole else "number", "unit": column.unit}
        | ({"description": notes[column.name]} if notes.get(column.name) else {})
        for column in header.columns
    }
    return _schema("upright.row", fields)


def _numbered(words: Mapping[int, str], how: str) -> str:
    return f"{how} {', '.join(f'{number} {word}' for number, word in words.items())}" if words else ""


EVENT_SCHEMA: Mapping[str, Mapping[str, str]] = {
    "t": {"type": "number", "unit": "s"},
    "kind": {"type": "string"},
    "text": {"type": "string"},
    "row": {"type": "integer", "unit": "1", "description": "rows of this file before it"},
    "dropped": {"type": "integer", "unit": "1", "description": "rows of the loop that are missing here"},
}


def event_schema() -> bytes:
    """JSON Schema of an event."""
    return _schema("upright.event", EVENT_SCHEMA)


def _schema(title: str, fields: Mapping[str, Any]) -> bytes:
    return json.dumps({"title": title, "type": "object", "properties": fields, "required": list(fields)}).encode()


def columns_of_schema(schema: bytes) -> tuple[LogColumn, ...]:
    """Columns as the schema of a row has them."""
    fields: dict[str, Any] = json.loads(schema)["properties"]
    return tuple(LogColumn(name, str(field["unit"]), field["type"] == "integer") for name, field in fields.items())


def row_writer(columns: Sequence[LogColumn]) -> Callable[[Sequence[float]], bytes]:
    """Function from the numbers of a row to its message; every number comes back to the last bit."""
    keys = [json.dumps(column.name) for column in columns]
    form = "{" + ",".join(
        f"{key.replace('%', '%%')}:%{'d' if column.whole else 'r'}" for key, column in zip(keys, columns, strict=True)
    ) + "}"  # fmt: skip

    def message(row: Sequence[float]) -> bytes:
        if isfinite(sum(row)):
            return (form % tuple(row)).encode()
        return json.dumps(
            {c.name: x if isfinite(x) else None for c, x in zip(columns, row, strict=True)}, separators=(",", ":")
        ).encode()

    return message


def with_checksum(texts: Mapping[str, str]) -> dict[str, str]:
    """Texts of a metadata record with their checksum."""
    return {**texts, CHECK: f"{_sum(texts):08x}"}


def holds(texts: Mapping[str, str]) -> bool:
    """Whether the texts of a metadata record are those that were written."""
    rest = {name: text for name, text in texts.items() if name != CHECK}
    return texts.get(CHECK) == f"{_sum(rest):08x}"


def _sum(texts: Mapping[str, str]) -> int:
    return zlib.crc32(json.dumps(texts, sort_keys=True).encode())


class RunFile:
    """An MCAP file of a run: rows and events go in, whole chunks reach the file.

    Parameters
    ----------
    stream
        Binary file with ``write``, ``tell`` and ``flush``.
    """

    def __init__(self, stream: Any, header: LogHeader) -> None:
        writer, _ = library()
        self._file = writer.Writer(stream)
        self._message = row_writer(header.columns)
        self._epoch = round(header.start * 1e9) if 0.0 <= header.start < 1e10 else 0
        self._file.start(profile=PROFILE, library=f"upright {header.versions.get('upright', '')}".strip())
        metadata = header.as_metadata()
        for name, texts in metadata.items():
            self._file.add_metadata(name, with_checksum(texts))
        self._channels = [
            self._file.register_channel(
                topic, "json", self._file.register_schema(name, "jsonschema", schema), metadata["log"]
            )  # once more, inside the first chunk with its checksum
            for topic, name, schema in (
                (SAMPLES, "upright.row", row_schema(header)), (EVENTS, "upright.event", event_schema())
            )
        ]  # fmt: skip
        self.rows = self.events = 0
        stream.flush()

    def row(self, row: Sequence[float]) -> None:
        """Add a row."""
        self._add(0, row[0], self._message(row), self.rows)
        self.rows += 1

    def event(self, t: float, kind: str, text: str, dropped: int = 0) -> None:
        """Add an event, behind the rows that were added before."""
        t = t if isfinite(t) else 0.0
        content = {"t": t, "kind": kind, "text": text, "row": self.rows, "dropped": dropped}
        self._add(1, t, json.dumps(content, ensure_ascii=False).encode(), self.events)
        self.events += 1

    def _add(self, channel: int, t: float, content: bytes, number: int) -> None:
        # the format counts in nanoseconds from 0 to 2^64; the row has the time itself
        at = self._epoch + (round(t * 1e9) if 0.0 <= t < 1e9 else 0)
        self._file.add_message(self._channels[channel], at, content, at, number & 0xFFFFFFFF)

    def flush(self) -> None:
        """Close the chunk and hand it to the file."""
        self._file.flush()

    def finish(self) -> None:
        """Write the summary, by which other programs find their way."""
        self._file.finish()
