"""The kernel's text as C: the same loop, the same events of dry friction, one function each.

The text is a small part of Python: numbers, arrays of numbers by index, loops over ranges, functions that return one
number or a tuple of them. Whole numbers become long, all others double; a name is whole if it holds nothing else.
The kernel's writer keeps to that part; a construct beyond it is refused, never written as something like it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from upright.errors import BadInput
from upright.exports.texts import filled
from upright.simulation.lowering.instructions import LARGEST_POWER

Kind = Literal["long", "double", "double *", "long *"]
Arrays = Mapping[str, tuple[Kind, tuple[int, ...]]]
"""Kind of each array argument, and what each of its indices is multiplied by."""

_OPERATORS: dict[type[ast.AST], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.BitAnd: "&",
    ast.BitOr: "|", ast.BitXor: "^", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==",
    ast.NotEq: "!=", ast.And: "&&", ast.Or: "||", ast.USub: "-", ast.UAdd: "+", ast.Not: "!",
}  # fmt: skip
_LIBRARY = {"floor", "sqrt", "exp", "sin", "cos", "tan", "log", "ldexp"}
_CONSTANTS = {"nan": "NAN", "inf": "INFINITY", "pi": "3.141592653589793"}
_KEYWORDS = {
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern", "float",
    "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed", "sizeof",
    "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while",
}  # fmt: skip


def helpers(text: str) -> str:
    """Functions of ``arithmetic.c`` that a text calls."""
    own = re.split(r"\n\n(?=static)", filled("arithmetic.c").strip())[1:]
    return "".join(f"{h}\n" for h in own if f"{h.partition('(')[0].split()[-1]}(" in text)


@dataclass
class _Known:
    """What is known of a function: kinds of its names, and what it returns; a tuple through its last argument."""

    node: ast.FunctionDef
    kinds: dict[str, Kind] = field(default_factory=dict[str, Kind])
    gives: Literal["nothing", "number", "tuple"] = "nothing"
    result: Kind = "long"

    @property
    def arguments(self) -> list[str]:
        return [a.arg for a in self.node.args.args]


def as_c(text: str, entry: str, arrays: Arrays, sizes: Mapping[str, str]) -> str:
    """Functions in C that `entry` needs, itself the last.

    Parameters
    ----------
    text : str
        Of a kernel, `simulation.kernel.compiled.source`.
    arrays : mapping
        Of the entry.
    sizes : mapping of str to str
        In C, what ``X.size`` and ``X.shape[0]`` are, by ``"X"``.

    Raises
    ------
    BadInput
        When the text holds what has no counterpart here.
    """
    functions = {n.name: _Known(n) for n in ast.parse(text).body if isinstance(n, ast.FunctionDef)}
    needed = _needed(functions, entry)
    for name in functions[entry].arguments:
        functions[entry].kinds[name] = arrays[name][0] if name in arrays else "double" if name == "_dt" else "long"
    for known in functions.values():
        returns = [n.value for n in ast.walk(known.node) if isinstance(n, ast.Return) and n.value is not None]
        if returns:
            known.gives = "tuple" if isinstance(returns[0], ast.Tuple) else "number"
    while _infer(functions, needed):
        pass
    return "\n".join(_Writer(functions[n], functions, arrays, sizes).text() for n in needed)


def _needed(functions: Mapping[str, _Known], entry: str) -> list[str]:
    """Functions by name, each after those that it calls."""
    out: list[str] = []

    def visit(name: str) -> None:
        for node in ast.walk(functions[name].node):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in functions:
                visit(node.func.id)
        if name not in out:
            out.append(name)

    visit(entry)
    return out


def _infer(functions: Mapping[str, _Known], needed: list[str]) -> bool:
    """Let names hold what they are given; whether any kind changed."""
    changed = False

    def widen(known: _Known, name: str, kind: Kind) -> None:
        nonlocal changed
        before = known.kinds.get(name)
        wanted = kind if before in (None, "long") else before
        if wanted != before:
            known.kinds[name], changed = wanted, True

    for name in needed:
        known = functions[name]
        for node in ast.walk(known.node):
            if isinstance(node, ast.Assign):
                for target in node.targets:
                    pairs = [(target, node.value)]
                    if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                        pairs = list(zip(target.elts, node.value.elts, strict=True))
                    elif isinstance(target, ast.Tuple):
                        pairs = [(t, ast.Constant(0.0)) for t in target.elts]
                    for t, value in pairs:
                        if isinstance(t, ast.Name):
                            widen(known, t.id, _kind(value, known, functions))
            elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
                widen(known, node.target.id, _kind(ast.BinOp(node.target, node.op, node.value), known, functions))
            elif isinstance(node, ast.For) and isinstance(node.target, ast.Name):
                widen(known, node.target.id, "long")
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in functions:
                called = functions[node.func.id]
                for argument, value in zip(called.arguments, node.args, strict=True):
                    widen(called, argument, _kind(value, known, functions))
            elif isinstance(node, ast.Return) and node.value is not None and known.gives == "number":
                kind = _kind(node.value, known, functions)
                if known.result == "long" and kind == "double":
                    known.result, changed = "double", True
    return changed


def _kind(node: ast.expr, known: _Known, functions: Mapping[str, _Known]) -> Kind:
    """What an expression is."""

    def of(*nodes: ast.expr) -> Kind:
        return "double" if any(_kind(n, known, functions) == "double" for n in nodes) else "long"

    match node:
        case ast.Constant(value=value):
            return "double" if isinstance(value, float) else "long"
        case ast.Name(id=name):
            return known.kinds.get(name, "double" if name in _CONSTANTS else "long")
        case ast.BinOp(left=left, op=op, right=right):
            return "double" if isinstance(op, ast.Div | ast.Pow) else of(left, right)
        case ast.UnaryOp(op=op, operand=operand):
            return "long" if isinstance(op, ast.Not) else of(operand)
        case ast.IfExp(body=body, orelse=orelse):
            return of(body, orelse)
        case ast.Call(func=ast.Name(id=name), args=args):
            if name in functions:
                return functions[name].result
            return of(*args) if name in ("abs", "min", "max") else "long" if name in ("int", "round") else "double"
        case ast.Subscript(value=ast.Name(id=name), slice=ast.Slice()):
            return known.kinds.get(name, "double *")
        case ast.Subscript(value=ast.Name(id=name)):
            return "long" if known.kinds.get(name) == "long *" else "double"
        case _:
            return "long"  # comparisons, sizes


class _Writer:
    """Writes one function."""

    def __init__(
        self, known: _Known, functions: Mapping[str, _Known], arrays: Arrays, sizes: Mapping[str, str]
    ) -> None:
        self.known, self.functions, self.arrays, self.sizes = known, functions, arrays, sizes
        self.lines: list[str] = []
        self.depth = 1
        self.temporaries = 0

    def text(self) -> str:
        known = self.known
        parameters = [_declared(known.kinds.get(a, "double"), _name(a)) for a in known.arguments]
        parameters += ["double *result_"] if known.gives == "tuple" else []
        result = known.result if known.gives == "number" else "void"
        head = f"static {result} k_{known.node.name}({', '.join(parameters)})"
        for statement in known.node.body:
            self.statement(statement)
        own = {n: k for n, k in known.kinds.items() if n not in known.arguments}
        declared = [
            f"    {kind} " + ", ".join(f"{_name(n)} = 0" for n, k in own.items() if k == kind) + ";"
            for kind in ("long", "double")
            if kind in own.values()
        ]
        read = {n.id for n in ast.walk(known.node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
        unread = [f"    (void){_name(n)};" for n in {**dict.fromkeys(known.arguments), **own} if n not in read]
        return "\n".join([head, "{", *declared, *unread, *self.lines, "}", ""])

    def add(self, line: str) -> None:
        self.lines.append("    " * self.depth + line)

    def block(self, body: list[ast.stmt]) -> None:
        self.depth += 1
        for statement in body:
            self.statement(statement)
        self.depth -= 1

    def statement(self, node: ast.stmt) -> None:
        match node:
            case ast.Assign(targets=[target], value=value):
                self.assign(target, value)
            case ast.AugAssign(target=target, op=op, value=value):
                whole = ast.copy_location(ast.BinOp(target, op, value), node)
                self.add(f"{self.value(target)} = {self.value(whole)};")
            case ast.For(target=ast.Name(id=name), iter=ast.Call(args=[_] | [_, _] as ends)):
                low, high = ("0", self.value(ends[0])) if len(ends) == 1 else (self.value(e) for e in ends)
                i = _name(name)
                self.add(f"for ({i} = {low}; {i} < {high}; {i}++) {{")
                self.block(node.body)
                self.add("}")
            case ast.While(test=test, body=body, orelse=[]):
                self.add(f"while {_bracketed(self.value(test))} {{")
                self.block(body)
                self.add("}")
            case ast.If(test=test, body=body, orelse=orelse):
                self.add(f"if {_bracketed(self.value(test))} {{")
                self.block(body)
                if orelse:
                    self.add("} else {")
                    self.block(orelse)
                self.add("}")
            case ast.Return(value=None):
                self.add("return;")
            case ast.Return(value=ast.Tuple(elts=elts)):
                for k, part in enumerate(elts):
                    self.add(f"result_[{k}] = {self.value(part)};")
                self.add("return;")
            case ast.Return(value=value) if value is not None:
                self.add(f"return {self.value(value)};")
            case ast.Expr(value=ast.Call() as call):
                self.add(f"{self.value(call)};")
            case ast.Expr(value=ast.Constant()):
                pass  # what a function says of itself
            case ast.Pass():
                self.add(";")
            case ast.Break() | ast.Continue():
                self.add(f"{type(node).__name__.lower()};")
            case _:
                raise _refusal(node)

    def assign(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Tuple):
            self.temporaries += 1
            several = f"several_{self.temporaries}"
            count = len(target.elts)
            self.add("{")
            self.depth += 1
            if isinstance(value, ast.Tuple):  # whole numbers up to 2^53 are doubles, too
                self.add(f"const double {several}[{count}] = {{{', '.join(self.value(v) for v in value.elts)}}};")
            else:
                self.add(f"double {several}[{count}];")
                self.add(f"{self.value(value)[:-1]}, {several});")
            for k, part in enumerate(target.elts):
                cast = "(long)" if _kind(part, self.known, self.functions) == "long" else ""
                self.add(f"{self.value(part)} = {cast}{several}[{k}];")
            self.depth -= 1
            self.add("}")
        elif isinstance(target, ast.Subscript) and isinstance(target.slice, ast.Slice):
            array = ast.unparse(target.value)
            self.add(f"memset({_name(array)}, 0, sizeof(double) * {self.sizes[array]});")
        else:
            self.add(f"{self.value(target)} = {self.value(value)};")

    def value(self, node: ast.expr) -> str:
        match node:
            case ast.Constant(value=bool() as value):
                return str(int(value))
            case ast.Constant(value=int() | float() as value):
                return repr(value)
            case ast.Name(id=name):
                return _name(name) if name in self.known.kinds else _CONSTANTS.get(name, _name(name))
            case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=int(n))) if 0 < n <= LARGEST_POWER:
                return f"power_d({self.value(left)}, {n})"
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return f"pow({self.value(left)}, {self.value(right)})"
            case ast.BinOp(left=left, op=op, right=right):
                if isinstance(op, ast.FloorDiv | ast.Mod):
                    return self.floored(op, left, right, _kind(node, self.known, self.functions) == "long")
                whole = isinstance(op, ast.Div) and _kind(left, self.known, self.functions) == "long"
                return f"({'(double)' * whole}{self.value(left)} {_operator(op, node)} {self.value(right)})"
            case ast.UnaryOp(op=op, operand=operand):
                return f"({_operator(op, node)}{self.value(operand)})"
            case ast.BoolOp(op=op, values=values):
                return "(" + f" {_operator(op, node)} ".join(self.value(v) for v in values) + ")"
            case ast.Compare(left=left, ops=ops, comparators=rights):
                ends = [left, *rights]
                pairs = zip(ends, ops, rights, strict=False)
                each = [f"({self.value(a)} {_operator(op, node)} {self.value(b)})" for a, op, b in pairs]
                return each[0] if len(each) == 1 else f"({' && '.join(each)})"
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return f"({self.value(test)} ? {self.value(body)} : {self.value(orelse)})"
            case ast.Call(func=ast.Name(id=name), args=args):
                return self.call(name, args, node)
            case ast.Subscript():
                return self.element(node)
            case ast.Attribute(value=ast.Name(id=name), attr="size"):
                return self.sizes[name]
            case _:
                raise _refusal(node)

    def floored(self, op: ast.operator, left: ast.expr, right: ast.expr, whole: bool) -> str:
        """Quotient towards minus infinity, or its rest; C's own go towards zero."""
        a, b = self.value(left), self.value(right)
        if isinstance(op, ast.Mod):
            return f"rest_{'l' if whole else 'd'}({a}, {b})"
        return f"quotient_l({a}, {b})" if whole else f"floor((double){a} / {b})"

    def call(self, name: str, args: list[ast.expr], node: ast.expr) -> str:
        values = ", ".join(self.value(a) for a in args)
        if name in self.functions:
            return f"k_{name}({values})"
        if name in _LIBRARY:
            return f"{name}({'(double)' if name != 'ldexp' and len(args) == 1 else ''}{values})"
        if name == "frexp":
            return f"parted_d({values})"
        whole = _kind(node, self.known, self.functions) == "long"
        if name == "abs":
            return f"labs({values})" if whole else f"fabs({values})"
        if name in ("min", "max"):
            return f"{'least' if name == 'min' else 'most'}_{'l' if whole else 'd'}({values})"
        if name == "round" and len(args) == 1:
            return f"round_l({values})"
        if name in ("int", "float"):
            return f"({'long' if name == 'int' else 'double'})({values})"
        raise _refusal(node)

    def element(self, node: ast.Subscript) -> str:
        if isinstance(node.value, ast.Attribute):  # X.shape[0]
            return self.sizes[ast.unparse(node.value.value)]
        array = ast.unparse(node.value)
        if isinstance(node.slice, ast.Slice):
            assert node.slice.lower is not None
            return f"({_name(array)} + {self.value(node.slice.lower)})"
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        by = self.arrays[array][1] if array in self.arrays and len(indices) > 1 else (1,)
        at = " + ".join(
            self.value(i) if step == 1 else f"{step} * {self.value(i)}" for i, step in zip(indices, by, strict=True)
        )
        return f"{_name(array)}[{at}]"


def _operator(op: ast.AST, node: ast.AST) -> str:
    if type(op) not in _OPERATORS:
        raise _refusal(node)
    return _OPERATORS[type(op)]


def _refusal(node: ast.AST) -> BadInput:
    return BadInput(
        f"the kernel of this rig contains '{ast.unparse(node)[:80]}', which cannot be translated to C; the target "
        "gymnasium runs the kernel itself."
    )


def _bracketed(condition: str) -> str:
    """In one pair of brackets: compilers take two for an assignment that was meant."""
    depth = 0
    for k, c in enumerate(condition):
        depth += (c == "(") - (c == ")")
        if not depth:
            return condition if k == len(condition) - 1 and k else f"({condition})"
    return f"({condition})"


def _declared(kind: Kind, name: str) -> str:
    return f"{kind}{name}" if kind.endswith("*") else f"{kind} {name}"


def _name(name: str) -> str:
    """A name that C does not keep for itself."""
    plain = f"{name.lstrip('_') or 'turn'}_" if name.startswith("_") else name
    return f"{plain}_" if plain in _KEYWORDS else plain
