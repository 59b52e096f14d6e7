"""Equations of motion of a plant as plain text, and what they are worth at given states.

They are derived once from the plant's energies, so that nothing needs SymPy at run time. The text is evaluated here, on
numbers or on arrays, and nowhere else but in compiled code.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, reduce
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Scope = Mapping[str, Any]
Program = Callable[[Scope], tuple[tuple[Any, ...], ...]]

FUNCTIONS = (
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs", "pi",
)  # fmt: skip
"""What the text of equations calls by name."""


@dataclass(frozen=True, kw_only=True)
class DryJoint:
    """Dry friction of one joint: names of the parameters that set it, "" where a term is absent.

    The joint turns or slides by ``direction . q``.
    """

    direction: tuple[float, ...]
    coulomb: str = ""
    quadratic: str = ""
    stiction: str = ""
    stribeck_speed: str = ""
    presliding: str = ""


@dataclass(frozen=True, kw_only=True)
class Derived:
    """Equations of motion ``M(q) a = f(q, v, u) + dry friction`` as text.

    Attributes
    ----------
    name : str
        Name of the plant's class.
    coordinates, inputs, parameters : tuple of str
        Names, in order; the velocity of ``theta`` is called ``theta_dot``.
    lumps : tuple of str
        Expressions in the parameters alone; the i-th is called ``k{i}`` below.
    trig : tuple of (str, str, str)
        Name of a sine, name of the cosine, their common argument.
    steps : tuple of (str, str)
        Intermediate results in the order in which to evaluate them.
    mass : tuple of str
        Upper triangle of the mass matrix, row by row.
    force : tuple of str
        Generalized forces: inputs, gravity, springs, gyroscopic and viscous terms, no dry friction.
    stiffness, damping, gain : tuple of str
        ``-df/dq``, ``-df/dv`` (n x n, row by row) and ``df/du`` (n x inputs) at rest without input,
        in parameters and coordinates, with ``sin`` and ``cos`` written out; where pieces are chosen by speeds, in
        these too.
    kinetic, potential, power_lost : str
        Energies [J] and viscous power [W], in parameters, coordinates and velocities.
    joints : tuple of DryJoint
        Dry friction, joint by joint.
    """

    name: str
    coordinates: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    lumps: tuple[str, ...]
    trig: tuple[tuple[str, str, str], ...]
    steps: tuple[tuple[str, str], ...]
    mass: tuple[str, ...]
    force: tuple[str, ...]
    stiffness: tuple[str, ...]
    damping: tuple[str, ...]
    gain: tuple[str, ...]
    kinetic: str
    potential: str
    power_lost: str
    joints: tuple[DryJoint, ...] = ()


def chooses(text: str) -> bool:
    """Whether an expression has several pieces."""
    return " if " in text


def evaluated(expression: str, scope: Scope) -> Array:
    """Value of one derived expression; names are looked up in `scope`, elementwise on arrays."""
    if chooses(expression):
        scope = _arrays(scope)
    with np.errstate(**_quiet(expression)):
        value = eval(_code(expression), {"__builtins__": {}, **_functions(np)}, dict(scope))  # our own text
    return np.asarray(value, dtype=np.float64) + 0.0


def mass_and_force(derived: Derived, scope: Scope) -> tuple[Array, Array]:
    """Mass matrix (..., n, n) and generalized forces (..., n) of ``M a = f``, without dry friction and drag.

    Parameters
    ----------
    derived : Derived
        Equations of the plant.
    scope : mapping
        Parameters, coordinates, velocities (``theta_dot``) and inputs by name, each a number or an array that
        broadcasts with the others; what is not named is zero.
    """
    mass, force = _program(derived, ("mass", "force"), _scalar(scope))(scope)
    n = len(derived.coordinates)
    values = np.broadcast_arrays(*mass, *force)
    M = np.empty((*values[0].shape, n, n))
    for (i, j), place in _places(n).items():
        M[..., i, j] = M[..., j, i] = values[place]
    return M, np.stack(values[len(mass) :], axis=-1)


def small_motions(derived: Derived, scope: Scope, shape: tuple[int, ...] = ()) -> tuple[Array, Array, Array, Array]:
    """M, D, K (*shape, n, n) and G (*shape, n, inputs) of ``M a + D v + K q = G u`` about a point at rest.

    Parameters
    ----------
    derived : Derived
        Equations of the plant.
    scope : mapping
        Parameters and the coordinates of the point by name, each a number or an array that broadcasts to `shape`.
    shape : tuple of int, optional
        As above.
    """
    n, m = len(derived.coordinates), len(derived.inputs)
    parts = _program(derived, ("mass", "damping", "stiffness", "gain"), _scalar(scope))(scope)

    def matrix(entries: tuple[Any, ...], columns: int) -> Array:
        if not shape:
            return np.array(entries, dtype=np.float64).reshape(n, columns)
        rows = np.array([np.broadcast_to(e, shape) for e in entries], dtype=np.float64).reshape(n, columns, *shape)
        return np.moveaxis(rows, (0, 1), (-2, -1)).copy()

    place = _places(n)
    mass = tuple(parts[0][place[min(i, j), max(i, j)]] for i in range(n) for j in range(n))
    return matrix(mass, n), matrix(parts[1], n), matrix(parts[2], n), matrix(parts[3], m)


def needed_force(derived: Derived, scope: Scope, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
    """Generalized forces (n, ...) of a motion beyond what gravity, springs and viscous friction give, ``M a - f``.

    Parameters
    ----------
    derived : Derived
        Equations of the plant.
    scope : mapping
        Parameters by name, each a number or an array that broadcasts with the motion.
    q, v, a : (n, ...) arrays
        Coordinates, speeds and accelerations.
    """
    q, v, a = (np.asarray(x, dtype=np.float64) for x in (q, v, a))
    states = {c: q[i] for i, c in enumerate(derived.coordinates)}
    speeds = {f"{c}_dot": v[i] for i, c in enumerate(derived.coordinates)}
    mass, force = _program(derived, ("mass", "force"), False)({**scope, **states, **speeds})
    n = len(derived.coordinates)
    place = _places(n)
    rows = [sum(mass[place[min(r, c), max(r, c)]] * a[c] for c in range(n)) - force[r] for r in range(n)]
    return np.array(np.broadcast_arrays(*rows))


@cache
def _places(n: int) -> dict[tuple[int, int], int]:
    """Where an entry of the upper triangle stands in its row by row list."""
    return {(i, j): k for k, (i, j) in enumerate((i, j) for i in range(n) for j in range(i, n))}


def _scalar(scope: Scope) -> bool:
    return all(isinstance(value, float | int) for value in scope.values())


def _functions(library: Any) -> dict[str, Any]:
    """What the text calls; choices between arrays by a name of ours."""
    return {"abs": abs, "_where": np.where, **{name: getattr(library, name) for name in FUNCTIONS if name != "abs"}}


class _ForArrays(ast.NodeTransformer):
    """Choices and conditions element by element."""

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        self.generic_visit(node)
        return ast.Call(ast.Name("_where", ast.Load()), [node.test, node.body, node.orelse], [])

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        self.generic_visit(node)
        op = ast.BitAnd() if isinstance(node.op, ast.And) else ast.BitOr()
        return reduce(lambda a, b: ast.BinOp(a, op, b), node.values)


def _for_arrays(tree: Any) -> Any:
    return ast.fix_missing_locations(_ForArrays().visit(tree))


def _arrays(scope: Scope) -> Scope:
    """Numbers as arrays: of what is not chosen Python's own would raise, or leave the real axis."""
    return {name: np.asarray(value, dtype=np.float64) for name, value in scope.items()}


