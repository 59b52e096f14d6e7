"""Nelder and Mead's simplex on the sum of squares, made to start from any guess: the paper's way.

It copes where stiction makes the cost a staircase, and costs 5 to 40 times more than least squares.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from upright.identification.problem.residuals import Problem
from upright.identification.search.descent import SearchLog

Array = NDArray[np.float64]


def simplex(
    problem: Problem, x: Array, log: SearchLog | None = None, *, horizon: float = math.inf, limit: int = 2000,
    keep: bool = False,
) -> tuple[Array, float]:  # fmt: skip
    """Best coordinates within `horizon` seconds and their cost, after at most `limit` simulations.

    To `keep`, every improvement becomes the best of the `log`, should somebody interrupt.
    The first simplex reaches 10 % of each number, or 10 % of its scale when it is zero.
    """
    from scipy.optimize import minimize

    log = SearchLog() if log is None else log
    size = np.array([1.0 if u.log else max(abs(z), u.scale) for u, z in zip(problem.unknowns, x, strict=True)])
    lower, upper = problem.lower, problem.upper
    best = [x.copy(), problem.cost(x, horizon)]
    count = 0

    def cost(z: Array) -> float:
        nonlocal count
        here = np.clip(x + z * size, lower, upper)
        value = problem.cost(here, horizon)
        count += 1
        if value < best[1]:
            best[0], best[1] = here, value
            if keep:
                log.best = problem, here
            if count % 20 == 0:
                log.tell("simplex", count / limit, value, problem)
        return value if math.isfinite(value) else 1e300

    corners = np.vstack([np.zeros(x.size), 0.1 * np.eye(x.size)])
    # a first step away from a bound rather than into it
    for i in range(x.size):
        if x[i] + 0.1 * size[i] > upper[i]:
            corners[1 + i, i] = -0.1
    options = {"initial_simplex": corners, "maxfev": limit, "adaptive": True, "xatol": 1e-6, "fatol": 1e-9 * best[1]}
    minimize(cost, np.zeros(x.size), method="Nelder-Mead", options=options)
    return np.asarray(best[0]), float(best[1])
