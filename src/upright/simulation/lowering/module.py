"""All functions of one text as a module of LLVM's text, with one of them to be called from outside.

The text marks each function with a decorator: ``inline``, ``inline_strict`` and ``exact`` stand where they are called,
``scalar`` is called, ``entry`` is called from outside, ``separate`` is a module of its own and called by its address,
unless all stand together. What floats may be rearranged to differs too, nothing in an ``exact`` one: no `nnan` or
`ninf` anywhere, because a lane that diverges must stay visible as NaN.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from upright.simulation.lowering.function import Function, Wider
from upright.simulation.lowering.operands import ArrayOf, Number, TupleOf, Type, llvm

_FAST, _CONTRACT = "reassoc nsz arcp contract afn ", "contract "
_MARKS = {
    "inline": (_FAST, "alwaysinline"),
    "inline_strict": (_CONTRACT, "alwaysinline"),
    "exact": ("", "alwaysinline"),
    "scalar": (_CONTRACT, "noinline"),
    "entry": (_FAST, "alwaysinline"),
    "separate": ("", "alwaysinline"),
}
# as wide as there are; LLVM would settle for 256 bits
_WIDE = 'nounwind "prefer-vector-width"="512" "min-legal-vector-width"="512"'

_NATIVE = ("llvm.fabs.", "llvm.floor.", "llvm.trunc.", "llvm.sqrt.", "llvm.rint.", "llvm.memset.")
"""What every processor does by itself, and alike, of all that LLVM knows by name."""

ALIGNED = {"W": 64}
"""Arrays that start on a cache line, with their alignment [bytes]."""


@lru_cache(maxsize=8)
def functions(text: str) -> dict[str, ast.FunctionDef]:
    """Functions of a text by name."""
    return {node.name: node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)}


def mark(node: ast.FunctionDef) -> str:
    """The decorator of a function of the text."""
    decorator = node.decorator_list[0] if node.decorator_list else None
    return decorator.id if isinstance(decorator, ast.Name) else "inline_strict"


@dataclass(frozen=True, kw_only=True)
class Platform:
    """What a module is written for.

    Attributes
    ----------
    triple, layout : str
        As LLVM names them.
    head : int
        Bytes before an array's data pointer in NumPy's array object: those that every Python object begins with.
    """

    triple: str
    layout: str
    head: int


class Module:
    """Functions of one text, written for so many lanes in a vector; `together` when none of them is `separate`.

    With `strict` every operation is rounded by itself, in the order of the text: the same numbers on every processor.
    """

    def __init__(self, text: str, lanes: int, *, together: bool = False, strict: bool = False) -> None:
        self._functions, self._lanes, self._together, self._strict = functions(text), lanes, together, strict
        self._written: list[str] = []
        self.declared: dict[str, str] = {}
        """What of LLVM and of the C library is called, by name."""
        self._instances: dict[tuple[str, tuple[Type, ...]], tuple[str, Number | TupleOf | None]] = {}

    def library(self) -> list[str]:
        """Functions of the C library that are called, whose last bits are each system's own."""
        return sorted({x.removeprefix("llvm.").split(".")[0] for x in self.declared if not x.startswith(_NATIVE)})

    def defined(self, name: str) -> ast.FunctionDef | None:
        """The function of that name."""
        return self._functions.get(name)

    def separate(self, name: str) -> bool:
        """Whether it is a module of its own."""
        return mark(self._functions[name]) == "separate" and not self._together

    def instance(self, name: str, types: tuple[Type, ...]) -> tuple[str, Number | TupleOf | None]:
        """Symbol of a function for these types of arguments, written at first use, and its result."""
        key = name, types
        if key not in self._instances:
            flags, attribute = _MARKS[mark(self._functions[name])]
            flags = "" if self._strict else flags
            if self._together and mark(self._functions[name]) == "separate":
                attribute = "noinline"  # few lanes need it, at a time
            symbol = f"{name}.{len(self._instances)}"
            known: dict[str, Number | TupleOf] = {}
            result: list[Number | TupleOf] = []
            while True:
                function = Function(
                    self._functions[name], types, self, lanes=self._lanes, flags=flags, declared=self.declared,
                    aligned=ALIGNED, known=known, result=result,
                )  # fmt: skip
                try:
                    text = function.text(symbol, f"{attribute} {_WIDE}")
                    break
                except Wider:
                    continue
            self._written.append(text.replace("define ", "define internal ", 1))
            self._instances[key] = symbol, result[0] if result else None
        return self._instances[key]

    def entry(self, name: str, types: Sequence[Type], platform: Platform) -> str:
        """The module with ``name(words)`` to be called from outside: a number or NumPy array in each 64-bit word.

        An array's word says where its object lies; data and sizes are read from there, as NumPy's binary interface
        fixes them.
        """
        symbol, _ = self.instance(name, tuple(types))
        lines: list[str] = []
        parameters: list[str] = []
        for k, t in enumerate(types):
            lines += [f"%word{k} = getelementptr i64, ptr %words, i64 {k}"]
            kind = llvm(t, 1)
            lines += [f"%v{k} = load {kind}, ptr %word{k}"]
            if not isinstance(t, ArrayOf):
                parameters.append(f"{kind} %v{k}")
                continue
            for what, at in (("data", platform.head), ("sizes", platform.head + 16)):
                lines += [f"%{what}{k}.at = getelementptr i8, ptr %v{k}, i64 {at}"]
                lines += [f"%{what}{k} = load ptr, ptr %{what}{k}.at"]
            parameters.append(f"ptr %data{k}")
            for axis in range(t.axes):
                lines += [f"%size{k}.{axis}.at = getelementptr i64, ptr %sizes{k}, i64 {axis}"]
                lines += [f"%size{k}.{axis} = load i64, ptr %size{k}.{axis}.at"]
                parameters.append(f"i64 %size{k}.{axis}")
        lines += [f"call void @{symbol}({', '.join(parameters)})", "ret void"]
        body = "\n".join(f"  {line}" for line in lines)
        return self.whole(platform, f"define void @{name}(ptr %words) {_WIDE} {{\n{body}\n}}\n")

    def pointed(self, name: str, types: Sequence[Type], platform: Platform) -> str:
        """The module with a `separate` function under its own name, to be called by other modules."""
        symbol, _ = self.instance(name, tuple(types))
        named = [f"{llvm(t, 1)} %a{k}" for k, t in enumerate(types)]
        call = f"  call void @{symbol}({', '.join(named)})\n  ret void\n"
        return self.whole(platform, f"define void @{name}({', '.join(named)}) {_WIDE} {{\n{call}}}\n")

    def whole(self, platform: Platform, last: str) -> str:
        """The module with all functions requested, and with what is called from outside at its end."""
        head = [f'target triple = "{platform.triple}"', f'target datalayout = "{platform.layout}"']
        return "\n".join([*head, *self.declared.values(), *self._written, last]) + "\n"
