"""Did the drive begin and end then, or one swing of the shaft earlier? Moments are looked for afresh at the end.

When a push ends decides in which phase the shaft swings on, so the cost has a valley every period, and a descent stays
in the one it began in (seen on an ECP 205: 0.29 s too early, a tenth of the cost).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.problem.residuals import Problem
from upright.identification.search.descent import Descent, SearchLog, descend

Array = NDArray[np.float64]

MOMENTS = ("input_start", "input_end")

REACH, STEP = 0.6, 0.02
"""Seconds looked at on either side, two periods of a shaft at 3.5 Hz, and from one place to the next."""

WORTH = 1e-3
"""Share of the cost that another moment has to save before the descent is taken up from there."""


def other_moments(problem: Problem, found: Descent, log: SearchLog) -> Descent:
    """The optimum after every sought moment was tried on a grid, the other numbers following from the best place."""
    for _ in range(3):
        if found.interrupted:
            return found
        x = _moved(problem, found.x, found.normal.cost)
        if x is None:
            return found
        problem.settle_steps(x)
        other = descend(problem.normal, x, problem.lower, problem.upper, tolerance=1e-6, limit=60)
        log.note("another moment", other.normal.cost, problem)
        if other.interrupted or not other.normal.cost < found.normal.cost:
            return replace(found, interrupted=other.interrupted)
        found = other
        log.best = problem, found.x
    return found


def _moved(problem: Problem, x: Array, cost: float) -> Array | None:
    """Coordinates with the best moment of every run, each taken by itself; None when they are best already."""
    out = x.copy()
    shifts = np.arange(-round(REACH / STEP), round(REACH / STEP) + 1) * STEP
    for i, u in enumerate(problem.unknowns):
        if u.name not in MOMENTS or any(problem.tracks[k].windowed for k in u.runs):
            continue
        lanes = np.repeat(x[:, None], shifts.size, axis=1)
        lanes[i] = np.clip(x[i] + shifts, problem.lower[i], problem.upper[i])
        total = np.sum([_costs(problem, k, lanes) for k in u.runs], axis=0)
        best = int(np.nanargmin(total))
        if float(total[shifts.size // 2]) - float(total[best]) > WORTH * cost:
            out[i] = lanes[i, best]
    return None if np.array_equal(out, x) else out


def _costs(problem: Problem, index: int, lanes: Array) -> Array:
    """Sums of squares (lanes,) of one run; infinite where the simulation ran away."""
    track = problem.tracks[index]
    y = problem.simulate(index, lanes, track.length)[track.first :]
    target = track.targets(track.length)[track.first :]
    with np.errstate(over="ignore", invalid="ignore"):
        e = track.weighting @ (y - target[..., None])
        total = np.sum(e * e, axis=(0, 1, 2))
    return np.where(np.isfinite(total), total, np.inf)
