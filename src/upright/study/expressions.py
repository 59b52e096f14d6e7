"""What drove the rig, when the log does not hold it? Arithmetic on columns, read by its grammar and never executed.

``2.5*(0.2 - z)`` is a proportional law on column z, ``where(t < 1, 0, 0.5)`` a step at 1 s. A column whose name is no
Python name stands in backquotes.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from upright.errors import BadInput, nearest
from upright.records import Array

FUNCTIONS: dict[str, tuple[Callable[..., Any], int]] = {
    "where": (np.where, 3),
    "sin": (np.sin, 1),
    "cos": (np.cos, 1),
    "exp": (np.exp, 1),
    "sqrt": (np.sqrt, 1),
    "abs": (np.abs, 1),
    "sign": (np.sign, 1),
    "min": (np.minimum, 2),
    "max": (np.maximum, 2),
    "clip": (np.clip, 3),
    "mod": (np.mod, 2),
    "atan2": (np.arctan2, 2),
}
"""Functions by name, with their number of arguments."""

_CONSTANTS = {"pi": float(np.pi)}
_OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.Mod: np.mod,
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
    ast.Eq: np.equal,
    ast.NotEq: np.not_equal,
}
_LONGEST = 2000


def evaluate(expression: str, columns: Mapping[str, Array], t: Array) -> Array:
    """Value (N,) of an expression, sample by sample.

    Parameters
    ----------
    expression : str
        Numbers, columns, ``t`` [s], ``pi``, ``+ - * / % **``, comparisons joined by ``and``/``or``, `FUNCTIONS`, and
        ``integral`` over time, from the first sample on.
    columns : mapping of str to (N,) array
        What the names stand for, in the units of the log.
    t : (N,) array
        Time [s].

    Raises
    ------
    BadInput
        When it cannot be read, names an unknown column or function, or is not finite.
    """
    if expression in columns:
        return np.array(columns[expression], dtype=np.float64)
    quoted: dict[str, str] = {}

    def plain(match: re.Match[str]) -> str:
        quoted[name := f"_column_{len(quoted)}"] = match.group(1)
        return name

    text = re.sub(r"`([^`]*)`", plain, expression)
    try:
        if len(text) > _LONGEST:
            raise SyntaxError("too long")
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise BadInput(
            f"'{_short(expression)}' is neither a column nor arithmetic such as 2.5*(0.2 - z);"
            f" the log has the columns {', '.join(columns)}"
        ) from None
    scope = {"t": t, **_CONSTANTS, **columns, **{k: _look_up(v, columns, expression) for k, v in quoted.items()}}
    try:
        with np.errstate(all="ignore"):
            value = np.asarray(_value(tree, scope, expression), dtype=np.float64) + np.zeros(t.size)
    except RecursionError:
        raise BadInput(f"'{_short(expression)}' is nested too deeply; write it with fewer brackets and signs") from None
    if not np.isfinite(value).all():
        first = int(np.argmin(np.isfinite(value)))
        raise BadInput(f"'{_short(expression)}' is not finite at t = {t[first]:g} s; does it divide by zero there?")
    return value


def _value(node: ast.expr, scope: Mapping[str, Any], whole: str) -> Any:
    """Value of one piece of the grammar; anything not listed is refused."""

    def of(piece: ast.expr) -> Any:
        return _value(piece, scope, whole)

    match node:
        case ast.Constant(value=bool() | int() | float() as number) if abs(number) < 1e300:
            return float(number)
        case ast.Name(id=name):
            return _look_up(name, scope, whole)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](of(left), of(right))
        case ast.UnaryOp(op=ast.USub(), operand=piece):
            return np.negative(of(piece))
        case ast.UnaryOp(op=ast.UAdd(), operand=piece):
            return of(piece)
        case ast.UnaryOp(op=ast.Not(), operand=piece):
            return np.logical_not(of(piece))
        case ast.BoolOp(op=op, values=pieces):
            join = np.logical_and if isinstance(op, ast.And) else np.logical_or
            result = of(pieces[0])
            for piece in pieces[1:]:
                result = join(result, of(piece))
            return result
        case ast.Compare(left=left, ops=ops, comparators=rights) if all(type(op) in _OPERATORS for op in ops):
            terms = [of(left), *(of(right) for right in rights)]
            result = np.bool_(True)
            for op, a, b in zip(ops, terms, terms[1:], strict=False):
                result = np.logical_and(result, _OPERATORS[type(op)](a, b))
            return result
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return np.where(of(test), of(body), of(orelse))
        case ast.Call(func=ast.Name(id="integral"), args=[piece], keywords=[]):
            return _integral(scope["t"], of(piece), whole)
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
            if name not in FUNCTIONS:
                raise BadInput(f"'{_short(whole)}' calls '{name}'; {nearest(name, (*FUNCTIONS, 'integral'))}")
            function, count = FUNCTIONS[name]
            if len(args) != count:
                raise BadInput(f"'{_short(whole)}': {name} takes {count} values, got {len(args)}")
            return function(*(of(piece) for piece in args))
        case _:
            raise BadInput(
                f"'{_short(whole)}' uses '{_short(ast.unparse(node))}', which is no arithmetic on columns;"
                f" allowed are numbers, columns, t, pi, + - * / % **, comparisons, integral and {', '.join(FUNCTIONS)}"
            )


def _integral(t: Array, value: Any, whole: str) -> Array:
    """From the first sample on, of the cubic spline through the samples."""
    from scipy.interpolate import CubicSpline

    values = np.broadcast_to(np.asarray(value, dtype=np.float64), t.shape)
    if not np.isfinite(values).all() or t.size < 2:
        raise BadInput(f"'{_short(whole)}' integrates what is not finite, or a single sample")
    return CubicSpline(t, values).antiderivative()(t)


def _look_up(name: str, scope: Mapping[str, Any], whole: str) -> Any:
    if name not in scope:
        raise BadInput(
            f"'{_short(whole)}' names the column '{name}', which the log does not have; {nearest(name, scope)}"
        )
    return scope[name]


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:57]}..."
