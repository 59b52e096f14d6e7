"""How far can one number move before the runs object? Intervals of the profile likelihood.

For a number that is weakly seen or near a bound, where a standard error says too little: it is held, all others are
fitted again, and the ends are where the cost has risen by Student's quantile squared, rescaled for residuals with
a memory (the ratio of the robust to the white variance).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.covariance import Spread
from upright.identification.model.model import Estimate
from upright.identification.model.unknowns import FAR
from upright.identification.problem.normal import pseudo_inverse
from upright.identification.problem.problem import Problem
from upright.identification.search.descent import Report, descend
from upright.identification.search.strategy import count

Array = NDArray[np.float64]


def profile(
    problem: Problem, x: Array, place: int, spread: Spread, quantile: float, *, report: Report | None = None
) -> tuple[float, float]:
    """Interval of one number's value, an infinite end where the cost never rises enough.

    Raises
    ------
    KeyboardInterrupt
        When somebody interrupts: half a profile is no interval.
    """
    best = problem.normal(x)
    u = problem.unknowns[place]
    ratio = np.diag(spread.covariance)[spread.white > 0] / spread.white[spread.white > 0]
    here = float(spread.covariance[place, place] / spread.white[place]) if spread.white[place] > 0 else 0.0
    rise = quantile**2 * spread.variance * max(1.0, here or float(np.median(ratio)) if ratio.size else 1.0)
    curvature = _curvature(best.matrix, place, spread)
    g = float(best.gradient[place]) if spread.pinned[place] else 0.0
    ends: list[float] = []
    for sign in (-1.0, 1.0):
        # where the quadratic model has risen enough: 2 g s + c s^2 = rise
        slope = g * sign
        step = (-slope + math.sqrt(slope**2 + curvature * rise)) / curvature if curvature > 0 else u.scale
        most = 2.0 if u.log else 100 * max(abs(float(x[place])), u.scale)

        def tell(cost: float, share: float = (sign + 1) / 2) -> None:
            if report is not None:
                report(f"interval of {u.name}", share, cost, problem.evaluations)

        ends.append(_end(problem, x, place, best.cost, rise, sign * min(max(step, 1e-9 * u.scale), most), tell))
    if u.log:
        return (math.exp(ends[0]) if ends[0] > -700 else 0.0), math.exp(min(ends[1], 700.0))
    return ends[0], ends[1]


AFFORDED = 2.0e7
"""Residuals that the profiles of one fit may cost altogether."""


def work(problem: Problem, sought: int) -> float:
    """Residuals that one profile costs, give or take: some 40 simulations, 16 lanes of `sought` numbers at a time."""
    return 40.0 * count(problem) * (sought + 1) / 16


def settled(found: tuple[float, float], plain: Estimate, *, log: bool) -> tuple[float, float]:
    """Interval of a profile, with the ends of the standard error where the profile has none.

    A misfit with a long memory asks for a rise that no cost may reach; near the optimum the data tell all the same.
    A number sought by its `log` has no end that is `FAR` times or one part in `FAR` of its value.
    """
    low, high = found
    if log:
        return found if plain.value / FAR < low and high < plain.value * FAR else plain.interval
    return (low if math.isfinite(low) else plain.interval[0]), (high if math.isfinite(high) else plain.interval[1])


def _curvature(A: Array, place: int, spread: Spread) -> float:
    """Curvature of the cost along one number, the others following."""
    others = np.array([i for i in range(A.shape[0]) if i != place and not spread.pinned[i]], dtype=np.int64)
    row = A[place, others]
    return float(A[place, place] - row @ pseudo_inverse(A[np.ix_(others, others)]) @ row)


def _end(
    problem: Problem, x: Array, place: int, best: float, rise: float, step: float, tell: Callable[[float], None]
) -> float:
    """Coordinate at which the refitted cost has risen by `rise`, by secants of its square root, bracketed."""
    lower, upper = problem.lower.copy(), problem.upper.copy()
    bound = float(lower[place] if step < 0 else upper[place])
    reached, inner, outer = step, 0.0, math.inf
    height, z = 0.0, x
    for _ in range(5):
        at = float(np.clip(x[place] + reached, problem.lower[place], problem.upper[place]))
        lower[place] = upper[place] = at
        start = np.where(np.arange(x.size) == place, at, z)
        found = descend(problem.normal, start, lower, upper, tolerance=1e-3, limit=6, report=tell)
        if found.interrupted:
            raise KeyboardInterrupt
        z = found.x
        height = math.sqrt(max(found.normal.cost - best, 0.0) / rise)
        if abs(height - 1) < 0.05 or (at == bound and height < 1):
            return at
        if height < 1:
            inner = abs(reached)
        else:
            outer = abs(reached)
        guess = abs(reached) * min(3.0, 1 / max(height, 1e-3))
        if not inner < guess < outer:
            guess = (inner + outer) / 2
        reached = math.copysign(guess, step)
    return float(x[place]) + reached if height > 0.3 else math.copysign(math.inf, step)
