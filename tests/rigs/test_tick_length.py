"""Is a board whose tick is longer than it says found by the host's clock, and a sound one left alone?"""

from __future__ import annotations

import numpy as np
import pytest

from tests.rigs.test_supervisor import RIG, Scene
from upright.errors import RigStopped
from upright.rigs.tick_length import JITTER, LEAST, OFF, TickLength

T = RIG.period


@pytest.mark.parametrize("factor", [0.5, 0.9, 1.1, 2.0])
def test_a_tick_of_another_length_is_measured_within_a_second(factor):
    ticking = TickLength()
    found = [ticking.sees(k * T, k * T * factor) for k in range(round(1.1 / T))]
    seen = next(k for k, longer in enumerate(found) if longer != 1.0)
    assert found[seen] == pytest.approx(factor)
    assert min(seen * T, seen * T * factor) >= 0.0
    assert max(seen * T, seen * T * factor) >= LEAST


def test_late_samples_and_a_clock_within_its_tolerance_are_no_slow_tick():
    """Every sample late by up to what is allowed, and a resonator off by half of what is allowed, for a minute."""
    rng, ticking = np.random.default_rng(5), TickLength()
    late = rng.uniform(0, JITTER, 60_000)
    assert all(ticking.sees(k * 1e-3, k * 1e-3 * (1 + OFF / 2) + x) == 1.0 for k, x in enumerate(late))


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_tick_that_changes_after_a_minute_is_measured_within_two_seconds(factor):
    """Since the first sample alone it would take 1.83/0.47 = 3.9 s, and 38 s after ten minutes, and say 1.03."""
    ticking, rng = TickLength(), np.random.default_rng(6)
    late, sound = rng.uniform(0, 2e-3, 80_000), 60_000
    for k in range(sound):
        assert ticking.sees(k * 1e-3, k * 1e-3 + late[k]) == 1.0
    host = 60.0 + factor * 1e-3 * np.arange(1, 20_000)
    for k, x in enumerate(host):
        longer = ticking.sees(60.0 + (k + 1) * 1e-3, x + late[sound + k])
        if longer != 1.0:
            assert x - 60.0 < 2.0
            assert longer == pytest.approx(factor, rel=0.02)  # times of 0.25 s and more, each late by up to 2 ms
            return
    pytest.fail("it was never seen")


def test_a_host_that_sleeps_for_half_a_second_after_a_minute_has_not_slowed_the_board():
    """What came meanwhile is late by what is left of the sleep, in a whole piece of the time compared."""
    ticking = TickLength()
    times = [k * 1e-3 for k in range(62_000)]
    seen = {ticking.sees(t, 60.5 if 60.0 <= t < 60.5 else t) for t in times}
    assert seen == {1.0}


@pytest.mark.parametrize(("after", "asleep"), [(0.6, 0.06), (10.0, 0.4)])
def test_a_sample_that_its_host_took_after_a_sleep_is_no_slow_tick(after, asleep):
    """It was in time; the host was not, and the board's own watchdog tells it with the next sample."""
    ticking, last = TickLength(), round(after / 1e-3)
    assert {ticking.sees(k * 1e-3, k * 1e-3 + asleep * (k == last)) for k in range(last + 2_000)} == {1.0}


@pytest.mark.parametrize("watchdog", [0.0, 0.02, 0.05, 0.5])
def test_whatever_a_watchdog_lets_pass_is_no_slow_tick(watchdog):
    """The first sample late by all of it and the others not, or the other way round; two clocks 2 % apart."""
    late = max(JITTER, watchdog)
    for first, others in ((late, 0.0), (0.0, late)):
        ticking = TickLength(watchdog)
        times = [k * 4e-3 for k in range(2_500)]
        assert {ticking.sees(t, 1.02 * t + (others if t else first)) for t in times} == {1.0}


def test_who_names_a_host_that_slept_is_its_board_s_watchdog():
    """The host sleeps for 60 ms with a sound sample in hand; the rig's limit is 20 ms."""
    scene = Scene().started()
    began = scene.rig.sample.time

    def clock():
        if scene.rig.sample.time - began > 0.6 and not scene.rig.sample.faults:
            scene.rig.alone(0.06)
        return scene.rig.sample.time

    scene.beside.clock = clock
    with pytest.raises(RigStopped, match="no command came within the watchdog's time"):
        scene.run(1.0)


def test_a_run_on_a_board_with_a_slow_tick_is_stopped_with_its_length():
    scene = Scene().started()
    scene.beside.clock = lambda: 2.0 * scene.rig.sample.time
    with pytest.raises(RigStopped, match=r"on average its ticks lasted 2 times 0\.884 ms by this computer's clock"):
        scene.run(1.0)
    assert scene.told[-1] == ("fault", 0.0, False)


def test_nothing_is_told_of_clocks_that_were_compared_for_less_than_half_a_second():
    """However long the host has been up: its clock stands at an hour when the board's first sample comes."""
    ticking = TickLength()
    assert [ticking.sees(k * 0.05, 3600 + k * 0.1) for k in range(5)] == [1.0] * 5
