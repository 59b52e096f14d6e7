"""Equations of motion as columns times base parameters: ``M(q) a - f(q, v) = sum of b_j Y_j(q, v, a) - inputs``.

Parameters enter the equations in combinations: a pendulum shows ``J_p + m_p l_cg^2`` and ``m_p g l_cg``, never its mass
alone. These combinations are the base parameters; each is what multiplies one column, in however many equations. They
are read off the derived text, whose every coefficient is a lump, so that no plant states its columns itself.

Base parameters: M. Gautier, W. Khalil, IEEE Trans. Robotics and Automation 6 (1990) 368-373.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.physics.equations import FUNCTIONS, Derived, chooses, evaluated, needed_force
from upright.physics.plant import Plant

Array = NDArray[np.float64]
Role = Literal["inertia", "force", ""]
_LUMP = re.compile(r"\bk\d+\b")


@dataclass(frozen=True, kw_only=True)
class BaseParameter:
    """A combination of parameters that multiplies one column.

    Attributes
    ----------
    text : str
        The combination, such as ``J_p + l_cg*l_cg*m_p``.
    names : frozenset of str
        Parameters in it.
    positive : bool
        Whether it is positive whatever the values of its parameters are within their bounds.
    always : bool
        Whether it is there although every parameter that may be left out is: an inertia is, a spring to ground is not.
    weights : tuple of float
        How much of it is in each lump of the derived text.
    """

    text: str
    names: frozenset[str]
    positive: bool
    always: bool
    weights: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Regressor:
    """Columns of a plant's equations of motion, one for each of its base parameters.

    `fixed` are lumps, by name and text, that do not multiply columns: the frequency of a ripple, the gap of a bumper.
    Without numbers for them nothing can be evaluated.
    """

    derived: Derived
    base: tuple[BaseParameter, ...]
    fixed: tuple[tuple[str, str], ...]

    def columns(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, known: Mapping[str, float] | None = None) -> Array:
        """What one unit of each base parameter adds to ``M a - f``, shape (base parameters, coordinates, ...).

        Parameters
        ----------
        q, v, a : (coordinates, ...) arrays
            Coordinates, speeds and accelerations.
        known : mapping of str to float, optional
            Parameters that are in `fixed`.
        """
        fixed = self._fixed(known or {})
        shape = (len(self.derived.coordinates), *np.shape(q)[1:])
        rest = needed_force(self.derived, fixed, q, v, a)
        lumps = [needed_force(self.derived, {**fixed, name: 1.0}, q, v, a) - rest for name in self.derived.parameters]
        shares = np.array([b.weights for b in self.base]).reshape(len(self.base), len(lumps))
        return np.tensordot(shares, np.broadcast_to(np.array(lumps), (len(lumps), *shape)), 1)

    def rest(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, known: Mapping[str, float] | None = None) -> Array:
        """What is in ``M a - f`` besides base parameters times columns, (coordinates, ...)."""
        return np.broadcast_to(needed_force(self.derived, self._fixed(known or {}), q, v, a), np.shape(q)).copy()

    def own(self, i: int) -> int | None:
        """Which base parameter is the inertia of coordinate `i` alone: its column is that acceleration and little else.

        None where every inertia of the coordinate depends on where it is.
        """
        return _own(self, i)

    def roles(self, i: int) -> tuple[Role, ...]:
        """What each base parameter's column is in row `i`: an inertia's, with accelerations, a force's, or none."""
        return _roles(self, i)

    def acting(self, i: int, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """Columns (n, ...) that explain the acceleration of coordinate `i`, friction that is dry and inputs besides.

        That of its own inertia is left out, and accelerations with an inertia that may be missing.
        """
        own, roles = self.own(i), self.roles(i)
        forces = [k for k, b in enumerate(self.base) if k != own and (roles[k] == "force" or (roles[k] and b.always))]
        return -self.columns(q, v, a)[forces, i]

    def values(self, parameters: Mapping[str, float]) -> Array:
        """Base parameters (n,) of a plant with these parameters."""
        return np.array([float(evaluated(b.text, parameters)) for b in self.base])

    def _fixed(self, known: Mapping[str, float]) -> dict[str, float]:
        return {name: float(evaluated(text, known)) for name, text in self.fixed}


def regressor(plant: type[Plant], zero: frozenset[str] = frozenset()) -> Regressor:
    """Regressor of a plant, parameters named in `zero` being zero."""
    return _regressor(plant, zero)


@cache
def _roles(equations: Regressor, i: int) -> tuple[Role, ...]:
    q, v, a = np.random.default_rng(0).normal(size=(3, len(equations.derived.coordinates), 20))
    moving, coasting = (equations.columns(q, v, x)[:, i] for x in (a, 0 * a))
    return tuple(
        "inertia" if np.any(x != y) else "force" if np.any(x) else "" for x, y in zip(moving, coasting, strict=True)
    )


@cache
def _own(equations: Regressor, i: int) -> int | None:
    if equations.fixed:
        return None
    n = len(equations.derived.coordinates)
    q, v, a = np.random.default_rng(0).normal(size=(3, n, 50))
    alone = np.zeros_like(a)
    alone[i] = 1.0
    inertia = equations.columns(q, 0 * v, alone)[:, i] - equations.columns(q, 0 * v, 0 * a)[:, i]
    besides = np.linalg.norm(equations.columns(q, v, a)[:, i] - inertia * a[i], axis=1)
    here = [j for j, b in enumerate(equations.base)
            if b.positive and b.always and np.ptp(inertia[j]) < 1e-9 < inertia[j, 0]]  # fmt: skip
    return min(here, key=lambda j: float(besides[j]), default=None)


@cache
def _regressor(plant: type[Plant], zero: frozenset[str]) -> Regressor:
    derived = plant.derived(without=zero)
    opened = replace(derived, lumps=(), parameters=tuple(f"k{i}" for i in range(len(derived.lumps))))
    nonlinear = _nonlinear(opened)
    shares: dict[str, dict[int, float]] = {}
    for i, text in enumerate(derived.lumps):
        if f"k{i}" not in nonlinear:
            for factor, product in _products(ast.parse(text, mode="eval").body):
                if not zero.intersection(_plain(product)):
                    here = shares.setdefault(product, {})
                    here[i] = here.get(i, 0.0) + factor
    alike: dict[tuple[float, ...], list[tuple[float, str]]] = {}
    for product, weight in shares.items():
        first = next(iter(weight.values()))
        weights = tuple(weight.get(i, 0.0) / first for i in range(len(derived.lumps)))
        alike.setdefault(weights, []).append((first, product))
    return Regressor(
        derived=opened,
        base=tuple(_base(plant, products, weights) for weights, products in alike.items()),
        fixed=tuple((f"k{i}", text) for i, text in enumerate(derived.lumps) if f"k{i}" in nonlinear),
    )


def _base(plant: type[Plant], products: list[tuple[float, str]], weights: tuple[float, ...]) -> BaseParameter:
    """Products that only ever come together, in which a minus that they share stands with the column."""
    if all(factor < 0 for factor, _ in products):
        products, weights = [(-factor, product) for factor, product in products], tuple(-w for w in weights)
    names = frozenset[str]().union(*(_names(product) for _, product in products))
    positive = all(
        factor > 0 and re.fullmatch(r"[\w.*/() ]+", product) and not re.search(r"\w\(", product)
        for factor, product in products
    )
    absent = {f.name for f in fields(plant) if f.default == 0}  # type: ignore[arg-type]
    return BaseParameter(
        always=any(not absent.intersection(_plain(product)) for _, product in products),
        text=" + ".join(product if factor == 1 else f"{factor!r}*({product})" for factor, product in products),
        names=names,
        positive=positive and all(plant.quantity(name).lower >= 0 for name in names),
        weights=weights,
    )


def _names(product: str) -> frozenset[str]:
    return frozenset(n.id for n in ast.walk(ast.parse(product)) if isinstance(n, ast.Name)) - frozenset(FUNCTIONS)


def _plain(product: str) -> list[str]:
    """Factors of a product, as text: what is zero as one of them takes the product away."""
    return [ast.unparse(factor) for factor in _factors(ast.parse(product, mode="eval").body)]


def _products(node: ast.expr) -> list[tuple[float, str]]:
    """Numerical factor and rest of each product in a sum."""
    match node:
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return [*_products(left), *_products(right)]
        case ast.BinOp(left=left, op=ast.Sub(), right=right):
            return [*_products(left), *((-factor, product) for factor, product in _products(right))]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return [(-factor, product) for factor, product in _products(operand)]
        case _:
            pass
    factor, symbols = 1.0, list[str]()
    for part in _factors(node):
        if any(isinstance(n, ast.Name) for n in ast.walk(part)):
            symbols.append(ast.unparse(part))
        else:
            factor *= float(evaluated(ast.unparse(part), {}))
    return [(factor, "*".join(sorted(symbols)) or "1.0")]


def _factors(node: ast.expr) -> list[ast.expr]:
    match node:
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            return [*_factors(left), *_factors(right)]
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return [*_factors(left), ast.BinOp(ast.Constant(1), ast.Div(), right)]
        case _:
            return [node]


def _nonlinear(opened: Derived) -> set[str]:
    """Lumps in which the equations are not linear, beside all others that are left.

    Where pieces are chosen, points at random may lie in one of them: what is in such a text is taken as not linear.
    """
    texts = [*opened.mass, *opened.force, *(text for _, text in opened.steps)]
    nonlinear = {name for _, _, argument in opened.trig for name in _LUMP.findall(argument)}
    if any(chooses(text) for text in texts):
        nonlinear |= {name for text in texts if chooses(text) or text in dict(opened.steps).values()
                  for name in _LUMP.findall(text)}  # fmt: skip
    rng = np.random.default_rng(0)
    q, v, a = rng.uniform(0.3, 1.0, (3, len(opened.coordinates), 6))
    k = {name: rng.uniform(1.0, 2.0) for name in opened.parameters}
    names = [name for name in opened.parameters if name not in nonlinear]

    def change(*moved: str, by: float = 1.0) -> Array:
        more = {name: k[name] + by for name in moved}
        return needed_force(opened, {**k, **more}, q, v, a) - needed_force(opened, k, q, v, a)

    def differ(one: Array, other: Array) -> bool:
        return not np.allclose(one, other, rtol=1e-9, atol=1e-9 * float(np.abs(one).max(initial=1.0)))

    alone = {name: change(name) for name in names}
    nonlinear |= {name for name in names if differ(change(name, by=2.0), 2 * alone[name])}
    names = [name for name in names if name not in nonlinear]
    if names and differ(change(*names), np.sum([alone[name] for name in names], axis=0)):
        for one, other in combinations(names, 2):
            if not {one, other} & nonlinear and differ(change(one, other), alone[one] + alone[other]):
                nonlinear.add(other)
    return nonlinear
