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


def products(J: Array, r: Array) -> tuple[Array, Array, float]:
    """``J'J``, ``J'r`` and ``r'r`` in blocks too small for a linear-algebra library to wake its threads for.

    On a busy machine waiting for those threads costs more than the products themselves.
    """
    rows = max(64, 200_000 // max(1, J.shape[1] + 1) ** 2)
    whole = r.size // rows * rows
    both = np.concatenate([J, r[:, None]], axis=1)
    if not float(np.max(np.abs(both), initial=0.0)) < 1e100:
        return np.zeros((J.shape[1], J.shape[1])), np.zeros(J.shape[1]), math.inf
    blocks = both[:whole].reshape(-1, rows, both.shape[1])
    total = np.matmul(blocks.transpose(0, 2, 1), blocks).sum(axis=0) + both[whole:].T @ both[whole:]
    return total[:-1, :-1], total[:-1, -1], float(total[-1, -1])
