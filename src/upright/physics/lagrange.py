"""Equations of motion in symbols, as they follow from the energies. The only door to SymPy.

Euler and Lagrange: with L = T - V, ``M = d2L/dv2`` and
``f = dL/dq - (d2L/dv dq) v - dD/dv + Q``; terms of T that are linear in the velocities
(a motor's flux linkage) come out as gyroscopic forces.
"""

from __future__ import annotations

from collections.abc import Collection
from types import SimpleNamespace
from typing import Any

import sympy as sp

from upright.errors import BadInput, nearest
from upright.physics.statement import Statement


def symbols(cls: type[Statement]) -> tuple[SimpleNamespace, list[Any], list[Any], list[Any]]:
    """Real symbols of parameters (by name), coordinates, velocities and inputs."""
    p = SimpleNamespace(**{n: sp.Symbol(n, real=True) for n in cls.names()})
    q = [sp.Symbol(c.name, real=True) for c in cls.coordinates]
    v = [sp.Symbol(f"{c.name}_dot", real=True) for c in cls.coordinates]
    u = [sp.Symbol(i.name, real=True) for i in cls.inputs]
    return p, q, v, u


def energies(cls: type[Statement]) -> tuple[Any, Any, Any]:
    """T, V and D as the plant states them, checked.

    Raises
    ------
    BadInput
        When they do not evaluate, or are not those of a mechanical system in these coordinates.
    """
    p, q, v, _ = symbols(cls)
    where = f"{cls.__name__}.energies(p, q, v)"
    try:
        stated: Any = cls.energies(p, q, v)
    except AttributeError as error:
        if error.obj is not p:
            raise BadInput(f"{where} does not run: {error}; write it with SymPy's functions.") from error
        raise BadInput(f"{where} uses p.{error.name}; {nearest(str(error.name), cls.names())}") from error
    except Exception as error:
        raise BadInput(
            f"{where} does not run: {type(error).__name__}: {error}; write it with SymPy's sin, cos and sqrt."
        ) from error
    if not isinstance(stated, (tuple, list)) or len(stated) != 3:
        raise BadInput(f"{where} must return T, V, D (0 where there is none), got {stated!r}.")
    try:
        T, V, D = (sp.sympify(e, strict=True) for e in stated)
    except sp.SympifyError as error:
        raise BadInput(f"{where} must return SymPy expressions or numbers, got {stated!r}.") from error
    foreign = (T + V + D).free_symbols - {*vars(p).values(), *q, *v}
    if foreign:
        names = ", ".join(sorted(str(s) for s in foreign))
        raise BadInput(f"{where} uses {names}, which is none of its own symbols; take them from p, q and v.")
    if V.has(*v):
        raise BadInput(f"{where}: the potential energy V must not depend on velocities; move that term to T or D.")
    M = sp.hessian(T, v)
    if M.has(*v):
        raise BadInput(f"{where}: the kinetic energy T must be quadratic in the velocities; drag belongs to D.")
    _check_inertia(cls, M)
    return T, V, D


def _check_inertia(cls: type[Statement], M: Any) -> None:
    """Every motion needs an inertia; tried at arbitrary values, since a determinant in symbols can be long."""
    values = {s: (1 + sp.sqrt(2 + i)).evalf(30) for i, s in enumerate(sorted(M.free_symbols, key=str))}
    sample = M.evalf(30, subs=values)
    if abs(sample.det()) > 1e-20 * max(abs(e) for e in (*sample, sp.Float(1e-300))) ** M.rows:
        return
    idle = [c.name for i, c in enumerate(cls.coordinates) if M[i, :].is_zero_matrix]
    what = f"{', '.join(idle)} has no inertia" if idle else "some motion of the coordinates has no inertia"
    raise BadInput(f"{cls.__name__}: {what}, so its acceleration is undefined; give it a mass or leave it out.")


