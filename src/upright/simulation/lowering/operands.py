"""Types and operands of LLVM's text: numbers (one, or one in each lane), tuples, arrays, places in memory."""

from __future__ import annotations

import ast
import struct
from dataclasses import dataclass
from typing import Literal

Kind = Literal["float", "int", "bool"]

_ORDER: tuple[Kind, ...] = ("bool", "int", "float")
_LLVM = {"float": "double", "int": "i64", "bool": "i1"}


class Unsupported(Exception):
    """What the text of a kernel may not use, with where it stands.

    `function` and `line`, counted from the function's own first line, are filled in while the function is left.
    """

    def __init__(self, what: str) -> None:
        super().__init__(what)
        self.what = what
        self.function = ""
        self.line = 0


@dataclass(frozen=True, slots=True)
class Number:
    """Type of a number; `lanes` when every lane has its own."""

    kind: Kind
    lanes: bool = False


@dataclass(frozen=True, slots=True)
class TupleOf:
    """Type of a tuple."""

    items: tuple[Type, ...]


@dataclass(frozen=True, slots=True)
class ArrayOf:
    """Type of a contiguous array, row by row; with 0 axes a bare pointer whose sizes nobody asks for."""

    axes: int
    kind: Kind = "float"


Type = Number | TupleOf | ArrayOf

FLOAT, INT, BOOL = Number("float"), Number("int"), Number("bool")
FLOATS, INTS, BOOLS = Number("float", True), Number("int", True), Number("bool", True)


@dataclass(slots=True)
class Value:
    """A number.

    `text` is what LLVM calls it. A whole number that is known has it as `const`; one that is `first` plus the lane's
    number has `first`, and no text until somebody needs it as a vector.
    """

    type: Number
    text: str
    const: int | None = None
    first: Value | None = None


@dataclass(slots=True)
class Group:
    """A tuple."""

    items: list[Value | Group]

    @property
    def type(self) -> TupleOf:
        """Types of its items."""
        return TupleOf(tuple(x.type for x in self.items))


@dataclass(slots=True)
class Array:
    """Where an array lies, its sizes, and the alignment [bytes] that every 64th of its elements has."""

    type: ArrayOf
    pointer: str
    shape: list[Value]
    aligned: int = 8


@dataclass(slots=True)
class Slot:
    """A name's place in memory."""

    type: Number | TupleOf
    pointer: str


Operand = Value | Group | Array


def whole(x: int) -> Value:
    """A whole number that is known."""
    if not -(2**63) <= x < 2**63:
        raise Unsupported(f"{x} is no whole number of 64 bits")
    return Value(INT, str(x), const=x)


def truth(x: bool) -> Value:
    """A truth value that is known."""
    return Value(BOOL, "true" if x else "false", const=int(x))


def real(x: float) -> Value:
    """A float that is known, to the last bit."""
    return Value(FLOAT, "0x" + struct.pack(">d", x).hex().upper())


def known_real(v: Value) -> float:
    """The float behind a text that `real` wrote."""
    return struct.unpack(">d", bytes.fromhex(v.text[2:]))[0]


def llvm(t: Type, lanes: int) -> str:
    """LLVM's name of a type, for so many lanes in a vector."""
    if isinstance(t, TupleOf):
        return "{" + ", ".join([llvm(x, lanes) for x in t.items]) + "}"
    if isinstance(t, ArrayOf):
        return "ptr"
    return f"<{lanes} x {_LLVM[t.kind]}>" if t.lanes else _LLVM[t.kind]


def wider(a: Type, b: Type, what: str = "") -> Type:
    """The type that holds both.

    Raises
    ------
    Unsupported
        When there is none.
    """
    if a == b:
        return a
    if isinstance(a, TupleOf) and isinstance(b, TupleOf) and len(a.items) == len(b.items):
        return TupleOf(tuple(wider(x, y, what) for x, y in zip(a.items, b.items, strict=True)))
    if not isinstance(a, Number) or not isinstance(b, Number):
        raise Unsupported(f"{what or 'this'} is a tuple of one length in one place and something else in another")
    return Number(_ORDER[max(_ORDER.index(a.kind), _ORDER.index(b.kind))], a.lanes or b.lanes)


def has_lanes(t: Type) -> bool:
    """Whether every lane has its own."""
    return any(has_lanes(x) for x in t.items) if isinstance(t, TupleOf) else isinstance(t, Number) and t.lanes


def line_of(node: ast.AST) -> int:
    """Line a node of the text stands in, 0 when it has none."""
    return int(getattr(node, "lineno", 0))
