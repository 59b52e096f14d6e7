"""The process beside the loop: takes rows out of the ring, writes them, and puts them on the disk about once a second.

It ends on request, or when the loop's process is gone; what waits in the ring is written first.
A disk that is full, or fails, ends the file at its last whole chunk: rows are taken out of the ring as before, so that
the loop goes on, and the sentence that says so waits in the ring for whoever asks.
"""

from __future__ import annotations

import errno
import json
import os
import sys
import threading
import time
from contextlib import suppress
from typing import Any

from upright.errors import UprightError
from upright.logs import ring as of
from upright.logs.header import LogHeader
from upright.logs.layout import DROPPED, FAULT, RunFile
from upright.logs.ring import Ring, join

BATCH = 100
"""Rows in a chunk at most, and"""
LATEST = 0.04
"""seconds that a row waits for others at most: two of them, with all else, stay below 100 ms."""
PAUSE, SYNC = 0.01, 1.0
_FULL = (errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC))


class _Output:
    """File that is written in whole chunks: what is not flushed is not there, and half a chunk is taken back."""

    def __init__(self, path: str) -> None:
        self._file = open(path, "xb", buffering=0)  # noqa: SIM115
        self._waiting = bytearray()
        self._whole = 0

    def write(self, content: bytes) -> int:
        self._waiting += content
        return len(content)

    def tell(self) -> int:
        return self._whole + len(self._waiting)

    def flush(self) -> None:
        left = memoryview(self._waiting)
        try:
            while left:
                left = left[self._file.write(left) or 0 :]
        except OSError:
            with suppress(OSError):
                self._file.truncate(self._whole)
            raise
        finally:
            left.release()
        self._whole += len(self._waiting)
        self._waiting = bytearray()

    def sync(self) -> None:
        with suppress(OSError):  # a disk that cannot hold what was written says so with the next chunk
            getattr(os, "fdatasync", os.fsync)(self._file.fileno())


class _Disk(threading.Thread):
    """Puts a file on the disk on request; the disk may take its time without holding up the chunks."""

    def __init__(self, output: _Output) -> None:
        super().__init__(daemon=True)
        self._output, self._requested = output, threading.Event()
        self.start()

    def ask(self) -> None:
        self._requested.set()

    def run(self) -> None:
        while self._requested.wait():
            self._requested.clear()
            self._output.sync()


class _Log:
    """Rows and events of a ring on their way into a file, until it fails."""

    def __init__(self, ring: Ring, output: _Output, header: LogHeader) -> None:
        self.ring, self.output, self.disk = ring, output, _Disk(output)
        self.file: RunFile | None = RunFile(output, header)
        self.number, self.t = 0, 0.0
        self.events: list[tuple[int, float, str, str]] = []
        self.unwritten = 0
        self.flushed = self.synced = time.monotonic()

    def take(self) -> bool:
        """Whatever waits in the ring; whether anything did."""
        self.events += map(json.loads, self.ring.take_events())
        before = self.number
        for number, *row in self.ring.take(BATCH):
            if number > self.number:
                self.missing(number - self.number, row[0])
            self.happened(number)
            self.number, self.t = number + 1, row[0]
            self.add(row)
            if self.unwritten >= BATCH:
                self.flush()
        fresh = self.number > before or bool(self.events)
        self.happened(self.number if self.ring.marks[of.TAIL] < self.ring.marks[of.HEAD] else sys.maxsize)
        now = time.monotonic()
        if self.unwritten and now - self.flushed > LATEST:
            self.flush()
        if now - self.synced > SYNC and self.file is not None:
            self.synced = now
            self.disk.ask()
        return fresh

    def happened(self, number: int) -> None:
        """Events from before the row of this number: each ends a chunk, a fault goes to the disk at once."""
        while self.events and self.events[0][0] <= number:
            _, t, kind, text = self.events.pop(0)
            self.event(t, kind, text)
            self.flush()
            if kind == FAULT:
                self.disk.ask()

    def add(self, row: list[Any]) -> None:
        if self.file is None:
            self.ring.marks[of.LOST] += 1
            return
        if not self.unwritten:
            self.flushed = time.monotonic()
        self.file.row(row)
        self.unwritten += 1

    def event(self, t: float, kind: str, text: str, dropped: int = 0) -> None:
        if self.file is not None:
            self.file.event(t, kind, text, dropped)

    def missing(self, rows: int, t: float) -> None:
        """Tell of rows that the loop handed over and the ring had no place for."""
        self.event(t, DROPPED, f"{rows} row{'s' if rows > 1 else ''} of the loop dropped before this", rows)

    def flush(self) -> None:
        """Hand the chunk to the file; when it does not take it, the log ends with the chunk before."""
        if self.file is None:
            return
        try:
            self.file.flush()
        except OSError as error:
            self.fail(error)
            return
        self.ring.marks[of.WRITTEN] += self.unwritten
        self.unwritten, self.flushed = 0, time.monotonic()

    def fail(self, error: OSError) -> None:
        what = "disk full" if error.errno in _FULL else f"the log's file failed ({error.strerror or error})"
        self.ring.say(f"{what} after {self.ring.marks[of.WRITTEN]} rows; the loop goes on")
        self.ring.marks[of.LOST] += self.unwritten
        self.ring.marks[of.STATE] = of.FAILED
        self.file, self.unwritten = None, 0
        self.output.sync()

    def finish(self) -> None:
        """Last chunk, summary, disk."""
        if self.ring.marks[of.NUMBER] > self.number:
            self.missing(self.ring.marks[of.NUMBER] - self.number, self.t)
        self.flush()
        if self.file is None:
            return
        try:
            self.file.finish()
            self.output.flush()
        except OSError as error:
            self.fail(error)
            return
        self.output.sync()
        self.ring.marks[of.STATE] = of.DONE


def _loop_is_gone() -> threading.Event:
    """Set when nobody holds the other end of this process's input any more."""
    gone = threading.Event()

    def read() -> None:
        with suppress(OSError, ValueError):
            while sys.stdin.buffer.read(1):
                pass
        gone.set()

    threading.Thread(target=read, daemon=True).start()
    return gone


def _ordinary_priority() -> None:
    """Leave the class of the loop's process, which may have the processor for itself."""
    with suppress(AttributeError, OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))  # type: ignore[attr-defined]


def write_log(path: str, memory: str, rows: int) -> None:
    """Write one log, its header the first line of this process's input, from a ring that another process made."""
    _ordinary_priority()
    about = LogHeader.of_metadata(json.loads(sys.stdin.buffer.readline()))
    ring = Ring(join(memory, Ring.size(len(about.columns), rows)), about.columns, rows)
    gone = _loop_is_gone()
    try:
        log = _Log(ring, _Output(path), about)
    except (OSError, UprightError) as error:
        ring.say(str(error.strerror if isinstance(error, OSError) else error))
        ring.marks[of.STATE] = of.FAILED
        return
    ring.marks[of.STATE] = of.WRITING
    try:
        while True:
            last = bool(ring.marks[of.STOP]) or gone.is_set()  # asked before the ring, which then holds its last row
            if not log.take():
                if last:
                    break
                gone.wait(PAUSE)
        log.finish()
    except Exception as error:  # a mistake of ours; the loop hears of it
        ring.say(f"{of.PROCESS} failed ({type(error).__name__}: {error}) after {ring.marks[of.WRITTEN]} rows")
        ring.marks[of.STATE] = of.FAILED


if __name__ == "__main__":
    _path, _memory, _rows = sys.argv[1:]
    write_log(_path, _memory, int(_rows))
