"""What a plant states: its parameters, coordinates, inputs, joints, equilibria and energies.

What its author may have forgotten is reported when the class is made.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, fields, replace
from inspect import get_annotations
from keyword import iskeyword
from typing import Any, ClassVar, Self, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, nearest
from upright.physics.combination import combination
from upright.physics.equations import FUNCTIONS
from upright.quantities import Quantity, quantities, quantity


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
    """Dry friction at a joint: which parameters set its terms; "" leaves a term out.

    `on` is the coordinate by which the joint turns or slides, or a combination of coordinates such as
    ``theta_2 - theta_1`` for the joint between two links whose angles are both absolute.
    `coulomb` is the sliding level, `quadratic` the drag per speed squared, `stiction` the break-away level,
    `stribeck_speed` the speed at which stiction fades into sliding, `presliding` Dahl's length.
    """

    on: str
    coulomb: str = ""
    quadratic: str = ""
    stiction: str = ""
    stribeck_speed: str = ""
    presliding: str = ""

    def parameters(self) -> dict[str, str]:
        """Name of the parameter, or "", by kind of friction."""
        return {kind: name for kind, name in vars(self).items() if kind != "on"}

    def direction(self, coordinates: Collection[str]) -> tuple[float, ...]:
        """By how much the joint turns or slides for each coordinate's own unit of motion."""
        factors = combination(self.on, coordinates)
        return tuple(factors.get(name, 0.0) for name in coordinates)


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(quantity,))
class Statement:
    """What a plant states; a subclass becomes a frozen, keyword-only dataclass whose fields are its parameters.

    Raises
    ------
    BadInput
        When the class is made and does not state a plant.
    ImpossiblePhysics
        When a plant is built with a parameter outside the bounds its `quantity` states.
    """

    coordinates: ClassVar[tuple[Coordinate, ...]] = ()
    inputs: ClassVar[tuple[Input, ...]] = ()
    joints: ClassVar[tuple[Joint, ...]] = ()
    equilibria: ClassVar[Mapping[str, Mapping[str, float]]] = {"rest": {}}
    optional: ClassVar[tuple[str, ...]] = ()
    """Parameters whose terms are left out of the equations when they are zero, to keep them cheap."""
    _base: ClassVar[type[Any]]

    def __init_subclass__(cls, *, abstract: bool = False, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if not abstract:
            declare(cls)
        elif Statement in cls.__bases__:
            cls._base = cls
        else:  # parameters that several plants share
            _as_dataclass(cls)

    def __new__(cls, *_: Any, **given: Any) -> Self:
        """Answer for a misspelt or a missing parameter."""
        known = {f.name: f for f in fields(cls)}  # type: ignore[arg-type]
        for name in given.keys() - known.keys():
            raise BadInput(f"{cls.__name__} has no parameter '{name}'; {nearest(name, known)}")
        missing = [n for n, f in known.items() if f.default is MISSING and n not in given]
        if missing:
            needed = "; ".join(f"{n}, {cls.quantity(n).meaning} [{cls.quantity(n).unit}]" for n in missing)
            raise BadInput(f"{cls.__name__} also needs {needed}.")
        return super().__new__(cls)

    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, Any]]:
        """What `__new__` is given for a copy, which is made without `__init__`."""
        return (), {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]

    def __post_init__(self) -> None:
        for name, what in quantities(self).items():
            value = getattr(self, name)
            if isinstance(value, str):
                from upright.units import parse

                value = parse(value, what.unit)
                object.__setattr__(self, name, value)
            try:
                what.check(name, float(value))
            except TypeError:
                raise BadInput(
                    f"{name} ({what.meaning}) must be a number in {what.unit} or a text with its unit, got "
                    f"{value!r:.40}."
                ) from None

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Kinetic energy T, potential energy V, Rayleigh's dissipation D, as SymPy expressions."""
        raise BadInput("a plant states its energies(p, q, v) -> T, V, D, but this one has none; add the method.")

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

    def parameters(self) -> dict[str, float]:
        """Values of the parameters by name."""
        return {f.name: float(getattr(self, f.name)) for f in fields(self)}  # type: ignore[arg-type]

    def replace(self, /, **changes: float) -> Self:
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

    def state(self, /, at: str | None = None, **values: float) -> NDArray[np.float64]:
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
        if not isinstance(at, str) or at not in self.equilibria:  # type: ignore[reportUnnecessaryIsInstance]
            raise BadInput(f"{type(self).__name__} has no equilibrium '{at}'; {nearest(at, self.equilibria)}")
        return {c.name: float(self.equilibria[at].get(c.name, 0.0)) for c in self.coordinates}


