"""Is a command that is cut off at any sample smoothed as if it had been cut off first?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.signals.smoothing import middle
from upright.signals.trips import TripRegression, goes_dead

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
    expected = np.column_stack([np.convolve(column, middle(WIDTH)[::-1], "valid") for column in cut.T])
    assert regression(switched).before(m) == pytest.approx(expected, abs=1e-12)


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
    left, slopes = made.explain(made.target[:, None] / 4)
    assert left == pytest.approx(0.0, abs=1e-12)
    assert slopes == pytest.approx([4.0])
    rest = made.target - made.target.mean()
    aside = np.cos(np.arange(rest.size))
    aside -= aside.mean()
    expected = 1 - (rest @ aside) ** 2 / (rest @ rest) / (aside @ aside)  # 1 - r^2
    assert made.explain(aside[:, None])[0] == pytest.approx(expected)


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
