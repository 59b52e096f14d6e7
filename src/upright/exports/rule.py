"""A rule's text with the functions that it calls: in C by the kernel's translation, in Python as it is."""

from __future__ import annotations

import ast
from collections.abc import Mapping

from upright.errors import BadInput
from upright.exports.controller import SampledController
from upright.exports.fmu.translation import Kind, as_c, helpers
from upright.laws import Rule
from upright.laws.rule import text_of
from upright.simulation.kernel.elementary import definitions
from upright.simulation.lowering.instructions import LARGEST_POWER


def rule_numbers(made: SampledController) -> tuple[list[float], list[float]]:
    """Its parameters, and what it remembers at first."""
    parameters, initial = (values[:, 0].tolist() for values in made.law.by_lane(1).values())
    return parameters, initial


def in_c(made: SampledController) -> str:
    """Functions in C, the last ``k_rule(t, y, r, z, p, result)``: commands, then what it remembers next."""
    rule = made.law
    assert isinstance(rule, Rule)  # asked before
    text = text_of(rule.function)
    tree = ast.parse(text)
    function = tree.body[0]
    assert isinstance(function, ast.FunctionDef)  # as `text_of` made sure
    time, *tuples = (a.arg for a in function.args.args)
    sizes = (len(made.readings), len(made.references), made.memories, len(rule_numbers(made)[0]))
    plain = ast.fix_missing_locations(_Plain(dict(zip(tuples, sizes, strict=True))).visit(tree))
    arrays: dict[str, tuple[Kind, tuple[int, ...]]] = dict.fromkeys(tuples, ("double *", (1,)))
    written = as_c(f"{definitions(text)}\n{ast.unparse(plain)}", "rule", {time: ("double", ()), **arrays}, {})
    return helpers(written) + written


_OWN = """
def ldexp(x, n):
    return x * 2.0 ** n

def power(x, n):
    out = x if n & 1 else 1.0
    while n > 1:
        n, x = n >> 1, x * x
        out = out * x if n & 1 else out
    return out
"""
"""As the kernel has them: the one grows to infinity where Python's would raise, the other multiplies."""


class _Powers(ast.NodeTransformer):
    """Small whole powers as products."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        match node:
            case ast.BinOp(left=x, op=ast.Pow(), right=ast.Constant(value=int(n))) if 0 < n <= LARGEST_POWER:
                return ast.Call(ast.Name("power", ast.Load()), [x, ast.Constant(n)], [])
            case _:
                return node


def in_python(made: SampledController) -> str:
    """The function as it was given, called ``rule``, after those that it calls."""
    rule = made.law
    assert isinstance(rule, Rule)  # asked before
    text = text_of(rule.function)
    tree = _Powers().visit(ast.parse(f"{_OWN}\n{definitions(text)}\n{text}"))
    for node in tree.body:
        assert isinstance(node, ast.FunctionDef)  # the texts hold nothing else
        node.decorator_list = []
    return "\n\n\n".join(ast.unparse(node) for node in ast.fix_missing_locations(tree).body)


class _Plain(ast.NodeTransformer):
    """Tuples of known sizes by their numbers, and one tuple returned."""

    def __init__(self, sizes: Mapping[str, int]) -> None:
        self._sizes, self._loops = sizes, 0

    def _size(self, node: ast.expr) -> int | None:
        return self._sizes.get(node.id) if isinstance(node, ast.Name) else None

    def _items(self, node: ast.expr) -> list[ast.expr]:
        """Items of a tuple that is written out, or that is given."""
        if isinstance(node, ast.Tuple):
            return [self.visit(x) for x in node.elts]
        size = self._size(node)
        if size is None:
            raise _refusal(node)
        return [ast.Subscript(node, ast.Constant(k), ast.Load()) for k in range(size)]

    def visit_Return(self, node: ast.Return) -> ast.Return:
        if not isinstance(node.value, ast.Tuple) or len(node.value.elts) != 2:
            raise _refusal(node)
        commands, memory = map(self._items, node.value.elts)
        return ast.Return(ast.Tuple([*commands, *memory], ast.Load()))

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        size = self._size(node.value)
        if size is None:
            raise _refusal(node)
        match node.slice:
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int(back))):
                return ast.Subscript(node.value, ast.Constant(size - back), node.ctx)
            case _:
                return ast.Subscript(node.value, self.visit(node.slice), node.ctx)

    def visit_Call(self, node: ast.Call) -> ast.expr:
        match node:
            case ast.Call(func=ast.Name(id="len"), args=[argument]) if self._size(argument) is not None:
                return ast.Constant(self._size(argument))
            case ast.Call(func=ast.Name(id="min" | "max") as function, args=[argument]):
                return self._least(function, self._items(argument))
            case ast.Call(func=ast.Name(id="min" | "max") as function, args=[_, _, *_] as argument):
                return self._least(function, [self.visit(x) for x in argument])
            case _:
                return self.generic_visit(node)  # type: ignore[return-value]

    def _least(self, function: ast.Name, items: list[ast.expr]) -> ast.expr:
        """Two at a time, as C has them."""
        first, *others = items
        for x in others:
            first = ast.Call(function, [first, x], [])
        return first

    def visit_Assign(self, node: ast.Assign) -> list[ast.stmt]:
        made: list[ast.stmt] = []
        for target in node.targets:
            value = node.value
            if isinstance(target, ast.Tuple):
                value = ast.Tuple(self._items(value), ast.Load())
                made.append(ast.Assign([target], value))
            else:
                made.append(ast.Assign([target], self.visit(value)))
        return made

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt:
        return ast.Assign([node.target], self.visit(node.value)) if node.value else ast.Pass()

    def visit_For(self, node: ast.For) -> list[ast.stmt]:
        """By a counter of its own, to an end that is computed once."""
        self._loops += 1
        counter, end = f"turn_{self._loops}", f"turns_{self._loops}"
        first: ast.expr = ast.Constant(0)
        item: ast.expr = ast.Name(counter, ast.Load())
        match node.iter:
            case ast.Call(func=ast.Name(id="range"), args=[last]):
                pass
            case ast.Call(func=ast.Name(id="range"), args=[first, last]):
                pass
            case ast.Name() if self._size(node.iter) is not None:
                last = ast.Constant(self._size(node.iter))
                item = ast.Subscript(node.iter, item, ast.Load())
            case _:
                raise _refusal(node)
        if not isinstance(node.target, ast.Name) or node.orelse:
            raise _refusal(node)
        count = ast.Call(ast.Name("range", ast.Load()), [self.visit(first), ast.Name(end, ast.Load())], [])
        body: list[ast.stmt] = [ast.Assign([node.target], item)]
        for statement in node.body:
            made = self.visit(statement)
            body += made if isinstance(made, list) else [made]
        return [
            ast.Assign([ast.Name(end, ast.Store())], self.visit(last)),
            ast.For(ast.Name(counter, ast.Store()), count, body, []),
        ]


def _refusal(node: ast.AST) -> BadInput:
    return BadInput(
        f"the rule contains '{ast.unparse(node).splitlines()[0][:80]}', which cannot be translated to C. Use numbers, "
        "the given tuples by index, if, for and while, and return (commands,), (memory,); or export it to python."
    )
