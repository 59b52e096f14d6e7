"""How fast is C on this machine? Compiles `furuta.c` on the spot, plainly and in lanes, and calls it."""

from __future__ import annotations

import ctypes
import functools
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.measure import Unavailable

SOURCE = Path(__file__).with_name("furuta.c")
LANES = 16
FLAGS = ("-std=gnu11", "-shared", "-fPIC", "-O3", "-march=native")
# gcc needs its partial redundancy elimination off, or the lane loop keeps a branch and stays scalar.
VECTOR = (f"-DLANES={LANES}", "-ffast-math", "-fopenmp-simd", "-fno-tree-pre")
# Left alone, gcc and LLVM take 256 bits where 512 are faster: ask for each, keep the best.
WIDTHS = ("-mprefer-vector-width=512", "-mprefer-vector-width=256", "")


class NoCompiler(Unavailable):
    """There is no C compiler here, or it refuses the source; the reason is the message."""


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


class Furuta:
    """The compiled pendulum; arrays in, arrays out."""

    def __init__(self, library: Path, flags: str) -> None:
        self._library = ctypes.CDLL(str(library))
        self.flags = flags

    def trajectory(
        self,
        p: np.ndarray,
        x0: np.ndarray,
        *,
        h: float,
        steps: int,
        friction: bool = False,
        torque: np.ndarray | None = None,
    ) -> np.ndarray:
        """States (steps + 1, 4) of one run, in the order psi, theta, psi_dot, theta_dot."""
        out = np.empty((steps + 1, 4))
        held = None if torque is None else _pointer(torque)
        self._library.trajectory(
            _pointer(p), _pointer(x0), held, ctypes.c_double(h), steps, int(friction), _pointer(out)
        )
        return out

    def ensemble(self, p: np.ndarray, x0: np.ndarray, loop: np.ndarray, *, samples: int, friction: bool) -> np.ndarray:
        """Last states (4, n) of n closed loops; p (10, n), x0 (4, n)."""
        p, x0 = np.ascontiguousarray(p), np.ascontiguousarray(x0)
        last = np.empty_like(x0)
        n = x0.shape[1]
        self._library.ensemble(_pointer(p), _pointer(x0), _pointer(loop), samples, n, int(friction), _pointer(last))
        return last


@functools.cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="furuta-")


@functools.cache
def compiled(*, lanes: bool, width: str = "") -> Furuta:
    """Compile one variant; raises `NoCompiler` with the reason."""
    compiler = os.environ.get("CC") or next(filter(shutil.which, ("gcc", "cc", "clang")), None)
    if compiler is None:
        raise NoCompiler("no C compiler was found (gcc, cc, clang)")
    flags = [*FLAGS, *(VECTOR if lanes else ()), *([width] if width else [])]
    library = Path(_folder().name) / f"furuta-{'lanes' if lanes else 'scalar'}{width}.so"
    done = subprocess.run(
        [*compiler.split(), *flags, str(SOURCE), "-o", str(library), "-lm"],
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        check=False,
    )
    if done.returncode:
        raise NoCompiler(f"{compiler} refused the baseline: {done.stderr.strip().splitlines()[-1]}")
    return Furuta(library, " ".join([compiler, *flags]))


@functools.cache
def fastest_lanes(seconds: Callable[[Furuta], float]) -> Furuta:
    """Variant in lanes with the vector width for which `seconds(furuta)` is smallest."""
    variants, refusals = [], []
    for width in WIDTHS:
        try:
            variants.append(compiled(lanes=True, width=width))
        except NoCompiler as reason:
            refusals.append(reason)
    if not variants:
        raise refusals[0]
    return min(variants, key=seconds)
