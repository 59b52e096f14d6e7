"""The whole text of one kernel, its functions compiled when they are first called and found again the next time."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput
from upright.laws.linear import Law, Structure
from upright.laws.rule import Rule, Written, line_in
from upright.simulation.kernel.elementary import ALWAYS, definitions
from upright.simulation.kernel.equations import acceleration, step, terms
from upright.simulation.kernel.events import events, places
from upright.simulation.kernel.flavour import Layout
from upright.simulation.kernel.lanes import ROUNDING, RUN_ARGUMENTS, law_text, run_text
from upright.simulation.lowering import cache as stored_code
from upright.simulation.lowering.gpu import threads
from upright.simulation.lowering.module import Module, Platform
from upright.simulation.lowering.operands import FLOAT, INT, ArrayOf, Type, Unsupported

if TYPE_CHECKING:
    from upright.simulation.lowering.webassembly import Wasm

WIDTH = 16
"""Lanes of a block: two AVX-512 or four AVX2 registers of each number hide the latency of the arithmetic."""

_NUMBERS, _TABLE, _MOTION, _PLACES = ArrayOf(1), ArrayOf(2), ArrayOf(3), ArrayOf(1, "int")

RUN: tuple[Type, ...] = (
    INT, INT, INT, _TABLE, _TABLE, _TABLE, _TABLE, _PLACES, _TABLE, _TABLE,
    INT, INT, INT, INT, INT, FLOAT, _NUMBERS, INT, _MOTION, _TABLE, _NUMBERS, INT,
)  # fmt: skip
"""Types of `lanes.RUN_ARGUMENTS`."""

_ARRAYS = [isinstance(t, ArrayOf) for t in RUN]
_WORDS = struct.Struct("=" + "".join("d" if t == FLOAT else "q" for t in RUN))

EVENTS: tuple[Type, ...] = (ArrayOf(0), ArrayOf(0), INT, FLOAT)
"""Types of the arguments of the search of events."""


def source(p: Layout) -> str:
    """Text of the module that steps one plant in one flavour."""
    d = p.derived
    texts = [*d.lumps, *(of for _, _, of in d.trig), *(text for _, text in d.steps), *d.mass, *d.force]
    texts += [p.flavour.loop.text] if isinstance(p.flavour.loop, Written) else []
    functions = definitions(*texts)
    parts = [f'"""Generated kernel of {d.name}; {p.flavour}"""', ALWAYS, *[functions] * bool(functions)]
    parts += [acceleration(p), step(p)]
    parts += [f"@exact\n{p.flavour.loop.text}\n"] if isinstance(p.flavour.loop, Written) else []
    parts += [ROUNDING] if p.flavour.loop else []
    parts += [law_text(p)] if isinstance(p.flavour.loop, Structure) else []
    if p.flavour.dry:
        parts += [terms(p, places(p)), events(p)]
    return "\n\n".join([*parts, run_text(p, 1), run_text(p, WIDTH)])


@cache
def _version() -> str:
    """What the machine code depends on besides the text."""
    return f"{stored_code.lowered_by()} {hashlib.sha256(Path(__file__).read_bytes()).hexdigest()}"


class Kernel:
    """Functions of one kernel's text, each compiled at first use."""

    def __init__(self, text: str, *, strict: bool = False) -> None:
        self.text, self._strict = text, strict
        self.compiled: list[str] = []
        """Names of the functions that were not found in the cache."""
        self._addresses: dict[str, int] = {}

    @cached_property
    def run_1(self) -> Callable[..., None]:
        """Steps one motion."""
        return _steps(self.address("run_1"))

    @cached_property
    def run_16(self) -> Callable[..., None]:
        """Steps blocks of `WIDTH` motions."""
        return _steps(self.address("run_16"))

    @property
    def events(self) -> int:
        """Address of the search of events."""
        return self.address("events")

    def wasm(self, name: str) -> Wasm:
        """Module of WebAssembly of ``run_1`` or ``run_16``, to be called with `lanes.RUN_ARGUMENTS` plainly."""
        from upright.simulation.lowering import webassembly

        def packed() -> bytes:
            made = webassembly.compiled_wasm(
                self.text,
                name,
                dict(zip(RUN_ARGUMENTS.split(", "), RUN, strict=True)),
                lanes=1 if name == "run_1" else webassembly.LANES,
                strict=self._strict,
            )
            return " ".join(made.imports).encode() + b"\n" + made.code

        imports, _, code = self._code(f"wasm {name}", packed).partition(b"\n")
        return webassembly.Wasm(code=code, imports=tuple(imports.decode().split()))

    def library(self) -> list[str]:
        """Functions of the C library that stepping one motion calls."""
        module = Module(self.text, 1, together=True, strict=self._strict)
        module.instance("run_1", RUN)
        return module.library()

    def ptx(self, room: int) -> bytes:
        """Code that steps one motion in each thread of a GPU, with so much `lanes.room`."""
        from upright.simulation.lowering import machine

        return self._code(f"ptx {room}", lambda: machine.ptx(threaded(self.text, room, machine.gpu())))

    def address(self, name: str) -> int:
        """Where ``run_1``, ``run_16`` or ``events`` stands in memory; the former take `run_words`."""
        from upright.simulation.lowering import machine

        if name not in self._addresses:
            code = self._code(name, lambda: machine.compiled(lowered(self.text, name, strict=self._strict)))
            self._addresses[name] = machine.address_of(code, name)
        return self._addresses[name]

    def _code(self, name: str, compiled: Callable[[], bytes]) -> bytes:
        def noted() -> bytes:
            self.compiled.append(name)
            return compiled()

        return stored_code.code(stored_code.key(_version(), name, "strict" * self._strict, self.text), noted)


def _steps(address: int) -> Callable[..., None]:
    """The compiled loop over blocks of lanes at an address, to be called with `lanes.RUN_ARGUMENTS`."""
    from upright.simulation.lowering import machine

    function = machine.function(address)

    def run(*args: Any) -> None:
        function(run_words(*args))

    return run


def run_words(*args: Any) -> bytes:
    """`lanes.RUN_ARGUMENTS` as a compiled loop reads them; whoever keeps the words keeps the arrays as well."""
    return _WORDS.pack(*[id(a) if by_address else a for by_address, a in zip(_ARRAYS, args, strict=True)])


def lowered(text: str, name: str, *, strict: bool = False) -> str:
    """LLVM's text of one function of a kernel, for this processor."""
    from upright.simulation.lowering import machine

    module = Module(text, 1 if name == "run_1" else machine.lanes(), strict=strict)
    if name == "events":
        return module.pointed(name, EVENTS, machine.platform())
    return module.entry(name, RUN, machine.platform())


def threaded(text: str, room: int, platform: Platform) -> str:
    """LLVM's text of a kernel of which each thread steps one motion, with so much `lanes.room`."""
    types: dict[str, Type] = dict(zip(RUN_ARGUMENTS.split(", "), RUN, strict=True))
    return threads(text, "run_1", types, platform, room)


@contextmanager
def compiling(loop: Law | Rule | None) -> Generator[None]:
    """Say in a sentence what of a rule cannot be compiled, and where it stands."""
    try:
        yield
    except Unsupported as error:
        if not isinstance(loop, Rule):
            raise
        where = line_in(loop.function, error.line) if error.function == "rule" else "what it returns"
        raise BadInput(f"the rule cannot be compiled: {error.what} ({where}).") from None


@cache
def kernel(p: Layout) -> Kernel:
    """Compiled kernel of a plant in a flavour."""
    return Kernel(source(p), strict=p.flavour.strict)
