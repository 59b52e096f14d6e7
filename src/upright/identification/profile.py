"""How far can one number move before the runs object? Intervals of the profile likelihood.

For a number that is weakly seen or near a bound, where a standard error says too little: it is held, all others are
fitted again, and the ends are where the cost has risen by Student's quantile squared, rescaled for residuals with
a memory (the ratio of the robust to the white variance).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from upright.identification.descent import descend
from upright.identification.problem import Problem
from upright.identification.statistics import Spread

Array = NDArray[np.float64]


def profile(problem: Problem, x: Array, place: int, spread: Spread, quantile: float) -> tuple[float, float]:
    """Interval of one number's value, an infinite end where the cost never rises enough."""
    best = problem.normal(x)
    white = float(spread.white[place])
    robust = float(spread.covariance[place, place])
    inflation = max(1.0, robust / white) if white > 0 else 1.0
    rise = quantile**2 * spread.variance * inflation
    u = problem.unknowns[place]
    first = math.sqrt(robust) * quantile if robust > 0 else 0.1 * u.scale
    first = min(first, 2.0 if u.log else 2 * max(abs(float(x[place])), u.scale))
    ends = [_end(problem, x, place, best.cost, rise, sign * first) for sign in (-1.0, 1.0)]
    if u.log:
        return (math.exp(ends[0]) if ends[0] > -700 else 0.0), math.exp(min(ends[1], 700.0))
    return ends[0], ends[1]


def _end(problem: Problem, x: Array, place: int, best: float, rise: float, step: float) -> float:
    """Coordinate at which the refitted cost has risen by `rise`, by at most four secant steps in the square root."""
    lower, upper = problem.lower.copy(), problem.upper.copy()
    bound = float(lower[place] if step < 0 else upper[place])
    near, far = 0.0, step
    z = x
    for _ in range(4):
        at = float(x[place]) + far
        if (step < 0 and at <= bound) or (step > 0 and at >= bound):
            at = bound
        if at == x[place]:
            return at
        lower[place] = upper[place] = at
        found = descend(problem.normal, np.where(np.arange(x.size) == place, at, z), lower, upper,
                        tolerance=1e-3, limit=6)  # fmt: skip
        z = found.x
        height = math.sqrt(max(found.normal.cost - best, 0.0) / rise)
        if abs(height - 1) < 0.05:
            return at
        if at == bound and height < 1:
            return bound
        reached = at - float(x[place])
        if height < 1:
            near = reached
            far = reached * min(3.0, 1 / max(height, 0.1))
        else:
            far = reached / height if near == 0.0 else (near + reached) / 2
    return float(x[place]) + far if height > 0.3 else math.copysign(math.inf, step)
