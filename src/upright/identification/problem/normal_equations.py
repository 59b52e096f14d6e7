"""Normal equations of least squares: the sum of squares, its gradient ``J'r`` and its Gauss-Newton matrix ``J'J``."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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


def squares(lanes: Sequence[Array], target: Array, offset: Array, W: Array, scale: Array | None = None) -> Array:
    """``B'B`` (p, p) of what p lanes miss and how they differ, ``B = W (z_0 - y, z_1 - z_0, ...)``.

    Parameters
    ----------
    lanes : sequence of (T, p) arrays
        Simulated outputs, one after another; they are multiplied by `scale`, then `offset` is added, (outputs, p) each.
    target : (T, outputs) array
        Measured outputs.
    W : (rows, outputs) array
        Weights of the outputs, or of combinations of them; an output that has none may run away.

    Notes
    -----
    In blocks small enough to stay near the processor.
    """
    lengths = len(lanes), BLOCK, offset.shape[1]
    blocks, mixed, total = np.empty(lengths), np.empty(lengths[1:]), np.zeros((lengths[2],) * 2)
    rows = [[(int(k), float(row[k])) for k in np.flatnonzero(row)] for row in W if row.any()]
    scaled = {k: scale is not None and bool((scale[k] != 1.0).any()) for row in rows for k, _ in row}
    with np.errstate(over="ignore", invalid="ignore"):  # a lane that ran away makes the sum infinite
        for first in range(0, target.shape[0], BLOCK):
            here = slice(first, first + BLOCK)
            B = blocks[:, : target[here].shape[0]]
            for k, own in scaled.items():
                z = lanes[k][here]
                if own and scale is not None:
                    z = np.multiply(z, scale[k], out=B[k])
                if offset[k].any():
                    z = np.add(z, offset[k], out=B[k])
                unmoved = z[:, :1].copy()
                np.subtract(z[:, 1:], unmoved, out=B[k, :, 1:])
                np.subtract(unmoved[:, 0], target[here, k], out=B[k, :, 0])
            for (k, weight), *others in rows:
                together = np.multiply(B[k], weight, out=mixed[: B.shape[1]])
                for other, its in others:
                    together += its * B[other]
                total += together.T @ together
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
