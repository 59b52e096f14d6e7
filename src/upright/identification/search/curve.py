"""Curve fitting: a formula met to data by the descent that fits rigs, with standard errors.

For whatever is a formula rather than a motion: a decay, a frequency response, a line through squared periods.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.identification.problem.normal_equations import Normal, pseudo_inverse
from upright.identification.search.descent import Descent, descend

Array = NDArray[np.float64]

STEP = 6e-6
"""Relative step of central differences: the cube root of the rounding error, where their error is least."""

CAREFUL = 1e-6
"""Length of the first step of the second walk, as a multiple of the undamped one."""


@dataclass(frozen=True, kw_only=True)
class CurveFit:
    """Where the sum of squares is least.

    Attributes
    ----------
    values : (n,) array
        Numbers sought.
    stderr : (n,) array
        Standard errors, residuals taken as independent and alike.
    covariance : (n, n) array
        Covariance of the values.
    cost : float
        Sum of squared residuals.
    evaluations : int
        Models evaluated, their Jacobians included as one.
    converged : bool
        Whether the walk settled.
    """

    values: Array
    stderr: Array
    covariance: Array
    cost: float
    evaluations: int
    converged: bool


def fit_curve(
    model: Callable[[Array], ArrayLike],
    y: ArrayLike,
    start: ArrayLike,
    *,
    sigma: ArrayLike = 1.0,
    lower: ArrayLike = -math.inf,
    upper: ArrayLike = math.inf,
    limit: int = 20_000,
) -> CurveFit:
    """Least squares by the same Levenberg-Marquardt walk that fits rigs.

    Walks twice, briskly and with careful first steps, and keeps the better end: a bold first step can land where the
    model is flat and nothing leads back (BoxBOD of NIST's reference problems).

    Parameters
    ----------
    model : callable
        Numbers (n,) to predictions (T,).
    y : (T,) array
        Data.
    start : (n,) array
        Where to begin.
    sigma : float or (T,) array
        Relative standard deviations of the data; their common level is estimated.
    lower, upper : float or (n,) arrays
        Bounds.
    limit : int
        Largest number of evaluations of each walk.

    Raises
    ------
    BadInput
        When there are fewer data than numbers, or the model is not finite at the start.
    """
    x, target = np.array(start, dtype=np.float64), np.asarray(y, dtype=np.float64)
    weight = 1.0 / np.asarray(sigma, dtype=np.float64)
    if target.ndim != 1 or target.size <= x.size:
        raise BadInput(f"{x.size} numbers need more than {x.size} data in one array, got shape {target.shape}.")
    low, high = np.broadcast_to(np.asarray(lower, float), x.shape), np.broadcast_to(np.asarray(upper, float), x.shape)
    count = 0

    def residual(z: Array) -> Array:
        return (np.asarray(model(z), dtype=np.float64) - target) * weight

    def evaluate(z: Array) -> Normal:
        nonlocal count
        count += 1
        return Normal.by_differences(residual, z, STEP * np.where(z == 0.0, 1e-3, np.abs(z)), central=True)

    if not math.isfinite(evaluate(x).cost):
        raise BadInput(f"the model is not finite at the start {x.tolist()}; start elsewhere.")
    walks: list[Descent] = []
    for stride in (1.0, CAREFUL):
        walks.append(descend(evaluate, x, low, high, tolerance=1e-16, limit=limit, stride=stride))
        if walks[-1].interrupted:
            raise KeyboardInterrupt
    best = min(walks, key=lambda w: w.normal.cost)
    covariance = pseudo_inverse(best.normal.matrix) * best.normal.cost / (target.size - x.size)
    return CurveFit(
        values=best.x,
        stderr=np.sqrt(np.diag(covariance)),
        covariance=covariance,
        cost=best.normal.cost,
        evaluations=count,
        converged=best.converged,
    )
