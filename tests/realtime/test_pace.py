"""Are ticks due by the clock, whatever became of the one before?"""

from __future__ import annotations

import os
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from upright.errors import BadInput
from upright.realtime.jitter import Jitter, measure
from upright.realtime.pace import Virtual, WallClock
from upright.realtime.priority import LoopPriority, step_forward


class Clock:
    """A clock of the test's own [ms]; whoever sleeps on it is woken `oversleeps` after the deadline."""

    def __init__(self):
        self.now, self.oversleeps, self.woken = 100.0, 0.0, []

    def __call__(self):
        return round(1e6 * self.now)

    def sleep(self, deadline):
        self.now = max(self.now, 1e-6 * deadline) + self.oversleeps
        self.woken.append(self.now)


class Watched(Clock):
    """Whoever looks at it takes a microsecond for that."""

    def __call__(self):
        self.now += 0.001
        return super().__call__()


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
    assert (pace.late, pace.passed) == (3, 2)  # the first of them had its tick, late
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


def test_whoever_keeps_vigil_sleeps_less_and_is_never_early():
    clock = Watched()
    pace = WallClock(2e-3, clock, clock.sleep, vigil=0.2e-3)
    delays = [pace.wait() for _ in range(4)]
    assert clock.woken == pytest.approx([101.8, 103.8, 105.8, 107.8], abs=0.01)
    assert max(delays) < 5e-6
    assert min(delays) >= 0


def test_a_vigil_is_a_fifth_of_a_period_at_most(clock):
    WallClock(1e-3, lambda: round(1e6 * clock.now) + 1_000_000 * len(clock.woken), clock.sleep, vigil=1.0).wait()
    assert clock.woken == pytest.approx([100.8])


def found(behind=0.0, *, late=0, work=1e-5, overslept=0.0, priority="FIFO", rate=1000.0, **more):
    """A thousand ticks, all alike."""
    behind, overslept, work = (np.full(1000, v) for v in (behind, overslept, work))
    standing = LoopPriority(priority=priority, locked=True)
    return Jitter(period=1 / rate, behind=behind, overslept=overslept, late=late, work=work, standing=standing, **more)


def test_a_host_that_took_the_processor_is_named_with_the_late_ticks():
    assert "Its host took its processors away for 0.31 s meanwhile." in found(3e-4, late=1000, stolen=0.31).verdict


def test_how_late_a_sleep_ends_is_told_although_a_vigil_hides_it():
    clock = Watched()
    pace = WallClock(2e-3, clock, clock.sleep, vigil=0.2e-3)
    clock.oversleeps = 0.15
    assert pace.wait() < 5e-6
    assert pace.overslept == pytest.approx(0.15e-3, abs=5e-6)
    clock.now = 103.9  # back within the vigil: there is no time to sleep
    assert pace.wait() < 5e-6
    assert pace.overslept == 0.0
    clock.now = 107.0  # late
    pace.wait()
    assert pace.overslept == 0.0


def test_the_systems_sleep_is_never_early():
    pace = WallClock(2e-3)
    assert min(pace.wait() for _ in range(20)) >= 0


def idle():
    """A tick that has nothing to do."""
    return (lambda: None), (lambda: None)


def test_a_machine_is_measured_and_judged():
    found = measure(0.5, 200.0, fifo=False, make=idle)
    assert found.behind.size == 100
    assert found.behind.min() > 0
    assert found.quantiles["p50"] <= found.quantiles["p99"] <= found.quantiles["max"]
    assert "ticks were late at 200 Hz" in found.verdict


@pytest.mark.parametrize(("behind", "rate"), [(3e-4, 1000), (8e-3, 100), (0.1, 0)])
def test_a_rate_that_was_not_held_gives_way_to_the_fastest_below_whose_period_exceeds_the_delay(behind, rate):
    measured = found(behind, late=1000, rate=1100.0, priority="ordinary")
    assert measured.rate == rate
    assert measured.promising == 0


@pytest.mark.parametrize("rate", [1000.0, 1131.0, 490.0])
def test_a_rate_that_was_held_is_the_one_that_was_tried_and_no_faster_one(rate):
    measured = found(5e-6, rate=rate)
    assert measured.rate == pytest.approx(rate)
    assert measured.held
    assert f"holds {rate:.4g} Hz" in measured.verdict


