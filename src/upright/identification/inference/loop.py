"""What the uncertainty of a fit does to the plant upright: the pole that grows, and whether a loop still holds it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from upright.errors import UprightError
from upright.identification.inference.covariance import Optimum
from upright.identification.inference.poles import linear_plant, poles, shared_values
from upright.identification.model.fit import Assumption, Estimate, Pole
from upright.identification.model.grey_box import GreyBox
from upright.identification.problem.normal_equations import to_one

Array = NDArray[np.float64]

DRAWS = 400
"""Rigs drawn; a share of 99 % is then known to half a percent."""

STEP = 1e-4
"""Share of a standard error by which numbers are moved to see how the plant follows."""

FASTER = (1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 2.75)
"""Where the poles of the loop are placed, in units of the growth rate: as fast as what they must hold."""


@dataclass(frozen=True, kw_only=True)
class Standing:
    """An unstable equilibrium: its name, the fastest `growth` [1/s], and the `share` of rigs that one loop holds."""

    at: str
    growth: Estimate
    share: float


def standing(
    best: Optimum, assumed: Sequence[Assumption] = (), known: Mapping[str, tuple[Pole, ...]] | None = None, *,
    seed: int = 0,
) -> Standing | None:  # fmt: skip
    """How rigs within the intervals stand at the equilibrium that grows fastest; None where none grows or is driven.

    One state feedback, placed for the estimate, meets plants drawn from the covariance, to first order in it: A and B
    move by their derivatives, the gain of the drive included. Poles of the free plant may be `known`, by equilibrium.
    """
    rig = best.problem.rig
    if len(rig.plant.inputs) != 1:
        return None
    values, names, C = shared_values(best)
    by_equilibrium = poles(rig, values, names, C, best.quantile, assumed=assumed) if known is None else known
    growing = {at: max((p.real for p in there), key=lambda e: e.value) for at, there in by_equilibrium.items()}
    at = max(growing, key=lambda a: growing[a].value, default="")
    if not names:  # every number that was to be estimated was left out
        return None
    if not at or growing[at].value <= 0 or growing[at].interval[0] == growing[at].interval[1] == 0:
        return None
    growth = growing[at].value
    try:
        A, B = driven_plant(rig, values, at)
        steps = np.maximum(STEP * np.sqrt(np.diag(C)), 1e-12)
        moved = [driven_plant(rig, {**values, n: values[n] + s}, at) for n, s in zip(names, steps, strict=True)]
    except UprightError:
        return None
    K = placed(A / growth, B[:, 0] / growth, -np.array(FASTER[: len(A)]))
    if K is None:
        return None
    z = np.random.default_rng(seed).normal(size=(DRAWS, len(names))) @ matrix_root(C).T
    dA = np.array([(a - A) / s for (a, _), s in zip(moved, steps, strict=True)])
    dB = np.array([(b - B) / s for (_, b), s in zip(moved, steps, strict=True)])
    loops = A + np.tensordot(z, dA, 1) - (B + np.tensordot(z, dB, 1)) @ K[None, :]
    return Standing(at=at, growth=growing[at], share=float(np.mean(np.linalg.eigvals(loops).real.max(axis=1) < 0)))


def matrix_root(C: Array) -> Array:
    """L (n, n) with ``L L' = C``, of a covariance that rounding may have left a little indefinite: L of the nearest."""
    try:
        return np.asarray(
            np.linalg.cholesky(C + 1e-12 * np.diag(np.diag(C)) + 1e-300 * np.eye(len(C))), dtype=np.float64
        )
    except np.linalg.LinAlgError:
        s = to_one(C)
        w, V = np.linalg.eigh(C * s[:, None] * s)
        return np.asarray(
            np.sqrt(np.maximum(np.diag(C), 0.0))[:, None] * V * np.sqrt(np.maximum(w, 0.0)), dtype=np.float64
        )


def placed(A: Array, b: Array, wanted: Array) -> Array | None:
    """Gains by Ackermann's formula, time counted so that the poles are near one; None where b does not reach all.

    In double precision on purpose: no rig is run with these gains, which only meet plants drawn from the covariance,
    and `gains.place`, exact to the last digit, imports mpmath and takes 45 ms. A condition below 1e10 leaves them some
    six digits, and the drawn plants differ by far more.
    """
    reach = np.stack([np.linalg.matrix_power(A, k) @ b for k in range(len(A))], axis=1)
    if np.linalg.cond(reach) > 1e10:
        return None
    p = reduce(lambda product, pole: product @ (A - pole * np.eye(len(A))), wanted, np.eye(len(A)))
    return np.linalg.solve(reach.T, np.eye(len(A))[-1]) @ p


def driven_plant(rig: GreyBox, values: dict[str, float], at: str) -> tuple[Array, Array]:
    """State matrices with the drive's gain, and its loss per speed as damping."""
    linear = linear_plant(rig.plant, tuple(values[n] for n in rig.plant.names()), at)
    A, B = linear.A.copy(), linear.B * values.get("actuator.gain", 1.0)
    place = [c.name for c in rig.plant.coordinates].index(rig.plant.inputs[0].on)
    A[:, 2 * place + 1] -= linear.B[:, 0] * values.get("actuator.slope", 0.0)
    return A, B
