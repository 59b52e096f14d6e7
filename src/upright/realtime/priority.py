"""What a process may do to be on time here: memory that stays, no collector, a place before others.

Linux gives FIFO priority to whoever may have it (root, CAP_SYS_NICE, an rtprio limit). Else, from 6.12 on, a short
slice makes the ordinary scheduler wake the process early; else only an idle machine helps, and a warning says so.

A processor that sleeps between ticks wakes late, and a virtual one is given to others by its host meanwhile: whoever
may have FIFO also asks for processors that stay awake (measured in `benchmarks.jitter`).
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import os
import sys
from dataclasses import dataclass

FIFO_PRIORITY = 50
SLICE = 100_000
"""Slice requested of the ordinary scheduler [ns]; the shortest it takes."""
_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274}
_WAKE_LATENCY = "/dev/cpu_dma_latency"
"""Holds processors to a time [us] in which they wake, for as long as the file is open."""
_VIGIL = 200e-6
_LOCK_ALL = 3  # MCL_CURRENT | MCL_FUTURE
_TIMER_SLACK = 29  # PR_SET_TIMERSLACK


@dataclass(frozen=True, kw_only=True)
class LoopPriority:
    """What this process got.

    Attributes
    ----------
    priority : str
        ``"FIFO"``, ``"short slice"`` or ``"ordinary"``.
    locked : bool
        Whether its memory stays where it is.
    awake : bool
        Whether the processors are kept from sleep for as long as this process lives.
    warning : str
        What to do for more, as a sentence; empty with FIFO.
    """

    priority: str
    locked: bool
    awake: bool = False
    warning: str = ""

    @property
    def vigil(self) -> float:
        """How long before a deadline to watch the clock [s]: with FIFO only, else it costs the place in the queue."""
        return _VIGIL if self.priority == "FIFO" else 0.0


class _Attributes(ctypes.Structure):
    _fields_ = (
        ("size", ctypes.c_uint32), ("policy", ctypes.c_uint32), ("flags", ctypes.c_uint64), ("nice", ctypes.c_int32),
        ("priority", ctypes.c_uint32), ("runtime", ctypes.c_uint64), ("deadline", ctypes.c_uint64),
        ("period", ctypes.c_uint64),
    )  # fmt: skip


def step_forward(*, fifo: bool = True) -> LoopPriority:
    """Freeze the collector, lock memory, and take the best place there is, for this process until its end.

    Parameters
    ----------
    fifo : bool
        Whether to ask for FIFO.
    """
    gc.collect()
    gc.freeze()
    gc.disable()
    if sys.platform != "linux":
        return LoopPriority(
            priority="ordinary", locked=False,
            warning=f"{sys.platform} gives no deadlines to this program: count on late ticks, or let the rig's own "
            "controller hold it (mode MCU).",
        )  # fmt: skip
    libc = ctypes.CDLL(None, use_errno=True)
    locked = libc.mlockall(_LOCK_ALL) == 0
    libc.prctl(_TIMER_SLACK, 1, 0, 0, 0)
    if fifo:
        with contextlib.suppress(PermissionError, OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
            return LoopPriority(priority="FIFO", locked=locked, awake=_stay_awake())
    advice = "give yourself real-time priority (ulimit -r 50, or `@lab - rtprio 50` in /etc/security/limits.conf)."
    if _short_slice(libc):
        return LoopPriority(priority="short slice", locked=locked, warning=f"No FIFO priority here; {advice}")
    return LoopPriority(priority="ordinary", locked=locked, warning=f"Neither FIFO nor a short slice here; {advice}")


def _stay_awake() -> bool:
    try:
        held = os.open(_WAKE_LATENCY, os.O_WRONLY)  # never closed: the request ends with the process
        os.write(held, (0).to_bytes(4, sys.byteorder))
    except OSError:
        return False
    return True


def _short_slice(libc: ctypes.CDLL) -> bool:
    number = _SCHED_SETATTR.get(os.uname().machine)
    release = os.uname().release.split(".")
    if number is None or not (release[0].isdigit() and release[1].isdigit()):
        return False
    if (int(release[0]), int(release[1])) < (6, 12):  # before, the number is taken and not used
        return False
    attributes = _Attributes(size=ctypes.sizeof(_Attributes), policy=0, nice=os.nice(0), runtime=SLICE)
    return libc.syscall(number, 0, ctypes.byref(attributes), 0) == 0
