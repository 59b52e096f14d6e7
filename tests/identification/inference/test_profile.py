"""Ends of intervals that were followed along a valley of the cost, and those that were not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification.inference import intervals
from upright.identification.inference.covariance import Optimum, assess
from upright.identification.inference.intervals import beside_bound, profile
from upright.identification.model.fit import Estimate
from upright.identification.problem.normal_equations import Normal
from upright.identification.problem.residuals import formulate
from upright.identification.problem.unknowns import Unknown
from upright.identification.search.descent import SearchLog, descend_progressively
from upright.physics import Pendulum


@pytest.fixture(scope="module")
def best() -> Optimum:
    """A swing whose friction is asked."""
    asked = rig(Pendulum, {**PENDULUM, "b_2q": 0.0}, {"b_2": 1.5e-3, "b_2c": 1.5e-3})
    problem = formulate(asked, [noisy(swing({**PENDULUM, "b_2q": 0.0}), 1e-3, 1)])
    return assess(problem, descend_progressively(problem, problem.start).x)


@pytest.mark.parametrize("side", [0, 1])
def test_no_end_is_the_estimate_itself_where_no_wall_stands(
    best: Optimum, side: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # a refit that stalls beside the estimate shrinks the bracket; the standard error says how far the end is
    place = [u.name for u in best.problem.unknowns].index("b_2")
    plain, x = beside_bound(best, place), float(best.x[place])
    stalled = (x * (1 - 1e-6), 3 * x) if side == 0 else (0.1 * x, x * (1 + 1e-6))
    monkeypatch.setattr(intervals, "_ends", lambda *_: stalled)
    found = profile(best, place, plain, best.quantile, SearchLog())
    assert found[side] == pytest.approx(plain.interval[side], rel=1e-2)
    assert found[1 - side] == stalled[1 - side]


def test_an_end_at_a_wall_stays(best: Optimum, monkeypatch: pytest.MonkeyPatch) -> None:
    place = [u.name for u in best.problem.unknowns].index("b_2")
    plain, x = beside_bound(best, place), float(best.x[place])
    wall = x * (1 - 1e-6)
    walled = [replace(u, lower=wall) if u.name == "b_2" else u for u in best.problem.unknowns]
    monkeypatch.setattr(best.problem, "unknowns", walled)
    monkeypatch.setattr(intervals, "_ends", lambda *_: (wall, 3 * x))
    assert profile(best, place, plain, best.quantile, SearchLog()) == (wall, 3 * x)


class Valley:
    """A problem of one number whose cost is h(x)^2, first flatter and then steeper than its curvature says."""

    lower, upper = np.array([-np.inf]), np.array([np.inf])
    evaluations = 0

    def __init__(self, unknowns: list[Unknown]) -> None:
        self.unknowns = unknowns

    @staticmethod
    def height(x: float) -> float:
        return 0.5 * x + 0.05 * math.tanh(10 * x) + 49 * max(abs(x) - 1, 0.0) ** 8 * math.copysign(1.0, x)

    def normal(self, x: np.ndarray) -> Normal:
        h = self.height(float(x[0]))
        return Normal(h * h, np.ones((1, 1)), np.array([h]))

    def value(self, x: np.ndarray) -> np.ndarray:
        return x


def test_the_ends_of_a_profile_are_where_the_cost_has_risen_enough() -> None:
    """One standard error up the cost has risen too little, the secant from there goes far beyond: found in between.

    A height is right to 5 %, and beyond 1.5 it rises by 10 % in every hundredth.
    """
    u = Unknown(name="x", runs=(), value=0.0, lower=-math.inf, upper=math.inf, log=False, scale=1.0)
    one = np.ones((1, 1))
    best = Optimum(
        problem=Valley([u]), x=np.zeros(1), covariance=one, sandwich=one, white=np.ones(1), matrix=one, variance=1.0,
        memory=0.0, samples=1e6, pinned=np.zeros(1, dtype=bool),
    )  # fmt: skip
    assert Valley.height(1.0) < 1 < Valley.height(2.0)
    end = brentq(lambda x: Valley.height(x) - 1, 1.0, 2.0)
    low, high = profile(best, 0, Estimate(value=0.0, stderr=1.0, interval=(-1.0, 1.0)), 1.0, SearchLog())
    assert (low, high) == pytest.approx((-end, end), rel=0.02)


class Flat(Valley):
    """A cost that levels off at a height of so much of the rise that is asked."""

    def __init__(self, unknowns: list[Unknown], level: float, lower: float = -math.inf) -> None:
        super().__init__(unknowns)
        self.level, self.lower = level, np.array([lower])

    def normal(self, x: np.ndarray) -> Normal:
        h, slope = self.level * math.tanh(float(x[0])), self.level / math.cosh(min(abs(float(x[0])), 300.0)) ** 2
        return Normal(h * h, np.array([[slope**2]]), np.array([h * slope]))


@pytest.mark.parametrize(
    ("level", "lower", "low", "high"),
    [
        (0.2, -math.inf, -7.0, 8.0),  # hardly rises: what the standard error says
        (3.0, -math.inf, -math.atanh(1 / 3), math.atanh(1 / 3)),
        (3.0, -0.1, -0.1, math.atanh(1 / 3)),  # a wall comes first
        (0.2, -0.1, -0.1, 8.0),
    ],
)
def test_where_the_cost_never_rises_enough_the_standard_error_or_a_wall_ends_the_interval(
    level: float, lower: float, low: float, high: float
) -> None:
    u = Unknown(name="x", runs=(), value=0.0, lower=lower, upper=math.inf, log=False, scale=1.0)
    one = np.ones((1, 1))
    best = Optimum(
        problem=Flat([u], level, lower), x=np.zeros(1), covariance=one, sandwich=one, white=np.ones(1), matrix=one,
        variance=1.0, memory=0.0, samples=1e6, pinned=np.zeros(1, dtype=bool),
    )  # fmt: skip
    found = profile(best, 0, Estimate(value=0.0, stderr=1.0, interval=(-7.0, 8.0)), 1.0, SearchLog())
    assert found == (pytest.approx(low, rel=0.05), pytest.approx(high, rel=0.05))


@pytest.mark.parametrize(("level", "plain_stands"), [(None, False), (0.2, True)])
def test_a_number_sought_by_its_logarithm_has_the_exponentials_of_the_ends_or_the_plain_interval(
    level: float | None, plain_stands: bool
) -> None:
    """About 1, whose logarithm is 0; a cost that never rises has no end."""
    u = Unknown(name="x", runs=(), value=1.0, lower=0.0, upper=math.inf, log=True, scale=1.0)
    one = np.ones((1, 1))
    problem = Valley([u]) if level is None else Flat([u], level)
    best = Optimum(
        problem=problem, x=np.zeros(1), covariance=one, sandwich=one, white=np.ones(1), matrix=one, variance=1.0,
        memory=0.0, samples=1e6, pinned=np.zeros(1, dtype=bool),
    )  # fmt: skip
    found = profile(best, 0, Estimate(value=1.0, stderr=1.0, interval=(0.25, 9.0)), 1.0, SearchLog())
    if plain_stands:
        assert found == (0.25, 9.0)
    else:
        end = brentq(lambda x: Valley.height(x) - 1, 1.0, 2.0)
        assert found == pytest.approx((math.exp(-end), math.exp(end)), rel=0.03)
