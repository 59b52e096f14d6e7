"""What does a sum of squares look like from here? Its value, gradient and Gauss-Newton matrix."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Normal:
    """Sum of squares, its Gauss-Newton matrix J'J and gradient J'r."""

    cost: float
    matrix: Array
    gradient: Array


@dataclass(frozen=True)
class Rows:
    """Residuals (T, outputs) of one run, windows one after another, and their Jacobian (T, outputs, sought here)."""

    residual: Array
    jacobian: Array
    sought: NDArray[np.int64]


def products(J: Array, r: Array) -> tuple[Array, Array, float]:
    """``J'J``, ``J'r`` and ``r'r`` in blocks too small for a linear-algebra library to wake its threads for.

    On a busy machine waiting for those threads costs more than the products themselves.
    """
    total = gram(np.concatenate([J, r[:, None]], axis=1))
    return total[:-1, :-1], total[:-1, -1], float(total[-1, -1])


def gram(both: Array) -> Array:
    """``B'B`` of a tall array (T, p), infinite where it has run away."""
    rows = max(64, 200_000 // max(1, both.shape[1]) ** 2)
    whole = both.shape[0] // rows * rows
    blocks = both[:whole].reshape(-1, rows, both.shape[1])
    with np.errstate(over="ignore", invalid="ignore"):
        total = np.matmul(blocks.transpose(0, 2, 1), blocks).sum(axis=0) + both[whole:].T @ both[whole:]
    return total if np.isfinite(total.sum()) else np.full_like(total, math.inf)
