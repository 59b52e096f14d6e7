"""Equations of motion in symbols, as they follow from the energies, and as short text. The only door to SymPy.

Euler and Lagrange: with L = T - V, ``M = d2L/dv2`` and
``f = dL/dq - (d2L/dv dq) v - dD/dv + Q``; terms of T that are linear in the velocities
(a motor's flux linkage) come out as gyroscopic forces.

The text is cheap to evaluate, for code that knows no symbols: every constant combination of parameters is computed once
(k0, k1, ...), every sine and cosine once (s0, c0, ...), what is left in common once (w0, w1, ...).
What has a kink (Abs, Max, ...) becomes a choice between smooth pieces, so that derivatives hold no impulses.
"""

from __future__ import annotations

from collections.abc import Collection
from contextlib import suppress
from types import SimpleNamespace
from typing import Any

import sympy as sp
from sympy.core.relational import Relational
from sympy.functions.elementary.piecewise import ExprCondPair
from sympy.logic.boolalg import BooleanAtom
from sympy.printing.pycode import PythonCodePrinter

from upright.errors import BadInput, nearest
from upright.physics.equations import FUNCTIONS, Derived, DryJoint
from upright.physics.statement import Statement

_KINKED: dict[Any, Any] = {
    sp.Abs: lambda a: sp.Piecewise((a, a >= 0), (-a, True)),
    sp.sign: lambda a: sp.Piecewise((1, a > 0), (-1, a < 0), (0, True)),
    sp.Heaviside: lambda a, half=sp.S.Half: sp.Piecewise((1, a > 0), (0, a < 0), (half, True)),
    sp.Max: lambda *a: sp.Piecewise(*((x, sp.And(*(x >= y for y in a if y != x))) for x in a[1:]), (a[0], True)),
    sp.Min: lambda *a: sp.Piecewise(*((x, sp.And(*(x <= y for y in a if y != x))) for x in a[1:]), (a[0], True)),
}
_SMOOTH = tuple(getattr(sp, name) for name in FUNCTIONS if name not in ("sqrt", "abs", "pi"))
_KNOWN = (
    sp.Add, sp.Mul, sp.Pow, sp.Number, sp.NumberSymbol, sp.Symbol, *_SMOOTH, *_KINKED, sp.Piecewise, ExprCondPair,
    Relational, sp.And, sp.Or, sp.Not, BooleanAtom,
)  # fmt: skip


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
    _check_functions(where, T, V, D)
    if V.has(*v):
        raise BadInput(f"{where}: the potential energy V must not depend on velocities; move that term to T or D.")
    M = sp.hessian(T, v)
    if M.has(*v):
        raise BadInput(f"{where}: the kinetic energy T must be quadratic in the velocities; drag belongs to D.")
    _check_inertia(cls, M)
    return T, V, D


def _check_functions(where: str, *stated: Any) -> None:
    unknown = {x.func.__name__ for e in stated for x in sp.preorder_traversal(e) if not isinstance(x, _KNOWN)}
    if unknown:
        raise BadInput(
            f"{where} uses {', '.join(sorted(unknown))}, which the kernel does not know; it knows SymPy's "
            f"{', '.join([*(f for f in FUNCTIONS if f not in ('abs', 'pi')), *(f.__name__ for f in _KINKED)])} and "
            "Piecewise."
        )
    for choice in (c for e in stated for c in e.atoms(sp.Piecewise)):
        if sp.Or(*(c for _, c in choice.args)) is not sp.true:
            raise BadInput(f"{where}: {choice} leaves cases open; let its last piece hold for True.")


def _in_pieces(e: Any) -> Any:
    """The same with every kink as a choice between smooth pieces."""
    for kinked, pieces in _KINKED.items():
        e = e.replace(kinked, pieces)
    return e.replace(sp.Piecewise, lambda *pairs: sp.Piecewise(*pairs[:-1], (pairs[-1][0], True)))