@pytest.mark.parametrize(
    ("work", "overslept", "rate"),
    [
        (1e-5, 0.0, 10_000),  # 10 us of work and a vigil of 20 in 100
        (8e-5, 0.0, 5_000),  # 80 and 20 leave nothing for anybody in 100
        (1.2e-4, 0.0, 5_000),  # 120 and 40 in 200
        (1.6e-4, 0.0, 2_000),  # 160 and 40 in 200, all of the processor
        (1e-5, 1.8e-4, 5_000),  # hidden by a vigil of 200; that of 40 leaves 140 of 200, that of 20 160 of 100
        (4e-4, 0.0, 0),  # 400 and 100 in 500
    ],
)
def test_a_faster_rate_is_promising_where_work_vigil_and_late_wake_ups_leave_time(work, overslept, rate):
    measured = found(work=work, overslept=overslept)
    assert measured.promising == rate
    assert ("which was not tried" in measured.verdict) == (rate > 0)


def test_quantiles_are_those_of_the_delays():
    measured = found(np.arange(1000.0)[::-1])
    assert measured.quantiles == pytest.approx({"p50": 499.5, "p99": 989.01, "p99.9": 998.001, "max": 999.0})


@pytest.mark.parametrize(("late", "held"), [(0, True), (1, False)])
def test_thirty_late_ticks_in_a_minute_at_1_khz_are_borne(late, held):
    assert found(late=late).held == held
    minute = Jitter(
        period=1e-3, behind=np.zeros(60_000), overslept=np.zeros(1), late=30 + late, work=np.zeros(1),
        standing=LoopPriority(priority="FIFO", locked=True),
    )  # fmt: skip
    assert minute.held == held


def test_the_verdict_on_a_machine_says_what_was_tried_what_it_would_hold_and_what_to_do():
    measured = found(3e-3, late=7, rate=1100.0, priority="ordinary")
    assert measured.verdict == "7 of 1000 ticks were late at 1100 Hz (ordinary): it would have held 200 Hz."
    none = found(0.5, late=1000, rate=500.0)
    assert none.verdict == (
        "1000 of 1000 ticks were late at 500 Hz (FIFO), and it would not hold 100 Hz: run on an idle machine, or on "
        "the rig's controller."
    )
    fine = found(5e-6, work=4e-4, rate=1000.0)
    assert fine.verdict == "0 of 1000 ticks were late at 1000 Hz (FIFO): this machine holds 1000 Hz as it is now."


def test_work_delays_a_tick_as_a_late_wake_up_does():
    """0.6 ms late and 0.3 ms of work fit into 1 ms, and 1.7 ms of work into 2 ms no longer."""
    assert found(6e-4, late=9, work=3e-4, rate=1100.0).rate == 1000
    assert found(6e-4, late=9, work=1.7e-3, rate=1100.0).rate == 200
    # what a vigil hides of a sleep is not late: 200 us with FIFO alone
    assert found(0.0, late=9, overslept=1.1e-3, work=0.0, rate=1100.0).rate == 1000
    assert found(0.0, late=9, overslept=1.1e-3, work=0.0, rate=1100.0, priority="ordinary").rate == 500


@pytest.mark.parametrize(("seconds", "rate"), [(0.09, 100.0), (3601, 100.0), (1.0, 0.9), (1.0, 20_001.0)])
def test_what_is_no_loop_is_not_measured(seconds, rate):
    with pytest.raises(BadInput, match=r"measured at 1 to 20000 Hz for 0\.1 to 3600 s"):
        measure(seconds, rate, fifo=False, make=idle)


def test_a_vigil_is_kept_with_fifo_alone():
    assert LoopPriority(priority="FIFO", locked=True).vigil == pytest.approx(200e-6)
    assert LoopPriority(priority="short slice", locked=True).vigil == 0.0


def test_virtual_time_waits_for_nothing():
    pace = Virtual()
    assert (pace.late, pace.wait()) == (0, 0.0)


def test_a_deadline_that_is_met_to_the_nanosecond_is_not_late_and_a_period_behind_is(clock, pace):
    pace.wait()
    clock.now = 104.0
    assert pace.wait() == 0.0
    assert pace.late == 0
    clock.now = 108.0  # that at 106 was missed by a period, which makes the one at 108 late too
    assert pace.wait() == pytest.approx(2e-3)
    assert pace.late == 2


