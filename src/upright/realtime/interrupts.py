"""Signals while something must be done to its end: a rig zeroed, its log closed, its verdict said."""

from __future__ import annotations

import signal
import threading
from collections.abc import Generator, Sequence
from contextlib import contextmanager

INTERRUPT = (signal.SIGINT,)
ENDING: tuple[signal.Signals, ...] = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGBREAK")
    if hasattr(signal, name)
)
"""By which a person or a system ends a program or, with Ctrl-Z, leaves it standing where it is."""


@contextmanager
def ignoring(signals: Sequence[signal.Signals] = INTERRUPT) -> Generator[None]:
    """Ignore signals meanwhile, in this process and in those that it starts; in these alone from another thread."""
    if threading.current_thread() is not threading.main_thread():
        if not hasattr(signal, "pthread_sigmask"):
            yield
            return
        from multiprocessing.resource_tracker import ensure_running

        ensure_running()  # of multiprocessing; where it starts meanwhile, it lets these signals through again
        held = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, held)
        return
    before = {each: signal.signal(each, signal.SIG_IGN) for each in signals}
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, signal.SIG_DFL if handler is None else handler)  # None: not Python's own
