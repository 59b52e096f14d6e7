"""How a pendulum answers its hinge: the last row of a plant's equations, regressed on its throw and its gravity."""

from __future__ import annotations

from dataclasses import dataclass

from upright.physics import Plant
from upright.physics.regressor import regressor
from upright.signals.regression import LeastSquares
from upright.signals.smoothing import Motion


@dataclass(frozen=True, kw_only=True)
class Hinge:
    """Base parameters of a pendulum over its inertia, both positive where its column counts as the plant does.

    `throw`: its acceleration per that of its hinge, hanging; `gravity`: that per sine of its angle [1/s^2]; `left`:
    sum of squares that both leave, `unthrown` and `weightless` those that only the other one leaves.
    """

    throw: float
    gravity: float
    left: float
    unthrown: float
    weightless: float


def hinge_of(plant: type[Plant], motion: Motion, inside: slice) -> Hinge:
    """Hinge of a cart pendulum or a Furuta pendulum that moves so, its angle zero hanging."""
    equations = regressor(plant, frozenset(plant.optional))
    own, roles = equations.own(1), equations.roles(1)
    assert own is not None  # a pendulum's inertia about its hinge is its own
    row = equations.columns(motion.q, motion.v, motion.a)[:, 1, inside]
    throws, pulls = ([k for k, b in enumerate(equations.base) if b.always and k != own and roles[k] == role]
                     for role in ("inertia", "force"))  # fmt: skip
    table = -row[[*throws, *pulls]].T
    both = LeastSquares.of(table, row[own])
    throw, gravity = both.slopes.tolist()
    return Hinge(
        throw=throw, gravity=gravity, left=both.squares, unthrown=LeastSquares.of(table[:, 1:], row[own]).squares,
        weightless=LeastSquares.of(table[:, :1], row[own]).squares,
    )  # fmt: skip
