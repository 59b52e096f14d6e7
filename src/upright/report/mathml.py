"""How does a formula reach the page? As MathML, which a browser draws, prints and reads aloud without any library."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from functools import cache
from html import escape

from upright.report.symbols import parts

_WEAK, _SUM, _PRODUCT, _POWER = 0, 1, 2, 3
_LINE = 38  # names on one line of an equation
_THIN = '<mspace width="0.17em"/>'


@cache
def _identifier(name: str, power: str = "") -> str:
    """``theta_ddot`` -> theta with two dots; ``b_1c`` -> b with a subscript."""
    twice = name.endswith("_ddot")
    stem, below, dot = parts(name.replace("_ddot", "_dot"))
    upright = ' mathvariant="normal"' if len(stem) > 1 else ""
    out = f"<mi{upright}>{escape(stem)}</mi>"
    if dot:
        # not as an accent: browsers without a mathematical font would draw the dots into the letter
        out = f"<mover>{out}<mo>{'¨' if twice else '˙'}</mo></mover>"
    below = f"<mtext>{escape(below)}</mtext>" if below else ""
    if below and power:
        return f"<msubsup>{out}{below}{power}</msubsup>"
    if power:
        return f"<msup>{out}{power}</msup>"
    return f"<msub>{out}{below}</msub>" if below else out


def symbol(name: str) -> str:
    """A parameter's or signal's name, to stand in a sentence or a table."""
    if not name.replace("_", "").isalnum():
        return f"<span>{escape(name)}</span>"
    return f"<math><mrow>{_identifier(name)}</mrow></math>"


class Writer:
    """Writes expressions; factors come as numbers, parameters in the plant's order, sums, functions, motion."""

    def __init__(self, parameters: Sequence[str]) -> None:
        self._order = {name: i for i, name in enumerate(parameters)}

    def aligned(self, rows: Sequence[tuple[ast.expr, ast.expr]]) -> str:
        """Equations left = right under each other, long right-hand sides broken between terms."""
        table = ""
        room = _LINE - max(_names(left) for left, _ in rows)
        for left, right in rows:
            for k, terms in enumerate(_lines(_terms(right), room)):
                head = f"<mtd>{self(left)}</mtd><mtd><mo>=</mo></mtd>" if k == 0 else "<mtd></mtd><mtd></mtd>"
                table += f"<mtr>{head}<mtd>{self._sum(terms, leading=k > 0)}</mtd></mtr>"
        return f'<math display="block" class="motion"><mtable>{table}</mtable></math>'

    def __call__(self, node: ast.expr, around: int = _WEAK) -> str:
        """Markup of an expression; `around` says how tightly its surroundings bind."""
        match node:
            case ast.Constant(value=value):
                return f"<mn>{value:g}</mn>" if isinstance(value, int | float) else f"<mi>{escape(str(value))}</mi>"
            case ast.Name(id=name):
                return _identifier(name)
            case ast.UnaryOp(operand=inner):
                return _bracket(f"<mo>−</mo>{self(inner, _PRODUCT)}", around > _SUM)
            case ast.BinOp(op=ast.Add()):
                return _bracket(self._sum(_terms(node)), around > _SUM)
            case ast.BinOp(op=ast.Mult()):
                return _bracket(self._product(node), around > _PRODUCT)
            case ast.BinOp(left=a, op=ast.Div(), right=b):
                return f"<mfrac><mrow>{self(a)}</mrow><mrow>{self(b)}</mrow></mfrac>"
            case ast.BinOp(left=a, op=ast.Pow(), right=b):
                return f"<msup><mrow>{self(a, _POWER)}</mrow><mrow>{self(b)}</mrow></msup>"
            case ast.Call(func=ast.Name(id="sqrt"), args=[inner]):
                return f"<msqrt>{self(inner)}</msqrt>"
            case ast.Call(func=ast.Name(id="abs"), args=[inner]):
                return f"<mrow><mo>|</mo>{self(inner)}<mo>|</mo></mrow>"
            case ast.Call(func=ast.Name(id=name), args=[inner]):
                return self._function(name, inner)
            case _:
                return f"<mtext>{escape(ast.unparse(node))}</mtext>"

    def _function(self, name: str, inner: ast.expr, power: str = "") -> str:
        head = f"<mi>{escape(name)}</mi>"
        head = f"<msup>{head}{power}</msup>" if power else head
        bare = isinstance(inner, ast.Name) and name != "sgn"
        body = f"{_THIN}{self(inner)}" if bare else _bracket(self(inner), True)
        return f"<mrow>{head}<mo>&#x2061;</mo>{body}</mrow>"

    def _sum(self, terms: Sequence[ast.expr], *, leading: bool = False) -> str:
        out = ""
        for i, e in enumerate(terms):
            minus, size = isinstance(e, ast.UnaryOp), e.operand if isinstance(e, ast.UnaryOp) else e
            sign = "−" if minus else "+" if i or leading else ""
            out += (f"<mo>{sign}</mo>" if sign else "") + self(size, _SUM)
        return f"<mrow>{out}</mrow>"

    def _product(self, node: ast.expr) -> str:
        powers: dict[str, tuple[ast.expr, int]] = {}
        for f in _factors(node):
            key = ast.dump(f)
            powers[key] = (f, powers.get(key, (f, 0))[1] + 1)
        ordered = sorted(powers.values(), key=lambda factor: self._rank(factor[0]))
        return f"<mo>&#x2062;</mo>{_THIN}".join(self._raised(f, n) for f, n in ordered)

    def _rank(self, e: ast.expr) -> int:
        match e:
            case ast.Constant() | ast.BinOp(op=ast.Div()):
                return -1
            case ast.Name(id=name):
                return self._order.get(name, len(self._order) + 2)
            case ast.Call(func=ast.Name(id=name)) if name != "abs":
                return len(self._order) + 1
            case ast.Call():
                return len(self._order) + 3
            case _:
                return len(self._order)

    def _raised(self, e: ast.expr, n: int) -> str:
        if n == 1:
            return self(e, _WEAK if isinstance(e, ast.Constant) else _POWER)
        power = f"<mn>{n}</mn>"
        match e:
            case ast.Name(id=name):
                return _identifier(name, power)
            case ast.Call(func=ast.Name(id="sin" | "cos" as name), args=[inner]):
                return self._function(name, inner, power)
            case _:
                return f"<msup><mrow>{self(e, _POWER)}</mrow>{power}</msup>"