def _stated(cls: type[Statement], without: Collection[str]) -> tuple[Any, Any, Any]:
    """T, V and D in smooth pieces, some parameters zero."""
    T, V, D = energies(cls)
    p = symbols(cls)[0]
    return tuple(_in_pieces(e.subs({getattr(p, name): 0 for name in without})) for e in (T, V, D))


def _check_inertia(cls: type[Statement], M: Any) -> None:
    """Every motion needs an inertia; tried at arbitrary values, since a determinant in symbols can be long."""
    values = {s: (1 + sp.sqrt(2 + i)).evalf(30) for i, s in enumerate(sorted(M.free_symbols, key=str))}
    sample = M.evalf(30, subs=values)
    if abs(sample.det()) > 1e-20 * max(abs(e) for e in (*sample, sp.Float(1e-300))) ** M.rows:
        return
    idle = [c.name for i, c in enumerate(cls.coordinates) if M[i, :].is_zero_matrix]
    what = f"{', '.join(idle)} has no inertia" if idle else "some motion of the coordinates has no inertia"
    raise BadInput(f"{cls.__name__}: {what}, so its acceleration is undefined; give it a mass or leave it out.")


def _check_jumps(cls: type[Statement], V: Any, M: Any, f: Any) -> None:
    """Runge and Kutta's steps need forces without jumps; tried at arbitrary values on both sides of each border."""
    _, q, v, _ = symbols(cls)
    parts = [("its potential energy V", V), *(("its mass matrix", e) for e in M)]
    parts += [(f"the force on {c.name}", e) for c, e in zip(cls.coordinates, f, strict=True)]
    for what, e in parts:
        conditions = {r for choice in e.atoms(sp.Piecewise) for _, c in choice.args for r in c.atoms(Relational)}
        for g in sorted({r.lhs - r.rhs for r in conditions if r.has(*q, *v)}, key=sp.default_sort_key):
            s = next(x for x in (*q, *v) if g.has(x))
            some = {x: (1 + sp.sqrt(2 + i)).evalf(60) for i, x in enumerate(sorted(e.free_symbols - {s}, key=str))}
            for place in _zeros(g.subs(some), s):
                one, other = (_value(e, {**some, s: place + d * sp.Float("1e-24", 60)}) for d in (1, -1))
                if abs(one - other) > 1e-9 * max(abs(one) + abs(other), 1.0):
                    raise BadInput(
                        f"{cls.__name__}: {what} jumps where {g} = 0, and the kernel steps over jumps; let it rise "
                        "over a short way, as tanh does, and state dry friction in a Joint."
                    )


def _zeros(g: Any, s: Any) -> list[Any]:
    """Where an expression of one symbol is zero: everywhere for a straight line, else near a few values."""
    slope = sp.diff(g, s)
    if not slope.has(s):
        return [-g.subs(s, 0) / slope]
    roots: list[Any] = []
    for start in (0.3, -0.3, 2.0):
        with suppress(ValueError, TypeError, ZeroDivisionError):  # none is found from here
            roots.append(sp.nsolve(g, s, start, prec=60))
    return roots


def _value(e: Any, at: dict[Any, Any]) -> complex:
    """NaN where there is none."""
    try:
        return complex(e.subs(at).evalf(60))
    except (TypeError, ValueError):
        return complex("nan")


def _steady(e: Any) -> Any:
    """A quotient of hyperbolic sine and cosine, as the slope of log(cosh(v/w)), by what is finite for all speeds."""
    for a in {c.args[0] for c in e.atoms(sp.cosh)}:
        e = e.subs(sp.sinh(a) / sp.cosh(a), sp.tanh(a))
    return e


def symbolic_mass_and_force(cls: type[Statement], *, without: Collection[str] = ()) -> tuple[Any, Any]:
    """Mass matrix M and force vector f of ``M a = f(q, v, u)``, as SymPy matrices, dry friction left out.

    Parameters named in `without` are zero.
    """
    _, q, v, u = symbols(cls)
    T, V, D = _stated(cls, without)
    lagrangian = T - V
    Q = [sum((ui for ui, i in zip(u, cls.inputs, strict=True) if i.on == c.name), sp.S.Zero) for c in cls.coordinates]
    f = sp.Matrix(
        [
            sp.diff(lagrangian, qi) - sum(sp.diff(lagrangian, vi, qj) * vj for qj, vj in zip(q, v, strict=True))
            - sp.diff(D, vi) + Qi
            for qi, vi, Qi in zip(q, v, Q, strict=True)
        ]
    )  # fmt: skip
    return sp.hessian(T, v), f.applyfunc(_steady)


