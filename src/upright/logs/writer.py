"""The log of a run as the loop sees it: rows handed over, nothing waited for, nothing raised."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from upright.errors import BadInput
from upright.files import PathLike, check_output
from upright.logs import ring as of
from upright.logs.header import LogHeader
from upright.logs.ring import Ring, shared_memory

_START, _END = 30.0, 30.0  # s that the process may take to begin, and to write what waits


@dataclass(frozen=True, kw_only=True)
class LogStatus:
    """How far a log has come.

    Attributes
    ----------
    rows : int
        In the file: readable, whatever happens next to either process.
    dropped : int
        Rows of the loop that are not in the file and will never be.
    message : str
        What is wrong, as a sentence; empty while all is well.
    """

    rows: int
    dropped: int
    message: str = ""


class LogWriter:
    """A log that is being written, by a process of its own.

    Open it before the loop is given its priority and its processor: the process begins with those of its parent.

    Parameters
    ----------
    path : path
        File to write (MCAP); there must be none yet.
    rows : int
        Rows that may wait for the process; what comes while so many wait is dropped, and counted.

    Raises
    ------
    BadInput
        When the file exists or may not be written, or the rig extra is not installed.
    """

    def __init__(self, path: PathLike, *, header: LogHeader, rows: int = 8192) -> None:
        from upright.logs.layout import library

        library()
        self._path = check_output(path)
        if self._path.exists():
            raise BadInput(f"'{path}' exists already, and a run is not logged over another; name another file.")
        if not 16 <= rows <= 1 << 22:
            raise BadInput(f"the buffer of a log holds 16 to {1 << 22} rows, got {rows}.")
        self._path.parent.mkdir(parents=True, exist_ok=True)
        memory, name, inherited = shared_memory(Ring.size(len(header.columns), rows))
        self._ring: Ring | None = Ring(memory, header.columns, rows)
        self._columns, self._unfit, self._full = header.columns, 0, 0
        self._last, self._clock = LogStatus(rows=0, dropped=0), threading.Event()
        self._process = self._begin(header, name, inherited, rows)
        for _ in range(round(_START / 0.005)):
            if self._ring.marks[of.STATE] != of.STARTING or self._process.poll() is not None:
                break
            self._clock.wait(0.005)
        if self._ring.marks[of.STATE] != of.WRITING:
            message = self._ring.message() or "its process did not begin"
            _end(self._process, 0.0)
            raise BadInput(f"the log '{path}' cannot be written: {message}; name another file.")

    def _begin(self, header: LogHeader, name: str, inherited: tuple[int, ...], rows: int) -> subprocess.Popen[bytes]:
        """The process, which reads the header from its input, whose end later means that the loop is gone."""
        try:
            process = subprocess.Popen(
                [sys.executable, "-P", "-m", "upright.logs.process", str(self._path), name, str(rows)],
                stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, pass_fds=inherited,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
                # Ctrl-C is for the loop, which then closes the log
                start_new_session=os.name != "nt", creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
            )  # fmt: skip
        finally:
            for end in inherited:
                os.close(end)
        assert process.stdin is not None
        with suppress(OSError):
            process.stdin.write(json.dumps(header.as_metadata()).encode() + b"\n")
            process.stdin.flush()
        return process

    @property
    def pid(self) -> int:
        """Number of the process that writes."""
        return self._process.pid

    def row(self, sample: Sequence[float]) -> None:
        """Hand over one row in the order of `LogHeader.columns`."""
        if self._ring is None:
            return
        if refused := self._ring.put(sample):
            if refused == of.UNFIT:
                self._unfit += 1
            else:
                self._full += 1

    def event(self, t: float, kind: str, text: str) -> None:
        """Hand over an event at a time [s]; one of kind ``"fault"`` is put on the disk at once."""
        if self._ring is not None:
            with suppress(TypeError, ValueError):
                content = [self._ring.marks[of.NUMBER], float(t), _cut(str(kind), 80), _cut(str(text), 800)]
                self._ring.put_event(json.dumps(content).encode())

    def status(self) -> LogStatus:
        """How far the log has come; takes some microseconds."""
        ring = self._ring
        if ring is None:
            return self._last
        dropped = self._full + self._unfit + ring.marks[of.LOST]
        messages = [ring.message()]
        ended = self._process.poll()
        if ended is not None and ring.marks[of.STATE] != of.DONE:
            dropped = ring.marks[of.NUMBER] - ring.marks[of.WRITTEN]
            if not messages[0]:
                messages = [f"{of.PROCESS} ended (code {ended}) after {ring.marks[of.WRITTEN]} rows; the loop goes on"]
        if self._full:
            messages.append(f"{self._full} rows dropped: {ring.rows} waited already")
        if self._unfit:
            names = ", ".join(c.name + (" (whole)" if c.whole else "") for c in self._columns)
            messages.append(f"{self._unfit} rows dropped that were not the {len(self._columns)} numbers {names}")
        if ring.marks[of.EVENTS_LOST]:
            messages.append(f"{ring.marks[of.EVENTS_LOST]} events dropped: too many at once")
        return LogStatus(rows=ring.marks[of.WRITTEN], dropped=dropped, message="; ".join(filter(None, messages)))

    def close(self) -> LogStatus:
        """Let the process write what waits, and end the file."""
        if self._ring is not None:
            self._ring.marks[of.STOP] = 1
            _end(self._process, _END)
            self._last = self.status()
            self._ring.close()
            self._ring = None
        return self._last

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _cut(text: str, most: int) -> str:
    """Beginning of a text that JSON writes in at most so many bytes."""
    while len(json.dumps(text)) > most:
        text = text[: max(len(text) * 3 // 4, 1) if len(text) > 1 else 0]
    return text


def _end(process: subprocess.Popen[bytes], patience: float) -> None:
    """Close a process's input, which tells it to end, and stop it when it does not."""
    with suppress(OSError):
        if process.stdin is not None:
            process.stdin.close()
    try:
        process.wait(patience)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
