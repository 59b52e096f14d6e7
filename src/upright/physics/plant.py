"""What follows from what a plant states: equations of motion, energies, the linear model close to rest.

A subclass states kinetic energy, potential energy and Rayleigh's dissipation once (see `pendulums.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import ImpossiblePhysics, NotIdentifiable
from upright.physics.equations import Derived, chooses, evaluated, mass_and_force, small_motions
from upright.physics.outline import Outline
from upright.physics.statement import Statement
from upright.physics.stored import stored
from upright.shown import Shown
from upright.systems import StateSpace

Matrix = NDArray[np.float64]


def linearize(plant: Statement, derived: Derived, at: str | None = None, side: float = 0.0) -> StateSpace:
    """Linear model about a named equilibrium; with the rig out of level, about the equilibrium nearest to it.

    With a kink there it has one on each `side`, so far off in every state.

    Raises
    ------
    NotIdentifiable
        When the named point is no equilibrium and none is found near it, or it lies on a kink.
    ImpossiblePhysics
        When the mass matrix there is not positive definite.
    """
    point = _rest(plant, derived, plant.equilibrium(at))
    here = {**plant.parameters(), **point}
    if side:
        here |= {state: here.get(state, 0.0) + side for state in plant.state_names()}
    mass, damping, stiffness, gain = small_motions(derived, here)
    if np.linalg.eigvalsh(mass).min() <= 0:
        raise ImpossiblePhysics(
            f"{type(plant).__name__} needs a positive definite mass matrix, got {mass.tolist()}; check its inertias."
        )
    if not side:
        _check_kinks(plant, derived, point)
    n, m = gain.shape
    solve = np.linalg.solve(mass, np.hstack([-stiffness, -damping, gain]))
    A, B, C = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, m)), np.zeros((n, 2 * n))
    A[0::2, 1::2] = C[:, 0::2] = np.eye(n)
    A[1::2, 0::2], A[1::2, 1::2], B[1::2] = solve[:, :n], solve[:, n : 2 * n], solve[:, 2 * n :]
    units = {c.name: c.unit for c in plant.coordinates}
    units |= {f"{name}_dot": f"{unit}/s" for name, unit in units.items()} | {i.name: i.unit for i in plant.inputs}
    return StateSpace(
        A, B, C, point=point, states=plant.state_names(), inputs=derived.inputs,
        outputs=derived.coordinates, units=units, name=type(plant).__name__,
    )  # fmt: skip


def _check_kinks(plant: Statement, derived: Derived, point: dict[str, float]) -> None:
    """Small motions are those of one linear model only where stiffness and damping are the same on all sides."""
    if not any(chooses(text) for text in (*derived.stiffness, *derived.damping)):
        return
    at = {**plant.parameters(), **point}
    size = max(float(np.abs(m).max()) for m in small_motions(derived, at)[1:3])
    for name in (*derived.coordinates, *(f"{c}_dot" for c in derived.coordinates)):
        near, far = (_across(derived, at, name, way) for way in (1e-9, 1e-6))
        if near > max(0.5 * far, 1e-9 * size):  # what has no jump shrinks with the distance
            raise NotIdentifiable(
                f"{type(plant).__name__} has no linear model at {point}: stiffness or damping differ to either side in "
                f"{name}; name an equilibrium on one side, or round the kink."
            )


def _across(derived: Derived, at: dict[str, float], name: str, way: float) -> float:
    """Largest difference between stiffness or damping so far to either side."""
    one, other = (small_motions(derived, {**at, name: at.get(name, 0.0) + d})[1:3] for d in (way, -way))
    return max(float(np.abs(a - b).max()) for a, b in zip(one, other, strict=True))


def _rest(plant: Statement, derived: Derived, point: dict[str, float]) -> dict[str, float]:
    """Nearest true equilibrium to a nominal one; a coordinate that floats there is also tried from either side."""
    aside = [{**point, name: value + d} for name, value in point.items() for d in (0.5, -0.5)]
    for start in (point, *aside):
        rest = _newton(plant, derived, start)
        if rest is not None:
            return rest
    raise NotIdentifiable(
        f"{type(plant).__name__} has no equilibrium near {point}; level the rig or anchor the free coordinate."
    )


def _newton(plant: Statement, derived: Derived, point: dict[str, float]) -> dict[str, float] | None:
    """Newton's steps, none longer than 0.3, to where no force is left."""
    for _ in range(50):
        scope = {**plant.parameters(), **point}
        force = mass_and_force(derived, scope)[1]
        stiffness = small_motions(derived, scope)[2]
        scale = np.abs(stiffness).max(axis=1, initial=0.0)
        if np.all(np.abs(force) <= 1e-12 * scale):
            return point
        even = 1 / np.sqrt(np.where(scale > 0, scale, 1.0))  # a stiff anchor must not hide a soft pendulum
        step = even * np.linalg.lstsq(stiffness * even[:, None] * even, force * even, rcond=1e-9)[0]
        step *= min(1.0, 0.3 / max(float(np.abs(step).max()), 1e-300))
        point = {name: value + float(d) for (name, value), d in zip(point.items(), step, strict=True)}
    return None


