"""A constant linear combination of coordinates, read and written: ``theta_2 - theta_1``, ``x + 0.3*alpha``."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterable

from upright.errors import BadInput, nearest

_LONGEST = 500


def combination(text: str, names: Collection[str]) -> dict[str, float]:
    """Factor of each name in a sum of names times numbers, in the order of `names`; nothing is executed.

    Raises
    ------
    BadInput
        When it names something else, or is no such sum.
    """
    try:
        if len(text) > _LONGEST:
            raise SyntaxError("too long")
        total, constant = _sum(ast.parse(text.strip(), mode="eval").body, names, text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        if isinstance(error, BadInput):
            raise
        raise _no_sum(text) from None
    factors = {name: total[name] for name in names if total.get(name)}
    if constant or not factors:
        raise _no_sum(text)
    return factors


def _no_sum(text: str) -> BadInput:
    shown = text if len(text) <= 60 else f"{text[:57]}..."
    return BadInput(f"'{shown}' is no sum of coordinates times numbers, such as theta_2 - theta_1 or x + 0.3*alpha")


def _sum(node: ast.expr, names: Collection[str], whole: str) -> tuple[dict[str, float], float]:
    """Factors by name, and what is constant."""
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool) and abs(number) < 1e300:
            return {}, float(number)
        case ast.Name(id=name):
            if name not in names:
                raise BadInput(f"'{name}' is no coordinate; {nearest(name, names)}")
            return {name: 1.0}, 0.0
        case ast.UnaryOp(op=ast.UAdd() | ast.USub() as sign, operand=piece):
            return _scaled(_sum(piece, names, whole), -1.0 if isinstance(sign, ast.USub) else 1.0)
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() as op, right=right):
            a, b = _sum(left, names, whole), _scaled(_sum(right, names, whole), -1.0 if isinstance(op, ast.Sub) else 1)
            return {n: a[0].get(n, 0.0) + b[0].get(n, 0.0) for n in {**a[0], **b[0]}}, a[1] + b[1]
        case ast.BinOp(left=left, op=ast.Mult() | ast.Div() as op, right=right):
            a, b = _sum(left, names, whole), _sum(right, names, whole)
            if isinstance(op, ast.Mult) and not a[0]:
                return _scaled(b, a[1])
            if not b[0] and (b[1] or isinstance(op, ast.Mult)):
                return _scaled(a, b[1] if isinstance(op, ast.Mult) else 1 / b[1])
        case _:
            pass
    raise _no_sum(whole)


def _scaled(of: tuple[dict[str, float], float], factor: float) -> tuple[dict[str, float], float]:
    return {n: factor * x for n, x in of[0].items()}, factor * of[1]


def spelled(factors: Iterable[float], names: Iterable[str]) -> str:
    """A combination as text that can stand in a product: ``b``, ``(-a + b)``, ``0.0`` when nothing is in it."""
    terms = [(f, n) for f, n in zip(factors, names, strict=True) if f]
    if not terms:
        return "0.0"
    text = " + ".join(n if f == 1 else f"-{n}" if f == -1 else f"{f!r} * {n}" for f, n in terms)
    return text if len(terms) == 1 and terms[0][0] == 1 else f"({text.replace('+ -', '- ')})"
