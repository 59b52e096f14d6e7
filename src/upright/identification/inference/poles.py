"""Poles at every equilibrium of a fitted plant, with their intervals."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from upright.errors import ImpossiblePhysics, NotIdentifiable
from upright.identification.inference.assumptions import NEGLIGIBLE
from upright.identification.inference.covariance import Optimum
from upright.identification.model.fit import Assumption, Estimate, Pole
from upright.identification.model.grey_box import GreyBox
from upright.physics import Plant
from upright.systems import StateSpace

Array = NDArray[np.float64]

STEP = 1e-4
"""Share of a standard error by which parameters are moved to see how the poles follow."""


ASIDE = 2e-3
"""Share by which an assumed number is moved to see whether the poles follow."""

SPLIT = 1e-6
"""Imaginary parts below this share of the largest pole are rounding."""


def shared_values(best: Optimum) -> tuple[dict[str, float], list[str], Array]:
    """Every parameter by name, which of them are uncertain, and the covariance (names, names) of these values."""
    unknowns = best.problem.unknowns
    values = best.problem.base | best.problem.shared_at(best.x)
    slope = np.array([values[unknowns[i].name] if unknowns[i].log else 1.0 for i in best.shared])
    C = best.covariance[np.ix_(best.shared, best.shared)] * np.outer(slope, slope)
    return values, [unknowns[i].name for i in best.shared], C


def poles(
    rig: GreyBox, values: Mapping[str, float], names: list[str], covariance: Array, quantile: float,
    held: Iterable[frozenset[str]] = (frozenset(),), assumed: Sequence[Assumption] = (),
) -> dict[str, tuple[Pole, ...]]:  # fmt: skip
    """Poles [1/s] at each equilibrium, the fastest growing first, friction viscous only and back-EMF included.

    First-order propagation (delta method) of the covariance of the numbers sought. Of a conjugate pair the one above
    the real axis is reported. Equilibria that the fitted plant does not have are left out.

    Parameters
    ----------
    values : mapping of str to float
        Every parameter of plant and actuator.
    names : list of str
        Which of them are uncertain.
    covariance : (names, names) array
        Theirs.
    quantile : float
        Standard errors from the estimate to the end of an interval.
    held : iterable of sets of str
        Coordinates that did not move freely, for each way in which the rig was run: it swings otherwise then, and the
        equilibrium is called so.
    assumed : sequence of Assumption
        Numbers that nobody measured; a pole that moves with one, and with what the fit makes of it, rests on it.
    """
    out: dict[str, tuple[Pole, ...]] = {}
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    if not np.isfinite(covariance).all():
        return out
    ways = sorted({still & {c.name for c in rig.plant.coordinates} for still in held}, key=sorted)
    for at, still in product(rig.plant.equilibria, ways):
        try:
            here = _poles(rig, values, at, still)
            slope = np.zeros((here.size, len(names)), dtype=np.complex128)
            for i, name in enumerate(names):
                if (step := STEP * float(sigma[i])) > 0:
                    moved = _poles(rig, {**values, name: values[name] + step}, at, still)
                    nearest = np.abs(moved[None, :] - here[:, None]).argmin(axis=1)
                    slope[:, i] = (moved[nearest] - here) / step
            follows = [_follow(rig, values, at, still, here, a) for a in assumed]
        except (ImpossiblePhysics, NotIdentifiable):
            continue
        errors = [
            np.sqrt(np.maximum(np.einsum("pi,ij,pj->p", part, covariance, part), 0.0))
            for part in (slope.real, slope.imag)
        ]
        resting = [
            tuple(a.name for a, moves in zip(assumed, follows, strict=True) if moves[i]) for i in range(here.size)
        ]
        out[f"{at}, {' and '.join(sorted(still))} held" if still else at] = tuple(
            Pole(
                real=_resting(_of_one_sign(float(p.real), float(a), quantile, "1/s"), on),
                imag=_resting(_of_one_sign(float(p.imag), float(b), quantile, "rad/s"), on),
            )
            for p, a, b, on in zip(here, *errors, resting, strict=True)
            if p.imag >= 0
        )
    return out


def _resting(e: Estimate, on: tuple[str, ...]) -> Estimate:
    return replace(e, rests_on=on, status=f"rests on {', '.join(on)}") if on else e


def _follow(
    rig: GreyBox, values: Mapping[str, float], at: str, still: frozenset[str], here: NDArray[np.complex128],
    a: Assumption,
) -> NDArray[np.bool_]:  # fmt: skip
    """Which poles move with an assumed number and all that the fit makes of it, or may."""
    if not all(math.isfinite(percent) for percent in a.follows.values()):
        return np.ones(here.size, dtype=np.bool_)
    moved = {n: v * (1 + ASIDE * a.follows.get(n, 0.0)) for n, v in values.items()}
    moved[a.name] = a.value + ASIDE * (a.size or abs(a.value))
    there = _poles(rig, moved, at, still)
    shift = np.abs(there[None, :] - here[:, None]).min(axis=1)
    return shift > NEGLIGIBLE * ASIDE * np.maximum(np.abs(here), SPLIT * np.abs(here).max(initial=0.0))


def _of_one_sign(value: float, stderr: float, quantile: float, unit: str) -> Estimate:
    """A decay or growth, or the imaginary part of the upper pole of a pair: its logarithm is what is uncertain.

    So a stable pole stays stable, and a frequency positive. An interval that ends at 0 says of a pair that it may as
    well be two real poles, of a decay that none is seen.
    """
    plain = Estimate.within(value, stderr, quantile * stderr, unit)
    low, high = plain.interval
    if value == 0 or not math.isfinite(high - low):
        return plain
    if low * high <= 0:
        return replace(plain, interval=(0.0, high) if value > 0 else (low, 0.0))
    ends = sorted(value * math.exp(sign * quantile * stderr / abs(value)) for sign in (-1, 1))
    return replace(plain, interval=(ends[0], ends[1]))


@lru_cache(maxsize=256)
def linear_plant(plant: type[Plant], values: tuple[float, ...], at: str) -> StateSpace:
    """Linear model of a plant at an equilibrium, for the values of its parameters in their order."""
    return plant(**dict(zip(plant.names(), values, strict=True))).linear(at)


def _poles(rig: GreyBox, values: Mapping[str, float], at: str, held: frozenset[str]) -> NDArray[np.complex128]:
    """Poles with the actuator's loss per speed as damping of the coordinates that it drives, some coordinates held."""
    linear = linear_plant(rig.plant, tuple(values[n] for n in rig.plant.names()), at)
    A = linear.A.copy()
    driven = {c.name: i for i, c in enumerate(rig.plant.coordinates)}
    for k, source in enumerate(rig.plant.inputs):
        i = driven[source.on]
        A[:, 2 * i + 1] -= linear.B[:, k] * values.get("actuator.slope", 0.0)
    if held:  # what holds them takes up the force in their rows
        free = [i for name, i in driven.items() if name not in held]
        states = [s for i in free for s in (2 * i, 2 * i + 1)]
        mass = rig.plant(**{n: values[n] for n in rig.plant.names()}).mass_matrix(at)
        force = mass @ A[1::2]
        A = A[np.ix_(states, states)]
        A[1::2] = np.linalg.solve(mass[np.ix_(free, free)], force[np.ix_(free, states)])
    roots = np.linalg.eigvals(A).astype(np.complex128)
    # rounding splits a double pole, as that of a free body, by the root of what it is
    roots.imag[np.abs(roots.imag) < SPLIT * np.abs(roots).max(initial=0.0)] = 0.0
    return roots[np.lexsort((roots.imag, -roots.real))]
