"""Normal equations of least squares: the sum of squares, its gradient ``J'r`` and its Gauss-Newton matrix ``J'J``."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upright.simulation.lowering.routine import Routine

Array = NDArray[np.float64]
Places = NDArray[np.int64]

NULL = 1e-6
"""Singular values of the scaled Jacobian below this share of the largest are zero: finite differences are no better."""


@dataclass(frozen=True)
class Normal:
    """Sum of squares, its Gauss-Newton matrix J'J and gradient J'r."""

    cost: float
    matrix: Array
    gradient: Array

    @classmethod
    def lost(cls, size: int) -> Normal:
        """Cost of a point from where the model diverges: an infinite cost."""
        return cls(math.inf, np.zeros((size, size)), np.zeros(size))

    @classmethod
    def by_differences(
        cls, residual: Callable[[Array], Array], x: Array, steps: Array, *, central: bool = False
    ) -> Normal:
        """Normal equations of a function's values (T,), its Jacobian by differences over `steps` (n,)."""
        with np.errstate(all="ignore"):  # a walk that has left for where the model is not finite is called back
            r = residual(x)
            if not finite(r):
                return cls.lost(x.size)
            J = np.empty((r.size, x.size))
            for i, step in enumerate(np.diag(steps)):
                behind = residual(x - step) if central else r
                J[:, i] = (residual(x + step) - behind) / (steps[i] * (1 + central))
            normal = cls(float(r @ r), J.T @ J, J.T @ r)
        return normal if math.isfinite(normal.cost) and finite(normal.matrix) else cls.lost(x.size)


BLOCK = 1024
"""Samples whose lanes stay near the processor."""

VECTOR = 16
"""Lanes that machine code takes at once, as the kernel of a plant does."""

TEXT = Path(__file__).with_suffix(".kernel").read_text(encoding="utf-8")
"""What `squares` sums, in the language of kernels."""


def finite(values: Array) -> bool:
    """Whether all values are finite, tested by their sum: one pass without a temporary."""
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.isfinite(values.sum()))


def slopes(lanes: Array, steps: Array, *, central: bool = False) -> Array:
    """Derivatives (..., n) from lanes (..., n + 1), the first unmoved and then each number moved by its one of `steps`.

    When `central`, n more lanes are moved the other way. At the edge of where a model is stable one side may run away:
    its squares overflow, and the other side alone tells. Where both do there is no derivative.
    """
    n = steps.size
    here, ahead = lanes[..., :1], lanes[..., 1 : n + 1]
    with np.errstate(over="ignore", invalid="ignore"):
        if not central:
            return (ahead - here) / steps
        out = (ahead - lanes[..., n + 1 :]) / (2 * steps)
        if finite(out * out):
            return out
        sides = np.stack([(ahead - here) / steps, (here - lanes[..., n + 1 :]) / steps])
        tells = np.isfinite(np.sum(sides * sides, axis=tuple(range(1, sides.ndim - 1))))
        for k in np.flatnonzero(tells.any(axis=0) & ~tells.all(axis=0)):
            out[..., k] = sides[int(np.argmax(tells[:, k])), ..., k]
    return out


def squares(
    motion: Array, columns: Sequence[int], target: Array, offset: Array, W: Array, scale: Array | None = None,
    kept: Places | None = None,
) -> Array:  # fmt: skip
    """``B'B`` (p, p) of what p lanes miss and how they differ, ``B = W (z_0 - y, z_1 - z_0, ...)``.

    Parameters
    ----------
    motion : (T, rows, lanes) array
        Simulated states, at least p lanes; their `columns` are multiplied by `scale`, then `offset` is added,
        (outputs, p) each. Fastest where the lanes are a multiple of `VECTOR`.
    target : (T, outputs) array
        Measured outputs.
    W : (combinations, outputs) array
        Weights of the outputs, or of combinations of them; an output that has none may run away.
    kept : (samples,) array, optional
        The samples that count, all when omitted.

    Notes
    -----
    In blocks small enough to stay near the processor. Every operation is rounded by itself: where stiction makes a
    staircase of the cost, a last bit may lead a search to another step.
    """
    outputs, p = offset.shape
    if more := -motion.shape[2] % VECTOR:
        motion = np.pad(motion, ((0, 0), (0, 0), (0, more)), mode="edge")
    width, W = motion.shape[2], W[W.any(axis=1)]
    gain, shift = np.ones((outputs, width)), np.zeros((outputs, width))
    shift[:, :p] = offset
    if scale is not None:
        gain[:, :p] = scale
    kept = np.arange(target.shape[0]) if kept is None else kept
    block, first, total = np.empty((len(W), BLOCK, width)), np.zeros(1, dtype=np.int64), np.zeros((p, p))
    fill = Routine(
        TEXT, "differences", motion, np.array(columns, dtype=np.int64), np.ascontiguousarray(target), kept, W, gain,
        shift, first, block, vectors=True,
    )  # fmt: skip
    with np.errstate(over="ignore", invalid="ignore"):  # a lane that ran away makes the sum infinite
        for begin in range(0, kept.size, BLOCK):
            first[0] = begin
            fill()
            for B in block[:, : kept.size - begin, :p]:
                total += B.T @ B
    return total if finite(total) else np.full_like(total, math.inf)


def products(J: Array, r: Array) -> tuple[Array, Array, float]:
    """``J'J``, ``J'r`` and ``r'r``, infinite where they have run away.

    In blocks too small for a linear-algebra library to wake its threads for: on a busy machine waiting for those
    threads costs more than the products themselves.
    """
    both = np.concatenate([J, r[:, None]], axis=1)
    rows = max(64, 200_000 // max(1, both.shape[1]) ** 2)
    whole = both.shape[0] // rows * rows
    blocks = both[:whole].reshape(-1, rows, both.shape[1])
    with np.errstate(over="ignore", invalid="ignore"):
        total = np.matmul(blocks.transpose(0, 2, 1), blocks).sum(axis=0) + both[whole:].T @ both[whole:]
    if not finite(total):
        total = np.full_like(total, math.inf)
    return total[:-1, :-1], total[:-1, -1], float(total[-1, -1])


def to_one(A: Array) -> Array:
    """Factors (n,) of rows and columns that bring the diagonal of a matrix (n, n) to one; 0 where it has nothing."""
    d = np.sqrt(np.maximum(np.diag(A), 0.0))
    return np.where(d > 0, 1 / np.where(d > 0, d, 1.0), 0.0)


def correlation(C: Array) -> Array:
    """Correlations (n, n) of a covariance, one with itself also of what does not scatter."""
    s = to_one(C)
    R = C * s[:, None] * s
    np.fill_diagonal(R, 1.0)
    return R


def pseudo_inverse(A: Array) -> Array:
    """Inverse of a Gauss-Newton matrix in the directions that it sees; columns scaled to one first."""
    s = to_one(A)
    w, V = np.linalg.eigh(A * s[:, None] * s)
    keep = w > NULL**2 * max(float(w[-1]), 0.0) if w.size else np.zeros(0, dtype=bool)
    inverse = (V[:, keep] / w[keep]) @ V[:, keep].T
    return inverse * s[:, None] * s
