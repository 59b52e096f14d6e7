"""A kernel's text as a module of WebAssembly, which a page or Node can instantiate; no linker and no C library needed.

LLVM writes an object for a linker: its functions are complete, and its linking section says which of them has which
name. While the module stands alone every index in it is already right, so that an export section is all that it lacks.
Formats: WebAssembly core specification 2.0, chapter 5; tool conventions, ``Linking.md``, for the symbol table.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from upright.errors import BadInput
from upright.simulation.lowering import machine
from upright.simulation.lowering.module import Module
from upright.simulation.lowering.operands import FLOAT, ArrayOf, Type, llvm

EXPORT = "run"
"""Name of the one function of a module that is called from outside."""

LANES = 2
"""Lanes of a vector: one register of 128 bits."""

_MAGIC = b"\0asm\1\0\0\0"
_CUSTOM, _TYPE, _IMPORT, _EXPORT, _DATA = 0, 1, 2, 7, 11
# sections in the order of the specification, that of the data's count before the code
_ORDER = {1: 1, 2: 2, 3: 3, 4: 4, 5: 5, 13: 6, 6: 7, 7: 8, 8: 9, 9: 10, 12: 11, 10: 12, 11: 13}
_SYMBOLS, _FUNCTION, _DATA_SYMBOL, _SECTION = 8, 0, 1, 3
_UNDEFINED, _EXPLICIT_NAME = 0x10, 0x40


@dataclass(frozen=True, kw_only=True)
class Wasm:
    """A module of WebAssembly.

    Attributes
    ----------
    code : bytes
        The module. It imports ``env.__linear_memory`` and ``env.__stack_pointer``, and exports `EXPORT`.
    imports : tuple of str
        Functions of the C library that it imports from ``env``; a page takes them from ``Math``, whose last bits are
        the browser's own.
    """

    code: bytes
    imports: tuple[str, ...]


def compiled_wasm(text: str, entry: str, arguments: Mapping[str, Type], *, lanes: int, strict: bool) -> Wasm:
    """Module that exports ``run(...)``, the entry of a text with its arguments given plainly.

    Whole numbers and sizes are 32 bits wide, so that JavaScript's own numbers are passed: an array is its address and
    its sizes, one after the other.

    Parameters
    ----------
    text, entry : str
        Text of the functions, and the name of the one to call.
    arguments : mapping of str to Type
        Those of the entry, in its order.
    lanes : int
        Lanes of a vector.
    strict : bool
        Whether every operation is rounded by itself, in the order of the text.

    Raises
    ------
    BadInput
        When constants would have to lie in memory, or a function is imported that `Math` does not have.
    """
    module = Module(text, lanes, together=True, strict=strict)
    symbol, _ = module.instance(entry, tuple(arguments.values()))
    parameters: list[str] = []
    passed: list[str] = []
    lines: list[str] = []
    for k, t in enumerate(arguments.values()):
        number = t == FLOAT
        if isinstance(t, ArrayOf) or number:
            parameters.append(f"{llvm(t, 1)} %a{k}")
            passed.append(parameters[-1])
        for part in [] if number else [f"{k}.{axis}" for axis in range(t.axes)] if isinstance(t, ArrayOf) else [f"{k}"]:
            parameters.append(f"i32 %n{part}")
            lines.append(f"  %w{part} = sext i32 %n{part} to i64")
            passed.append(f"i64 %w{part}")
    body = "\n".join([*lines, f"  call void @{symbol}({', '.join(passed)})", "  ret void"])
    last = f"define void @{EXPORT}({', '.join(parameters)}) nounwind {{\n{body}\n}}\n"
    return linked(machine.wasm(module.whole(machine.page_platform(), last)), EXPORT)


MATH = ("acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "cos", "cosh", "exp", "expm1", "hypot",
        "log", "log10", "log1p", "log2", "pow", "sin", "sinh", "tan", "tanh")  # fmt: skip
"""Functions of the C library that JavaScript's ``Math`` has under the same name."""


