"""Instructions of one function in LLVM's text: arithmetic, comparisons, conversions, memory, jumps.

Python's meaning is kept: whole numbers divide towards minus infinity, `min` and `max` return their first argument
unless another is better. Floats divide by zero as NumPy's do, and whole numbers have 64 bits and wrap.
"""

from __future__ import annotations

from typing import Literal, cast

from upright.simulation.lowering.operands import (
    BOOL,
    BOOLS,
    FLOAT,
    FLOATS,
    INT,
    INTS,
    Array,
    Group,
    Kind,
    Number,
    Operand,
    Slot,
    TupleOf,
    Type,
    Unsupported,
    Value,
    known_real,
    llvm,
    real,
    truth,
    whole,
    wider,
)

Operator = Literal["+", "-", "*", "/", "//", "%", "**", "&", "|", "^", "<<", ">>"]
Relation = Literal["<", "<=", ">", ">=", "==", "!="]

_FLOATS = {"+": "fadd", "-": "fsub", "*": "fmul", "/": "fdiv"}
_INTS = {"+": "add nsw", "-": "sub nsw", "*": "mul nsw"}
_BITS = {"&": "and", "|": "or", "^": "xor", "<<": "shl", ">>": "ashr"}
_ORDERED = {"<": "olt", "<=": "ole", ">": "ogt", ">=": "oge", "==": "oeq", "!=": "une"}
_SIGNED = {"<": "slt", "<=": "sle", ">": "sgt", ">=": "sge", "==": "eq", "!=": "ne"}
_CONVERSIONS: dict[tuple[Kind, Kind], str] = {
    ("int", "float"): "sitofp",
    ("bool", "int"): "zext",
    ("bool", "float"): "uitofp",
    ("float", "int"): "fptosi",
}
_IN_VECTORS = ("floor", "fabs", "sqrt", "trunc")
LARGEST_POWER = 16
"""Up to this whole exponent powers are products."""


class Crooked(Exception):
    """A loop over lanes is no straight line, and stays a loop."""


