"""By how much may friction and gain differ in a log of another day, and what does that do to a prediction?

Both are factors of the whole run: friction of all its terms together, and the drive's gain. Such a factor is not
small, and a joint that sticks, or a pendulum that swings far, answers its two signs differently. So the mean square
that it adds is not that of a slope: it is computed by Gauss and Hermite's rule of three points, exact for outputs that
are quadratic in it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.bands import Bands
from upright.identification.model.runs import Run
from upright.identification.problem.residuals import Problem

Array = NDArray[np.float64]

FRICTION, GAIN = 0.13, 0.1
"""Standard deviations, relative, of friction and gain from log to log: friction of two runs of one day differed by
13 %, and two of the public rigs drift by 10 to 20 % between days.

Without them 68 % of the arm's samples and 69 % of the pendulum's lie inside in a free run of another log of a Furuta
pendulum, two logs of which are fitted.
"""

MANY = 3
"""Logs from which on a fit has seen how much they differ."""

OUTER = math.sqrt(3.0)
"""Standard deviations at which the outer two of three points lie; each weighs 1/6."""


def log_name(run: Run) -> str:
    """The log that a run is from, as its source names it; empty where nobody says."""
    return run.source.partition(";")[0]


def of_another_day(bands: Bands, run: Run) -> dict[str, float]:
    """Factors by which a log of its own may differ, each with one sigma of its logarithm.

    None that is estimated from the run or its group, and no gain that the study states without an uncertainty.
    Where the fitted runs are from `MANY` logs or more these differed as well, and the covariance holds it already.
    """
    log = log_name(run)
    if not log or not bands.logs or log in bands.logs or len(bands.logs) >= MANY:
        return {}
    daily = {"friction": FRICTION} | ({"gain": GAIN} if "actuator.gain" in bands.names and run.u.any() else {})
    return {name: sigma for name, sigma in daily.items() if name not in (*run.unknown, *run.shared)}


def daily_moves(problem: Problem, x: Array, factors: Mapping[str, float]) -> Array:
    """How the outputs (N, outputs, two for each factor) of the first run move with `factors` of another day.

    Scaled so that their squares add up to a mean square.
    """
    wider = problem.with_factors(0, tuple(factors))
    places = np.arange(x.size, x.size + len(factors))
    wider.steps[places] = OUTER * np.array([factors[wider.unknowns[i].name] for i in places])
    lanes = wider.lanes(np.append(x, np.zeros(len(factors))), places, central=True)
    y = wider.simulate(0, lanes, wider.tracks[0].length)
    with np.errstate(over="ignore", invalid="ignore"):  # a motion that runs away has no band
        return wider.tracks[0].flat(y[..., 1:] - y[..., :1]) / math.sqrt(6.0)
