"""How do rows leave the loop without holding it up? Through memory that two processes share, one writing, one reading.

Each row has a place in a ring, with its number and a checksum. The loop writes the row, then moves the head; the other
side reads from the tail up to the head and moves the tail. Nobody waits: a row for which there is no place is dropped,
and its number is missing afterwards. Processors may show the head before the row (ARM does); the checksum tells.
Events have a smaller ring of their own, each a text of at most some 1000 bytes.
"""

from __future__ import annotations

import errno
import mmap
import os
import struct
import sys
import tempfile
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from upright.logs.header import LogColumn

HEAD, TAIL, NUMBER, EVENT_HEAD, EVENT_TAIL, EVENTS_LOST, STOP, STATE, WRITTEN, LOST = range(10)
"""Numbers at the beginning: the loop moves heads, NUMBER, EVENTS_LOST and STOP; the other process the rest."""
FULL, UNFIT = "full", "unfit"
PROCESS = "the process that writes the log"
STARTING, WRITING, DONE, FAILED = range(4)
_MESSAGE = 128
_ROWS = 1024  # bytes before the first row
_EVENTS, _EVENT = 64, 1024
_CHECK = struct.Struct("<I")


class Ring:
    """Rows and events on their way, in memory that another process maps too.

    Attributes
    ----------
    marks : memoryview
        The numbers at the beginning, 64 bits each, written by one side each.
    """

    def __init__(self, memory: mmap.mmap, columns: Sequence[LogColumn], rows: int) -> None:
        self._memory = memory
        self._row = struct.Struct("<q" + "".join("q" if column.whole else "d" for column in columns))
        self._stride = self._row.size + 8
        self.rows = rows
        self.marks = memoryview(memory)[: 8 * (LOST + 1)].cast("q")
        self._first_event = _ROWS + rows * self._stride

    @staticmethod
    def size(columns: int, rows: int) -> int:
        """Bytes of memory that are needed."""
        return _ROWS + rows * (8 * (columns + 2)) + _EVENTS * _EVENT

    def put(self, row: Sequence[float]) -> str:
        """Hand a row over; why it was dropped: `FULL`, `UNFIT` for these columns, or empty when it was not."""
        marks = self.marks
        number, head = marks[NUMBER], marks[HEAD]
        marks[NUMBER] = number + 1
        if head - marks[TAIL] >= self.rows:
            return FULL
        try:
            packed = self._row.pack(number, *row)
        except (struct.error, TypeError, OverflowError):
            return UNFIT
        at = _ROWS + head % self.rows * self._stride
        end = at + self._row.size
        self._memory[at:end] = packed
        _CHECK.pack_into(self._memory, end, zlib.crc32(packed))
        marks[HEAD] = head + 1
        return ""

    def take(self, most: int) -> Iterator[tuple[Any, ...]]:
        """Rows that wait, their numbers first; each is released when the next is read."""
        for position in range(self.marks[TAIL], min(self.marks[HEAD], self.marks[TAIL] + most)):
            at = _ROWS + position % self.rows * self._stride
            end = at + self._row.size
            packed = self._memory[at:end]
            if zlib.crc32(packed) != _CHECK.unpack_from(self._memory, end)[0]:
                return  # not all of it can be seen yet
            yield self._row.unpack(packed)
            self.marks[TAIL] = position + 1

    def put_event(self, content: bytes) -> bool:
        """Hand an event over, cut where it is too long; False when there is no place."""
        head = self.marks[EVENT_HEAD]
        if head - self.marks[EVENT_TAIL] >= _EVENTS:
            self.marks[EVENTS_LOST] += 1
            return False
        content = content[: _EVENT - 8]
        at = self._first_event + head % _EVENTS * _EVENT
        self._memory[at + 8 : at + 8 + len(content)] = content
        struct.pack_into("<II", self._memory, at, len(content), zlib.crc32(content))
        self.marks[EVENT_HEAD] = head + 1
        return True

    def take_events(self) -> Iterator[bytes]:
        """Events that wait."""
        for position in range(self.marks[EVENT_TAIL], self.marks[EVENT_HEAD]):
            at = self._first_event + position % _EVENTS * _EVENT
            length, check = struct.unpack_from("<II", self._memory, at)
            content = self._memory[at + 8 : at + 8 + length]
            if zlib.crc32(content) != check:
                return
            yield content
            self.marks[EVENT_TAIL] = position + 1

    def say(self, sentence: str) -> None:
        """Leave a sentence for the other side."""
        content = sentence.encode()[: _ROWS - _MESSAGE - 8]
        self._memory[_MESSAGE + 8 : _MESSAGE + 8 + len(content)] = content
        struct.pack_into("<II", self._memory, _MESSAGE, len(content), zlib.crc32(content))

    def message(self) -> str:
        """Message of the writer; empty when there is none."""
        length, check = struct.unpack_from("<II", self._memory, _MESSAGE)
        content = self._memory[_MESSAGE + 8 : _MESSAGE + 8 + min(length, _ROWS)]
        return content.decode(errors="ignore") if zlib.crc32(content) == check else ""

    def close(self) -> None:
        """Let go of the memory."""
        self.marks.release()
        self._memory.close()


def shared_memory(size: int) -> tuple[mmap.mmap, str, tuple[int, ...]]:
    """Memory that a child may map too: as `join` needs it there, and the files that the child must inherit.

    It has no name that could outlive its processes, however they end. Where there are files that are on no disk
    (Linux), no write-back can hold up who writes to it.
    """
    if sys.platform == "win32":
        name = f"upright-{os.getpid()}-{os.urandom(8).hex()}"
        return mmap.mmap(-1, size, tagname=name), name, ()
    try:
        file = _nameless(size, "/dev/shm")
    except OSError:
        file = _nameless(size, None)
    return mmap.mmap(file, size), str(file), (file,)


def _nameless(size: int, folder: str | None) -> int:
    """Number of an open file of zeros that no folder shows any more."""
    file, path = tempfile.mkstemp(prefix="upright-log-", dir=folder)
    Path(path).unlink()
    try:
        if os.write(file, bytes(size)) == size:  # written, so that a full disk is reported here, not by a signal later
            return file
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    except OSError:
        os.close(file)
        raise


def join(name: str, size: int) -> mmap.mmap:
    """The memory that `shared_memory` made in another process."""
    if sys.platform == "win32":
        return mmap.mmap(-1, size, tagname=name)
    return mmap.mmap(int(name), size)
