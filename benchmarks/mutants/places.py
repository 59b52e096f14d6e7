"""Which single places of a program can be changed, and into what: operators, constants, guards, indices, signs.

Positions come from the syntax tree, and only the text of the place is replaced: the rest of the file stays as it is,
byte by byte. Left out is what is not computed with: annotations, docstrings, texts, decorators, messages of errors.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

COMPARED = {
    ast.Lt: ("<", ("<=", ">")), ast.LtE: ("<=", ("<", ">=")), ast.Gt: (">", (">=", "<")), ast.GtE: (">=", (">", "<=")),
    ast.Eq: ("==", ("!=",)), ast.NotEq: ("!=", ("==",)), ast.Is: ("is", ("is not",)), ast.IsNot: ("is not", ("is",)),
    ast.In: ("in", ("not in",)), ast.NotIn: ("not in", ("in",)),
}  # fmt: skip
COMPUTED = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "*"), ast.Pow: ("**", "*"),
}  # fmt: skip
SWAPPED = {"min": "max", "max": "min", "any": "all", "all": "any"}
NUMBERS = re.compile(r"\b(float|int|NDArray|ndarray|Floats?|complex)\b")
"""Annotations of what is returned whose sign can be turned."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """Bytes of a file, the line they begin on, and what may stand there instead."""

    start: int
    end: int
    line: int
    instead: tuple[bytes, ...]


@dataclass(frozen=True, kw_only=True)
class Change:
    """One place of one file, changed."""

    path: str
    place: Place
    text: bytes

    def applied(self, source: bytes) -> bytes:
        """The file with the change in it."""
        return source[: self.place.start] + self.text + source[self.place.end :]

    def shown(self, source: bytes) -> str:
        """The lines that change, before -> after, each on one line."""
        begin = source.rfind(b"\n", 0, self.place.start) + 1
        stop = source.find(b"\n", self.place.end)
        stop = len(source) if stop < 0 else stop
        before, after = source[begin:stop], source[begin : self.place.start] + self.text + source[self.place.end : stop]
        return " -> ".join(" ".join(text.decode().split()) for text in (before, after))


def places(source: bytes) -> list[Place]:
    """All places of a file that can be changed, in the order of its text."""
    return sorted(_Finder(source).found(), key=lambda place: (place.start, place.end, place.instead))


def compiles(source: bytes) -> bool:
    """Whether a program can be read."""
    try:
        ast.parse(source)
    except SyntaxError:
        return False
    return True


class _Finder:
    """Walks the statements of a file and yields its places."""

    def __init__(self, source: bytes) -> None:
        self.source = source
        self.starts = [0]
        for line in source.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))
        self.returned: list[str] = [""]

    def found(self) -> Iterator[Place]:
        yield from self.visit(ast.parse(self.source))

    def begin(self, node: ast.AST) -> int:
        return self.starts[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]

    def end(self, node: ast.AST) -> int:
        return self.starts[node.end_lineno - 1] + node.end_col_offset  # type: ignore[attr-defined]

    def place(self, start: int, end: int, *instead: str | bytes) -> Place:
        line = self.source.count(b"\n", 0, start) + 1
        texts = tuple(text.encode() if isinstance(text, str) else text for text in instead)
        return Place(start=start, end=end, line=line, instead=texts)

    def whole(self, node: ast.AST, *forms: str) -> Place:
        """The text of a node in a form with {}, which stands for it."""
        text = self.source[self.begin(node) : self.end(node)]
        return self.place(self.begin(node), self.end(node), *(f.encode().replace(b"{}", text) for f in forms))

    def between(self, left: int, right: int, word: str, *instead: str) -> Iterator[Place]:
        """The operator between two operands, comments aside."""
        gap = re.sub(rb"#[^\n]*", lambda m: b" " * len(m[0]), self.source[left:right])
        pattern = rb"\s+".join(re.escape(part.encode()) for part in word.split())
        if match := re.search(rb"\b%s\b" % pattern if word[0].isalpha() else pattern, gap):
            yield self.place(left + match.start(), left + match.end(), *instead)

    def visit(self, node: ast.AST) -> Iterator[Place]:
        """The places of a node and of all below it that is computed with."""
        if isinstance(node, (ast.JoinedStr, ast.Raise, ast.Assert, ast.Import, ast.ImportFrom)):
            return
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith(("default_rng", "SeedSequence")):
            return  # another seed is as good
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            self.returned.append(ast.unparse(node.returns) if node.returns else "")
            for part in [*node.args.defaults, *filter(None, node.args.kw_defaults), *node.body]:
                yield from self.visit(part)
            self.returned.pop()
            return
        if isinstance(node, ast.ClassDef):
            for part in node.body:
                yield from self.visit(part)
            return
        if isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "__name__ == '__main__'"):
            return
        yield from self.here(node)
        for name, value in ast.iter_fields(node):
            if name == "annotation":
                continue
            for part in value if isinstance(value, list) else [value]:
                if isinstance(part, ast.AST):
                    yield from self.visit(part)

    def here(self, node: ast.AST) -> Iterator[Place]:
        """The places of this node alone."""
        match node:
            case ast.Compare():
                yield from self.compared(node)
            case ast.BoolOp(op=op, values=values):
                word, other = ("and", "or") if isinstance(op, ast.And) else ("or", "and")
                for left, right in pairwise(values):
                    yield from self.between(self.end(left), self.begin(right), word, other)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in COMPUTED and not _texts(left, right):
                word, other = COMPUTED[type(op)]
                yield from self.between(self.end(left), self.begin(right), word, other)
            case ast.AugAssign(target=target, op=op, value=value) if type(op) in COMPUTED and not _texts(value):
                word, other = COMPUTED[type(op)]
                yield from self.between(self.end(target), self.begin(value), f"{word}=", f"{other}=")
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                yield self.place(self.begin(node), self.begin(node) + 1, "+")
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                text = self.source[self.begin(operand) : self.end(operand)]
                yield self.place(self.begin(node), self.end(node), b"bool(" + text + b")")
            case ast.Constant(value=value):
                yield from self.constant(node, value)
            case ast.If(test=test) | ast.IfExp(test=test):
                yield self.whole(test, "not ({})", "True", "False")
            case ast.While(test=test) if not isinstance(test, ast.Constant):
                yield self.whole(test, "not ({})", "False")
            case ast.comprehension(ifs=ifs):
                yield from (self.whole(test, "not ({})", "True") for test in ifs)
            case ast.Subscript(slice=ast.Slice() as cut):
                bounds = [b for b in (cut.lower, cut.upper) if b is not None and not isinstance(b, ast.Constant)]
                yield from (self.whole(bound, "({}) + 1", "({}) - 1") for bound in bounds)
            case ast.Call(func=ast.Name(id="range"), args=[*_, last]) if not isinstance(last, ast.Constant):
                yield self.whole(last, "({}) + 1", "({}) - 1")
            case ast.Call(func=ast.Name(id=name) as called) if name in SWAPPED:
                yield self.whole(called, SWAPPED[name])
            case ast.Return(value=value) if value is not None and not isinstance(value, ast.Constant):
                if self.returned[-1] == "bool":
                    yield self.whole(value, "not ({})")
                elif NUMBERS.search(self.returned[-1]) and "[" not in self.returned[-1].replace("NDArray[", ""):
                    yield self.whole(value, "-({})")
            case _:
                return

    def compared(self, node: ast.Compare) -> Iterator[Place]:
        for left, op, right in zip([node.left, *node.comparators], node.ops, node.comparators, strict=False):
            word, others = COMPARED[type(op)]
            yield from self.between(self.end(left), self.begin(right), word, *others)

    def constant(self, node: ast.Constant, value: object) -> Iterator[Place]:
        if isinstance(value, bool):
            yield self.whole(node, str(not value))
        elif isinstance(value, int):
            yield self.whole(node, str(value + 1), *([str(value - 1)] if value > 0 else []))
        elif isinstance(value, float):
            yield self.whole(node, *((repr(2 * value), repr(value / 2)) if value else ("1.0",)))


def _texts(*nodes: ast.AST) -> bool:
    """Whether one of them is a text or a list as written: another operator would raise at once."""
    written = (ast.JoinedStr, ast.List, ast.ListComp, ast.Tuple)
    return any(
        isinstance(node, written) or (isinstance(node, ast.Constant) and isinstance(node.value, str | bytes))
        for node in nodes
    )
