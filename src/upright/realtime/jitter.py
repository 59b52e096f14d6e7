"""How late is this machine? The loop's own deadlines with the loop's own work, and nothing at its other end.

Only rates that were tried are confirmed. Slower rates are judged by the same delays; of faster ones it is only said
whether delays and work leave time for them: more of a period goes into them, and less of it hides how late a sleep
ends.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from upright.errors import BadInput, UprightError
from upright.realtime.pace import WallClock, vigil_within
from upright.realtime.priority import LoopPriority, step_forward
from upright.records import Array

RATES = (10_000, 5_000, 2_000, 1_000, 500, 200, 100)
"""Rates that are spoken of [Hz]."""
TOLERATED = 30 / 60_000
"""Share of late ticks with which a rate counts as held: 30 in a minute at 1 kHz."""
_SHARE = 0.95
"""Of a processor that Linux leaves to real-time processes (sched_rt_runtime_us), then it stops them for a while."""

Work = tuple[Callable[[], object], Callable[[], object]]
"""What a tick has to do, and what happens between two, in the place of a rig's exchange; the first is timed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Jitter:
    """What was measured.

    Attributes
    ----------
    period : float
        [s].
    behind : array, shape (N,)
        How far behind its deadline each tick was woken [s].
    overslept : array, shape (N,)
        How much later than requested the sleep before it ended [s]; see `realtime.pace`.
    late, passed : int
        Ticks that were late, and those of them that were passed over: see `realtime.pace`.
    work : array, shape (N,)
        Time that the work of each tick took [s].
    stolen : float
        Time for which the host of a virtual machine gave its processors to others meanwhile, over all of them [s].
    """

    period: float
    behind: Array
    overslept: Array
    late: int
    work: Array
    standing: LoopPriority
    stolen: float = 0.0
    passed: int = 0

    @property
    def due(self) -> int:
        """Ticks that were due, of which some were late."""
        return self.behind.size + self.passed

    @property
    def quantiles(self) -> dict[str, float]:
        """p50, p99, p99.9 and the largest [s]."""
        p50, p99, p999, most = np.percentile(self.behind, [50, 99, 99.9, 100]).tolist()
        return {"p50": p50, "p99": p99, "p99.9": p999, "max": most}

    @property
    def held(self) -> bool:
        """Whether the rate that was tried is held."""
        return self.late <= TOLERATED * self.due

    @property
    def rate(self) -> float:
        """Rate that is held [Hz]: the one that was tried, else the fastest of `RATES` below it; 0 for none."""
        tried = 1.0 / self.period
        if self.held:
            return tried
        return next((rate for rate in RATES if rate < tried and self._missed(rate) <= TOLERATED), 0)

    @property
    def promising(self) -> int:
        """Fastest of `RATES` above one that was held for which there seems to be time [Hz]; 0 for none."""
        for rate in RATES if self.held else ():
            share = rate * (float(np.mean(self.work)) + vigil_within(1.0 / rate, self.standing.vigil))
            if rate * self.period > 1.0 + 1e-9 and share <= _SHARE and self._missed(rate) <= TOLERATED:
                return rate
        return 0

    def _missed(self, rate: float) -> float:
        """Share of ticks that, with these delays, would not have been woken and done within a period of a rate."""
        woken = np.maximum(self.behind, self.overslept - vigil_within(1.0 / rate, self.standing.vigil))
        return float(np.mean(woken + self.work > 1.0 / rate))

    @property
    def verdict(self) -> str:
        """What it says of this machine, in a sentence or two."""
        tried = 1.0 / self.period
        head = f"{self.late} of {self.due} ticks were late at {tried:.4g} Hz ({self.standing.priority})"
        if self.held:
            more = f" There seems to be time for {self.promising} Hz, which was not tried." if self.promising else ""
            return f"{head}: this machine holds {tried:.4g} Hz as it is now.{more}"
        theft = f"Its host took its processors away for {self.stolen:.2g} s meanwhile." if self.stolen else ""
        if self.rate == 0:
            head = f"{head}, and it would not hold {RATES[-1]} Hz"
            return f"{head}: run on an idle machine, or on the rig's controller. {theft}".strip()
        return " ".join(filter(None, (f"{head}: it would have held {self.rate:g} Hz.", theft, self.standing.warning)))


def measure(seconds: float, rate: float, *, fifo: bool, make: Callable[[], Work]) -> Jitter:
    """Jitter of a loop of its own process on this machine, now.

    Parameters
    ----------
    seconds, rate : float
        [s], [Hz].
    fifo : bool
        Whether to ask for FIFO priority.
    make : callable
        Makes the work of a tick, in that process.

    Raises
    ------
    BadInput
        When that is no loop.
    """
    if not (1 <= rate <= 20_000 and 0.1 <= seconds <= 3600):
        raise BadInput(f"a loop is measured at 1 to 20000 Hz for 0.1 to 3600 s, got {rate:g} Hz for {seconds:g} s.")
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    child = context.Process(target=_measured, args=(theirs, seconds, rate, fifo, make), daemon=True)
    before = _stolen()
    child.start()
    theirs.close()
    try:
        result: dict[str, Any] | UprightError = ours.recv()
    except EOFError:
        raise BadInput("the process that measures did not come back; is there memory left?") from None
    finally:
        child.join(5.0)
        ours.close()
    if isinstance(result, UprightError):
        raise result
    return Jitter(period=1.0 / rate, stolen=_stolen() - before, **result)


def _stolen() -> float:
    """Time that a host gave to others since the start [s]; unknown where there is no host, or no Linux."""
    try:
        with open("/proc/stat", encoding="ascii") as file:
            return int(file.readline().split()[8]) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError, AttributeError):
        return 0.0


def _measured(pipe: Any, seconds: float, rate: float, fifo: bool, make: Callable[[], Work]) -> None:
    from time import monotonic_ns

    ticks = round(seconds * rate)
    behind, overslept, work = np.zeros(ticks), np.zeros(ticks), np.zeros(ticks)
    try:
        step, between = make()
        standing = step_forward(fifo=fifo)
        pace = WallClock(1.0 / rate, vigil=standing.vigil)
        for k in range(ticks):
            behind[k], overslept[k] = pace.wait(), pace.overslept
            began = monotonic_ns()
            step()
            work[k] = 1e-9 * (monotonic_ns() - began)
            between()
    except UprightError as error:
        pipe.send(error)
    else:
        late = {"late": pace.late, "passed": pace.passed}
        result = {"behind": behind, "overslept": overslept, "work": work, "standing": standing, **late}
        pipe.send(result)
    pipe.close()
