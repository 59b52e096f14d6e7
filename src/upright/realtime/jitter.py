"""How late is this machine? The loop's own deadlines with the loop's own work, and nothing at its other end."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from upright.errors import BadInput
from upright.laws import state_feedback
from upright.realtime.pace import WallClock
from upright.realtime.priority import LoopPriority, step_forward
from upright.records import Array
from upright.rigs.law import RunningLaw

RATES = (10_000, 5_000, 2_000, 1_000, 500, 200, 100)
"""Rates that are spoken of [Hz]."""
TOLERATED = 30 / 60_000
"""Share of late ticks with which a rate counts as held: 30 in a minute at 1 kHz."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Jitter:
    """What was measured.

    Attributes
    ----------
    period : float
        [s].
    behind : array, shape (N,)
        How far behind its deadline each tick was woken [s].
    late : int
        Ticks that were late: see `realtime.pace`.
    work : float
        Median time that the work of a tick took [s].
    standing : LoopPriority
    stolen : float
        Time for which the host of a virtual machine gave its processors to others meanwhile, over all of them [s].
    """

    period: float
    behind: Array
    late: int
    work: float
    standing: LoopPriority
    stolen: float = 0.0

    @property
    def quantiles(self) -> dict[str, float]:
        """p50, p99, p99.9 and the largest [s]."""
        p50, p99, p999, most = np.percentile(self.behind, [50, 99, 99.9, 100]).tolist()
        return {"p50": p50, "p99": p99, "p99.9": p999, "max": most}

    @property
    def rate(self) -> int:
        """Fastest of `RATES` that this machine would have held in this time [Hz]; 0 for none.

        A tick of that rate would have been late when it was woken, and its work done, after a period.
        """
        for rate in RATES:
            if np.mean(self.behind + self.work > 1.0 / rate) <= TOLERATED:
                return rate
        return 0

    @property
    def verdict(self) -> str:
        """What it says of this machine, in a sentence or two."""
        asked = 1.0 / self.period
        head = f"{self.late} of {self.behind.size} ticks were late at {asked:.4g} Hz ({self.standing.priority})"
        if self.late <= TOLERATED * self.behind.size:
            return f"{head}: this machine holds {asked:.4g} Hz as it is now."
        theft = f"Its host took its processors away for {self.stolen:.2g} s meanwhile." if self.stolen else ""
        if self.rate == 0:
            head = f"{head}, and it would not hold {RATES[-1]} Hz"
            return f"{head}: run on an idle machine, or on the rig's controller. {theft}".strip()
        return " ".join(
            filter(None, (f"{head}: this machine held {self.rate} Hz as it is now.", theft, self.standing.warning))
        )


def measure(seconds: float, rate: float = 1000.0, *, fifo: bool = True) -> Jitter:
    """Jitter of a loop of its own process on this machine, now.

    Parameters
    ----------
    seconds, rate : float
        [s], [Hz].
    fifo : bool
        Whether to ask for FIFO priority.

    Raises
    ------
    BadInput
        When that is no loop.
    """
    if not (1 <= rate <= 20_000 and 0.1 <= seconds <= 3600):
        raise BadInput(f"a loop is measured at 1 to 20000 Hz for 0.1 to 3600 s, got {rate:g} Hz for {seconds:g} s.")
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    child = context.Process(target=_measured, args=(theirs, seconds, rate, fifo), daemon=True)
    before = _stolen()
    child.start()
    theirs.close()
    try:
        behind, late, work, standing = ours.recv()
    except EOFError:
        raise BadInput("the process that measures did not come back; is there memory left?") from None
    finally:
        child.join(5.0)
        ours.close()
    stolen = _stolen() - before
    return Jitter(period=1.0 / rate, behind=behind, late=late, work=work, standing=standing, stolen=stolen)


def _stolen() -> float:
    """Time that a host gave to others since the start [s]; none is told where there is no host, or no Linux."""
    try:
        with open("/proc/stat", encoding="ascii") as file:
            return int(file.readline().split()[8]) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError, AttributeError):
        return 0.0


def _measured(pipe: Any, seconds: float, rate: float, fifo: bool) -> None:
    from time import monotonic_ns

    law = RunningLaw(state_feedback([1.0, 0.1, 2.0, 0.2], 1.0 / rate, memory=0.5, k_pf=1.0), 1.0 / rate)
    ticks = round(seconds * rate)
    behind, work = np.zeros(ticks), np.zeros(ticks)
    step: Callable[..., float] = law.step
    standing = step_forward(fifo=fifo)
    pace = WallClock(1.0 / rate, vigil=standing.vigil)
    for k in range(ticks):
        behind[k] = pace.wait()
        began = monotonic_ns()
        step((0.01, 0.02), 0.0)
        work[k] = monotonic_ns() - began
    pipe.send((behind, pace.late, 1e-9 * float(np.median(work)), standing))
    pipe.close()
