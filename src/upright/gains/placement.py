"""Pole placement by Ackermann's formula, the poles that the gains give, and the prefilter beside them.

Ackermann's formula and eigenvalues take 60 digits, which keeps rounding out of the sum: on a model of ten states with
poles from 1 to 10, eigenvalues in double precision are off by 4.6, whatever the gains.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upright.errors import BadInput
from upright.gains.requests import Roots, checked, conjugate_poles, lost_modes, matched, poles_of, weak_modes, written
from upright.laws.linear import Array

DIGITS = 60


def ackermann(A: Array, b: Array, poles: Roots) -> Array | None:
    """Gains ``K = [0 ... 0 1] [b, A b, ...]^-1 p(A)`` rounded once, at the end; None where that matrix is singular.

    Parameters
    ----------
    A, b : arrays, shape (n, n) and (n,)
    poles : array, shape (n,)
        In conjugate pairs, roots of p.

    Returns
    -------
    array, shape (n,), or None
    """
    import mpmath as mp

    n = A.shape[0]
    with mp.workdps(DIGITS):
        M, column = mp.matrix(A.tolist()), mp.matrix(b.tolist())
        transposed: Any = mp.matrix(n, n)
        for i in range(n):
            transposed[i, :] = column.T
            column = M * column
        last: Any = mp.matrix(n, 1)
        last[n - 1] = 1
        try:
            row = mp.lu_solve(transposed, last).T
        except ZeroDivisionError:
            return None
        coefficients: list[Any] = [mp.mpf(1)]
        for pole in poles.tolist():
            shifted = [*coefficients, mp.mpf(0)]
            for i, c in enumerate(coefficients):
                shifted[i + 1] -= mp.mpmathify(pole) * c
            coefficients = shifted
        gains = row * 0
        for c in coefficients:  # Horner's scheme on the row
            gains = gains * M + row * mp.re(c)
        return np.array([float(g) for g in gains], dtype=np.float64)


def eigenvalues(A: Array, B: Array, K: Array) -> Roots:
    """Eigenvalues of ``A - B K``, the difference formed and solved with 60 digits; shapes (n, n), (n, m), (m, n)."""
    import mpmath as mp

    with mp.workdps(DIGITS):
        closed = mp.matrix(A.tolist()) - mp.matrix(B.tolist()) * mp.matrix(K.tolist())
        # of one number it gives back its vectors too, asked for or not
        result: Any = mp.eig(closed, left=False, right=False) if len(A) > 1 else [closed[0, 0]]
        values = np.array([complex(z) for z in result], dtype=np.complex128)
        values.imag[np.abs(values.imag) < 1e-25 * np.abs(values)] = 0.0
        return values


MISSED = 1e-6
"""Poles farther from the requested ones than this part of the fastest are refused; its m-th root where m coincide,
since a change of e in a coefficient moves an m-fold root by e^(1/m)."""
ILL = 1e8
"""Condition from which half of the sixteen digits are gone."""


@dataclass(frozen=True, kw_only=True)
class Placement:
    """State feedback ``u = -K x`` and the poles that it really gives.

    Attributes
    ----------
    K : array, shape (inputs, states)
        Gains, in the input's unit per unit of the state.
    requested, attained : arrays, shape (states,)
        Poles wanted and eigenvalues of ``A - B K`` beside them [1/s]; K is rounded to double, the eigenvalues are not.
    miss : float
        Largest distance between the two [1/s].
    condition : float
        Of the controllability matrix of the balanced model, time and states scaled; inf beyond 1e16.
    sensitivity : float
        Farthest that a pole moves when one number of A or B is 0.1 % off [1/s].
    sentence : str
        How well conditioned all this is.
    """

    K: Array
    requested: Roots
    attained: Roots
    miss: float
    condition: float
    sensitivity: float
    sentence: str


@dataclass(frozen=True, kw_only=True)
class _Balanced:
    """The model with time and states scaled by powers of two, so that nothing is rounded: ``x = T x_b, t = t_b/rate``.

    ``A_b = T^-1 A T / rate`` and ``B_b = T^-1 B / (rate size)``, `size` one number per input.
    """

    A: Array
    B: Array
    T: Array
    rate: float
    size: Array

    def gains(self, K: Array) -> Array:
        """Gains of the model itself; ``A - B K`` scales as A does."""
        return K / self.T / self.size[:, None]


def place(A: ArrayLike, B: ArrayLike, poles: ArrayLike) -> Placement:
    """State feedback that puts the poles of ``x' = (A - B K) x`` where they are requested.

    One input: Ackermann's formula on the balanced model, in 60 digits. Several: scipy's `place_poles`, or Ackermann's
    formula through one mixture of the inputs when more poles coincide than there are inputs. Either way the poles are
    computed again from the gains. A sampled model is placed the same way, its poles given in z.

    Parameters
    ----------
    A : array, shape (n, n)
    B : array, shape (n, m)
    poles : array, shape (n,)
        In conjugate pairs [1/s, or z].

    Raises
    ------
    BadInput
        When the poles are too few, too many or not conjugate, when the inputs do not reach every mode, or when the
        problem is so ill conditioned that gains rounded to double precision miss the poles.
    """
    A, B = checked(A, B)
    n, m = B.shape
    requested = conjugate_poles(poles, n)
    even = _balanced(A, B)
    lost = lost_modes(even.A, even.B)
    if lost:
        what = "poles" if len(lost) > 1 else "pole"
        raise BadInput(
            f"the input cannot move the {what} at {written(np.array(lost) * even.rate)} (Popov, Belevitch and Hautus' "
            f"test: [A - s I, B] has rank {n - lost.count(lost[0])} of {n} there), so no gain places all poles; add an "
            "input or a coupling, or leave that mode out of the model."
        )
    gains = _single(even, requested) if m == 1 else _several(even, requested)
    weakest = written([weak_modes(even.A, even.B)[0][1] * even.rate])
    if gains is None or not np.isfinite(gains).all():
        raise BadInput(
            f"no gains place the poles {written(requested)}: the mode at {weakest} is almost out of the inputs' "
            "reach; leave it where it is, or add an input or a coupling."
        )
    K = even.gains(gains)
    attained = matched(requested, eigenvalues(A, B, K))
    condition, sensitivity = _condition(even), _sensitivity(A, B, K)
    miss = float(np.abs(attained - requested).max())
    _refuse_a_miss(requested, attained, condition, weakest)
    return Placement(
        K=K,
        requested=requested,
        attained=attained,
        miss=miss,
        condition=condition,
        sensitivity=sensitivity,
        sentence=_sentence(requested, condition, sensitivity),
    )


def swift_gains(A: ArrayLike, B: ArrayLike, poles: ArrayLike) -> Array | None:
    """The gains of `place` for one input while a slider moves: Ackermann's formula in double precision.

    The poles are computed again from the gains; None where they miss, which `place` answers or refuses in its 60
    digits.
    """
    A, B = checked(A, B)
    requested = conjugate_poles(poles, len(A))
    even = _balanced(A, B)
    reach = np.column_stack([np.linalg.matrix_power(even.A, k) @ even.B for k in range(len(A))])
    wanted = np.zeros_like(even.A)
    for c in np.real(np.poly(requested / even.rate)):
        wanted = even.A @ wanted + c * np.eye(len(A))
    with suppress(np.linalg.LinAlgError):
        K = even.gains(np.linalg.solve(reach.T, np.eye(len(A))[-1])[None] @ wanted)
        if np.isfinite(K).all():
            attained = matched(requested, np.linalg.eigvals(A - B @ K).astype(np.complex128))
            if (np.abs(attained - requested) <= _allowed(requested)).all():
                return K
    return None


def _balanced(A: Array, B: Array) -> _Balanced:
    from scipy.linalg import matrix_balance

    made: Any = matrix_balance(A, permute=False, separate=True)
    scaled, T = np.asarray(made[0], dtype=np.float64), np.asarray(made[1][0], dtype=np.float64)
    rate = _power(float(np.abs(np.linalg.eigvals(A)).max(initial=0.0)) or float(np.abs(A).max(initial=0.0)))
    even = B / T[:, None] / rate
    size = np.array([_power(float(np.linalg.norm(column))) for column in even.T])
    return _Balanced(A=scaled / rate, B=even / size, T=T, rate=rate, size=size)


def _power(value: float) -> float:
    """Nearest power of two; 1 for nothing."""
    return float(2.0 ** np.round(np.log2(value))) if value > 0 else 1.0


def _single(even: _Balanced, requested: Roots) -> Array | None:
    gains = ackermann(even.A, even.B[:, 0], requested / even.rate)
    return None if gains is None else gains[None]


def _several(even: _Balanced, requested: Roots) -> Array | None:
    """Gains of several inputs; None when neither way leads to any."""
    import scipy.signal

    place_poles: Any = scipy.signal.place_poles

    crowd = max(int(np.sum(np.abs(requested - p) <= 1e-9 * abs(p))) for p in requested)
    if crowd <= np.linalg.matrix_rank(even.B):
        try:
            K: Array = np.asarray(place_poles(even.A, even.B, requested / even.rate).gain_matrix, dtype=np.float64)
        except ValueError:
            K = np.full((even.B.shape[1], even.A.shape[0]), np.nan)
        if np.isfinite(K).all():
            attained = matched(requested, even.rate * eigenvalues(even.A, even.B, K))
            if np.all(np.abs(attained - requested) <= _allowed(requested)):
                return K
    # Heymann's lemma: after a feedback that gives distinct poles, a single mixture of the inputs reaches every mode
    first = np.zeros((even.B.shape[1], even.A.shape[0]))
    for _ in range(2):
        A = even.A - even.B @ first
        v = _mixture(A, even.B)
        if not lost_modes(A, even.B @ v[:, None]):
            gains = ackermann(A, even.B @ v, requested / even.rate)
            return None if gains is None else first + np.outer(v, gains)
        spread = -float(np.abs(requested).max()) * np.linspace(0.5, 1.5, requested.size) / even.rate
        first = np.asarray(place_poles(even.A, even.B, spread).gain_matrix, dtype=np.float64)
    return None


def _mixture(A: Array, B: Array) -> Array:
    """Of a few mixtures of the inputs, the one that reaches its weakest mode best."""
    m = B.shape[1]
    mixtures = (np.ones(m), *np.eye(m), np.arange(1.0, m + 1), (-1.0) ** np.arange(m))
    return max(mixtures, key=lambda v: weak_modes(A, B @ v[:, None])[0][0])


def _allowed(requested: Roots) -> Array:
    """Tolerance about each requested pole."""
    scale = float(np.abs(requested).max(initial=0.0)) or 1.0
    together = np.sum(np.abs(requested[:, None] - requested[None, :]) <= 1e-3 * scale, axis=1)
    return scale * MISSED ** (1.0 / together)


def _refuse_a_miss(requested: Roots, attained: Roots, condition: float, weakest: str) -> None:
    over = np.abs(attained - requested) / _allowed(requested)
    i = int(np.argmax(over))
    if over[i] > 1.0:
        raise BadInput(
            f"gains rounded to double precision leave a pole {abs(attained[i] - requested[i]):.2g} 1/s away from where "
            f"it was asked, {written(requested[i : i + 1])} (controllability matrix: condition {condition:.1e}). "
            f"Ask for poles closer to those of the model, of which {weakest} is the hardest to reach, or for fewer."
        )


def _condition(even: _Balanced) -> float:
    columns = [even.B]
    for _ in range(even.A.shape[0] - 1):
        columns.append(even.A @ columns[-1])
    values = np.linalg.svd(np.hstack(columns), compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 1e-16 * values[0] else float("inf")


def _sensitivity(A: Array, B: Array, K: Array, part: float = 1e-3) -> float:
    """Farthest that a pole of ``A - B K`` moves when one entry of A or B is multiplied by ``1 + part``."""
    closed = A - B @ K
    before = poles_of(closed)
    worst = 0.0
    for i, j in np.argwhere(A):
        changed = closed.copy()
        changed[i, j] += part * A[i, j]
        worst = max(worst, float(np.abs(matched(before, poles_of(changed)) - before).max()))
    for i, j in np.argwhere(B):
        changed = closed.copy()
        changed[i] -= part * B[i, j] * K[j]
        worst = max(worst, float(np.abs(matched(before, poles_of(changed)) - before).max()))
    return worst


def _sentence(requested: Roots, condition: float, sensitivity: float) -> str:
    fastest = float(np.abs(requested).max(initial=0.0))
    size = f"condition {condition:.2g}" if np.isfinite(condition) else "condition beyond 1e16"
    moved = f"one number of the model 0.1 % off moves a pole by up to {sensitivity:.2g} 1/s"
    if condition > ILL or sensitivity > fastest:
        return (
            f"Ill conditioned ({size}): these gains are right for these very numbers, but {moved}; do not build this."
        )
    if sensitivity > 0.1 * fastest:
        return f"Reachable ({size}), but touchy: {moved}."
    return f"Well conditioned ({size}): {moved}."


def prefilter(
    A: ArrayLike, B: ArrayLike, C: ArrayLike, K: ArrayLike, *, D: float = 0.0, sampled: bool = False
) -> float:
    """Gain k_pf of ``u = k_pf r - K x`` for unit static gain from r to ``y = C x + D u``.

    It is ``1/((C - D K) (B K - A)^-1 B + D)``, with ``B K - A + I`` for a sampled model.

    Parameters
    ----------
    A, B, C, K : arrays, shape (n, n), (n, 1), (n,) and (1, n)
        C is the row of the output that follows.
    D : float
        What of the command that output shows at once.
    sampled : bool
        A and B belong to ``x[k+1]`` instead of ``x'``.

    Raises
    ------
    BadInput
        When the output cannot be held anywhere but at zero by a constant command.
    """
    a, b = np.asarray(A, dtype=np.float64), np.asarray(B, dtype=np.float64).reshape(-1, 1)
    row, gains = np.asarray(C, dtype=np.float64).reshape(1, -1), np.asarray(K, dtype=np.float64).reshape(1, -1)
    rest = (np.eye(a.shape[0]) if sampled else 0.0) - a + b @ gains
    try:
        state = np.linalg.solve(rest, b)
    except np.linalg.LinAlgError:
        raise BadInput("the closed loop has a pole at rest, so nothing holds the output; place it elsewhere.") from None
    static = float(((row - D * gains) @ state)[0, 0]) + D
    if abs(static) <= 1e-10 * max(float(np.abs(row).max() * np.abs(state).max()), abs(D)):
        raise BadInput(
            "a constant command leaves this output at zero (a zero of the plant at rest), so no prefilter makes it "
            "follow; track another coordinate."
        )
    return 1.0 / static