class Plant(Shown, Statement, abstract=True):
    """Base of every plant: what is known of a rig, from its own statement."""

    @classmethod
    def derived(cls, *, without: frozenset[str] = frozenset()) -> Derived:
        """Equations of motion as text; `without` names optional parameters held at zero, all of them or none.

        The built-in plants' equations are read from the package, a user's plant is derived by SymPy.
        """
        return _derived(cls, frozenset(cls.optional) if without >= frozenset(cls.optional) else frozenset())

    @classmethod
    def derived_for(cls, parameters: Mapping[str, Any]) -> Derived:
        """Equations without the optional terms when they are all zero in `parameters` (scalars or arrays)."""
        return cls.derived(without=frozenset(n for n in cls.optional if not np.any(parameters.get(n, 0.0))))

    def energy(self, x: ArrayLike) -> NDArray[np.float64]:
        """Kinetic plus potential energy [J] of states `x`, shape (..., states)."""
        d = self.derived()
        scope = self._scope(np.asarray(x, dtype=np.float64))
        return evaluated(d.kinetic, scope) + evaluated(d.potential, scope)

    def power_lost(self, x: ArrayLike) -> NDArray[np.float64]:
        """Power [W] that viscous friction takes, shape (...); dry friction is not included."""
        return evaluated(self.derived().power_lost, self._scope(np.asarray(x, dtype=np.float64)))

    @staticmethod
    def drawing(q: Mapping[str, Matrix]) -> list[Matrix]:
        """Lines of a moving drawing seen from the side, each of shape (moments, 2, points).

        `q` has coordinates by name, shape (moments,). Without lines it is drawn by what its coordinates are called.
        """
        return []

    @staticmethod
    def outline(p: Any, q: Any) -> Outline:
        """Lines of the rig in space [m], z up: each with the coordinate that moves it, empty for what stands.

        Points are expressions in the coordinates, as in `energies`. A plant without an outline is not drawn alive.
        """
        return []

    def _scope(self, x: NDArray[np.float64]) -> dict[str, Any]:
        states = {name: x[..., i] for i, name in enumerate(self.state_names())}
        return {**self.parameters(), **states}

    def linear(self, at: str | None = None, *, side: float = 0.0) -> StateSpace:
        """State space about an equilibrium, friction viscous only; see `linearize`."""
        return linearize(self, self.derived_for(self.parameters()), at, side)

    def mass_matrix(self, at: str | None = None) -> Matrix:
        """Mass matrix at an equilibrium, shape (coordinates, coordinates)."""
        derived = self.derived_for(self.parameters())
        return small_motions(derived, {**self.parameters(), **_rest(self, derived, self.equilibrium(at))})[0]


@cache
def _derived(cls: type[Plant], without: frozenset[str]) -> Derived:
    shipped = cls.__module__.startswith("upright.physics.")
    if shipped and (known := stored(stem(cls, without))) is not None:
        return known
    from upright.physics.lagrange import derive

    return derive(cls, without=without)


def stem(cls: type[Plant], without: frozenset[str] = frozenset()) -> str:
    """Name of the file that holds a built-in plant's equations."""
    return "_without_".join([cls.__name__.lower(), *(["_".join(sorted(without))] if without else [])])