def derive(cls: type[Statement], *, without: frozenset[str] = frozenset()) -> Derived:
    """Derive a plant's equations of motion from its energies.

    Raises
    ------
    BadInput
        When the energies are not those of a mechanical system in these coordinates.
    """
    p, q, v, u = symbols(cls)
    M, f = symbolic_mass_and_force(cls, without=without)
    T, V, D = _stated(cls, without)
    _check_jumps(cls, V, M, f)
    n = len(q)
    entries = [M[i, j] for i in range(n) for j in range(i, n)] + list(f)
    lumps: list[Any] = []
    trig, entries = _name_trig(entries, [*q, *v, *u], lumps)
    entries = _lump(entries, [*(s for t in trig for s in t[:2]), *q, *v, *u], list(vars(p).values()), lumps)
    steps, entries = sp.cse(entries, symbols=(sp.Symbol(f"w{i}") for i in range(1000)), optimizations="basic")
    rest = {**dict.fromkeys(v, 0), **dict.fromkeys(u, 0)}

    def at_rest(e: Any) -> Any:
        """What chooses by a speed has two sides there: its names stay."""
        return e if any(c.has(*v) for choice in e.atoms(sp.Piecewise) for _, c in choice.args) else e.subs(rest)

    index = {c.name: i for i, c in enumerate(cls.coordinates)}
    momentum_energy = sum(vi * sp.diff(T, vi) for vi in v) - T  # T without its velocity-linear terms
    return Derived(
        name=cls.__name__,
        coordinates=tuple(index),
        inputs=tuple(i.name for i in cls.inputs),
        parameters=cls.names(),
        lumps=tuple(python_source(k) for k in lumps),
        trig=tuple((s.name, c.name, python_source(a)) for s, c, a in trig),
        steps=tuple((s.name, python_source(e)) for s, e in steps),
        mass=tuple(python_source(e) for e in list(entries)[:-n]),
        force=tuple(python_source(e) for e in list(entries)[-n:]),
        stiffness=tuple(python_source(at_rest(e)) for e in -f.jacobian(q)),
        damping=tuple(python_source(at_rest(e)) for e in -f.jacobian(v)),
        gain=tuple(python_source(e) for e in f.jacobian(u).subs(rest)) if u else (),
        kinetic=python_source(sp.expand(momentum_energy) if momentum_energy.is_polynomial(*v) else momentum_energy),
        potential=python_source(V),
        power_lost=python_source(sum(vi * _steady(sp.diff(D, vi)) for vi in v)),
        joints=tuple(DryJoint(direction=j.direction(index), **j.parameters()) for j in cls.joints),
    )


class _Printer(PythonCodePrinter):
    """Small integer powers as products, which every compiler turns into multiplications; halves by square roots."""

    def _print_Pow(self, expr: Any, rational: bool = False) -> str:
        base, exponent = expr.args
        whole = sp.floor(exponent) if exponent.is_Rational and exponent.q <= 2 else 0
        if 2 <= exponent <= 4 if exponent.is_Integer else 1 <= whole <= 4:
            factor = self._print(base) if base.is_Symbol else f"({self._print(base)})"
            root = [] if exponent.is_Integer else [f"sqrt({self._print(base)})"]
            return "(" + "*".join([factor] * int(whole) + root) + ")"
        return super()._print_Pow(expr, rational=rational)

    def _print_NumberSymbol(self, expr: Any) -> str:
        return repr(float(expr))

    _print_Exp1 = _print_NumberSymbol  # SymPy's own would call it e, a name that the text does not have


_PRINTER = _Printer({"fully_qualified_modules": False})


def python_source(expression: Any) -> str:
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
