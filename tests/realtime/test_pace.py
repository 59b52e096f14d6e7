"""Are ticks due by the clock, whatever became of the one before?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.realtime.jitter import Jitter, measure
from upright.realtime.pace import WallClock
from upright.realtime.priority import LoopPriority


class Clock:
    """A clock of the test's own [ms]; whoever sleeps on it is woken `oversleeps` after the deadline."""

    def __init__(self):
        self.now, self.oversleeps, self.woken = 100.0, 0.0, []

    def __call__(self):
        return round(1e6 * self.now)

    def sleep(self, deadline):
        self.now = max(self.now, 1e-6 * deadline) + self.oversleeps
        self.woken.append(self.now)


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def pace(clock):
    return WallClock(2e-3, clock, clock.sleep)


def test_deadlines_are_whole_periods_from_the_first_however_long_the_work(clock, pace):
    for work in (0.0, 1.9, 0.3, 1.0, 0.0):
        clock.now += work
        pace.wait()
    assert clock.woken == pytest.approx([102.0, 104.0, 106.0, 108.0, 110.0])
    assert pace.late == 0


def test_periods_that_are_no_whole_nanoseconds_do_not_drift(clock):
    pace = WallClock(1 / 3000, clock, clock.sleep)
    for _ in range(30_000):
        pace.wait()
    assert clock.now == pytest.approx(100.0 + 10_000.0, abs=1e-5)


def test_late_ticks_are_counted_and_never_caught_up(clock, pace):
    pace.wait()
    clock.now += 7.0  # the deadlines at 104, 106, 108 pass; the next is at 110
    assert pace.wait() == pytest.approx(5e-3)
    assert pace.late == 3
    pace.wait()
    assert clock.woken == pytest.approx([102.0, 110.0])
    assert pace.late == 3


def test_a_wake_up_a_little_late_is_told_and_one_a_period_late_is_a_late_tick(clock, pace):
    clock.oversleeps = 0.4
    assert pace.wait() == pytest.approx(0.4e-3)
    assert pace.late == 0
    clock.oversleeps = 2.5
    assert pace.wait() == pytest.approx(2.5e-3)
    assert pace.late == 1


def test_whoever_keeps_vigil_sleeps_less_and_is_never_early(clock):
    class Watched(Clock):
        def __call__(self):
            self.now += 0.001  # looking takes time
            return super().__call__()

    clock = Watched()
    pace = WallClock(2e-3, clock, clock.sleep, vigil=0.2e-3)
    delays = [pace.wait() for _ in range(4)]
    assert clock.woken == pytest.approx([101.8, 103.8, 105.8, 107.8], abs=0.01)
    assert max(delays) < 5e-6
    assert min(delays) >= 0


def test_a_vigil_is_a_fifth_of_a_period_at_most(clock):
    WallClock(1e-3, lambda: round(1e6 * clock.now) + 1_000_000 * len(clock.woken), clock.sleep, vigil=1.0).wait()
    assert clock.woken == pytest.approx([100.8])


def test_a_host_that_took_the_processor_is_named_with_the_late_ticks():
    found = Jitter(period=1e-3, behind=np.full(1000, 3e-4), late=1000, work=1e-5, stolen=0.31,
                   standing=LoopPriority(priority="FIFO", locked=True))  # fmt: skip
    assert "Its host took its processors away for 0.31 s meanwhile." in found.verdict


def test_the_systems_sleep_is_never_early():
    pace = WallClock(2e-3)
    assert min(pace.wait() for _ in range(20)) >= 0


def test_a_machine_is_measured_and_judged():
    found = measure(0.5, 200.0, fifo=False)
    assert found.behind.size == 100
    assert found.behind.min() > 0
    assert found.quantiles["p50"] <= found.quantiles["p99"] <= found.quantiles["max"]
    assert "ticks were late at 200 Hz" in found.verdict


@pytest.mark.parametrize(("behind", "rate"), [(5e-6, 10_000), (3e-4, 2_000), (8e-3, 100), (0.1, 0)])
def test_the_rate_held_is_the_fastest_whose_period_exceeds_the_delay(behind, rate):
    found = Jitter(period=1e-3, behind=np.full(1000, behind), late=1000, work=1e-5,
                   standing=LoopPriority(priority="ordinary", locked=False))  # fmt: skip
    assert found.rate == rate
