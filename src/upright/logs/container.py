"""Which whole records does an MCAP file hold, and where does it stop making sense?

The format (mcap.dev/spec): a magic number, then records of an opcode, a length and content. Ours begin with metadata,
go on with compressed chunks of messages, and end with a summary, which a file that was torn lacks. What is read here
was checked: chunks and metadata by their checksums, messages by their count. Opcodes and lengths have no checksum, so
that only what a writer of ours puts in this order is taken; the first byte that cannot be right ends the reading.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from upright.logs.layout import CHECK, PROFILE, holds, library

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX = range(1, 8)
STATISTICS, METADATA, DATA_END = 0x0B, 0x0C, 0x0F
_LARGEST = 16 << 20  # bytes that a chunk may unpack to; ours have some 20 kB
_FRAME = struct.Struct("<BQ")
_PARSING = (struct.error, UnicodeDecodeError, IndexError, KeyError, ValueError)


class Damaged(Exception):
    """A place in a file that cannot be as it was written; `at` is the byte, the text says what is there."""

    def __init__(self, at: int, what: str) -> None:
        super().__init__(what)
        self.at = at


@dataclass(frozen=True)
class Message:
    """Content of one message, the topic of its channel, and its number among those of the channel."""

    topic: str
    number: int
    content: bytes


class Cursor:
    """Fields of a record, one after the other."""

    def __init__(self, content: bytes) -> None:
        self.content, self.at = content, 0

    def number(self, form: str) -> int:
        """Little-endian number of a `struct` format."""
        (value,) = struct.unpack_from(f"<{form}", self.content, self.at)
        self.at += struct.calcsize(f"<{form}")
        return value

    def bytes(self, length: int) -> bytes:
        """So many bytes."""
        if length > len(self.content) - self.at:
            raise ValueError("a field runs past the end of its record")
        self.at += length
        return self.content[self.at - length : self.at]

    def text(self) -> str:
        """Text behind its length."""
        return self.bytes(self.number("I")).decode()

    def texts(self) -> dict[str, str]:
        """Pairs of texts behind their length."""
        end = self.number("I") + self.at
        out: dict[str, str] = {}
        while self.at < end:
            name = self.text()
            out[name] = self.text()
        return out


@dataclass
class Container:
    """Reads records as far as they go; more may be given when a file has grown.

    Attributes
    ----------
    at : int
        First byte that was not read yet.
    texts : dict
        Metadata by name.
    channel_texts : dict
        Metadata of channels by topic.
    schemas : dict
        Schema of each topic.
    lost : list of str
        Names of metadata whose checksum does not fit.
    ended : bool
        Whether the end of the data was reached, which only a writer that finished puts there.
    """

    at: int = 0
    texts: dict[str, dict[str, str]] = field(default_factory=dict[str, dict[str, str]])
    channel_texts: dict[str, dict[str, str]] = field(default_factory=dict[str, dict[str, str]])
    schemas: dict[str, bytes] = field(default_factory=dict[str, bytes])
    lost: list[str] = field(default_factory=list[str])
    ended: bool = False
    _known: dict[int, bytes] = field(default_factory=dict[int, bytes])
    _topics: dict[int, str] = field(default_factory=dict[int, str])
    _counts: dict[str, int] = field(default_factory=dict[str, int])
    _headed: bool = False

    def __post_init__(self) -> None:
        library()  # said before the first chunk, whose mistakes are a file's

    def read(self, data: bytes) -> Iterator[list[Message]]:
        """Messages of each further whole chunk in `data`, which continues the file at `at`.

        Raises
        ------
        Damaged
            At the first place that cannot be right; a record that is not complete yet is none.
        """
        base = self.at
        if not self.at:
            if not MAGIC.startswith(data[: len(MAGIC)]):
                raise Damaged(0, "no MCAP file begins like this")
            if len(data) < len(MAGIC):
                return
            self.at = len(MAGIC)
        while not self.ended and len(data) - (self.at - base) >= _FRAME.size:
            begin = self.at - base
            opcode, length = _FRAME.unpack_from(data, begin)
            if not self._expected(opcode, length):
                raise Damaged(self.at, f"a record of kind {opcode:#04x} and {length} bytes has no place there")
            end = begin + _FRAME.size + length
            if end > len(data):
                return
            try:
                messages = self._record(opcode, data[begin + _FRAME.size : end])
            except _PARSING as error:
                raise Damaged(self.at, f"a record of kind {opcode:#04x} does not hold what it says ({error})") from None
            self.at = base + end
            if messages:
                yield messages

    def _expected(self, opcode: int, length: int) -> bool:
        if opcode == DATA_END:
            return length == 4
        if not self._headed:
            return opcode == HEADER
        return opcode in (METADATA, CHUNK, MESSAGE_INDEX)

    def _record(self, opcode: int, content: bytes) -> list[Message]:
        cursor = Cursor(content)
        if opcode == HEADER:
            if (profile := cursor.text()) != PROFILE:
                raise ValueError(f"its profile is {profile[:40]!r}, that of upright's logs is {PROFILE!r}")
            self._headed = True
        elif opcode == METADATA:
            name, texts = cursor.text(), cursor.texts()
            if holds(texts):
                self.texts[name] = {key: text for key, text in texts.items() if key != CHECK}
            else:
                self.lost.append(name)
        elif opcode == CHUNK:
            return self._messages(Cursor(_unpacked(cursor)))
        elif opcode == DATA_END:
            self.ended = True
        return []

    def _messages(self, chunk: Cursor) -> list[Message]:
        messages: list[Message] = []
        while chunk.at < len(chunk.content):
            opcode, length = chunk.number("B"), chunk.number("Q")
            record = Cursor(chunk.bytes(length))
            if opcode == SCHEMA:
                number, _, _ = record.number("H"), record.text(), record.text()
                self._known[number] = record.bytes(record.number("I"))
            elif opcode == CHANNEL:
                number, schema, topic, _ = record.number("H"), record.number("H"), record.text(), record.text()
                self._topics[number], self.schemas[topic] = topic, self._known[schema]
                self.channel_texts[topic] = record.texts()
            elif opcode == MESSAGE:
                topic, number, _ = self._topics[record.number("H")], record.number("I"), record.bytes(16)
                if number != self._counts.get(topic, 0) & 0xFFFFFFFF:
                    raise ValueError(f"message {self._counts.get(topic, 0)} of {topic} is missing before it")
                self._counts[topic] = self._counts.get(topic, 0) + 1
                messages.append(Message(topic, number, record.bytes(length - 22)))
        return messages

    def count(self) -> int:
        """Messages that were read."""
        return sum(self._counts.values())


def _unpacked(chunk: Cursor) -> bytes:
    """Records of a chunk, as its checksum promises them."""
    _, zstandard = library()
    _, size, check = chunk.bytes(16), chunk.number("Q"), chunk.number("I")
    compression, packed = chunk.text(), chunk.bytes(chunk.number("Q"))
    if size > _LARGEST or compression != "zstd":
        raise ValueError(f"it unpacks to {size} bytes by {compression[:20]!r}")
    try:
        if zstandard.frame_content_size(packed) != size:
            raise ValueError("its size is not the one that it states")
        content: bytes = zstandard.decompress(packed, max_output_size=size)
    except zstandard.ZstdError as error:
        raise ValueError(str(error)) from None
    if len(content) != size or zlib.crc32(content) != check:
        raise ValueError("its checksum does not fit")
    return content


def summary_fault(data: bytes, at: int, messages: int) -> str:
    """What is wrong with the summary that begins at a byte, for so many messages before it; empty when nothing is."""
    foot = _FRAME.size + 20 + len(MAGIC)
    if len(data) < at + foot or data[-len(MAGIC) :] != MAGIC:
        return "its summary is torn"
    footer = len(data) - foot
    opcode, length, start, _, check = struct.unpack_from("<BQQQI", data, footer)
    if (opcode, length, start) != (FOOTER, 20, at) or zlib.crc32(data[at : footer + _FRAME.size + 16]) != check:
        return "its summary is damaged"
    counted = _statistics(data[at:footer])
    return "" if counted == messages else f"its summary counts {counted} messages, and {messages} are there"


def _statistics(summary: bytes) -> Any:
    at = 0
    while at + _FRAME.size <= len(summary):
        opcode, length = _FRAME.unpack_from(summary, at)
        if opcode == STATISTICS:
            return struct.unpack_from("<Q", summary, at + _FRAME.size)[0]
        at += _FRAME.size + length
    return "no"
