"""Derivatives from lanes that are moved to one side and the other."""

from __future__ import annotations

import numpy as np
import pytest

from upright.identification.problem.normal_equations import slopes

STEPS = np.array([0.5, 0.25])


def lanes(*, ahead: float = 1.0, behind: float = 1.0) -> np.ndarray:
    """Of ``f = 3 a + 2 b^2`` at a = 1, b = 2, and twice that, the lanes of b multiplied."""
    f = np.array([11.0, 12.5, (3 + 2 * 2.25**2) * ahead, 9.5, (3 + 2 * 1.75**2) * behind])
    return np.stack([f, 2 * f])


def test_both_sides_have_no_error_of_second_order() -> None:
    assert slopes(lanes(), STEPS, central=True) == pytest.approx(np.array([[3.0, 8.0], [6.0, 16.0]]))


def test_one_side_has_the_step_times_half_the_curvature() -> None:
    assert slopes(lanes()[:, :3], STEPS) == pytest.approx(np.array([[3.0, 8.5], [6.0, 17.0]]))


@pytest.mark.parametrize("far", [1e200, np.inf, np.nan])
def test_where_one_side_runs_away_the_other_tells(far: float) -> None:
    assert slopes(lanes(ahead=far), STEPS, central=True) == pytest.approx(np.array([[3.0, 7.5], [6.0, 15.0]]))
    assert slopes(lanes(behind=far), STEPS, central=True) == pytest.approx(np.array([[3.0, 8.5], [6.0, 17.0]]))


def test_where_both_run_away_nothing_is_made_up() -> None:
    with np.errstate(over="ignore"):
        found = slopes(lanes(ahead=1e200, behind=-1e200), STEPS, central=True)
        assert found[:, 0] == pytest.approx([3.0, 6.0])
        assert not np.isfinite(found[:, 1] ** 2).all()


def test_one_sample_of_one_output_that_runs_away_leaves_that_number_to_its_other_side() -> None:
    """Outputs (samples, windows, outputs, lanes): the slope by b is one-sided everywhere, that by a stays central."""
    many = np.stack([[lanes(), 3 * lanes()], [5 * lanes(), 7 * lanes()]])  # (2, 2, 2, 5)
    sizes = np.array([1, 2, 3, 6, 5, 10, 7, 14], dtype=float).reshape(2, 2, 2)
    whole = slopes(many, STEPS, central=True)
    assert whole == pytest.approx(sizes[..., None] * np.array([3.0, 8.0]))
    many[1, 0, 1, 2] = np.inf  # b moved ahead
    found = slopes(many, STEPS, central=True)
    assert found == pytest.approx(sizes[..., None] * np.array([3.0, 7.5]))
