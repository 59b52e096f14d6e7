"""Is this class a plant? What its author can have forgotten is said in a sentence, when the class is made."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import Field, dataclass, fields
from inspect import get_annotations
from keyword import iskeyword
from typing import Any

from upright.errors import BadInput, nearest
from upright.quantities import quantities

FUNCTIONS = ("sin", "cos", "tan", "sqrt", "exp", "log", "pi")
INTERMEDIATE = re.compile(r"[kscw]\d+")  # k0, s0, c0, w0: what `Derived` calls its own intermediate results
QUANTITY = 'quantity("kg", "what it is")'


def declare(cls: type[Any], base: type[Any]) -> None:
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
    dataclass(frozen=True, kw_only=True)(cls)
    for f in fields(cls):
        if f.name not in quantities(cls):
            raise BadInput(f"{cls.__name__}: parameter '{f.name}' has no unit; write {f.name}: float = {QUANTITY}.")
    if not cls.coordinates:
        raise BadInput(
            f'{cls.__name__} has no coordinates; write coordinates = (Coordinate("theta", "rad", "angle"),).'
        )
    if cls.energies is base.energies:
        raise BadInput(f"{cls.__name__} states no energies; define energies(p, q, v) that returns T, V, D.")
    _check_names(cls, base)
    _check_references(cls)


def _check_names(cls: type[Any], base: type[Any]) -> None:
    """Every name is an identifier, used once, and none that equations or plants use for themselves."""
    seen: dict[str, str] = {}
    for kind, names in (
        ("coordinate", [c.name for c in cls.coordinates]),
        ("velocity", [f"{c.name}_dot" for c in cls.coordinates]),
        ("input", [i.name for i in cls.inputs]),
        ("parameter", list(quantities(cls))),
    ):
        for name in names:
            if not name.isidentifier() or iskeyword(name):
                raise BadInput(f"{cls.__name__}: {kind} '{name}' is no Python name; use letters, digits and '_'.")
            if name in FUNCTIONS or INTERMEDIATE.fullmatch(name):
                raise BadInput(
                    f"{cls.__name__}: {kind} '{name}' is a name that equations use themselves; "
                    f"call it '{name[0]}_{name[1:]}'."
                )
            if name in seen:
                raise BadInput(f"{cls.__name__}: '{name}' is both {seen[name]} and {kind}; rename one of them.")
            if kind == "parameter" and hasattr(base, name):
                raise BadInput(
                    f"{cls.__name__}: parameter '{name}' hides what a plant itself calls {name}; call it '{name}_0'."
                )
            seen[name] = kind


def _check_references(cls: type[Any]) -> None:
    """Inputs, joints, equilibria and optional parameters speak of what exists."""
    coordinates, parameters = [c.name for c in cls.coordinates], list(quantities(cls))

    def known(name: str, among: Iterable[str], where: str) -> None:
        if name not in among:
            raise BadInput(f"{cls.__name__}: {where} names '{name}'; {nearest(name, among)}")

    for i in cls.inputs:
        known(i.on, coordinates, f"input {i.name}")
    for j in cls.joints:
        known(j.on, coordinates, "a joint")
        for name in (j.coulomb, j.quadratic, j.stiction, j.stribeck_speed, j.presliding):
            if name:
                known(name, parameters, f"the joint on {j.on}")
    if not cls.equilibria:
        raise BadInput(
            f'{cls.__name__} has no equilibria; write equilibria = {{"rest": {{}}}} for all coordinates at 0.'
        )
    for at, point in cls.equilibria.items():
        for name in point:
            known(name, coordinates, f"equilibrium '{at}'")
    for name in cls.optional:
        known(name, parameters, "optional")
