"""Restarted predictions whose initial error is eliminated by variable projection.

A window starts from a measured state, and near upright a slip of a thousandth grows a thousandfold in a second: such
windows say little about friction, and everything about the encoder. Left alone they outvote the rest (seen: a fall
from upright, whose first window took all dry friction out of the model). The restart's error is therefore eliminated:
it is worth as much as the samples that the state was smoothed from, neither more nor less. Scores stay predictions
from the measured state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BENDING = 4.0
"""Factor on the variance of a smoothed state, for what smoothing bends."""

PERTURBATION = 1e-5
"""Share of a state's spread by which restarts are shifted to see what follows."""

STEPS = 6
"""Gauss-Newton steps of a restart at most."""

ENOUGH = 1e-6
"""Relative gain of the cost below which restarts have settled."""


def smoothed_variance(samples: int, width: int, dt: float, starts: NDArray[np.int64], *, order: int = 4) -> Array:
    """Variances (W, 2) of smoothed position and speed at some samples, for unit variance of the measured signal.

    Polynomials of `order` over `width` samples centred on the restart, one-sided at the ends of the record.
    """
    m = min(max(order + 2, width), samples)
    m -= 1 - m % 2
    order = min(order, m - 1)
    half = m // 2
    out = np.empty((starts.size, 2))
    s = np.arange(m) / max(m - 1, 1)
    for row, at in enumerate(starts):
        here = min(max(int(at), half), samples - 1 - half)
        place = (half + int(at) - here) / max(m - 1, 1)
        C = np.linalg.pinv(np.vander(s - place, order + 1, increasing=True))
        out[row, 0] = C[0] @ C[0]
        out[row, 1] = C[1] @ C[1] / (max(m - 1, 1) * dt) ** 2 if order else 0.0
    return BENDING * out


@dataclass(frozen=True, kw_only=True)
class Restart:
    """Windows restarted where it suits them best, at a price.

    `shift` (states, W, 1) is the change of their first states, `residual` (W, R) the weighted residuals then and
    `slope` (W, R, S) their change per unit of the S uncertain states; `change` (W, S) is that of these states and
    `variance` (W, S) theirs over that of a residual, 0 for a state that is known.
    """

    shift: Array
    residual: Array
    slope: Array
    change: Array
    variance: Array

    @property
    def price(self) -> Array:
        """Each state's change (W, S) over its standard error."""
        return _over(self.change, np.sqrt(self.variance))

    def rows(self, residual: Array, jacobian: Array) -> tuple[Array, Array]:
        """Residuals (W, R + S) and their Jacobian (W, R + S, m) once the restarts follow the parameters.

        Variable projection (Golub and Pereyra 1973) with Kaufman's Jacobian: the least of ``|r + A d|^2 + |d/s|^2``.
        """
        with np.errstate(over="ignore", invalid="ignore"):  # from where the motion runs away nothing finite comes
            A = self.slope * np.sqrt(self.variance)[:, None, :]
            follow = -_solve(A, np.matmul(A.transpose(0, 2, 1), jacobian))
            moved = np.concatenate([jacobian + np.matmul(A, follow), follow], axis=1)
        return np.concatenate([residual, self.price], axis=1), moved


def settle(respond: Callable[[Array], tuple[Array, Array]], variance: Array) -> tuple[Array, Array, Array]:
    """Change of the restarts (W, S) that every window likes best, residuals (W, R) and slopes (W, R, S) there.

    Gauss-Newton steps from the measured states, halved twice for a window that they make worse.
    `respond` maps a change to residuals and slopes.
    """
    s = np.sqrt(variance)
    d = np.zeros(variance.shape)
    residual, slope = respond(d)
    cost = _cost(residual, d, s)
    step, stride = _step(residual, slope, d, s), np.ones(len(d))
    for _ in range(STEPS):
        trial = d + stride[:, None] * step
        r, A = respond(trial)
        new = _cost(r, trial, s)
        better = new < cost
        gained = float(np.sum(np.where(better, cost - np.where(better, new, 0.0), 0.0)))
        d = np.where(better[:, None], trial, d)
        residual = np.where(better[:, None], r, residual)
        slope = np.where(better[:, None, None], A, slope)
        cost = np.where(better, new, cost)
        if gained <= ENOUGH * float(np.sum(cost)) and better.any():
            break
        step, stride = _step(residual, slope, d, s), np.where(better, 1.0, stride / 4)
    return d, residual, slope


def _step(residual: Array, slope: Array, d: Array, s: Array) -> Array:
    """Gauss-Newton step (W, S) of the restarts; none where a simulation ran away."""
    with np.errstate(over="ignore", invalid="ignore"):
        squares = np.sum(residual**2, axis=1) + np.sum((slope * s[:, None, :]) ** 2, axis=(1, 2))
    sound = np.isfinite(squares)
    A = np.where(sound[:, None, None], slope, 0.0) * s[:, None, :]
    r = np.where(sound[:, None], residual, 0.0)
    gradient = np.matmul(A.transpose(0, 2, 1), r[:, :, None]) + _over(d, s)[:, :, None]
    return -_solve(A, gradient)[:, :, 0] * s


def _solve(A: Array, b: Array) -> Array:
    """Solutions (W, S, m) of ``(A'A + 1) x = b``; NaN for windows in which A has run away."""
    M = np.matmul(A.transpose(0, 2, 1), A) + np.eye(A.shape[2])
    ran_away = ~np.isfinite(M).all(axis=(1, 2))
    M[ran_away] = np.eye(A.shape[2])
    try:
        x = np.asarray(np.linalg.solve(M, b), dtype=np.float64)
    except np.linalg.LinAlgError:  # where A is so large that rounding takes the 1
        x = np.asarray(np.linalg.pinv(M, hermitian=True) @ b, dtype=np.float64)
    x[ran_away] = np.nan
    return x


def _over(d: Array, s: Array) -> Array:
    return d / np.where(s > 0, s, 1.0)


def _cost(residual: Array, d: Array, s: Array) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        cost = np.sum(residual**2, axis=1) + np.sum(_over(d, s) ** 2, axis=1)
    return np.where(np.isfinite(cost), cost, np.inf)
