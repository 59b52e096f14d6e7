"""Equations of motion that a fit used, as MathML, which a browser draws and reads aloud without any library.

The plant's derived text with its intermediate names put back and terms that are zero left out.
"""

from __future__ import annotations

import ast
from collections.abc import Collection, Sequence
from html import escape

from upright.physics import Derived, Plant
from upright.physics.combination import spelled
from upright.report.symbols import identifier

_ZERO = ast.Constant(0)
_WEAK, _SUM, _PRODUCT, _POWER = 0, 1, 2, 3
_LINE = 38  # names on one line of an equation
_THIN = '<mspace width="0.17em"/>'
_SPACE = 2 * _THIN
_RELATIONS: dict[type[ast.cmpop], str] = {ast.Lt: "&lt;", ast.LtE: "≤", ast.Gt: "&gt;", ast.GtE: "≥", ast.Eq: "="}


def equations(plant: type[Plant], *, zero: Collection[str] = ()) -> str:
    """Equations of motion ``M(q) a = f`` as MathML, one row per coordinate.

    Parameters
    ----------
    zero : collection of str
        Parameters that are zero in this fit; their terms are left out.
    """
    derived = plant.derived(without=frozenset(zero))
    inner, writer = _Inner(derived, frozenset(zero)), MathWriter(derived.parameters)
    return writer.aligned([_row(derived, i, inner, frozenset(zero)) for i in range(len(derived.coordinates))])


def _row(derived: Derived, i: int, inner: _Inner, zero: frozenset[str]) -> tuple[ast.expr, ast.expr]:
    n = len(derived.coordinates)
    left: ast.expr = _ZERO
    for j, c in enumerate(derived.coordinates):
        a, b = sorted((i, j))
        entry = inner.of(derived.mass[a * n - a * (a - 1) // 2 + b - a])
        left = _add(left, _multiply(entry, ast.Name(f"{c}_ddot")))
    right = inner.of(derived.force[i])
    for joint in derived.joints:
        v, factor = spelled(joint.direction, [f"{c}_dot" for c in derived.coordinates]), joint.direction[i]
        if not factor:
            continue
        times = "-" if factor == 1 else "" if factor == -1 else f"{-factor!r}*"
        if joint.coulomb and joint.coulomb not in zero:
            right = _add(right, inner.of(f"{times}{joint.coulomb}*sgn({v})"))
        if joint.quadratic and joint.quadratic not in zero:
            right = _add(right, inner.of(f"{times}{joint.quadratic}*{v}*abs({v})"))
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


class MathWriter:
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
                return identifier(name)
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
            case ast.IfExp(test=test, body=body, orelse=orelse):
                words = f"{self(body)}{_word('if')}{self(test)}{_word('else')}{self(orelse)}"
                return _bracket(words, around > _WEAK)
            case ast.Compare(left=a, ops=[op], comparators=[b]) if type(op) in _RELATIONS:
                return f"<mrow>{self(a)}<mo>{_RELATIONS[type(op)]}</mo>{self(b)}</mrow>"
            case ast.BoolOp(op=op, values=values):
                word = _word("and" if isinstance(op, ast.And) else "or")
                return _bracket(word.join(self(v) for v in values), around > _WEAK)
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
                return identifier(name, power)
            case ast.Call(func=ast.Name(id="sin" | "cos" as name), args=[inner]):
                return self._function(name, inner, power)
            case _:
                return f"<msup><mrow>{self(e, _POWER)}</mrow>{power}</msup>"


def _word(word: str) -> str:
    return f"{_SPACE}<mtext>{word}</mtext>{_SPACE}"


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
