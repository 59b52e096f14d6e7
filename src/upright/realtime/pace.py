"""Absolute deadlines: tick k is due k periods after the first, however late the one before was.

A tick is late when its deadline had passed before the loop was back to wait for it, or when it was woken a period or
more behind. Late ticks are counted and passed over, never caught up: two commands in one period help nobody.
"""

from __future__ import annotations

import ctypes
import sys
import threading
import time
from collections.abc import Callable
from typing import Protocol

_ABSOLUTE = 1  # TIMER_ABSTIME
_MONOTONIC = 1  # CLOCK_MONOTONIC


class Pace(Protocol):
    """When the next tick is; how many were late so far, and how many of these were passed over."""

    late: int
    passed: int

    def wait(self) -> float:
        """Wait for the next deadline; how far behind it we were woken [s]."""
        ...


def vigil_within(period: float, vigil: float) -> float:
    """How long before a deadline to watch the clock [s]: a fifth of a period at most, the rest is for others."""
    return min(vigil, period / 5)


class Virtual:
    """Time that passes with the samples, as on a twin or by a rig's own clock: nothing is waited for."""

    def __init__(self) -> None:
        self.late = self.passed = 0

    def wait(self) -> float:
        """Return at once."""
        return 0.0


class _Time(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_int64), ("nanoseconds", ctypes.c_long))


def _sleeper() -> Callable[[int], None]:
    """Sleep until a time of the monotonic clock [ns]."""
    if sys.platform == "linux":
        libc = ctypes.CDLL(None, use_errno=True)
        due = _Time()
        place = ctypes.byref(due)

        def sleep_to(deadline: int) -> None:
            due.seconds, due.nanoseconds = divmod(deadline, 1_000_000_000)
            while libc.clock_nanosleep(_MONOTONIC, _ABSOLUTE, place, None):
                pass  # a signal came; the deadline is the same

        return sleep_to
    never = threading.Event()

    def wait_to(deadline: int) -> None:
        while (left := deadline - time.monotonic_ns()) > 0:
            never.wait(1e-9 * left)

    return wait_to


class WallClock:
    """Deadlines by the clock on the wall, the first of them a period from the first `wait`.

    Parameters
    ----------
    period : float
        [s].
    now : callable
        Time of a clock that never goes back [ns].
    sleep : callable, optional
        Sleeps until a time of that clock; the operating system's when omitted.
    vigil : float
        How long before each deadline to wake and watch the clock instead of sleeping [s]; see `vigil_within`.

    Attributes
    ----------
    late : int
        Ticks that were late so far, those that were passed over among them.
    passed : int
        Ticks that were due and passed over.
    overslept : float
        How much later than requested the last sleep ended, most of which a vigil hides [s]; 0 where there was no sleep.
    """

    def __init__(
        self, period: float, now: Callable[[], int] = time.monotonic_ns, sleep: Callable[[int], None] | None = None,
        *, vigil: float = 0.0,
    ) -> None:  # fmt: skip
        self.period, self.late, self.passed, self.overslept = period, 0, 0, 0.0
        self._now, self._sleep = now, sleep or _sleeper()
        self._vigil = round(1e9 * vigil_within(period, vigil))
        self._first, self._tick = -1, 0

    def wait(self) -> float:
        """Wait for the next deadline; how far behind it we were woken [s]."""
        now = self._now()
        if self._first < 0:
            self._first = now
        self._tick += 1
        due = self._first + round(1e9 * self._tick * self.period)
        wake, self.overslept = due - self._vigil, 0.0
        if now > due:
            self.late += 1
        else:
            if now < wake:
                self._sleep(wake)
                self.overslept = 1e-9 * (self._now() - wake)
            while self._now() < due:
                pass
        behind = 1e-9 * (self._now() - due)
        if behind >= self.period:
            missed = int(behind / self.period)
            self.late += missed
            self.passed += missed
            self._tick += missed
        return behind
