"""What follows from what a plant states: equations of motion, energies, linear models.

A subclass states kinetic energy, potential energy and Rayleigh's dissipation once (see `pendulums.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.physics.equations import Derived, evaluate
from upright.physics.linear import Linear, linearize
from upright.physics.statement import Statement
from upright.shown import Shown


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
        return evaluate(d.kinetic, scope) + evaluate(d.potential, scope)

    def power_lost(self, x: ArrayLike) -> NDArray[np.float64]:
        """Power [W] that viscous friction takes, shape (...); dry friction is not included."""
        return evaluate(self.derived().power_lost, self._scope(np.asarray(x, dtype=np.float64)))

    def _scope(self, x: NDArray[np.float64]) -> dict[str, Any]:
        states = {name: x[..., i] for i, name in enumerate(self.state_names())}
        return {**self.parameters(), **states}

    def linear(self, at: str | None = None) -> Linear:
        """State space about an equilibrium, friction viscous only; see `upright.physics.linear`."""
        return linearize(self, self.derived_for(self.parameters()), at)


@cache
def _derived(cls: type[Plant], without: frozenset[str]) -> Derived:
    module = f"upright.physics.generated.{module_name(cls, without)}"
    if cls.__module__.startswith("upright.physics.") and find_spec(module):
        return import_module(module).DERIVED
    from upright.physics.derivation import derive

    return derive(cls, without=without)


def module_name(cls: type[Plant], without: frozenset[str] = frozenset()) -> str:
    """Name of the module that holds a built-in plant's equations."""
    return "_without_".join([cls.__name__.lower(), *(["_".join(sorted(without))] if without else [])])
