"""How much effort is good posture worth? Gains from weights, and the weight that just stays within the limit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upright.errors import BadInput
from upright.gains.requests import Roots, matched, poles_of
from upright.laws.linear import Array


def lqr(A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike) -> Array:
    """Gains K, shape (m, n), of ``u = -K x`` that minimize the integral of ``x'Q x + u'R u``.

    Q is a matrix or the diagonal of one, R a number or a matrix.

    Raises
    ------
    BadInput
        When the weights are of the wrong size or sign, or no gain makes that integral finite.
    """
    return _riccati("solve_continuous_are", A, B, Q, R)


def dlqr(A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike) -> Array:
    """The same for a sampled model and the sum over its samples."""
    return _riccati("solve_discrete_are", A, B, Q, R)


def locus(A: ArrayLike, B: ArrayLike, Q: ArrayLike, weights: ArrayLike) -> Roots:
    """Poles [1/s] of the loop closed by `lqr`, shape (len(weights), n), each followed from weight to weight."""
    A, B = np.asarray(A, dtype=np.float64), np.asarray(B, dtype=np.float64)
    rows: list[Roots] = []
    for R in np.atleast_1d(np.asarray(weights, dtype=np.float64)).tolist():
        found = poles_of(A - B @ lqr(A, B, Q, R))
        rows.append(matched(rows[-1], found) if rows else found[np.lexsort((found.imag, found.real))])
    return np.array(rows)


def motion(A: Array, B: Array, K: Array, start: ArrayLike, seconds: float = 0.0) -> tuple[Array, Array, Array]:
    """Linear motion under ``u = -K x`` from a deviation: t (N,) [s], x (N, n) and u (N, m).

    Without `seconds`, ten time constants of the slowest pole.
    """
    from scipy.linalg import expm

    poles = poles_of(A - B @ K)
    slow, fast = float(-poles.real.max()), float(np.abs(poles).max())
    if slow <= 0:
        raise BadInput("these gains do not stabilize the model, so the motion grows without end; choose others.")
    seconds = seconds or 10 / slow
    samples = int(np.clip(40 * fast * seconds, 400, 20_000))
    step = np.asarray(expm((A - B @ K) * seconds / samples), dtype=np.float64)
    x = np.empty((samples + 1, A.shape[0]))
    x[0] = start
    for k in range(samples):
        x[k + 1] = step @ x[k]
    return np.linspace(0.0, seconds, samples + 1), x, -x @ K.T


def peak_effort(A: Array, B: Array, K: Array, start: ArrayLike) -> float:
    """Largest command on the way back from a deviation [the input's unit]; the limit itself is not in the model."""
    return float(np.abs(motion(A, B, K, start)[2]).max())


def weight_for_effort(A: ArrayLike, B: ArrayLike, Q: ArrayLike, start: ArrayLike, limit: float) -> float:
    """Effort weight R whose gains need just `limit` [the input's unit] to come back from the deviation `start` (n,).

    Raises
    ------
    BadInput
        When even the least effort that stabilizes needs more.
    """
    A, B = np.asarray(A, dtype=np.float64), np.asarray(B, dtype=np.float64)
    if not limit > 0:
        raise BadInput(f"the effort's limit must be above 0, got {limit:g}.")
    # a unit of cost by dimension: what the weights make of the deviation, over what the limit makes of the command
    x0 = np.asarray(start, dtype=np.float64)
    unit = float(x0 @ _square(Q, A.shape[0], "Q") @ x0) / limit**2 or 1.0

    def peak(exponent: float) -> float:
        return peak_effort(A, B, lqr(A, B, Q, unit * 10**exponent), x0)

    low, high = -6.0, 6.0  # cheap control, dear control
    least = peak(high)
    if least > limit:
        raise BadInput(
            f"coming back from there takes at least {least:.4g}, and the limit is {limit:.4g}; ask for a deviation of "
            f"at most {100 * limit / least:.0f} % of it, or for a stronger drive."
        )
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (low, middle) if peak(middle) < limit else (middle, high)
    return unit * 10**high


def _riccati(solver: str, A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike) -> Array:
    import scipy.linalg

    a, b = np.atleast_2d(np.asarray(A, dtype=np.float64)), np.asarray(B, dtype=np.float64)
    b = b[:, None] if b.ndim == 1 else b
    q, r = _square(Q, a.shape[0], "Q"), _square(R, b.shape[1], "R")
    if np.linalg.eigvalsh(r).min() <= 0 or np.linalg.eigvalsh(q).min() < -1e-12 * np.abs(q).max(initial=0.0):
        raise BadInput("weights must cost: R above 0 and no eigenvalue of Q below 0; check their signs.")
    solve: Any = getattr(scipy.linalg, solver)
    try:
        P = np.asarray(solve(a, b, q, r), dtype=np.float64)
    except (np.linalg.LinAlgError, ValueError):
        raise BadInput(
            "no gain is best for these weights: a mode that does not die out by itself is out of the input's reach, or "
            "Q does not see it; weigh its state, or use place."
        ) from None
    if solver == "solve_continuous_are":
        return np.asarray(np.linalg.solve(r, b.T @ P), dtype=np.float64)
    return np.asarray(np.linalg.solve(r + b.T @ P @ b, b.T @ P @ a), dtype=np.float64)


def _square(weight: ArrayLike, size: int, name: str) -> Array:
    w = np.asarray(weight, dtype=np.float64)
    w = np.diag(np.broadcast_to(w, (size,))) if w.ndim < 2 and (w.ndim == 0 or w.size == size) else w
    if w.shape != (size, size) or not np.isfinite(w).all() or not np.allclose(w, w.T):
        raise BadInput(f"{name} must be {size} weights or a symmetric matrix of shape ({size}, {size}), got {w.shape}.")
    return w