def _quiet(text: str) -> dict[str, Any]:
    """For `numpy.errstate`: what is not chosen is computed too, and need not exist."""
    return {"divide": "ignore", "invalid": "ignore"} if chooses(text) else {}


@cache
def _code(expression: str) -> Any:
    return compile(_for_arrays(ast.parse(expression, mode="eval")), "<derived>", "eval")


@cache
def _program(derived: Derived, parts: tuple[str, ...], scalar: bool) -> Program:
    """All expressions of some parts of the equations, compiled together; `scalar` ones know no arrays but are fast."""
    names = (*derived.parameters, *derived.coordinates, *(f"{c}_dot" for c in derived.coordinates), *derived.inputs)
    lines = [f"    {name} = _scope.get({name!r}, 0.0)" for name in names]  # no plant's name starts like ours
    lines += [f"    k{i} = {text}" for i, text in enumerate(derived.lumps)]
    for s, c, argument in derived.trig:
        lines += [f"    {s} = sin({argument})", f"    {c} = cos({argument})"]
    lines += [f"    {name} = {text}" for name, text in derived.steps]
    results = ["(" + "".join(f"{text}, " for text in getattr(derived, part)) + ")" for part in parts]
    text = "\n".join(["def run(_scope):", *lines, f"    return {', '.join(results)}"])
    scope = _functions(math if scalar and not chooses(text) else np)
    exec(compile(_for_arrays(ast.parse(text)), f"<{derived.name}>", "exec"), scope)  # our own text
    run = scope["run"]

    def chosen(p: Scope) -> tuple[tuple[Any, ...], ...]:
        with np.errstate(**_quiet(text)):
            return run(_arrays(p))

    return chosen if chooses(text) else run
