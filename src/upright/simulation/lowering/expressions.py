"""Expressions of the text as instructions."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from typing import Protocol, cast

from upright.simulation.lowering.instructions import Crooked, Instructions, Operator, Relation
from upright.simulation.lowering.operands import (
    BOOL,
    FLOAT,
    FLOATS,
    INT,
    INTS,
    Array,
    ArrayOf,
    Group,
    Number,
    Operand,
    Slot,
    TupleOf,
    Type,
    Unsupported,
    Value,
    has_lanes,
    real,
    truth,
    whole,
    wider,
)

_OPERATORS: dict[type[ast.operator], Operator] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%", ast.Pow: "**",
    ast.BitAnd: "&", ast.BitOr: "|", ast.BitXor: "^", ast.LShift: "<<", ast.RShift: ">>",
}  # fmt: skip
_RELATIONS: dict[type[ast.cmpop], Relation] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
_CONSTANTS = {"nan": math.nan, "inf": math.inf, "pi": math.pi}
_INTRINSICS = ("sin", "cos", "exp", "sqrt", "floor")
_BRANCHES = ast.For | ast.While | ast.If
_COSTLY = ast.Subscript | ast.Call | ast.IfExp | ast.BoolOp


def is_straight(node: ast.AST) -> bool:
    """Whether a function or loop body runs from top to bottom."""
    return not any(isinstance(x, _BRANCHES) for x in ast.walk(node))


class Callees(Protocol):
    """The functions that a text may call: its own."""

    def defined(self, name: str) -> ast.FunctionDef | None:
        """The function of that name."""
        ...

    def separate(self, name: str) -> bool:
        """Whether it is compiled by itself and called by its address."""
        ...

    def instance(self, name: str, types: tuple[Type, ...]) -> tuple[str, Number | TupleOf | None]:
        """Its symbol for these types of arguments, and the type of its result."""
        ...


class Expressions:
    """Expressions of one function, among the names it has so far."""

    def __init__(self, write: Instructions, callees: Callees) -> None:
        self.write, self.callees = write, callees
        self.names: dict[str, Operand | Slot] = {}
        self.in_lane: dict[str, Operand] | None = None
        """Names of the loop over lanes that is being written as vector instructions."""

    def read(self, name: str) -> Operand:
        """What a name stands for."""
        if self.in_lane is not None and name in self.in_lane:
            return self.in_lane[name]
        operand = self.names.get(name)
        if isinstance(operand, Slot):
            return self.write.fetch(operand)
        if operand is not None:
            return operand
        if name in _CONSTANTS:
            return real(_CONSTANTS[name])
        raise Unsupported(f"'{name}' is not known where it is used")

    def value(self, node: ast.expr) -> Operand:
        """An expression's value."""
        how: Callable[[ast.expr], Operand] | None = getattr(self, f"_{type(node).__name__}", None)
        if how is None:
            raise Unsupported(f"'{ast.unparse(node)}' is more than numbers, tuples of numbers and their arithmetic")
        return how(node)

    def number(self, node: ast.expr) -> Value:
        """An expression's value, which must be a number."""
        return self.write.number(self.value(node))

    def _Constant(self, node: ast.Constant) -> Operand:
        v = node.value
        if isinstance(v, bool):
            return truth(v)
        if isinstance(v, int):
            return whole(v)
        if isinstance(v, float):
            return real(v)
        raise Unsupported(f"{ast.unparse(node)} is no number")

    def _Name(self, node: ast.Name) -> Operand:
        return self.read(node.id)

    def _Tuple(self, node: ast.Tuple) -> Operand:
        items = [self.value(x) for x in node.elts]
        if any(isinstance(x, Array) for x in items):
            raise Unsupported("an array cannot be part of a tuple")
        return Group(cast("list[Value | Group]", items))

    def _Attribute(self, node: ast.Attribute) -> Operand:
        a = self.value(node.value)
        if isinstance(a, Array) and node.attr == "shape":
            return Group(list[Value | Group](a.shape))
        if isinstance(a, Array) and node.attr == "size" and len(a.shape) == 1:
            return a.shape[0]
        raise Unsupported(f"'{ast.unparse(node)}' is not known")

    def _Subscript(self, node: ast.Subscript) -> Operand:
        a = self.value(node.value)
        if isinstance(a, Group):
            return self._item(a, self.number(node.slice))
        array, i = self.place(node, a)
        return self.write.load(array, i)

    def _item(self, a: Group, i: Value) -> Operand:
        n = len(a.items)
        if i.const is not None:
            if not -n <= i.const < n:
                raise Unsupported(f"number {i.const} is read from a tuple of {n}")
            return a.items[i.const]
        if i.type.kind == "float" or not n:
            raise Unsupported("an item of a tuple is read at an index that is no whole number")
        out = a.items[0]
        for k, x in enumerate(a.items[1:], 1):
            here = [self.write.compare("==", i, whole(place)) for place in (k, k - n)]
            out = self.write.choose(self.write.binary_number("|", *here), x, out)
        return out

    def place(self, node: ast.Subscript, a: Operand) -> tuple[Array, Value]:
        """An array's element, counted through all axes; relative to the first for a slice that begins there."""
        if not isinstance(a, Array):
            raise Unsupported(f"'{ast.unparse(node.value)}' is no array")
        index = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        at: Value | None = None
        for k, x in enumerate(index):
            i = self.number(x)
            if i.type.kind != "int":
                i = self.write.number(self.write.convert(i, INTS if i.type.lanes else INT))
            if at is not None:
                at = self.write.binary_number("*", at, a.shape[k])
                i = self.write.binary_number("+", at, i)
            at = i
        assert at is not None
        return a, at

    def _UnaryOp(self, node: ast.UnaryOp) -> Operand:
        v = self.value(node.operand)
        if isinstance(node.op, ast.Not):
            return self.write.opposite(v)
        if isinstance(node.op, ast.USub):
            return self.write.negative(v)
        if isinstance(node.op, ast.UAdd):
            return self.write.number(v)
        raise Unsupported(f"'{ast.unparse(node)}' is not known")

    def _BinOp(self, node: ast.BinOp) -> Operand:
        return self.join(node.op, self.value(node.left), self.value(node.right))

    def join(self, op: ast.operator, a: Operand, b: Operand) -> Operand:
        """Two operands joined by an operator of the text."""
        known = _OPERATORS.get(type(op))
        if known is None:
            raise Unsupported("matrices are not known; write their products out")
        return self.write.binary(known, a, b)

    def _Compare(self, node: ast.Compare) -> Operand:
        left, out = self.value(node.left), None
        for op, after in zip(node.ops, node.comparators, strict=True):
            relation = _RELATIONS.get(type(op))
            if relation is None:
                raise Unsupported(f"'{ast.unparse(node)}' compares in a way that numbers do not have")
            right = self.value(after)
            here = self.write.compare(relation, left, right)
            out = here if out is None else self.write.binary_number("&", out, here)
            left = right
        assert out is not None
        return out

    def _BoolOp(self, node: ast.BoolOp) -> Operand:
        w = self.write
        out = w.condition(self.value(node.values[0]))
        both = isinstance(node.op, ast.And)
        for x in node.values[1:]:
            if out.const is not None:
                if bool(out.const) != both:
                    return out
                out = w.condition(self.value(x))
            elif out.type.lanes or _is_cheap(x):
                out = w.binary_number("&" if both else "|", out, w.condition(self.value(x)))
            else:
                out = self._second(out, x, both)
        return out

    def _second(self, first: Value, x: ast.expr, both: bool) -> Value:
        """The second of two conditions, computed only where the first leaves it open."""
        w = self.write
        more, end = w.label("more"), w.label("end")
        before = w.block
        w.fork(first, *((more, end) if both else (end, more)))
        w.start(more)
        second = w.condition(self.value(x))
        after = w.block
        w.jump(end)
        w.start(end)
        return w.emit(BOOL, f"phi i1 [ {'false' if both else 'true'}, %{before} ], [ {second.text}, %{after} ]")

    def _IfExp(self, node: ast.IfExp) -> Operand:
        w = self.write
        c = w.condition(self.value(node.test))
        if c.const is not None:
            return self.value(node.body if c.const else node.orelse)
        if c.type.lanes or (_is_cheap(node.body) and _is_cheap(node.orelse)):
            return w.choose(c, self.value(node.body), self.value(node.orelse))
        yes, no, end = w.label("yes"), w.label("no"), w.label("end")
        w.fork(c, yes, no)
        w.start(yes)
        a = self.value(node.body)
        left, mark = w.block, len(w.lines)
        w.start(no)
        b = self.value(node.orelse)
        t = cast("Number | TupleOf", wider(a.type, b.type))
        second = w.packed(cast("Value | Group", w.convert(b, t)))
        right = w.block
        w.jump(end)
        # the first side is converted where it ended, now that the other's type is known
        tail = w.lines[mark:]
        del w.lines[mark:]
        w.ended = False
        first = w.packed(cast("Value | Group", w.convert(a, t)))
        w.jump(end)
        w.lines += tail
        w.start(end)
        name = w.named(t)
        return w.unpacked(w.result(f"phi {name} [ {first}, %{left} ], [ {second}, %{right} ]"), t)

    def _Call(self, node: ast.Call) -> Operand:
        if not isinstance(node.func, ast.Name) or node.keywords or any(isinstance(a, ast.Starred) for a in node.args):
            raise Unsupported(f"'{ast.unparse(node)}' is not known; functions are called by name, without keywords")
        name = node.func.id
        if self.callees.defined(name) is not None:
            out = self.called(name, node.args)
            if out is None:
                raise Unsupported(f"'{name}' returns nothing")
            return out
        match name, node.args:
            case "ldexp", [x, ast.Call(func=ast.Name(id="int"), args=[power], keywords=[])]:
                return self.write.scaled_by_whole(self.value(x), self.value(power))
            case _:
                return self._built_in(name, [self.value(a) for a in node.args])

    def _built_in(self, name: str, args: list[Operand]) -> Operand:
        w = self.write
        if name in ("min", "max"):
            values = list[Operand](args[0].items) if len(args) == 1 and isinstance(args[0], Group) else args
            if not values:
                raise Unsupported(f"{name} of nothing")
            return w.least("<" if name == "min" else ">", values)
        if name == "len" and len(args) == 1 and isinstance(args[0], Group):
            return whole(len(args[0].items))
        if name == "ldexp" and len(args) == 2:
            return w.scaled(args[0], args[1])
        if name == "frexp" and len(args) == 1:
            return w.parted(args[0])
        if name == "round" and len(args) == 2:
            raise Unsupported("round takes one number here")
        if len(args) != 1:
            raise Unsupported(f"{name} with {len(args)} arguments is not known")
        return self._of_one(name, w.number(w.vector(args[0])))

    def _of_one(self, name: str, v: Value) -> Operand:
        w, wide = self.write, v.type.lanes
        if name == "abs":
            return w.absolute(v)
        if name == "float":
            return w.convert(v, FLOATS if wide else FLOAT)
        if name == "int":
            return w.convert(v, INTS if wide else INT)
        if name == "bool":
            return w.condition(v)
        if name == "round":
            return w.convert(w.intrinsic("rint", v), INT)
        if name in _INTRINSICS:
            return w.intrinsic(name, v)
        if name == "tan":
            return w.library(name, v)
        raise Unsupported(f"'{name}' is not known")

    def called(self, name: str, nodes: list[ast.expr]) -> Value | Group | None:
        """A function of the text, or the one behind the address in ``_name`` where it is compiled by itself."""
        w = self.write
        separate = self.callees.separate(name)
        args = [self._tail(x) if isinstance(x, ast.Subscript) and isinstance(x.slice, ast.Slice) else
                w.vector(self.value(x)) for x in nodes]  # fmt: skip
        typed: list[str] = []
        for a in args:
            if isinstance(a, Array):
                typed += [f"ptr {a.pointer}", *(f"i64 {n.text}" for n in a.shape[: a.type.axes])]
            else:
                typed.append(f"{w.named(a.type)} {w.packed(a)}")
        if separate:
            address = w.number(self.read(f"_{name}"))
            pointer = w.result(f"inttoptr i64 {address.text} to ptr")
            w.do(f"call void {pointer}({', '.join(typed)})")
            return None
        node = self.callees.defined(name)
        assert node is not None  # asked by who calls
        if any(has_lanes(a.type) for a in args) and not is_straight(node):
            raise Crooked
        symbol, result = self.callees.instance(name, tuple(a.type for a in args))
        call = f"@{symbol}({', '.join(typed)})"
        if result is None:
            w.do(f"call void {call}")
            return None
        return w.unpacked(w.result(f"call {w.named(result)} {call}"), result)

    def _tail(self, node: ast.Subscript) -> Array:
        """An array from one of its elements on, as a bare pointer."""
        cut = cast("ast.Slice", node.slice)
        a = self.value(node.value)
        if not isinstance(a, Array) or cut.upper is not None or cut.step is not None or cut.lower is None:
            raise Unsupported(f"'{ast.unparse(node)}' is not known; an array is handed on from one element to its end")
        return Array(ArrayOf(0, a.type.kind), self.write.element(a, self.number(cut.lower)), [])


def _is_cheap(node: ast.expr) -> bool:
    """Whether something may be computed before it is known to be needed."""
    return not any(isinstance(x, _COSTLY) for x in ast.walk(node))