class Linux:
    """What the kernel was asked for, and its answers."""

    def __init__(self, locks=0, slices=0):
        self.asked, self.locks, self.slices = [], locks, slices

    def mlockall(self, flags):
        self.asked.append(("lock", flags))
        return self.locks

    def prctl(self, *numbers):
        self.asked.append(("prctl", *numbers))
        return 0

    def syscall(self, number, process, attributes, flags):
        a = attributes._obj
        self.asked.append(("slice", number, process, a.size, a.policy, a.nice, a.priority, a.runtime, flags))
        return self.slices


@pytest.mark.skipif(sys.platform != "linux", reason="system calls of Linux")
@pytest.mark.parametrize(
    ("fifo", "allowed", "release", "machine", "slices", "priority"),
    [
        (True, True, "6.12.0", "x86_64", 0, "FIFO"),
        (True, False, "6.12.0-5", "x86_64", 0, "short slice"),
        (False, True, "6.12.0", "aarch64", 0, "short slice"),
        (False, True, "7.0.0", "x86_64", 0, "short slice"),
        (False, True, "6.11.9", "x86_64", 0, "ordinary"),
        (False, True, "5.20.0", "x86_64", 0, "ordinary"),
        (False, True, "6.12.0", "riscv64", 0, "ordinary"),
        (False, True, "6.12.0", "x86_64", -1, "ordinary"),
        (False, True, "6.x", "x86_64", 0, "ordinary"),
    ],
)
def test_a_loop_takes_the_best_place_that_the_kernel_gives(monkeypatch, fifo, allowed, release, machine, slices,
                                                           priority):  # fmt: skip
    libc, scheduled = Linux(slices=slices), []

    def schedule(process, policy, parameter):
        if not allowed:
            raise PermissionError
        scheduled.append((process, policy, parameter.sched_priority))

    def awake(path, flags):
        raise OSError

    for name in ("collect", "freeze", "disable"):
        monkeypatch.setattr(f"upright.realtime.priority.gc.{name}", lambda: None)
    monkeypatch.setattr("upright.realtime.priority.ctypes.CDLL", lambda *a, **k: libc)
    monkeypatch.setattr("upright.realtime.priority.os.sched_setscheduler", schedule)
    monkeypatch.setattr("upright.realtime.priority.os.open", awake)
    monkeypatch.setattr("upright.realtime.priority.os.uname", lambda: SimpleNamespace(release=release, machine=machine))
    found = step_forward(fifo=fifo)
    assert found.priority == priority
    assert found.locked
    assert not found.awake
    assert libc.asked[:2] == [("lock", 3), ("prctl", 29, 1, 0, 0, 0)]  # current and future pages; 1 ns of slack
    assert scheduled == ([(0, os.SCHED_FIFO, 50)] if priority == "FIFO" else [])
    if priority == "short slice":  # sched_setattr(2): 48 bytes, SCHED_OTHER, 0.1 ms
        number = {"x86_64": 314, "aarch64": 274}[machine]
        assert libc.asked[2] == ("slice", number, 0, 48, 0, os.nice(0), 0, 100_000, 0)
    assert ("real-time priority" in found.warning) == (priority != "FIFO")


@pytest.mark.skipif(sys.platform != "linux", reason="system calls of Linux")
def test_processors_are_kept_awake_by_a_latency_of_zero_that_is_never_taken_back(monkeypatch):
    asked = []
    for name in ("collect", "freeze", "disable"):
        monkeypatch.setattr(f"upright.realtime.priority.gc.{name}", lambda: None)
    monkeypatch.setattr("upright.realtime.priority.ctypes.CDLL", lambda *a, **k: Linux(locks=-1))
    monkeypatch.setattr("upright.realtime.priority.os.sched_setscheduler", lambda *a: None)
    monkeypatch.setattr("upright.realtime.priority.os.open", lambda path, flags: asked.append((path, flags)) or 7)
    monkeypatch.setattr("upright.realtime.priority.os.write", lambda file, data: asked.append((file, data)))
    found = step_forward()
    assert (found.priority, found.awake, found.locked, found.warning) == ("FIFO", True, False, "")
    assert asked == [("/dev/cpu_dma_latency", os.O_WRONLY), (7, bytes(4))]
