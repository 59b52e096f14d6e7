"""The whole text of one kernel, compiled, and found again the second time.

Two liberties go beyond what Numba documents: a loop may use 512-bit registers, and the search of events is called by
its address, so that it is compiled once and not into every loop. Both write LLVM's text through llvmlite; where a trial
of that fails, or when asked, the text is plain Numba, which gives the same motion more slowly.

The text is written once into the user's cache folder, under the hash of its content and of the compiler's versions, and
imported from there, so that Numba's own cache finds the machine code again; Numba itself asks whether the processor is
the same. A changed plant is another text, so nothing can go stale.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib.util
import os
import shutil
import sys
import tempfile
from functools import cache
from pathlib import Path
from types import ModuleType

from upright.laws.rule import Written
from upright.simulation.kernel.equations import ELEMENTARY, acceleration, step, terms
from upright.simulation.kernel.events import events, places
from upright.simulation.kernel.flavour import Layout
from upright.simulation.kernel.lanes import run

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


@cache
def kernel(p: Layout) -> ModuleType:
    """Compiled kernel of a plant in a flavour, from the cache when it has been there before."""
    text = source(p)
    name = called(text)
    path = written(folder() / f"{name}.py", text)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None  # a .py file always has a loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def called(text: str) -> str:
    """Name of the module with this text."""
    import llvmlite
    import numba

    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__}\n{text}".encode()).hexdigest()[:20]
    return f"upright_kernel_{digest}"


@cache
def folder() -> Path:
    """Folder of the kernels: ``UPRIGHT_CACHE``, else the user's cache folder, else one among temporary files."""
    from platformdirs import user_cache_dir

    places = [os.environ.get("UPRIGHT_CACHE"), user_cache_dir("upright"), _temporary()]
    for place in filter(None, places):
        path = Path(place) / "kernels"
        try:
            path.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=path):
                return path
        except OSError:
            continue
    passing = tempfile.mkdtemp(prefix="upright-")
    atexit.register(shutil.rmtree, passing, ignore_errors=True)
    return Path(passing)


def _temporary() -> str | None:
    """A folder among temporary files that only this user can write to, since code is run from it; or none."""
    if not hasattr(os, "getuid"):  # elsewhere the folder of temporary files is the user's own
        return os.path.join(tempfile.gettempdir(), "upright")
    path = Path(tempfile.gettempdir()) / f"upright-{os.getuid()}"
    try:
        path.mkdir(mode=0o700, exist_ok=True)
        found = path.lstat()
    except OSError:
        return None
    ours = found.st_uid == os.getuid() and not found.st_mode & 0o022 and not path.is_symlink()
    return str(path) if ours else None


def written(path: Path, text: str) -> Path:
    """File with this text: left alone where it is right, else written aside and moved, so that none sees half of it.

    Several processes may do so at once. Its time stamp is fixed, because Numba's cache takes a newer one for a change.
    """
    if _holds(path, text):
        return path
    with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".tmp", delete=False, encoding="utf-8") as file:
        file.write(text)
    try:
        os.utime(file.name, (1e9, 1e9))
        os.replace(file.name, path)
    except OSError:
        # Windows refuses while another process, which wrote the same, has the file open
        os.unlink(file.name)
        if not _holds(path, text):
            raise
    return path


def _holds(path: Path, text: str) -> bool:
    try:
        return path.read_text(encoding="utf-8") == text
    except (OSError, UnicodeDecodeError):
        return False
