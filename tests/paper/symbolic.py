"""Linear models of a plant in symbols, to hold against the paper's."""

from collections.abc import Collection
from typing import Any

import sympy as sp

from upright.physics.lagrange import symbolic_mass_and_force, symbols
from upright.physics.plant import Plant


def linear(cls: type[Plant], at: str, *, without: Collection[str] = ()) -> tuple[Any, Any]:
    """Matrices A, B about a named equilibrium, states in the paper's order, as simplified SymPy matrices."""
    determinant, A, B = over_determinant(cls, at, without=without)
    return tuple((m / determinant).applyfunc(sp.simplify) for m in (A, B))  # type: ignore[return-value]


def over_determinant(cls: type[Plant], at: str, *, without: Collection[str] = ()) -> tuple[Any, Any, Any]:
    """Determinant of the mass matrix (the paper's D_2), and A, B multiplied by it, about a named equilibrium."""
    _, q, v, u = symbols(cls)
    M, f = symbolic_mass_and_force(cls, without=without)
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
