"""LQR: gains from weights, and the weight of effort that just stays within the limit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.gains.requests import UNREACHED, Roots, checked, lost_modes, matched, poles_of, written
from upright.laws.linear import Array
from upright.systems.motion import march


class LeastCost(NamedTuple):
    """LQR gains, named as python-control's `lqr` returns them.

    Attributes
    ----------
    K : array, shape (m, n)
        Gains of ``u = -K x``.
    S : array, shape (n, n)
        Solution of Riccati's equation: ``x' S x`` is the cost from x.
    E : array, shape (n,)
        Poles of the loop [1/s, or z].
    """

    K: Array
    S: Array
    E: Roots


def lqr(A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike, *, states: Sequence[str] = ()) -> Array:
    """Gains K, shape (m, n), of ``u = -K x`` that of all that stabilize have the least integral of ``x'Q x + u'R u``.

    Q is a matrix or the diagonal of one, R a number or a matrix; `states` are their names, for messages.

    Raises
    ------
    BadInput
        When the weights are of the wrong size or sign, a mode that does not die out is out of the input's reach, or
        the weights do not see a mode that stays as it is.
    """
    return least_cost(A, B, Q, R, states=states).K


def dlqr(A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike, *, states: Sequence[str] = ()) -> Array:
    """The same for a sampled model and the sum over its samples."""
    return least_cost(A, B, Q, R, sampled=True, states=states).K


def least_cost(
    A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike, *, sampled: bool = False, states: Sequence[str] = ()
) -> LeastCost:
    """Gains of `lqr`, or of `dlqr` where the model is `sampled`, with what they cost and the poles they make."""
    import scipy.linalg

    a, b = checked(A, B)
    q, r = _square(Q, a.shape[0], "Q"), _square(R, b.shape[1], "R")
    least = float(np.linalg.eigvalsh(r).min())
    free = sampled and least == 0.0  # a sampled model may move for nothing, as far as its states cost
    if (least <= 0 and not free) or np.linalg.eigvalsh(q).min() < -1e-12 * np.abs(q).max(initial=0.0):
        raise BadInput("weights must cost: R above 0 and no eigenvalue of Q below 0; check their signs.")
    solve: Any = scipy.linalg.solve_discrete_are if sampled else scipy.linalg.solve_continuous_are
    solve = _cheap_riccati if free else solve
    try:
        S = np.asarray(solve(a, b, q, r), dtype=np.float64)
    except (np.linalg.LinAlgError, ValueError):
        raise BadInput(_why_none(a, b, q, sampled, states)) from None
    price = r + b.T @ S @ b if sampled else r
    if free and np.linalg.eigvalsh(price).min() <= 1e-12 * np.abs(price).max(initial=1e-300):
        raise BadInput("with R = 0 the weights of the states must see every input within a sample; weigh R too.")
    K = np.linalg.solve(price, b.T @ S @ (a if sampled else np.eye(len(a))))
    E = poles_of(a - b @ K)
    if not _dies_out(E, sampled).all():
        raise BadInput(_why_none(a, b, q, sampled, states))
    return LeastCost(np.asarray(K, dtype=np.float64), S, E)


def _cheap_riccati(A: Array, B: Array, Q: Array, R: Array) -> Array:
    """Solution of the discrete Riccati equation where R is singular.

    Stable deflating subspace of the extended symplectic pencil (Van Dooren, SIAM J. Sci. Stat. Comput. 2, 1981), which
    scipy solves for regular R alone.
    """
    from scipy.linalg import ordqz, qr

    n, m = B.shape
    H, J = np.zeros((2 * n + m, 2 * n + m)), np.zeros((2 * n + m, 2 * n + m))
    H[:n, :n], H[:n, 2 * n :], H[n : 2 * n, :n], H[2 * n :, 2 * n :] = A, B, -Q, R
    H[n : 2 * n, n : 2 * n] = J[:n, :n] = np.eye(n)
    J[n : 2 * n, n : 2 * n], J[2 * n :, n : 2 * n] = A.T, -B.T
    away = np.asarray(qr(H[:, 2 * n :])[0], dtype=np.float64)[:, m:].T  # the input is eliminated
    Z = np.asarray(ordqz(away @ H[:, : 2 * n], away @ J[:, : 2 * n], sort="iuc")[5], dtype=np.float64)
    S = np.linalg.solve(Z[:n, :n].T, Z[n:, :n].T).T
    return (S + S.T) / 2


def _dies_out(poles: Roots, sampled: bool) -> NDArray[np.bool_]:
    """Which modes die out, by more than rounding explains."""
    rounding = UNREACHED * poles.size
    if sampled:
        return np.abs(poles) < 1.0 - rounding
    return poles.real < -rounding * np.abs(poles).max(initial=0.0)


def _why_none(A: Array, B: Array, Q: Array, sampled: bool, states: Sequence[str]) -> str:
    """Why no LQR gains stabilise: a mode that stays or grows is out of reach, or costs nothing."""
    n = A.shape[0]

    def stays(p: complex) -> bool:
        return not bool(_dies_out(np.array([p]), sampled)[0])

    def at(p: complex) -> str:
        return written([p, p.conjugate()] if p.imag else p)

    out_of_reach = [p for p in lost_modes(A, B) if stays(p)]
    if out_of_reach:
        return (
            f"no gain is best for these weights: the input cannot move the mode at {at(out_of_reach[0])}, which "
            "does not die out by itself; add an input or a coupling, or leave that mode out of the model."
        )
    # duality: a mode is unseen by Q as that of the transposed model is unreached by it
    unseen = [p for p in lost_modes(A.T, Q) if stays(p)]
    if not unseen:
        return "no gain is best for these weights, which nearly miss a mode that does not die out; weigh more states."
    values, rows = np.linalg.svd(np.vstack([A - unseen[0] * np.eye(n), Q]))[1:]
    free = np.abs(rows[values <= UNREACHED * n * max(float(values[0]), 1.0)]).max(axis=0, initial=0.0)
    names = [states[i] if states else f"state {i + 1}" for i in range(n) if free[i] > 1e-8 * free.max()]
    return (
        f"no gain is best for these weights: they do not see the mode at {at(unseen[0])} ({', '.join(names)}), "
        "which does not die out by itself and costs nothing, so it would stay where it is; weigh "
        f"{' or '.join(names)} too, or use place."
    )


def locus(A: ArrayLike, B: ArrayLike, Q: ArrayLike, weights: ArrayLike, *, sampled: bool = False) -> Roots:
    """Poles [1/s, or z] of the loop closed by `lqr` (`dlqr`), shape (len(weights), n), each followed on its way."""
    A, B = np.asarray(A, dtype=np.float64), np.asarray(B, dtype=np.float64)
    rows: list[Roots] = []
    for R in np.atleast_1d(np.asarray(weights, dtype=np.float64)).tolist():
        poles = least_cost(A, B, Q, R, sampled=sampled).E
        rows.append(matched(rows[-1], poles) if rows else poles[np.lexsort((poles.imag, poles.real))])
    return np.array(rows)


def linear_motion(A: Array, B: Array, K: Array, start: ArrayLike, seconds: float = 0.0) -> tuple[Array, Array, Array]:
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
    x, _ = march(step, B[:, :0], np.zeros((samples + 1, 0)), np.asarray(start, dtype=np.float64))
    return np.linspace(0.0, seconds, samples + 1), x, -x @ K.T


def peak_effort(A: Array, B: Array, K: Array, start: ArrayLike) -> float:
    """Largest command on the way back from a deviation [the input's unit]; the limit itself is not in the model."""
    return float(np.abs(linear_motion(A, B, K, start)[2]).max())


def weight_for_effort(
    A: ArrayLike, B: ArrayLike, Q: ArrayLike, start: ArrayLike, limit: float, *, states: Sequence[str] = ()
) -> float:
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
        return peak_effort(A, B, lqr(A, B, Q, unit * 10**exponent, states=states), x0)

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


def _square(weight: ArrayLike, size: int, name: str) -> Array:
    w = np.asarray(weight, dtype=np.float64)
    w = np.diag(np.broadcast_to(w, (size,))) if w.ndim < 2 and (w.ndim == 0 or w.size == size) else w
    if w.shape != (size, size) or not np.isfinite(w).all() or not np.allclose(w, w.T):
        raise BadInput(f"{name} must be {size} weights or a symmetric matrix of shape ({size}, {size}), got {w.shape}.")
    return w