def _bracket(inner: str, needed: bool) -> str:
    return f"<mrow><mo>(</mo>{inner}<mo>)</mo></mrow>" if needed else f"<mrow>{inner}</mrow>"


def _terms(node: ast.expr, sign: int = 1) -> list[ast.expr]:
    """Terms of a sum, those that add first; a negative one is a `UnaryOp`."""
    match node:
        case ast.BinOp(left=a, op=ast.Add(), right=b):
            terms = [*_terms(a, sign), *_terms(b, sign)]
        case ast.UnaryOp(operand=inner):
            terms = _terms(inner, -sign)
        case _:
            terms = [node if sign > 0 else ast.UnaryOp(ast.USub(), node)]
    return sorted(terms, key=lambda e: isinstance(e, ast.UnaryOp))


def _names(e: ast.expr) -> int:
    return sum(isinstance(n, ast.Name) for n in ast.walk(e))


def _lines(terms: Sequence[ast.expr], room: int) -> list[list[ast.expr]]:
    """Terms shared out so that no line grows too long."""
    lines: list[list[ast.expr]] = [[]]
    length = 0
    for e in terms:
        size = _names(e)
        if lines[-1] and length + size > room:
            lines.append([])
            length = 0
        lines[-1].append(e)
        length += size
    return lines


def _factors(node: ast.expr) -> list[ast.expr]:
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
        return [*_factors(node.left), *_factors(node.right)]
    return [node]
