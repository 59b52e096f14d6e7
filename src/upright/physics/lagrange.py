"""Which equations of motion follow from the energies? The only door to SymPy.

Euler and Lagrange: with L = T - V, ``M = d2L/dv2`` and
``f = dL/dq - (d2L/dv dq) v - dD/dv + Q``; terms of T that are linear in the velocities
(a motor's flux linkage) come out as gyroscopic forces.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from upright.errors import BadInput
from upright.physics.derived import Derived, DryJoint
from upright.physics.plant import Plant


def symbols(cls: type[Plant]) -> tuple[SimpleNamespace, list[Any], list[Any], list[Any]]:
    """Real symbols of parameters (by name), coordinates, velocities and inputs."""
    p = SimpleNamespace(**{n: sp.Symbol(n, real=True) for n in cls.names()})
    q = [sp.Symbol(c.name, real=True) for c in cls.coordinates]
    v = [sp.Symbol(f"{c.name}_dot", real=True) for c in cls.coordinates]
    u = [sp.Symbol(i.name, real=True) for i in cls.inputs]
    return p, q, v, u


def motion(cls: type[Plant]) -> tuple[Any, Any]:
    """Mass matrix M and force vector f of ``M a = f(q, v, u)``, as SymPy matrices, dry friction left out."""
    p, q, v, u = symbols(cls)
    T, V, D = (sp.sympify(e) for e in cls.energies(p, q, v))
    lagrangian = T - V
    Q = [sum((ui for ui, i in zip(u, cls.inputs, strict=True) if i.on == c.name), sp.S.Zero) for c in cls.coordinates]
    M = sp.hessian(lagrangian, v)
    if M.has(*v):
        raise BadInput(f"{cls.__name__}: kinetic energy must be quadratic in the velocities; check energies().")
    f = sp.Matrix(
        [
            sp.diff(lagrangian, qi) - sum(sp.diff(lagrangian, vi, qj) * vj for qj, vj in zip(q, v, strict=True))
            - sp.diff(D, vi) + Qi
            for qi, vi, Qi in zip(q, v, Q, strict=True)
        ]
    )  # fmt: skip
    return M, f


def linear(cls: type[Plant], at: str) -> tuple[Any, Any]:
    """Matrices A, B about a named equilibrium, states in the paper's order, as simplified SymPy matrices."""
    _, q, v, u = symbols(cls)
    M, f = motion(cls)
    point = {qi: sp.nsimplify(cls.equilibria[at].get(qi.name, 0), [sp.pi]) for qi in q}
    rest = {**dict.fromkeys(v, 0), **dict.fromkeys(u, 0), **point}
    Minv = M.subs(point).inv()
    n = len(q)
    A, B = sp.zeros(2 * n), sp.zeros(2 * n, len(u))
    for rows, wrt in ((0, q), (1, v)):
        block = (Minv * f.jacobian(wrt).subs(rest)).applyfunc(sp.simplify)
        for i in range(n):
            A[2 * i, 2 * i + 1] = 1
            for j in range(n):
                A[2 * i + 1, 2 * j + rows] = block[i, j]
    if u:
        block = (Minv * f.jacobian(u).subs(rest)).applyfunc(sp.simplify)
        for i in range(n):
            B[2 * i + 1, :] = block[i, :]
    return A, B


def latex(cls: type[Plant]) -> str:
    """Equations of motion as a LaTeX ``align`` block, velocities dotted."""
    _, q, v, _ = symbols(cls)
    M, f = motion(cls)
    names = {vi: rf"\dot{{{sp.latex(qi)}}}" for qi, vi in zip(q, v, strict=True)}
    accelerations = sp.Matrix([sp.Symbol(rf"\ddot{{{sp.latex(qi)}}}") for qi in q])
    rows = [
        sp.latex((M[i, :] * accelerations)[0], symbol_names=names) + " &= " + sp.latex(f[i], symbol_names=names)
        for i in range(len(q))
    ]
    return "\\begin{align}\n" + " \\\\\n".join(rows) + "\n\\end{align}"


class _Printer(PythonCodePrinter):
    """Small integer powers as products, which every compiler turns into multiplications."""

    def _print_Pow(self, expr: Any, rational: bool = False) -> str:
        base, exponent = expr.args
        if exponent.is_Integer and 2 <= int(exponent) <= 4:
            factor = self._print(base) if base.is_Symbol else f"({self._print(base)})"
            return "(" + "*".join([factor] * int(exponent)) + ")"
        return super()._print_Pow(expr, rational=rational)


_PRINTER = _Printer({"fully_qualified_modules": False})


def text(expression: Any) -> str:
    """Python source of an expression, functions unqualified."""
    return _PRINTER.doprint(expression)