INTERMEDIATE = re.compile(r"[kscw]\d+")  # k0, s0, c0, w0: what `Derived` calls its own intermediate results
QUANTITY = 'quantity("kg", "what it is")'

_as_dataclass = dataclass(frozen=True, kw_only=True, repr=False)


def declare(cls: type[Any]) -> None:
    """Turn `cls` into a frozen, keyword-only dataclass and check that it states a plant.

    Raises
    ------
    BadInput
        When a parameter has no quantity, a name is unusable or unknown, or the energies are missing.
    """
    annotated = get_annotations(cls)
    for name, value in vars(cls).items():
        if isinstance(value, Field) and name not in annotated:
            raise BadInput(f"{cls.__name__}: {name} = quantity(...) needs a type; write {name}: float = quantity(...).")
    _as_dataclass(cls)
    for f in fields(cls):
        if f.name not in quantities(cls):
            raise BadInput(f"{cls.__name__}: parameter '{f.name}' has no unit; write {f.name}: float = {QUANTITY}.")
    if not cls.coordinates:
        raise BadInput(
            f'{cls.__name__} has no coordinates; write coordinates = (Coordinate("theta", "rad", "angle"),).'
        )
    if cls.energies is Statement.energies:
        raise BadInput(f"{cls.__name__} states no energies; define energies(p, q, v) that returns T, V, D.")
    _check_names(cls)
    _check_references(cls)


def _check_names(cls: type[Any]) -> None:
    """Every name is an identifier, used once, and none that equations or plants use for themselves."""
    kinds: dict[str, str] = {}
    for kind, names in (
        ("coordinate", [c.name for c in cls.coordinates]),
        ("velocity", [f"{c.name}_dot" for c in cls.coordinates]),
        ("input", [i.name for i in cls.inputs]),
        ("parameter", list(quantities(cls))),
    ):
        for name in names:
            if not name.isidentifier() or iskeyword(name):
                raise BadInput(f"{cls.__name__}: {kind} '{name}' is no Python name; use letters, digits and '_'.")
            if name.startswith("_"):
                raise BadInput(
                    f"{cls.__name__}: {kind} '{name}' starts with '_', as names that equations use themselves do; "
                    f"call it '{name.strip('_') or 'z'}'."
                )
            if name in FUNCTIONS or INTERMEDIATE.fullmatch(name):
                raise BadInput(
                    f"{cls.__name__}: {kind} '{name}' is a name that equations use themselves; "
                    f"call it '{name[0]}_{name[1:]}'."
                )
            if name in kinds:
                raise BadInput(f"{cls.__name__}: '{name}' is both {kinds[name]} and {kind}; rename one of them.")
            if kind == "coordinate" and name == "at":
                raise BadInput(f"{cls.__name__}: coordinate 'at' hides an argument of state(at=...); call it 'at_0'.")
            if kind == "parameter" and hasattr(cls._base, name):
                raise BadInput(
                    f"{cls.__name__}: parameter '{name}' hides what a plant itself calls {name}; call it '{name}_0'."
                )
            kinds[name] = kind


def _check_references(cls: type[Any]) -> None:
    """Inputs, joints, equilibria and optional parameters speak of what exists."""
    coordinates, parameters = [c.name for c in cls.coordinates], list(quantities(cls))

    def known(name: str, among: Iterable[str], where: str) -> None:
        if name not in among:
            raise BadInput(f"{cls.__name__}: {where} names '{name}'; {nearest(name, among)}")

    for i in cls.inputs:
        known(i.on, coordinates, f"input {i.name}")
    for j in cls.joints:
        try:
            j.direction(coordinates)
        except BadInput as error:
            raise BadInput(f"{cls.__name__}: a joint is on '{j.on}': {error}") from None
        for name in filter(None, j.parameters().values()):
            known(name, parameters, f"the joint on {j.on}")
    directions = [j.direction(coordinates) for j in cls.joints]
    if directions and np.linalg.matrix_rank(np.array(directions)) < len(directions):
        raise BadInput(
            f"{cls.__name__}: the joints on {', '.join(j.on for j in cls.joints)} do not move independently;"
            " state all friction of one joint in one Joint."
        )
    if not cls.equilibria:
        raise BadInput(
            f'{cls.__name__} has no equilibria; write equilibria = {{"rest": {{}}}} for all coordinates at 0.'
        )
    for at, point in cls.equilibria.items():
        for name in point:
            known(name, coordinates, f"equilibrium '{at}'")
    for name in cls.optional:
        known(name, parameters, "optional")
