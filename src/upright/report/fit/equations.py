"""Which equations did the fit use?

The plant's derived text with its intermediate names put back and terms that are zero left out.
"""

from __future__ import annotations

import ast
from collections.abc import Collection

from upright.physics import Derived, Plant
from upright.report.mathml import Writer

_ZERO = ast.Constant(0)


def equations(plant: type[Plant], *, zero: Collection[str] = ()) -> str:
    """Equations of motion ``M(q) a = f`` as MathML, one row per coordinate.

    Parameters
    ----------
    plant : type of Plant
    zero : collection of str
        Parameters that are zero in this fit; their terms are left out.
    """
    derived = plant.derived(without=frozenset(zero))
    inner, writer = _Inner(derived, frozenset(zero)), Writer(derived.parameters)
    return writer.aligned([_row(derived, i, inner, frozenset(zero)) for i in range(len(derived.coordinates))])


def _row(derived: Derived, i: int, inner: _Inner, zero: frozenset[str]) -> tuple[ast.expr, ast.expr]:
    n = len(derived.coordinates)
    left: ast.expr = _ZERO
    for j, c in enumerate(derived.coordinates):
        a, b = sorted((i, j))
        entry = inner.of(derived.mass[a * n - a * (a - 1) // 2 + b - a])
        left = _add(left, _multiply(entry, ast.Name(f"{c}_ddot")))
    right = inner.of(derived.force[i])
    v = f"{derived.coordinates[i]}_dot"
    for joint in derived.joints:
        if joint.coordinate != i:
            continue
        if joint.coulomb and joint.coulomb not in zero:
            right = _add(right, inner.of(f"-{joint.coulomb}*sgn({v})"))
        if joint.quadratic and joint.quadratic not in zero:
            right = _add(right, inner.of(f"-{joint.quadratic}*{v}*abs({v})"))
    return left, right


class _Inner(ast.NodeTransformer):
    """Put lumps, sines and intermediate results back where they are used; drop terms that are zero."""

    def __init__(self, derived: Derived, zero: frozenset[str]) -> None:
        self.names: dict[str, ast.expr] = dict.fromkeys(zero, _ZERO)
        for i, lump in enumerate(derived.lumps):
            self.names[f"k{i}"] = self.of(lump)
        for s, c, argument in derived.trig:
            self.names[s] = self.of(f"sin({argument})")
            self.names[c] = self.of(f"cos({argument})")
        for name, step in derived.steps:
            self.names[name] = self.of(step)

    def of(self, text: str) -> ast.expr:
        return self.visit(ast.parse(text, mode="eval").body)

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return self.names.get(node.id, node)

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        a, b = self.visit(node.left), self.visit(node.right)
        match node.op:
            case ast.Add():
                return _add(a, b)
            case ast.Sub():
                return _add(a, _negative(b))
            case ast.Mult():
                return _multiply(a, b)
            case ast.Div() if _is(a, 0):
                return _ZERO
            case _:
                return ast.BinOp(a, node.op, b)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        inner = self.visit(node.operand)
        return _negative(inner) if isinstance(node.op, ast.USub) else inner

    def visit_Call(self, node: ast.Call) -> ast.expr:
        inner = [self.visit(a) for a in node.args]
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name == "sqrt" and _is(inner[0], 1):
            return ast.Constant(1)
        if name in ("sin", "cos") and _is(inner[0], 0):
            return ast.Constant(0 if name == "sin" else 1)
        return ast.Call(node.func, inner, [])


def _is(node: ast.expr, value: float) -> bool:
    return isinstance(node, ast.Constant) and node.value == value


def _add(a: ast.expr, b: ast.expr) -> ast.expr:
    if _is(a, 0):
        return b
    return a if _is(b, 0) else ast.BinOp(a, ast.Add(), b)


def _negative(a: ast.expr) -> ast.expr:
    if _is(a, 0):
        return a
    return a.operand if isinstance(a, ast.UnaryOp) else ast.UnaryOp(ast.USub(), a)


def _multiply(a: ast.expr, b: ast.expr) -> ast.expr:
    if _is(a, 0) or _is(b, 0):
        return _ZERO
    if _is(a, 1):
        return b
    if isinstance(a, ast.UnaryOp):
        return _negative(_multiply(a.operand, b))
    if isinstance(b, ast.UnaryOp):
        return _negative(_multiply(a, b.operand))
    return a if _is(b, 1) else ast.BinOp(a, ast.Mult(), b)
