"""One function of the text in LLVM's: statements, and loops over the lanes of a block as vector instructions."""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from typing import cast

from upright.simulation.lowering.expressions import Callees, Expressions, is_straight
from upright.simulation.lowering.instructions import Crooked, Instructions
from upright.simulation.lowering.operands import (
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
    line_of,
    llvm,
    real,
    whole,
    wider,
)

LANE = "_i"
"""Loops over the lanes of a block count them by this name."""


class Wider(Exception):
    """A name or the result holds another type further down: the function is written anew with what is known now."""


class Function(Expressions):
    """Writes one function for given types of arguments.

    A function without branches needs no memory: every name stands for the last thing it was given. In others a name is
    a place in memory, of a type that only grows, and LLVM finds out the rest. `known` and `result` hold the types from
    one attempt to the next.
    """

    def __init__(
        self,
        node: ast.FunctionDef,
        types: Sequence[Type],
        callees: Callees,
        *,
        lanes: int,
        flags: str,
        declared: dict[str, str],
        aligned: dict[str, int],
        known: dict[str, Number | TupleOf],
        result: list[Number | TupleOf],
    ) -> None:
        super().__init__(Instructions(lanes, flags, declared), callees)
        self.node, self.types, self.aligned = node, types, aligned
        self.known, self.result = known, result
        self.straight = is_straight(node)
        self.mask: Value | None = None
        self.loops: list[tuple[str, str]] = []
        """Labels that `continue` and `break` of the loops around go to."""

    def text(self, symbol: str, attributes: str) -> str:
        """The whole function."""
        args = self._arguments()
        try:
            self.body(self.node.body)
        except Unsupported as error:
            error.function = error.function or self.node.name
            raise
        if not self.write.ended:
            if self.result:
                raise Unsupported(f"{self.node.name} returns something in one place and nothing in another")
            self.write.do("ret void")
        kind = llvm(self.result[0], self.write.lanes) if self.result else "void"
        return "\n".join(
            [
                f"define {kind} @{symbol}({', '.join(args)}) {attributes} {{",
                "entry:",
                *self.write.slots,
                "  br label %start",
                "start:",
                *self.write.lines,
                "}\n",
            ]
        )

    def _arguments(self) -> list[str]:
        names = [a.arg for a in self.node.args.args]
        if len(names) != len(self.types):
            raise Unsupported(f"{self.node.name} takes {len(names)} arguments, got {len(self.types)}")
        args: list[str] = []
        for name, t in zip(names, self.types, strict=True):
            at = f"%a.{name}"
            if isinstance(t, ArrayOf):
                shape = [Value(INT, f"{at}.{k}") for k in range(t.axes)]
                args += [f"ptr {'noalias ' if t.axes else ''}{at}", *(f"i64 {n.text}" for n in shape)]
                self.names[name] = Array(t, at, shape, self.aligned.get(name, 8))
                continue
            args.append(f"{self.write.named(t)} {at}")
            self.assign(name, self.write.unpacked(at, t))
        return args

    # -- names ----------------------------------------------------------------------------------------------------

    def assign(self, name: str, v: Operand) -> None:
        """Let a name stand for something."""
        if self.in_lane is not None:
            if self.mask is not None:
                if name not in self.in_lane:
                    raise Crooked
                v = self.write.choose(self.mask, v, self.in_lane[name])
            self.in_lane[name] = v
        elif self.straight or isinstance(v, Array):
            self.names[name] = v
        else:
            self.write.keep(v, self._slot(name, cast("Number | TupleOf", self.write.vector(v).type)))

    def _slot(self, name: str, t: Number | TupleOf) -> Slot:
        before = self.known.get(name)
        t = t if before is None else cast("Number | TupleOf", wider(before, t, f"'{name}'"))
        self.known[name] = t
        if before not in (None, t):
            raise Wider
        slot = self.names.get(name)
        if not isinstance(slot, Slot):
            slot = self.names[name] = self.write.slot(t)
        return slot

    # -- statements -----------------------------------------------------------------------------------------------

    def body(self, nodes: Sequence[ast.stmt]) -> None:
        """Statements one after the other."""
        for node in nodes:
            if self.write.ended:
                return
            how: Callable[[ast.stmt], None] | None = getattr(self, f"_{type(node).__name__}", None)
            try:
                if how is None:
                    word = ast.unparse(node).split(maxsplit=1)[0].rstrip(":")
                    raise Unsupported(f"'{word}' is not known; assignments, if, for, while and return are")
                how(node)
            except Unsupported as error:
                error.line = error.line or line_of(node) - line_of(self.node) + 1
                raise

    def _Pass(self, node: ast.Pass) -> None:
        pass

    def _Expr(self, node: ast.Expr) -> None:
        call = node.value
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and self.callees.defined(call.func.id):
            if self.in_lane is not None:
                raise Crooked
            self.called(call.func.id, call.args)
        elif not isinstance(call, ast.Constant):
            self.value(call)

    def _Assign(self, node: ast.Assign) -> None:
        v = self.value(node.value)
        for target in node.targets:
            self._set(target, v)

    def _AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self._set(node.target, self.value(node.value))

    def _set(self, target: ast.expr, v: Operand) -> None:
        if isinstance(target, ast.Name):
            self.assign(target.id, v)
        elif isinstance(target, ast.Tuple):
            if not isinstance(v, Group) or len(v.items) != len(target.elts):
                raise Unsupported(f"as many names as numbers are needed in '{ast.unparse(target)} = ...'")
            for t, x in zip(target.elts, v.items, strict=True):
                self._set(t, x)
        elif isinstance(target, ast.Subscript):
            self._store(target, v)
        else:
            raise Unsupported(f"'{ast.unparse(target)}' cannot be assigned to")

    def _store(self, target: ast.Subscript, v: Operand) -> None:
        if isinstance(target.slice, ast.Slice):
            a = self.value(target.value)
            if not isinstance(a, Array) or ast.unparse(target.slice) != ":" or v != real(0.0):
                raise Unsupported(f"'{ast.unparse(target)}' can only be set to 0.0 as a whole")
            self.write.clear(a)
            return
        a, i = self.place(target, self.value(target.value))
        one_for_all = self.in_lane is not None and self.write.lanes > 1 and i.first is None
        if one_for_all or (i.type.lanes and i.first is None):
            raise Crooked
        if self.mask is not None:
            v = self.write.choose(self.mask, v, self.write.load(a, i))
        self.write.store(a, i, self.write.number(v))

    def _AugAssign(self, node: ast.AugAssign) -> None:
        target = node.target
        if isinstance(target, ast.Name) and self.in_lane is not None and target.id not in self.in_lane:
            self._sum(target.id, node)
            return
        before = self.value(ast.copy_location(_as_read(target), target))
        self._set(target, self.join(node.op, before, self.value(node.value)))

    def _sum(self, name: str, node: ast.AugAssign) -> None:
        """Add something of every lane to a name outside of the loop over lanes."""
        if not isinstance(node.op, ast.Add) or self.mask is not None:
            raise Crooked
        v = self.number(node.value)
        if self.write.lanes > 1:
            v = self.write.sum_of_lanes(v)
        inside, self.in_lane = self.in_lane, None
        self.assign(name, self.write.binary("+", self.read(name), v))
        self.in_lane = inside

    def _Return(self, node: ast.Return) -> None:
        if self.in_lane is not None:
            raise Crooked
        if node.value is None:
            if self.result:
                raise Unsupported("something is returned in one place and nothing in another")
            self.write.do("ret void")
            self.write.ended = True
            return
        v = cast("Value | Group", self.write.vector(self.value(node.value)))
        t = cast("Number | TupleOf", wider(self.result[0], v.type, "what is returned") if self.result else v.type)
        if self.result and self.result[0] != t:
            self.result[0] = t
            raise Wider
        self.result[:] = [t]
        self.write.do(f"ret {self.write.named(t)} {self.write.packed(cast('Value | Group', self.write.convert(v, t)))}")
        self.write.ended = True

    def _If(self, node: ast.If) -> None:
        w = self.write
        c = w.condition(self.value(node.test))
        if c.const is not None:
            self.body(node.body if c.const else node.orelse)
            return
        if self.in_lane is not None:
            self._masked(c, node)
            return
        yes, no, end = w.label("yes"), w.label("no"), w.label("end")
        w.fork(c, yes, no if node.orelse else end)
        w.start(yes)
        self.body(node.body)
        reached = not w.ended or not node.orelse
        w.jump(end)
        if node.orelse:
            w.start(no)
            self.body(node.orelse)
            reached = reached or not w.ended
            w.jump(end)
        w.start(end)
        if not reached:
            w.unreachable()

    def _masked(self, c: Value, node: ast.If) -> None:
        """Both branches, each where its lanes want it."""
        w, outer = self.write, self.mask
        c = w.number(w.convert(c, Number("bool", w.lanes > 1)))
        for branch, here in ((node.body, c), (node.orelse, w.opposite(c))):
            if branch:
                self.mask = here if outer is None else w.binary_number("&", outer, here)
                self.body(branch)
        self.mask = outer

    def _For(self, node: ast.For) -> None:
        if self.in_lane is not None:
            raise Crooked
        if node.orelse or not isinstance(node.target, ast.Name):
            raise Unsupported("a for counts one name, and has no else")
        call = node.iter
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range":
            width = call.args[0].value if len(call.args) == 1 and isinstance(call.args[0], ast.Constant) else 0
            in_vectors = (
                node.target.id == LANE and isinstance(width, int) and width > 0 and not width % self.write.lanes
            )
            if not in_vectors or not self._over_lanes(node, cast("int", width)):
                self._counted(node, node.target.id, [self.value(a) for a in call.args])
            return
        items = self.value(call)
        if not isinstance(items, Group):
            raise Unsupported("a for runs over range(...) or over a tuple")
        end = self.write.label("done")
        for item in items.items:  # one copy of the body for each
            after = self.write.label("next")
            self.assign(node.target.id, item)
            self.loops.append((after, end))
            self.body(node.body)
            self.loops.pop()
            self.write.jump(after)
            self.write.start(after)
        self.write.jump(end)
        self.write.start(end)

    def _counted(self, node: ast.For, name: str, bounds: list[Operand]) -> None:
        w = self.write
        args = [w.number(w.convert(a, INT)) for a in bounds]
        if not 1 <= len(args) <= 3:
            raise Unsupported("range takes one to three whole numbers")
        first, last, by = ([whole(0), *args, whole(1)] if len(args) == 1 else [*args, whole(1)])[:3]
        if not by.const:
            raise Unsupported("range needs a step that is a number of the text, and not 0")
        counter = w.slot(INT)
        w.keep(first, counter)
        head, inside, step, end = (w.label(x) for x in ("head", "loop", "step", "done"))
        w.jump(head)
        w.start(head)
        k = cast("Value", w.fetch(counter))
        w.fork(w.compare("<" if by.const > 0 else ">", k, last), inside, end)
        w.start(inside)
        self.assign(name, k)
        self.loops.append((step, end))
        self.body(node.body)
        self.loops.pop()
        w.jump(step)
        w.start(step)
        w.keep(w.binary_number("+", w.fetch(counter), by), counter)
        w.jump(head)
        w.start(end)

    def _over_lanes(self, node: ast.For, width: int) -> bool:
        """Write a loop over lanes as vector instructions, piece by piece; False where its body is no straight line."""
        w = self.write
        mark, names, known, loops = w.mark(), dict(self.names), dict(self.known), len(self.loops)
        try:
            if w.lanes == 1:
                if width > 1:
                    return False
                self.in_lane = {LANE: whole(0)}
                self.body(node.body)
            elif width == w.lanes:
                self.in_lane = {LANE: Value(INTS, "", first=whole(0))}
                self.body(node.body)
            else:
                self._pieces(node, width)
            return True
        except Crooked:
            w.back_to(mark)
            w.ended = False
            self.names = names
            self.known.clear()
            self.known.update(known)
            del self.loops[loops:]
            return False
        finally:
            self.in_lane = self.mask = None

    def _pieces(self, node: ast.For, width: int) -> None:
        w = self.write
        counter = w.slot(INT)
        w.keep(whole(0), counter)
        head, end = w.label("lanes"), w.label("done")
        w.jump(head)
        w.start(head)
        k = cast("Value", w.fetch(counter))
        self.in_lane = {LANE: Value(INTS, "", first=k)}
        self.body(node.body)
        self.in_lane = None
        k = w.binary_number("+", w.fetch(counter), whole(w.lanes))
        w.keep(k, counter)
        w.fork(w.compare("<", k, whole(width)), head, end)
        w.start(end)

    def _While(self, node: ast.While) -> None:
        if self.in_lane is not None:
            raise Crooked
        if node.orelse:
            raise Unsupported("a while has no else here")
        w = self.write
        head, inside, end = w.label("head"), w.label("loop"), w.label("done")
        w.jump(head)
        w.start(head)
        w.fork(w.condition(self.value(node.test)), inside, end)
        w.start(inside)
        self.loops.append((head, end))
        self.body(node.body)
        self.loops.pop()
        w.jump(head)
        w.start(end)

    def _Break(self, node: ast.Break) -> None:
        self._leave(1)

    def _Continue(self, node: ast.Continue) -> None:
        self._leave(0)

    def _leave(self, where: int) -> None:
        if self.in_lane is not None or not self.loops:
            raise Crooked
        self.write.jump(self.loops[-1][where])


def _as_read(target: ast.expr) -> ast.expr:
    if isinstance(target, ast.Subscript):
        return ast.Subscript(value=target.value, slice=target.slice, ctx=ast.Load())
    if isinstance(target, ast.Name):
        return ast.Name(id=target.id, ctx=ast.Load())
    raise Unsupported(f"'{ast.unparse(target)}' cannot be added to")
