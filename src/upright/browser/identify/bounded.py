"""A task of which nobody knows what it takes: in a process of its own, with bounded memory and time."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Generator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any

from upright.errors import BadInput, UprightError
from upright.progress import Progress, silent
from upright.realtime.interrupts import ignoring
from upright.realtime.process import end_with_parent

MEMORY = 3072
"""Megabytes that a task may take beyond what it begins with."""
OFTEN = 0.1
"""Time between two reports of progress at least [s]."""


class Bounded:
    """A task in a process of its own.

    Parameters
    ----------
    task : callable
        Of a module; called with the arguments and a `Progress`, it gives a text.
    seconds, grace : float
        After so long it is interrupted, and after the grace ended [s].
    show : callable, optional
        Called with the pictures, as JSON holds them, that the task gives to a second callable.
    """

    def __init__(
        self, task: Callable[..., str], *arguments: Any, seconds: float, grace: float = 0.0,
        progress: Progress = silent, show: Callable[[Any], None] | None = None,
    ) -> None:  # fmt: skip
        self._task, self._arguments, self._progress, self._show = task, arguments, progress, show
        self._seconds, self._grace = seconds, grace
        self._stopping = threading.Event()
        self._process: Any = None

    def interrupt(self) -> None:
        """Let it end with what it has, within the grace."""
        self._stopping.set()

    def kill(self) -> None:
        """End it at once, with nothing."""
        self._grace = 0.0
        self._stopping.set()
        if self._process is not None:
            self._process.kill()

    def run(self) -> str:
        """What the task gives.

        Raises
        ------
        UprightError
            What the task raised, as a sentence; also when it took more memory or time than it may.
        """
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe(duplex=False)
        self._process = context.Process(
            target=_perform, args=(theirs, self._task, self._arguments, self._show is not None), daemon=True,
            name="upright clerk",
        )  # fmt: skip
        with ignoring():
            self._process.start()
        theirs.close()
        try:
            return self._answer(ours)
        finally:
            self._process.kill()
            self._process.join()
            ours.close()

    def _answer(self, pipe: Connection) -> str:
        until, ready, interrupted, overdue = time.monotonic() + self._seconds, False, False, False
        given_up = f"it took more than {self._seconds:g} s, and was given up."
        while True:
            late = time.monotonic() > until
            if ready and not interrupted and (late or self._stopping.is_set()):
                interrupted, overdue, late, until = True, late, False, time.monotonic() + self._grace
                os.kill(self._process.pid, signal.SIGINT)
            if late:
                raise BadInput(given_up)
            if not pipe.poll(OFTEN):
                continue
            try:
                kind, *content = json.loads(pipe.recv_bytes())
            except EOFError:
                raise UprightError("its process ended without an answer, by a fault or for want of memory.") from None
            if kind == "ready":
                ready = True
            elif kind == "progress":
                self._progress(*content)
            elif kind == "picture" and self._show is not None:
                self._show(*content)
            elif kind == "answer":
                return str(content[0])
            elif kind == "interrupted":
                raise BadInput(given_up if overdue else "it was interrupted before there was a result.")
            else:
                raise BadInput(content[0])


def finish() -> None:
    """From here on the task lets nobody interrupt it: it writes what it has."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _perform(pipe: Connection, task: Callable[..., str], arguments: tuple[Any, ...], shows: bool) -> None:
    end_with_parent()
    if hasattr(os, "nice"):
        os.nice(10)
    _limit()

    def send(*content: Any) -> None:
        data = json.dumps(content).encode()
        with _uninterrupted():  # half a message would be the last that is understood
            pipe.send_bytes(data)

    last = 0.0

    def progress(step: str, share: float) -> None:
        nonlocal last
        if time.monotonic() - last > OFTEN:
            last = time.monotonic()
            send("progress", step, share)

    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])  # blocked where a thread started it
        send("ready")
        text = task(*arguments, progress, *([lambda picture: send("picture", picture)] if shows else []))
        finish()
        send("answer", text)
    except UprightError as error:
        send("error", str(error))
    except MemoryError:
        send("error", f"it takes more than {MEMORY} MB of memory, and was given up.")
    except KeyboardInterrupt:
        send("interrupted")
    except Exception as error:
        traceback.print_exc()
        send("error", f"it stopped by a fault of the program ({type(error).__name__}); see what the server printed.")
    pipe.close()


@contextmanager
def _uninterrupted() -> Generator[None]:
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _limit() -> None:
    if sys.platform != "linux":  # elsewhere the time alone is bounded
        return
    import resource

    with open("/proc/self/statm", encoding="ascii") as file:
        now = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + (MEMORY << 20), resource.RLIM_INFINITY))
