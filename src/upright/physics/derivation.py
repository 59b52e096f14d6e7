"""Equations of motion of a plant as short text, cheap to evaluate, for code that knows no symbols.

Every constant combination of parameters is computed once (k0, k1, ...), every sine and cosine once (s0, c0, ...),
what is left in common once (w0, w1, ...).
"""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from upright.physics.equations import Derived, DryJoint
from upright.physics.lagrange import energies, motion, symbols
from upright.physics.statement import Statement


def derive(cls: type[Statement], *, without: frozenset[str] = frozenset()) -> Derived:
    """Derive a plant's equations of motion from its energies.

    Raises
    ------
    BadInput
        When the energies are not those of a mechanical system in these coordinates.
    """
    p, q, v, u = symbols(cls)
    zero = {getattr(p, n): 0 for n in without}
    M, f = motion(cls, without=without)
    T, V, D = (e.subs(zero) for e in energies(cls))
    n = len(q)
    entries = [M[i, j] for i in range(n) for j in range(i, n)] + list(f)
    lumps: list[Any] = []
    trig, entries = _name_trig(entries, [*q, *v, *u], lumps)
    entries = _lump(entries, [*(s for t in trig for s in t[:2]), *q, *v, *u], list(vars(p).values()), lumps)
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
        mass=tuple(text(e) for e in list(entries)[:-n]),
        force=tuple(text(e) for e in list(entries)[-n:]),
        stiffness=tuple(text(e) for e in -f.jacobian(q).subs(rest)),
        damping=tuple(text(e) for e in -f.jacobian(v).subs(rest)),
        gain=tuple(text(e) for e in f.jacobian(u).subs(rest)) if u else (),
        kinetic=text(sp.expand(momentum_energy) if momentum_energy.is_polynomial(*v) else momentum_energy),
        potential=text(V),
        power_lost=text(sum(vi * sp.diff(D, vi) for vi in v)),
        joints=tuple(DryJoint(coordinate=index[j.on], **j.parameters()) for j in cls.joints),
    )


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
    return str(_PRINTER.doprint(expression))


def _name_trig(entries: list[Any], moving: list[Any], lumps: list[Any]) -> tuple[list[tuple[Any, Any, Any]], list[Any]]:
    """Replace sines and cosines of what moves by symbols, one pair per argument, and cos^2 by 1 - sin^2.

    A constant angle in the argument is taken out by the addition theorem; one in parameters alone is left to `_lump`.
    """
    entries = [sp.expand(e) for e in entries]
    if any(a.args[0].free_symbols - set(moving) for e in entries for a in _moving_trig(e, moving)):
        entries = [sp.expand(e.replace(lambda a: a in _moving_trig(a, moving), sp.expand_trig)) for e in entries]
    arguments = sorted({a.args[0] for e in entries for a in _moving_trig(e, moving)}, key=sp.default_sort_key)
    trig: list[tuple[Any, Any, Any]] = []
    named: list[Any] = []
    for i, a in enumerate(arguments):
        constants = sorted(a.free_symbols - set(moving), key=str)  # such as a gear ratio: sin(n theta)
        trig.append((sp.Symbol(f"s{i}"), sp.Symbol(f"c{i}"), a.subs({p: _lump_symbol(lumps, p) for p in constants})))
    names = {f(a): t[k] for a, t in zip(arguments, trig, strict=True) for k, f in ((0, sp.sin), (1, sp.cos))}
    for e in entries:
        e = sp.expand(e.subs(names))
        for s, c, _ in trig:
            e = sp.expand(sp.rem(e, c**2 + s**2 - 1, c)) if e.is_polynomial(c) else e
        named.append(e)
    return trig, named


def _moving_trig(expression: Any, moving: list[Any]) -> set[Any]:
    """Sines and cosines whose argument changes with the state."""
    return {a for a in expression.atoms(sp.sin, sp.cos) if a.has(*moving)}


def _lump(entries: list[Any], generators: list[Any], parameters: list[Any], lumps: list[Any]) -> list[Any]:
    """Collect what depends on parameters alone: each distinct coefficient, up to a factor, becomes k0, k1, ..."""
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
    return lumped


def _lump_symbol(lumps: list[Any], expression: Any) -> Any:
    if expression not in lumps:
        lumps.append(expression)
    return sp.Symbol(f"k{lumps.index(expression)}")
