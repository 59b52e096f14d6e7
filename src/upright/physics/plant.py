"""What is a plant? Its energies, its inputs, its joints and where it can rest; everything else follows.

A subclass states kinetic energy, potential energy and Rayleigh's dissipation once (see `pendulums.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, ClassVar, Self, dataclass_transform

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput, nearest
from upright.physics.declaration import declare
from upright.physics.derived import Derived
from upright.quantities import Quantity, quantities, quantity

if TYPE_CHECKING:
    from upright.physics.linear import Linear


@dataclass(frozen=True)
class Coordinate:
    """A generalized coordinate: symbol, unit (``"rad"`` or ``"m"``), meaning."""

    name: str
    unit: str
    meaning: str


@dataclass(frozen=True)
class Input:
    """A force, torque or voltage that acts on one coordinate, in the direction of its velocity."""

    name: str
    unit: str
    meaning: str
    on: str


@dataclass(frozen=True)
class Joint:
    """Dry friction on one coordinate: which parameters set its terms; "" leaves a term out.

    `coulomb` is the sliding level, `quadratic` the drag per speed squared, `stiction` the break-away level,
    `stribeck_speed` the speed at which stiction fades into sliding, `presliding` Dahl's length.
    """

    on: str
    coulomb: str = ""
    quadratic: str = ""
    stiction: str = ""
    stribeck_speed: str = ""
    presliding: str = ""


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(quantity,))
class Plant:
    """Base of every plant; a subclass becomes a frozen, keyword-only dataclass whose fields are its parameters.

    Raises
    ------
    BadInput
        When the class is made and does not state a plant; see `declaration.py`.
    ImpossiblePhysics
        When a plant is built with a parameter outside the bounds its `quantity` states.
    """

    coordinates: ClassVar[tuple[Coordinate, ...]] = ()
    inputs: ClassVar[tuple[Input, ...]] = ()
    joints: ClassVar[tuple[Joint, ...]] = ()
    equilibria: ClassVar[Mapping[str, Mapping[str, float]]] = {"rest": {}}
    optional: ClassVar[tuple[str, ...]] = ()
    """Parameters whose terms are left out of the equations when they are zero, to keep them cheap."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        declare(cls, Plant)

    def __post_init__(self) -> None:
        for name, what in quantities(self).items():
            what.check(name, float(getattr(self, name)))

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Kinetic energy T, potential energy V, Rayleigh's dissipation D, as SymPy expressions."""
        raise BadInput("a plant states its energies(p, q, v) -> T, V, D, but this one has none; add the method.")

    # what follows from the statement

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        return tuple(quantities(cls))

    @classmethod
    def quantity(cls, name: str) -> Quantity:
        """Unit, meaning and bounds of one parameter."""
        return quantities(cls)[name]

    @classmethod
    def state_names(cls) -> tuple[str, ...]:
        """Names of the states in the paper's order: each coordinate followed by its velocity."""
        return tuple(s for c in cls.coordinates for s in (c.name, f"{c.name}_dot"))

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

    def parameters(self) -> dict[str, float]:
        """Values of the parameters by name."""
        return {f.name: float(getattr(self, f.name)) for f in fields(self)}  # type: ignore[arg-type]

    def replace(self, **changes: float) -> Self:
        """The same plant with other values.

        Raises
        ------
        BadInput
            When a name is not a parameter of this plant.
        """
        for name in changes:
            if name not in self.names():
                raise BadInput(f"{type(self).__name__} has no parameter '{name}'; {nearest(name, self.names())}")
        return replace(self, **changes)  # type: ignore[type-var]

    def state(self, at: str | None = None, **values: float) -> NDArray[np.float64]:
        """State vector at a named equilibrium with some states set by name.

        Parameters
        ----------
        at : str, optional
            Name of the equilibrium to start from, the first one when omitted.
        **values : float
            States by name, such as ``theta=1.2`` or ``psi_dot=0.1``.
        """
        x = np.zeros(2 * len(self.coordinates))
        for name, value in self.equilibrium(at).items():
            x[self.state_names().index(name)] = value
        for name, value in values.items():
            if name not in self.state_names():
                raise BadInput(f"{type(self).__name__} has no state '{name}'; {nearest(name, self.state_names())}")
            x[self.state_names().index(name)] = value
        return x

    def equilibrium(self, at: str | None = None) -> dict[str, float]:
        """Coordinates [rad or m] of a named equilibrium, every coordinate listed."""
        at = next(iter(self.equilibria)) if at is None else at
        if at not in self.equilibria:
            raise BadInput(f"{type(self).__name__} has no equilibrium '{at}'; {nearest(at, self.equilibria)}")
        return {c.name: float(self.equilibria[at].get(c.name, 0.0)) for c in self.coordinates}

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
        from upright.physics.linear import linearize

        return linearize(self, at)


def evaluate(expression: str, scope: Mapping[str, Any]) -> NDArray[np.float64]:
    """Value of a derived expression; names are looked up in `scope`, elementwise on arrays."""
    functions = {"sin": np.sin, "cos": np.cos, "sqrt": np.sqrt, "tan": np.tan, "exp": np.exp, "pi": np.pi}
    value = eval(_code(expression), {"__builtins__": {}, **functions}, dict(scope))  # our own text
    return np.asarray(value, dtype=np.float64) + 0.0


@cache
def _code(expression: str) -> Any:
    return compile(expression, "<derived>", "eval")


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
