"""How are lanes laid out in blocks, and blocks shared among threads?"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput

Array = NDArray[np.float64]


def padded(a: Array, width: int, extra: int = 0) -> Array:
    """Contiguous copy with the last lane repeated and room for `extra` rows."""
    rows, lanes = a.shape
    out = np.empty((rows + extra, width))
    out[:rows, :lanes] = a
    out[:rows, lanes:] = a[:, -1:]
    return out


def aligned(size: int) -> tuple[Array, int]:
    """Zeros that start on a cache line, so that no vector straddles two; and where that is."""
    raw = np.zeros(size + 7)
    address = raw.ctypes.data
    first = (-address // 8) % 8
    return raw[first : first + size], address + 8 * first


def recorded(shape: tuple[int, int, int], memory: Array | None) -> Array:
    """Array to record into: fresh, or the first part of `memory`."""
    if memory is None:
        return np.empty(shape)
    size = math.prod(shape)
    if memory.ndim != 1 or memory.size < size or memory.dtype != np.float64 or not memory.flags.carray:
        raise BadInput(f"memory needs at least {size} contiguous float64 values in one row, got {memory.shape}.")
    return memory[:size].reshape(shape)


def share(step: Callable[[int, int], None], blocks: int, threads: int) -> None:
    """Let threads take turns at pieces of the work; the kernel holds no lock."""
    from concurrent.futures import ThreadPoolExecutor

    pieces = min(blocks, 4 * threads)
    edges = [blocks * k // pieces for k in range(pieces + 1)]
    step(0, 0)  # compiled before the threads ask for it
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda k: step(edges[k], edges[k + 1]), range(pieces)))
