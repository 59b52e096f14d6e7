"""Are a busy host's stamps those that were measured, and is a sound clock left alone beside a wrong one?"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.hazards.clocks import BOARDS, WATCHDOG, lateness, watched


def test_a_host_is_late_as_often_as_one_of_ordinary_priority_was():
    """benchmarks/jitter.md, 1000 Hz and a short slice: 90, 41, 24 and 8 of 60,000 later than these."""
    late = lateness(600_000, 0.0, np.random.default_rng(3))
    for beyond, seen in ((0.5e-3, 90), (1e-3, 41), (2e-3, 24), (5e-3, 8)):
        assert abs(60_000 * np.mean(late > beyond) - seen) < 3 * np.sqrt(seen * 1.1)
    assert np.median(late) == pytest.approx(61e-6, rel=0.1)


@pytest.mark.parametrize("board", list(BOARDS))
def test_a_sound_clock_is_left_alone_and_the_board_ends_what_its_host_sleeps_through(board):
    """Pauses beyond the watchdog are its least over it, of all samples: 0.5 ms/20 ms of 1.5 in 1000."""
    run = watched(board, 6, 60.0)
    assert not run.stopped
    expected = 1.5e-3 * 0.5e-3 / WATCHDOG * 60.0 / 1e-3
    assert run.hours == 60.0 / 3600
    assert abs(run.ended - expected) < 4 * np.sqrt(expected)


@pytest.mark.parametrize("tick", [0.9, 1.1])
def test_a_tick_that_is_off_by_a_tenth_goes_apart_until_no_lateness_explains_it(tick):
    """By 30 ms and 3 % of the time it takes: 0.43 s of 10 % without lateness, and pieces of half a second each."""
    when, length = watched("crystal, 100 ppm", 7, 6.0, tick, 3.0).stopped[0]
    assert 0.43 < when - 3.0 < 2.1
    assert length == pytest.approx(tick, rel=0.03)
