"""Where does the compiled kernel come from the second time?

The text of a kernel is written once into the user's cache folder, under the hash of its content and of Numba's
version, and imported from there, so that Numba's own cache finds the machine code again.
A changed plant is another text, so nothing can go stale.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
from functools import cache
from pathlib import Path
from types import ModuleType

from upright.simulation.equations import ELEMENTARY, acceleration, step, terms
from upright.simulation.events import events
from upright.simulation.flavour import Layout
from upright.simulation.lanes import run
from upright.simulation.reach import places

WIDTH = 16
"""Lanes of a block: two AVX-512 or four AVX2 registers of each number hide the latency of the arithmetic."""

# no `nnan` or `ninf`: a lane that diverges must stay visible as NaN (DESIGN 2)
HEAD = '''"""Generated kernel of {name}; {flavour}"""

from math import cos, exp, pi, sin, sqrt, tan

import numpy
from llvmlite import ir
from numba import cfunc, float64, int64, njit, types
from numba.extending import intrinsic
from numpy import empty, floor, nan, zeros

FAST = {{"contract", "reassoc", "arcp", "nsz", "afn"}}
BARE = {{"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}}
inline = njit(fastmath=FAST, forceinline=True, **BARE)
inline_strict = njit(fastmath={{"contract"}}, forceinline=True, **BARE)
scalar = njit(fastmath={{"contract"}}, **BARE)
compiled = njit(fastmath=FAST, error_model="numpy", nogil=True, cache=True)


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
    parts = [HEAD.format(name=p.derived.name, flavour=p.flavour), ELEMENTARY, acceleration(p), step(p)]
    if p.flavour.dry:
        parts += [terms(p, places(p)), events(p)]
    return "\n\n".join([*parts, run(p, 1), run(p, WIDTH)])


@cache
def folder() -> Path:
    """Folder of the kernels: ``UPRIGHT_CACHE``, else the user's cache folder, else a temporary one."""
    from platformdirs import user_cache_dir

    for place in (os.environ.get("UPRIGHT_CACHE"), user_cache_dir("upright")):
        if place:
            path = Path(place) / "kernels"
            try:
                path.mkdir(parents=True, exist_ok=True)
                with tempfile.TemporaryFile(dir=path):
                    return path
            except OSError:
                continue
    return Path(tempfile.mkdtemp(prefix="upright-"))


@cache
def kernel(p: Layout) -> ModuleType:
    """Compiled kernel of a plant in a flavour, from the cache when it has been there before."""
    import numba

    text = source(p)
    digest = hashlib.sha256(f"{numba.__version__}\n{text}".encode()).hexdigest()[:20]
    name = f"upright_kernel_{digest}"
    path = folder() / f"{name}.py"
    if not path.exists():
        # written aside and moved, so that no other process sees half a file; a fixed time stamp, because Numba's
        # cache takes a newer one for a change
        with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False, encoding="utf-8") as file:
            file.write(text)
        os.utime(file.name, (1e9, 1e9))
        os.replace(file.name, path)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None  # a .py file always has a loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