def derive(cls: type[Plant], *, without: frozenset[str] = frozenset()) -> Derived:
    """Derive a plant's equations of motion from its energies.

    Raises
    ------
    BadInput
        When the energies are not those of a mechanical system in these coordinates.
    """
    p, q, v, u = symbols(cls)
    zero = {getattr(p, n): 0 for n in without}
    M, f = (m.subs(zero) for m in motion(cls))
    T, V, D = (sp.sympify(e).subs(zero) for e in cls.energies(p, q, v))
    n = len(q)
    entries = [M[i, j] for i in range(n) for j in range(i, n)] + list(f)
    trig, entries = _name_trig(entries)
    lumps, entries = _lump(entries, [s for t in trig for s in t[:2]], [*q, *v, *u], list(vars(p).values()))
    steps, entries = sp.cse(entries, symbols=(sp.Symbol(f"w{i}") for i in range(1000)), optimizations="basic")
    rest = {**dict.fromkeys(v, 0), **dict.fromkeys(u, 0)}
    index = {c.name: i for i, c in enumerate(cls.coordinates)}
    momentum_energy = sum(vi * sp.diff(T, vi) for vi in v) - T  # T without its velocity-linear terms
    return Derived(
        name=cls.__name__,
        coordinates=tuple(index),
        inputs=tuple(i.name for i in cls.inputs),
        parameters=cls.names(),
        lumps=tuple(text(k) for k in lumps),
        trig=tuple((s.name, c.name, text(a)) for s, c, a in trig),
        steps=tuple((s.name, text(e)) for s, e in steps),
        mass=tuple(text(e) for e in entries[: -n or None]),
        force=tuple(text(e) for e in entries[-n:]),
        stiffness=tuple(text(e) for e in -f.jacobian(q).subs(rest)),
        damping=tuple(text(e) for e in -f.jacobian(v).subs(rest)),
        gain=tuple(text(e) for e in f.jacobian(u).subs(rest)) if u else (),
        kinetic=text(sp.expand(momentum_energy) if momentum_energy.is_polynomial(*v) else momentum_energy),
        potential=text(V),
        power_lost=text(sum(vi * sp.diff(D, vi) for vi in v)),
        joints=tuple(
            DryJoint(
                coordinate=index[j.on],
                coulomb=j.coulomb,
                quadratic=j.quadratic,
                stiction=j.stiction,
                stribeck_speed=j.stribeck_speed,
                presliding=j.presliding,
            )
            for j in cls.joints
        ),
    )


def _name_trig(entries: list[Any]) -> tuple[list[tuple[Any, Any, Any]], list[Any]]:
    """Replace sines and cosines by symbols, one pair per argument, and squares of cosines by 1 - sine^2."""
    entries = [sp.expand(e) for e in entries]
    found: set[Any] = set()
    for e in entries:
        found |= {a.args[0] for a in e.atoms(sp.sin, sp.cos)}
    arguments = sorted(found, key=str)
    trig = [(sp.Symbol(f"s{i}"), sp.Symbol(f"c{i}"), a) for i, a in enumerate(arguments)]
    names = {f(a): s for s0, c0, a in trig for f, s in ((sp.sin, s0), (sp.cos, c0))}
    named: list[Any] = []
    for e in entries:
        e = sp.expand(e.subs(names))
        for s, c, _ in trig:
            e = sp.expand(sp.rem(e, c**2 + s**2 - 1, c)) if e.is_polynomial(c) else e
        named.append(e)
    return trig, named


def _lump(entries: list[Any], trig: list[Any], moving: list[Any], parameters: list[Any]) -> tuple[list[Any], list[Any]]:
    """Collect what depends on parameters alone: each distinct coefficient, up to a rational factor, becomes k0, k1, ..."""
    generators = [*trig, *moving]
    lumps: list[Any] = []
    lumped: list[Any] = []
    for e in entries:
        if not e.is_polynomial(*generators):  # such as a user's own nonlinear spring: parameters stay as they are
            present = [p for p in parameters if p in e.free_symbols]
            e = e.subs({p: _lump_symbol(lumps, p) for p in present})
            lumped.append(e)
            continue
        total = sp.S.Zero
        for monomial, coefficient in sp.Poly(e, *generators).terms():
            product = sp.prod(g**m for g, m in zip(generators, monomial, strict=True))
            factor, lump = sp.factor_terms(sp.expand(coefficient)).as_coeff_Mul()
            if lump.could_extract_minus_sign():
                factor, lump = -factor, -lump
            total += factor * product * (sp.S.One if lump == 1 else _lump_symbol(lumps, sp.expand(lump)))
        lumped.append(total)
    return lumps, lumped


def _lump_symbol(lumps: list[Any], expression: Any) -> Any:
    if expression not in lumps:
        lumps.append(expression)
    return sp.Symbol(f"k{lumps.index(expression)}")
