"""Is a command that is cut off at any sample smoothed as if it had been cut off first?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.signals.smoothing import middle
from upright.signals.trips import TripRegression, find_trip, goes_dead, trip_or_misfit

N, WIDTH = 60, 11
HALF = WIDTH // 2


def regression(switched, unit=1.0):
    rows = np.arange(HALF, N - HALF)
    base = np.full((rows.size, 1), unit)
    return TripRegression(rows=rows, target=np.sin(0.3 * rows), base=base, switched=switched, weights=middle(WIDTH))


@pytest.mark.parametrize("m", [0, 1, HALF, HALF + 1, 20, N - HALF - 1, N - HALF, N - 1, N])
def test_what_acts_before_a_sample_is_what_is_zero_from_there_on(m):
    """Zeros first, then the moving mean: only rows within half a window of the cut differ from all or nothing."""
    switched = np.random.default_rng(5).normal(size=(N, 2))
    cut = np.where((np.arange(N) < m)[:, None], switched, 0.0)
    expected = np.stack([np.convolve(column, middle(WIDTH)[::-1], "valid") for column in cut.T])
    assert regression(switched).before(np.array([m, 30]))[0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("command", "several"),
    [
        ([0, 0, 2, 2, 2, 0, 0], False),
        ([0, 0, 2, 2, -2, -2, 0], True),
        ([0, 0, 1, 2, 2, 1, 0], False),  # a step that was resampled passes what it never held
        ([2, 2, 2, 2, 2, 2, 2], False),
    ],
)
def test_levels_are_what_a_command_holds_besides_zero(command, several):
    switched = np.zeros((N, 2))
    switched[: len(command), 0] = command
    switched[len(command) :, 0] = command[-1]
    assert regression(switched).levels == several


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e6])
def test_columns_that_are_the_target_leave_nothing_and_others_what_is_orthogonal_to_them(unit):
    made = regression(np.ones((N, 2)), unit)
    left, slopes = made.explain(made.target[None] / 4)
    assert left == pytest.approx(0.0, abs=1e-12)
    assert slopes == pytest.approx([4.0])
    rest = made.target - made.target.mean()
    aside = np.cos(np.arange(rest.size))
    aside -= aside.mean()
    expected = 1 - (rest @ aside) ** 2 / (rest @ rest) / (aside @ aside)  # 1 - r^2
    assert made.explain(aside[None])[0] == pytest.approx(expected)


def pushed(alive, *, dt=4e-3, until=1500):
    """A body of unit mass and damping 0.4 pushed to and fro twice a second, with or without its drive from 4 s on."""
    t = dt * np.arange(until)
    u = np.where(np.floor(2 * t) % 2 == 0, 1.0, -1.0)
    y, v, out = 0.0, 0.0, []
    for k in range(until):
        out.append(y)
        force = u[k] if alive or k < 1000 else 0.0
        a = force - 0.4 * v
        y, v = y + v * dt + a * dt**2 / 2, v + a * dt
    return t, u, np.array(out)


@pytest.mark.parametrize("alive", [True, False])
def test_a_drive_is_dead_when_the_body_coasts_against_its_command(alive):
    assert goes_dead(*pushed(alive), 1000) is (not alive)


def test_what_has_hardly_moved_before_tells_nothing_of_its_drive():
    t, u, y = pushed(False)
    assert not goes_dead(t, u, y, 20)
    assert not goes_dead(t, u, np.zeros_like(y), 1000)
    assert not goes_dead(t, u, y, t.size)


def spun(begin, end, *, dt=0.01, until=1000, drag=0.4):
    """A body of unit mass and damping that is pushed by one from `begin` to `end` [s]; in closed form."""
    t = dt * np.arange(until)

    def answer(s):  # to a step at zero: drag y' = 1 - exp(-drag s)
        s = np.maximum(s, 0.0)
        return (s - (1 - np.exp(-drag * s)) / drag) / drag

    return t, answer(t - begin) - answer(t - end)


def speed(t, begin, end, drag=0.4):
    def answer(s):
        return (1 - np.exp(-drag * np.maximum(s, 0.0))) / drag

    return answer(t - begin) - answer(t - end)


def test_a_drive_that_went_off_early_is_found_with_the_acceleration_on_both_sides():
    t, y = spun(1.0, 4.0)
    u = np.where((t >= 1) & (t < 7), 1.0, 0.0)
    trip = find_trip(t, u, y, resolution=1e-7)
    assert not trip.late
    assert trip.at == pytest.approx(4.0, abs=0.02)
    assert trip.logged == pytest.approx(7.0, abs=0.011)
    # half way to the nearer end of the command, 1 s and 7 s: over 1.5 s; slopes of a line through the speed
    assert trip.before == pytest.approx(np.polyfit(t[250:400], speed(t, 1, 4)[250:400], 1)[0], rel=0.02)
    assert trip.after == pytest.approx(np.polyfit(t[400:550], speed(t, 1, 4)[400:550], 1)[0], rel=0.02)
    assert trip.before > 0 > trip.after
    assert trip.unexplained < 0.01
    assert trip.otherwise > 2 * trip.unexplained
    assert 0 < trip.error < 0.1
    found, left = trip_or_misfit(t, u, y, (), resolution=1e-7, late=False)
    assert (found.at, left) == (trip.at, trip.otherwise)


def test_a_drive_that_came_on_late_is_found_and_one_that_did_what_it_was_told_is_none():
    t, y = spun(3.0, 7.0)
    u = np.where((t >= 1) & (t < 7), 1.0, 0.0)
    trip = find_trip(t, u, y, resolution=1e-7, late=True)
    assert trip.late
    assert trip.at == pytest.approx(3.0, abs=0.02)
    assert trip.logged == pytest.approx(1.0, abs=0.011)
    assert trip.before == pytest.approx(0.0, abs=0.02)
    assert trip.after == pytest.approx(np.polyfit(t[300:400], speed(t, 3, 7)[300:400], 1)[0], rel=0.05)
    t, y = spun(1.0, 7.0)
    for late in (False, True):
        found, left = trip_or_misfit(t, u, y, (), resolution=1e-7, late=late)
        assert found is None
        assert left < 0.01  # of what is logged nothing is left


def test_a_record_too_short_or_without_a_command_says_nothing():
    t, y = spun(1.0, 4.0)
    u = np.where((t >= 1) & (t < 7), 1.0, 0.0)
    nobody = (None, math.inf)
    assert trip_or_misfit(t, 0 * u, y, (), resolution=0.0, late=False) == nobody
    assert trip_or_misfit(t, np.where(np.arange(t.size) < 9, 1.0, 0.0), y, (), resolution=0.0, late=False) == nobody
    assert trip_or_misfit(t[:99], u[:99] + 1, y[:99], (), resolution=0.0, late=False) == nobody
    assert trip_or_misfit(t, u, 0 * y, (), resolution=0.0, late=False) == nobody


def combs(u, truth, *, unit=1.0, late=False):
    """A regression whose target is the command until a sample, or from there on."""
    switched = np.column_stack([u, np.zeros(u.size)])
    rows = np.arange(u.size)[HALF:-HALF]
    acting = np.where((np.arange(u.size) < truth) != late, u, 0.0) * unit
    target = np.convolve(acting, middle(WIDTH)[::-1], "valid")
    return TripRegression(
        rows=rows, target=target, base=np.ones((rows.size, 1)), switched=switched, weights=middle(WIDTH)
    )


@pytest.mark.parametrize("truth", [137, 501, 998, 1760])
def test_the_sample_at_which_a_command_ended_is_found_by_three_combs(truth):
    n = 2000
    made = combs(np.where(np.arange(n) > 100, 1.0, 0.0), truth)
    at, costs = made.search(101, n - 20)
    assert at == truth
    assert costs[at] == pytest.approx(0.0, abs=1e-9)
    assert costs[at] == min(costs.values())
    assert len(costs) < 200
    assert all(101 <= m < n - 20 for m in costs)
    at, _ = combs(np.sin(0.01 * np.arange(n)), truth, late=True).search(101, n - 20, late=True, forward=False)
    assert at == truth


def test_a_command_that_would_push_backwards_is_no_trip():
    n, truth, at = 400, 200, np.array([200])
    u = np.where((np.arange(n) > 50) & (np.arange(n) < 350), 1.0, 0.0)
    forth, back = combs(u, truth), combs(u, truth, unit=-1.0)
    assert forth.misfit(at, late=False, forward=True) == pytest.approx(0.0, abs=1e-9)
    assert back.misfit(at, late=False, forward=False) == pytest.approx(0.0, abs=1e-9)
    assert back.misfit(at, late=False, forward=True) == 1.0
    assert combs(-u, truth).misfit(at, late=False, forward=True) == pytest.approx(0.0, abs=1e-9)
    assert combs(-u, truth, unit=-1.0).misfit(at, late=False, forward=True) == 1.0