def motion(cls: type[Statement], *, without: Collection[str] = ()) -> tuple[Any, Any]:
    """Mass matrix M and force vector f of ``M a = f(q, v, u)``, as SymPy matrices, dry friction left out.

    Parameters named in `without` are zero.
    """
    p, q, v, u = symbols(cls)
    T, V, D = (e.subs({getattr(p, name): 0 for name in without}) for e in energies(cls))
    lagrangian = T - V
    Q = [sum((ui for ui, i in zip(u, cls.inputs, strict=True) if i.on == c.name), sp.S.Zero) for c in cls.coordinates]
    f = sp.Matrix(
        [
            sp.diff(lagrangian, qi) - sum(sp.diff(lagrangian, vi, qj) * vj for qj, vj in zip(q, v, strict=True))
            - sp.diff(D, vi) + Qi
            for qi, vi, Qi in zip(q, v, Q, strict=True)
        ]
    )  # fmt: skip
    return sp.hessian(T, v), f


def linear(cls: type[Statement], at: str, *, without: Collection[str] = ()) -> tuple[Any, Any]:
    """Matrices A, B about a named equilibrium, states in the paper's order, as simplified SymPy matrices."""
    determinant, A, B = over_determinant(cls, at, without=without)
    return tuple((m / determinant).applyfunc(sp.simplify) for m in (A, B))  # type: ignore[return-value]


def over_determinant(cls: type[Statement], at: str, *, without: Collection[str] = ()) -> tuple[Any, Any, Any]:
    """Determinant of the mass matrix (the paper's D_2), and A, B multiplied by it, about a named equilibrium."""
    _, q, v, u = symbols(cls)
    M, f = motion(cls, without=without)
    point = {qi: sp.nsimplify(cls.equilibria[at].get(qi.name, 0), [sp.pi]) for qi in q}
    rest = {**dict.fromkeys(v, 0), **dict.fromkeys(u, 0), **point}
    mass = M.subs(point)
    determinant, adjugate = sp.factor(sp.expand(mass.det(method="berkowitz"))), mass.adjugate()
    n = len(q)
    A, B = sp.zeros(2 * n), sp.zeros(2 * n, len(u))
    for wrt, first, stride, into in ((q, 0, 2, A), (v, 1, 2, A), (u, 0, 1, B)):
        slope = adjugate * f.jacobian(wrt).subs(rest) if wrt else sp.zeros(n, 0)
        for i in range(n):
            for j in range(len(wrt)):
                into[2 * i + 1, first + stride * j] = sp.factor(slope[i, j])
    for i in range(n):
        A[2 * i, 2 * i + 1] = determinant
    return determinant, A, B


def latex(cls: type[Statement]) -> str:
    """Equations of motion as a LaTeX ``align`` block, velocities dotted, optional parameters left out."""
    _, q, v, _ = symbols(cls)
    equations: Any = [m.applyfunc(lambda e: sp.trigsimp(sp.expand(e))) for m in motion(cls, without=cls.optional)]
    M, f = equations
    names = {vi: rf"\dot{{{sp.latex(qi)}}}" for qi, vi in zip(q, v, strict=True)}
    accelerations = sp.Matrix([sp.Symbol(rf"\ddot{{{sp.latex(qi)}}}") for qi in q])
    sides = zip(M * accelerations, f, strict=True)
    rows = [" &= ".join(sp.latex(side, symbol_names=names) for side in row) for row in sides]
    return "\\begin{align}\n" + " \\\\\n".join(rows) + "\n\\end{align}"


def latex_linear(cls: type[Statement], at: str) -> str:
    """Linear model about a named equilibrium as a LaTeX ``align`` block, the common denominator D written once.

    Optional parameters are left out.
    """
    determinant, *numerators = over_determinant(cls, at, without=cls.optional)
    below = sp.Symbol("D")
    A, B = (m.applyfunc(lambda e: sp.S.One if e == determinant else e / below) for m in numerators)
    rows = [f"A &= {sp.latex(A)}", f"B &= {sp.latex(B)}", f"D &= {sp.latex(determinant)}"]
    return "\\begin{align}\n" + " \\\\\n".join(rows) + "\n\\end{align}"
