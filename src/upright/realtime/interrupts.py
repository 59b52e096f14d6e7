"""Ctrl-C while something must be done to its end: a rig zeroed, its log closed, its verdict said."""

from __future__ import annotations

import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager


@contextmanager
def no_interrupt() -> Generator[None]:
    """Ignore SIGINT meanwhile, in this process and in those that it starts; nothing in a thread, which gets none."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
