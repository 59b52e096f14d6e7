"""A number that a model leaves out, considered beside those that it has: what it would take off the cost.

An estimate is a number of its model, and what the model lacks pulls it aside. A considered parameter is not estimated,
but its effect on the estimates and their covariance is known (Schmidt 1966; Tapley, Schutz and Born 2004, section 6.5).
How much of the cost it would take away follows to first order from one evaluation at the optimum, without a search.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.covariance import Optimum
from upright.identification.model.grey_box import Parameter
from upright.identification.problem.normal_equations import pseudo_inverse
from upright.identification.problem.residuals import Problem
from upright.identification.problem.unknowns import shared_unknowns

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Considered:
    """The `problem` with the number, its last unknown, where the `share` of the `cost` goes to first order.

    At `x` the number is what it takes alone, with the others following.
    """

    problem: Problem
    x: Array
    cost: float
    share: float


def considered(best: Optimum, left_out: Parameter) -> Considered | None:
    """What a number that the model has at zero would do; None where it changes nothing or leaves its bounds."""
    problem = best.problem
    (unknown,) = shared_unknowns(replace(problem.rig, parameters={left_out.name: left_out}))
    wider = replace(
        problem,
        rig=replace(problem.rig, parameters={**problem.rig.parameters, left_out.name: left_out}),
        unknowns=[*problem.unknowns, unknown],
        steps=np.append(problem.steps, 1e-6),
    )
    z = np.append(best.x, 0.0)
    here = wider.settle_steps(z)
    free = np.append(~best.pinned, False)
    aside = here.matrix[-1, free] @ pseudo_inverse(here.matrix[np.ix_(free, free)])
    slope = float(here.gradient[-1] - aside @ here.gradient[free])
    curvature = float(here.matrix[-1, -1] - aside @ here.matrix[free, -1])
    if not curvature > 0 or (unknown.lower >= 0 and slope >= 0):
        return None
    z[-1] = min(-slope / curvature, unknown.upper)
    return Considered(problem=wider, x=z, cost=here.cost, share=slope**2 / (here.cost * curvature))
