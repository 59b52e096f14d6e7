"""Which gains put out every command as rounded? Where the law is exact but for the steps of the command's column,
a rounded row says more than its mean: the command before rounding lay within half a step. No noise is averaged; every
row bounds the gains, as Milanese and Vicino (1991) do with errors that are unknown but bounded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SLACK = 1e-10  # of the command, for the arithmetic
FEW = 400  # rows to begin with, and to add at most
LARGEST = 1e9  # times the command; a gain that nothing bounds stops there


def nearest(X: Array, u: Array) -> tuple[Array, float]:
    """Gains (p,) whose largest residual is least, and that residual."""
    size = _size(X)
    A, p = X / size, X.shape[1]
    one = np.ones((len(A), 1))
    cost = np.concatenate([np.zeros(p), [1.0]])
    found = _least(cost, np.block([[A, -one], [-A, -one]]), np.concatenate([u, -u]))
    return found[:p] / size, float(found[p])


def range_of(X: Array, u: Array, weights: Array, within: float) -> tuple[float, float]:
    """Least and largest ``weights @ gains`` of all gains whose residuals stay within a bound."""
    size = _size(X)
    A = X / size
    G, h, cost = np.concatenate([A, -A]), np.concatenate([u + within, within - u]), weights / size
    return float(cost @ _least(cost, G, h)), float(cost @ _least(-cost, G, h))


def _size(X: Array) -> Array:
    size = np.abs(X).max(axis=0)
    return np.where(size > 0, size, 1.0)


def _least(cost: Array, G: Array, h: Array) -> Array:
    """Where ``cost @ x`` is least under ``G x <= h``: solved on some rows, to which those violated are added."""
    from scipy.optimize import linprog

    slack = SLACK * float(np.abs(h).max())
    rows = np.unique(np.linspace(0, len(h) - 1, FEW).astype(int))
    x = np.zeros(cost.size)
    for _ in range(60):
        found = linprog(cost, A_ub=G[rows], b_ub=h[rows], bounds=(-LARGEST, LARGEST), method="highs")
        if found.x is None:
            return x
        x = np.asarray(found.x, dtype=np.float64)
        over = G @ x - h
        if over.max() <= slack:
            return x
        worst = np.argpartition(over, -FEW)[-FEW:] if over.size > FEW else np.arange(over.size)
        rows = np.union1d(rows, worst[over[worst] > slack])
    return x