def linked(code: bytes, export: str) -> Wasm:
    """What a linker makes of an object that stands alone: sections for linkers are left out, one function is exported.

    Raises
    ------
    BadInput
        When the object has data of its own, or imports a function that JavaScript does not have.
    """
    parts = list(_sections(code))
    kinds = [kind for kind, _ in parts]
    if _DATA in kinds:
        raise BadInput(
            "the kernel needs a table of constants in memory, which a page has no place for; "
            "write the rule with arithmetic instead of a table."
        )
    imports = tuple(_imported(next((body for kind, body in parts if kind == _IMPORT), b"\0")))
    if missing := [name for name in imports if name not in MATH]:
        raise BadInput(f"a page has no {', '.join(missing)}; its Math has {', '.join(MATH)}.")
    names = {k: v for kind, body in parts if kind == _CUSTOM for k, v in _functions(body)}
    word = export.encode()
    exports = b"\1" + _unsigned(len(word)) + word + b"\0" + _unsigned(names[export])
    rest = [(kind, body) for kind, body in parts if kind != _CUSTOM] + [(_EXPORT, exports)]
    rest.sort(key=lambda part: _ORDER[part[0]])
    return Wasm(
        code=_MAGIC + b"".join(bytes([kind]) + _unsigned(len(body)) + body for kind, body in rest), imports=imports
    )


def _number(code: bytes, at: int) -> tuple[int, int]:
    """An unsigned number in LEB128, and where it ends."""
    value = shift = 0
    while True:
        byte, at = code[at], at + 1
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            return value, at


def _unsigned(n: int) -> bytes:
    out = b""
    while n > 127:
        out, n = out + bytes([n & 127 | 128]), n >> 7
    return out + bytes([n])


def _name(code: bytes, at: int) -> tuple[str, int]:
    size, at = _number(code, at)
    return code[at : at + size].decode(), at + size


def _sections(code: bytes) -> Iterator[tuple[int, bytes]]:
    if code[:8] != _MAGIC:
        raise ValueError("LLVM wrote no object of WebAssembly")
    at = 8
    while at < len(code):
        kind = code[at]
        size, first = _number(code, at + 1)
        yield kind, code[first : first + size]
        at = first + size


def _imported(body: bytes) -> Iterator[str]:
    """Names of the functions that an import section asks for."""
    count, at = _number(body, 0)
    for _ in range(count):
        _, at = _name(body, at)
        name, at = _name(body, at)
        kind, at = body[at], at + 1
        if kind == 0:  # a function, its type
            _, at = _number(body, at)
            yield name
        elif kind == 3:  # a global: type and whether it changes
            at += 2
        else:  # a table has a type of its elements before its limits, a memory has limits
            at += kind == 1
            bounded, at = _number(body, at)
            for _ in range(1 + (bounded & 1)):
                _, at = _number(body, at)


def _functions(body: bytes) -> Iterator[tuple[str, int]]:
    """Functions defined in an object, by name, with their index; none of a section that is not the linker's."""
    section, at = _name(body, 0)
    if section != "linking":
        return
    _, at = _number(body, at)  # version
    while at < len(body):
        kind = body[at]
        size, at = _number(body, at + 1)
        end = at + size
        if kind == _SYMBOLS:
            yield from _symbols(body, at)
        at = end


def _symbols(body: bytes, at: int) -> Iterator[tuple[str, int]]:
    count, at = _number(body, at)
    for _ in range(count):
        kind = body[at]
        flags, at = _number(body, at + 1)
        if kind == _DATA_SYMBOL:
            _, at = _name(body, at)
            for _ in range(0 if flags & _UNDEFINED else 3):  # segment, offset, size
                _, at = _number(body, at)
            continue
        index, at = _number(body, at)
        if kind != _SECTION and (not flags & _UNDEFINED or flags & _EXPLICIT_NAME):
            name, at = _name(body, at)
            if kind == _FUNCTION:
                yield name, index
