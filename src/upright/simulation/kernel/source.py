"""What is the whole text of one kernel, and what does it ask of Numba?

Two liberties go beyond what Numba documents: a loop may use 512-bit registers, and the search of events is called by
its address, so that it is compiled once and not into every loop. Both write LLVM's text through llvmlite; where a trial
of that fails, or when asked, the text is plain Numba, which gives the same motion more slowly.
"""

from __future__ import annotations

from functools import cache

from upright.laws.rule import Written
from upright.simulation.kernel.equations import ELEMENTARY, acceleration, step, terms
from upright.simulation.kernel.events import events
from upright.simulation.kernel.flavour import Layout
from upright.simulation.kernel.lanes import run
from upright.simulation.kernel.reach import places

WIDTH = 16
"""Lanes of a block: two AVX-512 or four AVX2 registers of each number hide the latency of the arithmetic."""

# no `nnan` or `ninf`: a lane that diverges must stay visible as NaN
HEAD = '''"""Generated kernel of {name}; {flavour}"""

from math import cos, exp, pi, sin, sqrt, tan

import numpy
from numba import cfunc, float64, int64, njit
from numpy import floor, nan

FAST = {{"contract", "reassoc", "arcp", "nsz", "afn"}}
BARE = {{"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}}
inline = njit(fastmath=FAST, forceinline=True, **BARE)
inline_strict = njit(fastmath={{"contract"}}, forceinline=True, **BARE)
scalar = njit(fastmath={{"contract"}}, **BARE)
compiled = njit(fastmath=FAST, error_model="numpy", nogil=True, cache=True)
'''

DIRECT = '''
from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def wide(context):
    """Let the enclosing function use 512-bit registers where there are any; LLVM would settle for 256."""

    def generate(context, builder, signature, args):
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.void(), generate


@intrinsic
def call(context, address, lane, scratch, L, h):
    """Call the search of events by its address, so that it is compiled once and not into every loop."""

    def generate(context, builder, signature, args):
        number = ir.DoubleType().as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [number, number, ir.IntType(64), ir.DoubleType()])
        lane, scratch = (builder.inttoptr(a, number) for a in args[1:3])
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), [lane, scratch, *args[3:]])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64, types.int64, types.float64), generate

'''


def source(p: Layout) -> str:
    """Text of the module that steps one plant in one flavour."""
    parts = [HEAD.format(name=p.derived.name, flavour=p.flavour), "" if p.plain else DIRECT]
    parts += [ELEMENTARY, acceleration(p), step(p)]
    parts += [f"@inline_strict\n{p.flavour.loop.text}\n"] if isinstance(p.flavour.loop, Written) else []
    if p.flavour.dry:
        parts += [terms(p, places(p)), events(p)]
    return "\n\n".join([*parts, run(p, 1), run(p, WIDTH)])


@cache
def direct() -> bool:
    """Whether llvmlite still writes, and LLVM still reads, what `DIRECT` asks for."""
    try:
        from llvmlite import binding, ir

        nothing = ir.FunctionType(ir.VoidType(), [])
        module = ir.Module()
        function = ir.Function(module, nothing, "trial")
        set.add(function.attributes, '"prefer-vector-width"="512"')
        builder = ir.IRBuilder(function.append_basic_block())
        builder.call(builder.inttoptr(ir.Constant(ir.IntType(64), 8), nothing.as_pointer()), [])
        builder.ret_void()
        binding.parse_assembly(str(module)).verify()
        return '"prefer-vector-width"="512"' in str(module)
    except Exception:  # whatever another version makes of it
        return False