class Instructions:
    """Writes one function; `lanes` are those of a vector, `flags` what floats may be rearranged to."""

    def __init__(self, lanes: int, flags: str, declared: dict[str, str]) -> None:
        self.lanes, self.flags, self._declared = lanes, flags, declared
        self.lines: list[str] = []
        self.slots: list[str] = []
        self.block, self.ended = "start", False
        self._count = 0

    # -- writing and jumping --------------------------------------------------------------------------------------

    def mark(self) -> tuple[int, int, int, str]:
        """Where the text ends now, for `back_to`."""
        return len(self.lines), len(self.slots), self._count, self.block

    def back_to(self, mark: tuple[int, int, int, str]) -> None:
        """Forget what was written since."""
        lines, slots, self._count, self.block = mark
        del self.lines[lines:], self.slots[slots:]

    def do(self, text: str) -> None:
        """An instruction without a result."""
        self.lines.append("  " + text)

    def result(self, text: str) -> str:
        """An instruction's result, by LLVM's name of it."""
        name = f"%x{self._count}"
        self._count += 1
        self.lines.append(f"  {name} = {text}")
        return name

    def emit(self, t: Number, text: str) -> Value:
        """An instruction with its result."""
        return Value(t, self.result(text))

    def named(self, t: Type) -> str:
        """LLVM's name of a type here."""
        return llvm(t, self.lanes)

    def label(self, hint: str) -> str:
        """A label that no other block has."""
        self._count += 1
        return f"{hint}{self._count}"

    def start(self, label: str) -> None:
        """Begin a block."""
        self.lines.append(f"{label}:")
        self.block, self.ended = label, False

    def jump(self, label: str) -> None:
        """Go on elsewhere, unless the block has ended."""
        if not self.ended:
            self.do(f"br label %{label}")
            self.ended = True

    def fork(self, condition: Value, yes: str, no: str) -> None:
        """Go on in one of two blocks."""
        self.do(f"br i1 {condition.text}, label %{yes}, label %{no}")
        self.ended = True

    def unreachable(self) -> None:
        """End a block that nothing leads to."""
        self.do("unreachable")
        self.ended = True

    def declare(self, name: str, result: str, arguments: str) -> None:
        """Make a function of LLVM's or of the C library known."""
        self._declared.setdefault(name, f"declare {result} @{name}({arguments})")

    # -- memory ---------------------------------------------------------------------------------------------------

    def slot(self, t: Number | TupleOf) -> Slot:
        """Room for a name; NaN or 0 until something is stored, so that nothing depends on chance."""
        pointer = f"%m{self._count}"
        self._count += 1
        self.slots.append(f"  {pointer} = alloca {self.named(t)}")
        if isinstance(t, Number) and not t.lanes:
            empty = real(float("nan")).text if t.kind == "float" else "0"
            self.slots.append(f"  store {self.named(t)} {empty}, ptr {pointer}")
        return Slot(t, pointer)

    def fetch(self, slot: Slot) -> Value | Group:
        """What a name holds."""
        return self.unpacked(self.result(f"load {self.named(slot.type)}, ptr {slot.pointer}"), slot.type)

    def keep(self, v: Value | Group, slot: Slot) -> None:
        """Let a name hold something, converted to its type."""
        v = cast("Value | Group", self.convert(v, slot.type))
        self.do(f"store {self.named(slot.type)} {self.packed(v)}, ptr {slot.pointer}")

    def packed(self, v: Value | Group) -> str:
        """A tuple as one operand."""
        if isinstance(v, Value):
            return v.text
        out, t = "poison", self.named(v.type)
        for k, x in enumerate(v.items):
            out = self.result(f"insertvalue {t} {out}, {self.named(x.type)} {self.packed(x)}, {k}")
        return out

    def unpacked(self, text: str, t: Number | TupleOf) -> Value | Group:
        """The parts of what `packed` made."""
        if isinstance(t, Number):
            return Value(t, text)
        items: list[Value | Group] = []
        for k, x in enumerate(t.items):
            assert not isinstance(x, Array)
            part = self.result(f"extractvalue {self.named(t)} {text}, {k}")
            items.append(self.unpacked(part, cast("Number | TupleOf", x)))
        return Group(items)

    def element(self, a: Array, i: Value) -> str:
        """Pointer to an element, or to the first of a run of lanes."""
        at = i.first or i
        return self.result(f"getelementptr inbounds {self.named(Number(a.type.kind))}, ptr {a.pointer}, i64 {at.text}")

    def load(self, a: Array, i: Value) -> Value:
        """Element `i`, counted through all axes: one, a run of lanes, or another one for each lane."""
        kind = a.type.kind
        if i.first is not None:
            t, align = Number(kind, True), min(a.aligned, 8 * self.lanes)
            return self.emit(t, f"load {self.named(t)}, ptr {self.element(a, i)}, align {align}")
        if not i.type.lanes:
            return self.emit(Number(kind), f"load {self.named(Number(kind))}, ptr {self.element(a, i)}, align 8")
        t = Number(kind, True)
        out, one = "poison", self.named(Number(kind))
        for n in range(self.lanes):
            place = self.emit(INT, f"extractelement {self.named(INTS)} {i.text}, i64 {n}")
            x = self.result(f"load {one}, ptr {self.element(a, place)}, align 8")
            out = self.result(f"insertelement {self.named(t)} {out}, {one} {x}, i64 {n}")
        return Value(t, out)

    def store(self, a: Array, i: Value, v: Value) -> None:
        """Set element `i`, or a run of lanes."""
        t, align = (Number(a.type.kind, True), min(a.aligned, 8 * self.lanes)) if i.first else (Number(a.type.kind), 8)
        v = self.number(self.convert(v, t))
        self.do(f"store {self.named(t)} {v.text}, ptr {self.element(a, i)}, align {align}")

    def clear(self, a: Array) -> None:
        """Zeros throughout an array of one axis."""
        self.declare("llvm.memset.p0.i64", "void", "ptr, i8, i64, i1")
        size = self.emit(INT, f"shl i64 {a.shape[0].text}, 3")
        self.do(f"call void @llvm.memset.p0.i64(ptr align 8 {a.pointer}, i8 0, i64 {size.text}, i1 false)")

    # -- types ----------------------------------------------------------------------------------------------------

    def number(self, v: Operand) -> Value:
        """The operand as a number.

        Raises
        ------
        Unsupported
            When it is a tuple or an array.
        """
        if not isinstance(v, Value):
            raise Unsupported(f"{'a tuple' if isinstance(v, Group) else 'an array'} stands where a number is needed")
        return v

    def convert(self, v: Operand, t: Type) -> Operand:
        """The same in another type."""
        if v.type == t:
            return self.vector(v)
        if isinstance(v, Group) and isinstance(t, TupleOf) and len(v.items) == len(t.items):
            return Group([cast("Value | Group", self.convert(x, k)) for x, k in zip(v.items, t.items, strict=True)])
        v = self.number(v)
        if not isinstance(t, Number):
            raise Unsupported("a number stands where a tuple is needed")
        if t.lanes and not v.type.lanes:
            return self.spread(self.number(self.convert(v, Number(t.kind))))
        if v.type.lanes and not t.lanes:
            raise Unsupported("one number for all lanes is needed, and this differs from lane to lane")
        if v.const is not None and t.kind == "float":
            return real(float(v.const))
        if v.const is not None and t.kind == "int":
            return whole(v.const)
        v = self.number(self.vector(v))
        how = _CONVERSIONS.get((v.type.kind, t.kind))
        if how is None:
            raise Unsupported(f"a {v.type.kind} stands where a {t.kind} is needed")
        out = self.emit(t, f"{how} {self.named(v.type)} {v.text} to {self.named(t)}")
        # beyond 64 bits the result is any number, but always the same one
        return self.emit(t, f"freeze {self.named(t)} {out.text}") if how == "fptosi" else out

    def spread(self, v: Value) -> Value:
        """The same number in every lane."""
        if v.type.lanes:
            return v
        t = Number(v.type.kind, True)
        name, one = self.named(t), self.named(v.type)
        if not v.text.startswith("%"):
            return Value(t, "<" + ", ".join([f"{one} {v.text}"] * self.lanes) + ">")
        x = self.result(f"insertelement {name} poison, {one} {v.text}, i64 0")
        return self.emit(t, f"shufflevector {name} {x}, {name} poison, <{self.lanes} x i32> zeroinitializer")

    def vector(self, v: Operand) -> Operand:
        """Lane numbers as a vector, where only their first one was kept."""
        if isinstance(v, Group):
            return Group([cast("Value | Group", self.vector(x)) for x in v.items])
        if isinstance(v, Array) or v.first is None:
            return v
        count = "<" + ", ".join([f"i64 {k}" for k in range(self.lanes)]) + ">"
        return self.emit(INTS, f"add {self.named(INTS)} {self.spread(v.first).text}, {count}")

    def same(self, a: Value, b: Value) -> tuple[Value, Value]:
        """Both in the type that holds both."""
        t = wider(a.type, b.type)
        return self.number(self.convert(a, t)), self.number(self.convert(b, t))

    def condition(self, v: Operand) -> Value:
        """Whether something is true."""
        if isinstance(v, Value) and v.type.kind == "bool":
            return v
        v = self.number(v)
        return truth(bool(v.const)) if v.const is not None else self.compare("!=", v, whole(0))

    # -- arithmetic -----------------------------------------------------------------------------------------------

    def binary(self, op: Operator, a: Operand, b: Operand) -> Value | Group:
        """Two operands joined."""
        if isinstance(a, Group) and isinstance(b, Group) and op == "+":
            return Group([*a.items, *b.items])
        a, b = self.number(a), self.number(b)
        if a.const is not None and b.const is not None and op in ("+", "-", "*"):
            x, y = a.const, b.const
            return whole(x + y if op == "+" else x - y if op == "-" else x * y)
        if op in _BITS:
            return self._bits(op, a, b)
        integers = "float" not in (a.type.kind, b.type.kind)
        if integers and op in ("+", "-"):
            x, y = (b, a) if op == "+" and a.first is None else (a, b)
            if x.first is not None and not y.type.lanes:
                return Value(INTS, "", first=self.binary_number(op, x.first, y))
        if op == "**":
            return self.power(a, b)
        if op == "/" or not integers:
            return self._of_floats(op, a, b)
        t = INTS if a.type.lanes or b.type.lanes else INT
        a, b = self.number(self.convert(a, t)), self.number(self.convert(b, t))
        if op in _INTS:
            return self.emit(t, f"{_INTS[op]} {self.named(t)} {a.text}, {b.text}")
        return self._floored(op, a, b)

    def binary_number(self, op: Operator, a: Operand, b: Operand) -> Value:
        """Two numbers joined."""
        return self.number(self.binary(op, a, b))

    def _bits(self, op: Operator, a: Value, b: Value) -> Value:
        a, b = self.same(a, b)
        if a.type.kind == "float" or (a.type.kind == "bool" and op in ("<<", ">>")):
            raise Unsupported(f"'{op}' needs whole numbers on both sides")
        return self.emit(a.type, f"{_BITS[op]} {self.named(a.type)} {a.text}, {b.text}")

    def _of_floats(self, op: Operator, a: Value, b: Value) -> Value:
        t = FLOATS if a.type.lanes or b.type.lanes else FLOAT
        a, b = self.number(self.convert(a, t)), self.number(self.convert(b, t))
        name = self.named(t)
        if op in _FLOATS:
            return self.emit(t, f"{_FLOATS[op]} {self.flags}{name} {a.text}, {b.text}")
        if op == "//":
            return self.intrinsic("floor", self.emit(t, f"fdiv {name} {a.text}, {b.text}"))
        if t.lanes:
            raise Crooked
        rest = self.emit(t, f"frem {name} {a.text}, {b.text}")
        apart = self._bits("^", self.compare("<", rest, real(0.0)), self.compare("<", b, real(0.0)))
        apart = self._bits("&", apart, self.compare("!=", rest, real(0.0)))
        return self.choose_number(apart, self.emit(t, f"fadd {name} {rest.text}, {b.text}"), rest)

    def _floored(self, op: Operator, a: Value, b: Value) -> Value:
        """Whole quotient towards minus infinity, or its rest; 0 for a divisor of 0, where a processor would stop."""
        t, name = a.type, self.named(a.type)
        zero, one = (self.number(self.convert(whole(k), t)) for k in (0, 1))
        none = negated = None
        if not b.const:
            none, negated = self.compare("==", b, zero), self.compare("==", b, self.number(self.convert(whole(-1), t)))
            b = self.choose_number(self._bits("|", none, negated), one, b)
        quotient = self.emit(t, f"sdiv {name} {a.text}, {b.text}")
        rest = self.emit(t, f"srem {name} {a.text}, {b.text}")
        apart = self.compare("<", self._bits("^", rest, b), zero)
        apart = self._bits("&", apart, self.compare("!=", rest, zero))
        if op == "%":
            out = self.choose_number(apart, self.emit(t, f"add {name} {rest.text}, {b.text}"), rest)
        else:
            out = self.choose_number(apart, self.emit(t, f"sub {name} {quotient.text}, {one.text}"), quotient)
        if none is None or negated is None:
            return out
        if op == "//":
            out = self.choose_number(negated, self.emit(t, f"sub {name} {zero.text}, {a.text}"), out)
        return self.choose_number(none, zero, out)

    def power(self, a: Value, b: Value) -> Value:
        """A power: by multiplications where the exponent is a small whole number."""
        if b.const is not None and 0 < b.const <= LARGEST_POWER:
            out, square, n = None, a, b.const
            while n:
                if n & 1:
                    out = square if out is None else self.binary_number("*", out, square)
                n >>= 1
                square = self.binary_number("*", square, square) if n else square
            assert out is not None
            return out
        if a.type.lanes or b.type.lanes:
            raise Crooked
        a, b = self.number(self.convert(a, FLOAT)), self.number(self.convert(b, FLOAT))
        self.declare("llvm.pow.f64", "double", "double, double")
        return self.emit(FLOAT, f"call double @llvm.pow.f64(double {a.text}, double {b.text})")

    def negative(self, v: Operand) -> Value:
        """The same with the other sign."""
        v = self.number(self.vector(v))
        if v.const is not None:
            return whole(-v.const)
        if v.type.kind != "float":
            return self.binary_number("-", whole(0), v)
        if not v.type.lanes and not v.text.startswith("%"):
            return real(-known_real(v))
        return self.emit(v.type, f"fneg {self.flags}{self.named(v.type)} {v.text}")

    def opposite(self, v: Operand) -> Value:
        """Not."""
        v = self.condition(v)
        if v.const is not None:
            return truth(not v.const)
        yes = self.number(self.convert(truth(True), v.type))
        return self.emit(v.type, f"xor {self.named(v.type)} {v.text}, {yes.text}")

    def compare(self, relation: Relation, a: Operand, b: Operand) -> Value:
        """Whether two numbers stand in a relation."""
        a, b = self.same(self.number(a), self.number(b))
        how = f"fcmp {_ORDERED[relation]}" if a.type.kind == "float" else f"icmp {_SIGNED[relation]}"
        return self.emit(BOOLS if a.type.lanes else BOOL, f"{how} {self.named(a.type)} {a.text}, {b.text}")

    def choose(self, condition: Value, a: Operand, b: Operand) -> Value | Group:
        """One of two, both computed."""
        if isinstance(a, Group) and isinstance(b, Group) and len(a.items) == len(b.items):
            return Group([self.choose(condition, x, y) for x, y in zip(a.items, b.items, strict=True)])
        return self.choose_number(condition, self.number(a), self.number(b))

    def choose_number(self, condition: Value, a: Value, b: Value) -> Value:
        """One of two numbers, both computed."""
        if condition.const is not None:
            return a if condition.const else b
        a, b = self.same(a, b)
        if condition.type.lanes:
            a, b = self.spread(a), self.spread(b)
        t, name = a.type, self.named(a.type)
        flags = self.flags if t.kind == "float" else ""
        return self.emit(
            t, f"select {flags}{self.named(condition.type)} {condition.text}, {name} {a.text}, {name} {b.text}"
        )

    def intrinsic(self, name: str, v: Operand) -> Value:
        """A function that LLVM knows by name."""
        v = self.number(v)
        v = self.number(self.convert(v, FLOATS if v.type.lanes else FLOAT))
        if v.type.lanes and name not in _IN_VECTORS:
            raise Crooked
        t = self.named(v.type)
        symbol = f"llvm.{name}.{f'v{self.lanes}f64' if v.type.lanes else 'f64'}"
        self.declare(symbol, t, t)
        return self.emit(v.type, f"call {self.flags}{t} @{symbol}({t} {v.text})")

    def library(self, name: str, v: Operand) -> Value:
        """A function of the C library."""
        v = self.number(v)
        if v.type.lanes:
            raise Crooked
        v = self.number(self.convert(v, FLOAT))
        self.declare(name, "double", "double")
        return self.emit(FLOAT, f"call double @{name}(double {v.text})")

    def scaled(self, x: Operand, n: Operand) -> Value:
        """X times 2 to the power of the whole number n, between -1022 and 1023."""
        n = self.number(self.vector(n))
        return self._times_power(x, self.number(self.convert(n, INTS if n.type.lanes else INT)))

    def scaled_by_whole(self, x: Operand, power: Operand) -> Value:
        """X times 2 to the power of a float without its fraction, between -1022 and 1023.

        Vectors of floats become whole numbers one lane at a time on most processors. Beside 1.5 2^52 the last digits of
        a float are the whole number.
        """
        n = self.number(self.vector(power))
        reals, t = (FLOATS, INTS) if n.type.lanes else (FLOAT, INT)
        n = self.intrinsic("trunc", self.number(self.convert(n, reals)))
        beside = self.number(self.convert(real(1.5 * 2.0**52), reals))
        shifted = self.emit(reals, f"fadd {self.named(reals)} {n.text}, {beside.text}")  # rearranged it would be n
        return self._times_power(x, self.emit(t, f"bitcast {self.named(reals)} {shifted.text} to {self.named(t)}"))

    def _times_power(self, x: Operand, n: Value) -> Value:
        """X times 2 to the power of a whole number of which the last 12 binary digits count."""
        wanted, t = FLOATS if n.type.lanes else FLOAT, n.type
        bits = self.binary("<<", self.binary("+", n, self.convert(whole(1023), t)), self.convert(whole(52), t))
        factor = self.emit(wanted, f"bitcast {self.named(t)} {self.packed(bits)} to {self.named(wanted)}")
        return self.binary_number("*", x, factor)

    def parted(self, x: Operand) -> Group:
        """Of a number above 0 and finite, m from 1/2 to 1 and n with x = m 2^n; of any other, some m and n."""
        v = self.number(self.vector(x))
        reals, t = (FLOATS, INTS) if v.type.lanes else (FLOAT, INT)
        v = self.number(self.convert(v, reals))
        subnormal = self.compare("<", v, real(2.0**-1022))
        v = self.choose_number(subnormal, self.binary_number("*", v, real(2.0**54)), v)
        bits = self.emit(t, f"bitcast {self.named(reals)} {v.text} to {self.named(t)}")
        digits = self.binary_number("|", self.binary_number("&", bits, whole(2**52 - 1)), whole(1022 << 52))
        m = self.emit(reals, f"bitcast {self.named(t)} {digits.text} to {self.named(reals)}")
        n = self.binary_number("-", self.binary_number(">>", bits, whole(52)), whole(1022))
        return Group([m, self.binary_number("-", n, self.choose_number(subnormal, whole(54), whole(0)))])

    def sum_of_lanes(self, v: Value) -> Value:
        """All lanes added up."""
        v = self.number(self.convert(v, FLOATS))
        symbol = f"llvm.vector.reduce.fadd.v{self.lanes}f64"
        self.declare(symbol, "double", f"double, {self.named(FLOATS)}")
        return self.emit(
            FLOAT, f"call reassoc double @{symbol}(double {real(0.0).text}, {self.named(FLOATS)} {v.text})"
        )

    def least(self, relation: Relation, values: list[Operand]) -> Value:
        """`min` or `max`: the first unless a later one is better."""
        out = self.number(values[0])
        for x in values[1:]:
            a, b = self.same(out, self.number(x))
            out = self.choose_number(self.compare(relation, b, a), b, a)
        return out

    def absolute(self, v: Operand) -> Value:
        """Without its sign."""
        v = self.number(self.vector(v))
        if v.type.kind == "float":
            return self.intrinsic("fabs", v)
        return self.choose_number(self.compare("<", v, whole(0)), self.negative(v), v)
