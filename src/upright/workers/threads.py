"""Threads of this process for what machine code computes; it holds no lock of Python's, and the numbers are the same.

For work of milliseconds, which processes would take longer to be sent. A process that is one of many computes on one
core, and so does a thread that shares work already.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from functools import cache
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

_here = threading.local()


def cores() -> int:
    """How many cores this thread may share work among."""
    if getattr(_here, "alone", False):
        return 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def one_core() -> Generator[None]:
    """Within it, this thread shares no work: others need the cores."""
    before = getattr(_here, "alone", False)
    _here.alone = True
    try:
        yield
    finally:
        _here.alone = before


def share(task: Callable[[T], R], items: Sequence[T]) -> Generator[R]:
    """What a task makes of every item, in their order; each as it is wanted where there is but one core.

    Who wants no more of them closes it, and what has not begun is left out.
    """
    number = min(cores(), len(items))
    if number < 2:
        yield from map(task, items)
        return
    pool = _pool(os.getpid(), number)  # a process that was forked has none of the threads
    futures = [pool.submit(copy_context().run, task, item) for item in items]
    try:
        for future in futures:
            yield future.result()
    finally:
        for future in futures:
            future.cancel()


@cache
def _pool(_process: int, number: int) -> ThreadPoolExecutor:
    def alone() -> None:
        _here.alone = True

    return ThreadPoolExecutor(number, thread_name_prefix="upright core", initializer=alone)
