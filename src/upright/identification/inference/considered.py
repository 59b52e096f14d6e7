"""A number that the model keeps at zero, fitted beside its estimates where the runs would rather have it.

The considered parameter of Schmidt (1966); Tapley, Schutz and Born, Statistical Orbit Determination (2004), section
6.5. What it would take away from the cost is known to first order without a fit, with the estimates free to follow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from upright.identification.inference.covariance import Optimum, assess
from upright.identification.model.grey_box import Parameter
from upright.identification.problem.normal_equations import pseudo_inverse
from upright.identification.problem.unknowns import shared_unknowns
from upright.identification.search.descent import descend


@dataclass(frozen=True, kw_only=True)
class Considered:
    """The optimum with the number, its last, and what share of the cost it leaves."""

    optimum: Optimum
    leaves: float


def is_driven(best: Optimum) -> bool:
    """Whether anything drives one of the fitted runs."""
    return any(np.any(track.u) or track.run.loop is not None for track in best.problem.tracks)


def consider(
    best: Optimum, parameter: Parameter, *, share: float, tolerance: float, limit: int, farthest: float = math.inf
) -> Considered | None:
    """The optimum beside a number that is zero in the model.

    None where it would take away less than a `share` of the cost to first order, or only beyond its bounds.
    `farthest` is the largest value with which the fit begins.
    """
    problem = best.problem
    (number,) = shared_unknowns(replace(problem.rig, parameters={parameter.name: parameter}))
    rig = replace(problem.rig, parameters={**problem.rig.parameters, parameter.name: parameter})
    wider = replace(problem, rig=rig, unknowns=[*problem.unknowns, number], steps=np.append(problem.steps, 1e-6))
    z = np.append(best.x, 0.0)
    here = wider.settle_steps(z)
    free = np.append(~best.pinned, False)
    aside = here.matrix[-1, free] @ pseudo_inverse(here.matrix[np.ix_(free, free)])
    slope = float(here.gradient[-1] - aside @ here.gradient[free])
    curvature = float(here.matrix[-1, -1] - aside @ here.matrix[free, -1])
    if not curvature > 0 or not slope**2 > share * here.cost * curvature:
        return None
    z[-1] = np.clip(-slope / curvature, max(number.lower, -farthest), min(number.upper, farthest))
    if z[-1] == 0:
        return None
    end = descend(wider.normal, z, wider.lower, wider.upper, tolerance=tolerance, limit=limit)
    if end.interrupted:
        raise KeyboardInterrupt
    return Considered(optimum=assess(wider, end.x), leaves=end.normal.cost / here.cost)
