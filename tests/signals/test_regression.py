"""Least squares on columns of any size: slopes, their errors, and what is left."""

from __future__ import annotations

import numpy as np
import pytest

from upright.signals.regression import LeastSquares


def test_a_straight_line_has_the_slope_and_the_errors_of_the_textbook():
    """Slope S_xy/S_xx with error s/sqrt(S_xx), intercept with s sqrt(1/n + mean^2/S_xx)."""
    rng = np.random.default_rng(4)
    x = np.linspace(1.0, 3.0, 50)
    y = 2.0 - 0.7 * x + rng.normal(0, 0.1, x.size)
    line = LeastSquares.of([x, np.ones_like(x)], y)
    away = x - x.mean()
    slope = float(away @ y / (away @ away))
    s = np.sqrt(line.squares / (x.size - 2))
    assert line.slopes == pytest.approx([slope, y.mean() - slope * x.mean()])
    spread = [s / np.sqrt(away @ away), s * np.sqrt(1 / x.size + x.mean() ** 2 / (away @ away))]
    assert line.errors(x.size) == pytest.approx(spread)
    assert line.residual @ x == pytest.approx(0.0, abs=1e-12)


def test_the_unit_of_a_column_changes_its_slope_alone():
    rng = np.random.default_rng(5)
    table, y = rng.normal(size=(40, 3)), rng.normal(size=40)
    units = np.array([1.0, 1e12, 1e-9])
    one, other = LeastSquares.of(table, y), LeastSquares.of(table * units, y)
    np.testing.assert_allclose(other.slopes * units, one.slopes, rtol=1e-9)
    np.testing.assert_allclose(other.residual, one.residual, atol=1e-12)
    np.testing.assert_allclose(other.errors(40) * units, one.errors(40), rtol=1e-9)


def test_a_column_that_is_zero_explains_nothing():
    y = np.array([1.0, 2.0, 4.0])
    answer = LeastSquares.of([np.ones(3), np.zeros(3)], y)
    assert answer.slopes[1] == 0.0
    assert answer.squares == pytest.approx(float(np.var(y)) * 3)
