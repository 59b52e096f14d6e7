"""Stability margins of a loop: where it crosses the unit circle or the real axis, and what is left there.

A loop gain L crosses the unit circle where ``1 - L(1/z) L(z)`` is zero, the real axis where ``L(z) - L(1/z)`` is; both
are zeros of a linear system, eigenvalues of a pencil of twice its order (Boyd, Balakrishnan and Kabamba, Math. Control
Signals Systems 2, 1989). No frequency is too low and no resonance too narrow for that. Each is refined between its
neighbours on the response itself, so that rounding of the pencil does not enter.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from upright.errors import BadInput
from upright.gains.requests import Roots, poles_of
from upright.laws.linear import Array

NO_BOUND = 1e9
"""Factors on a command beyond which, or below whose inverse, it counts as unbounded."""

TOUCHING = 1e-7
"""What remains of a response's size or angle where it touches the circle or the axis without crossing, by rounding."""


@dataclass(frozen=True, kw_only=True)
class Margins:
    """How much the sampled loop stands, at the plant's input.

    Attributes
    ----------
    least_gain, most_gain : float
        Factors on the command between which the loop stays stable; 0 and inf where there is no bound.
    phase : float
        Smallest phase margin [rad]; inf when the loop gain never is 1.
    delay : float
        Further delay that it bears [s].
    modulus : float
        Least distance of the loop's frequency response to -1, the inverse of the peak of the sensitivity.
    gain_crossings : tuple of (float, float)
        Every frequency [rad/s] at which the loop gain is 1, and the phase margin there, from -pi to pi [rad].
    phase_crossings : tuple of (float, float)
        Every frequency [rad/s] at which the loop gain is real and negative, and the gain margin there, a factor.
    """

    least_gain: float
    most_gain: float
    phase: float
    delay: float
    modulus: float
    gain_crossings: tuple[tuple[float, float], ...] = ()
    phase_crossings: tuple[tuple[float, float], ...] = ()

    def dead_zone_cycle(self, dead_zone: float) -> tuple[float, float]:
        """Amplitude of the command [as `dead_zone`] and frequency [rad/s] of the cycle that a dead zone keeps up.

        Of a sine of amplitude A a dead zone d passes the share ``N = 1 - 2/pi (asin x + x sqrt(1 - x^2))``, x = d/A
        (describing function); a plant that falls by itself swings until N is the least gain that holds it. Without
        such a gain, or a dead zone, nothing cycles: both are 0.
        """
        at = [w for w, factor in self.phase_crossings if math.isclose(factor, self.least_gain, rel_tol=1e-6)]
        if not (dead_zone > 0.0 and self.least_gain > 0.0 and at):
            return 0.0, 0.0
        low, high = 0.0, 1.0  # N falls from 1 to 0 as x grows
        for _ in range(60):
            x = (low + high) / 2
            passed = 1.0 - 2.0 / math.pi * (math.asin(x) + x * math.sqrt(1.0 - x * x))
            low, high = (x, high) if passed > self.least_gain else (low, x)
        return dead_zone / low, at[0]


@dataclass(frozen=True, kw_only=True)
class Response:
    """One signal through ``x[k+1] = A x[k] + B u[k], y[k] = C x[k] + D u[k]``; B and C are a column and a row.

    Frequencies are angles ``omega T`` on the unit circle, from 0 to pi.
    """

    A: Array
    B: Array
    C: Array
    D: float = 0.0

    def at(self, angles: Array) -> Roots:
        """Frequency response; ``z - 1`` and ``A - 1`` are formed without cancellation, for slow loops live there."""
        one = np.eye(self.A.shape[0])
        gap = np.expm1(1j * np.atleast_1d(angles))[:, None, None] * one - (self.A - one)
        x = np.linalg.solve(gap, np.broadcast_to(self.B.astype(np.complex128), (len(gap), *self.B.shape)))
        return (self.C @ x)[:, 0, 0] + self.D

    def on_circle(self, radius: float = 1.0) -> Array:
        """Angles at which ``|y/u|`` is `radius`."""
        A, B, C, D = self.A, self.B / radius, self.C, self.D / radius
        # z x = A x + B u; y = C x + D u; p = z (A' p + C' y); u = B' p + D y
        left = _blocks([[A, None, B], [None, np.eye(len(A)), None], [D * C, B.T, np.array([[D * D - 1.0]])]])
        right = _blocks([[np.eye(len(A)), None, B * 0], [C.T @ C, A.T, D * C.T], [C * 0, None, np.zeros((1, 1))]])
        return _crossings(_angles(left, right), lambda w: np.log(np.abs(self.at(w)) / radius))

    def on_axis(self) -> tuple[Array, Array]:
        """Angles at which y/u is real, and its values there, each of shape (crossings,)."""
        A, B, C = self.A, self.B, self.C
        # z x = A x + B u; p = z (A' p + C' u); C x = B' p
        left = _blocks([[A, None, B], [None, np.eye(len(A)), None], [C, -B.T, np.zeros((1, 1))]])
        right = _blocks([[np.eye(len(A)), None, B * 0], [None, A.T, C.T], [C * 0, None, np.zeros((1, 1))]])
        crossings = _crossings(_angles(left, right), lambda w: np.imag(self.at(w)) / np.abs(self.at(w)))
        values = self.at(crossings).real if crossings.size else crossings
        ends = np.array([[w, v] for w in (0.0, math.pi) if math.isfinite(v := self._at_end(w))]).reshape(-1, 2)
        return np.concatenate([crossings, ends[:, 0]]), np.concatenate([values, ends[:, 1]])

    def _at_end(self, angle: float) -> float:
        """Value at z = 1 or z = -1, infinite at a pole."""
        try:
            return float(self.at(np.array([angle]))[0].real)
        except np.linalg.LinAlgError:
            return math.inf

    def peak(self) -> float:
        """Largest ``|y/u|`` of a stable system, by Bruinsma and Steinbuch (Systems & Control Letters 14, 1990).

        Between two neighbouring angles at which a level is met, the response is above it or below it: the middles give
        the next level, until none is met.
        """
        angles = np.concatenate([[0.0, math.pi], np.abs(np.angle(poles_of(self.A)))])
        level = float(np.abs(self.at(angles)).max())
        for _ in range(50):
            met = self.on_circle(level * (1 + 1e-9))
            if met.size < 2:
                break
            ends = np.concatenate([[0.0], met, [math.pi]])
            higher = float(np.abs(self.at((ends[1:] + ends[:-1]) / 2)).max())
            if higher <= level * (1 + 1e-9):
                break
            level = higher
        return level


def balanced(A: Array, B: Array, C: Array, D: float = 0.0) -> Response:
    """The same system with states scaled by powers of two, so that their units do not matter."""
    from scipy.linalg import matrix_balance

    n = A.shape[0]
    whole = np.block([[A - np.eye(n), B], [C, np.zeros((1, 1))]])
    scale = np.asarray(matrix_balance(whole, permute=False, separate=True)[1][0], dtype=np.float64)  # type: ignore[index]
    T = scale[:n] / scale[n]
    return Response(A=A / T[:, None] * T, B=B / T[:, None], C=C * T, D=D)


def sampled_continuous(A: Array, B: Array, C: Array, D: float, rate: float) -> Response:
    """A continuous system on the unit circle, ``z = (rate + s)/(rate - s)``: omega is ``rate tan(angle/2)``."""
    n = A.shape[0]
    inverse = np.linalg.inv(rate * np.eye(n) - A)
    root = math.sqrt(2 * rate)
    return balanced(inverse @ (rate * np.eye(n) + A), root * inverse @ B, root * C @ inverse,
                    D + float((C @ inverse @ B)[0, 0]))  # fmt: skip


def gain_factors(L: Response) -> tuple[Array, Array]:
    """Angles at which the loop gain is real and negative, and the factors that take it to -1 there."""
    angles, real = L.on_axis()
    bound = real < -1.0 / NO_BOUND
    return angles[bound], -1.0 / real[bound]


def gain_bounds(factors: Array) -> tuple[float, float]:
    """Factors next below and above 1 on the loop gain at which the closed loop has a pole on the circle."""
    least = float(factors[factors < 1.0].max(initial=0.0))
    return (least if least > 1.0 / NO_BOUND else 0.0), float(factors[factors > 1.0].min(initial=math.inf))


def phases(L: Response) -> tuple[Array, Array]:
    """Angles at which ``|L|`` is 1, and the phase of -L there, from -pi to pi."""
    w = L.on_circle()
    return w, np.angle(-L.at(w)) if w.size else w


def modulus(L: Response) -> float:
    """Least ``|1 + L|`` on the circle, of a stable loop."""
    d = 1.0 + L.D
    S = Response(A=L.A - L.B @ L.C / d, B=L.B / d, C=-L.C / d, D=1.0 / d)
    return 1.0 / S.peak()


def loop_margins(A: Array, B: Array, C: Array, D: float, period: float) -> Margins:
    """Margins of a loop gain under negative feedback, sampled with a `period` [s] or continuous where that is 0.

    Raises
    ------
    BadInput
        When the closed loop is not stable.
    """
    poles = poles_of(A - B @ C / (1.0 + D)) if D != -1.0 else np.full(1, np.inf, dtype=np.complex128)
    slow: Array = np.abs(poles) if period else 1.0 + np.real(poles)
    if not (slow < 1).all():
        raise BadInput("the closed loop is not stable, so it has no margins; check the sign of the feedback.")
    rate = 0.0
    L = balanced(A, B, C, D)
    if not period:
        rate = float(np.exp(np.log(np.abs(poles)).mean())) if poles.size else 1.0
        while np.abs(poles_of(A) - rate).min(initial=np.inf) < 0.1 * rate:  # no pole at infinity afterwards
            rate *= 1.3
        L = sampled_continuous(A, B, C, D, rate)

    def omega(angles: Array) -> Array:
        return angles / period if period else rate * np.tan(angles / 2)

    angles, phase = phases(L)
    late = (np.mod(phase, 2 * np.pi) / omega(angles)).min(initial=np.inf)
    return of_crossings(L, omega, float(late))


def of_crossings(L: Response, omega: Callable[[Array], Array], delay: float) -> Margins:
    """Margins of a loop gain whose angles on the circle are frequencies `omega` [rad/s]."""
    (angles, phase), (turned, factors) = phases(L), gain_factors(L)
    least, most = gain_bounds(factors)
    return Margins(
        least_gain=least, most_gain=most, phase=float(np.abs(phase).min(initial=np.inf)), delay=delay,
        modulus=modulus(L), gain_crossings=_pairs(omega(angles), phase), phase_crossings=_pairs(omega(turned), factors),
    )  # fmt: skip


def _pairs(omega: Array, values: Array) -> tuple[tuple[float, float], ...]:
    return tuple(sorted(zip(omega.tolist(), values.tolist(), strict=True)))


def _blocks(rows: list[list[Array | None]]) -> Array:
    """Block matrix of which None is a square of zeros, as wide and high as the first block of its row and column."""
    heights = [next(b.shape[0] for b in row if b is not None) for row in rows]
    widths = [next(row[j].shape[1] for row in rows if row[j] is not None) for j in range(len(rows[0]))]  # type: ignore[union-attr]
    return np.block([
        [np.zeros((h, w)) if b is None else b for b, w in zip(row, widths, strict=True)]
        for row, h in zip(rows, heights, strict=True)
    ])  # fmt: skip


def _angles(left: Array, right: Array) -> Array:
    """Angles of the finite eigenvalues of ``left - z right``, on the circle or not, inside 0 to pi."""
    from scipy.linalg import eigvals

    z: Roots = np.asarray(eigvals(left, right), dtype=np.complex128)
    angles = np.unique(np.abs(np.angle(z[np.isfinite(z)])))
    angles = angles[(angles > 1e-12) & (angles < math.pi - 1e-12)]
    return angles[np.diff(angles, prepend=0.0) > 1e-12 * angles]  # what rounding makes of one


def _crossings(candidates: Array, f: Callable[[Array], Array]) -> Array:
    """Angles at which f is zero, each between the middles of its candidate and the next ones."""
    if not candidates.size:
        return candidates
    between = np.sqrt(candidates[1:] * candidates[:-1])
    edges = np.concatenate([[candidates[0] / 2], between, [(candidates[-1] + math.pi) / 2]])
    signs, heights = np.sign(f(edges)), np.abs(f(candidates))
    out: list[float] = []
    for i, w in enumerate(candidates.tolist()):
        if signs[i] * signs[i + 1] < 0:
            out.append(root(lambda a: float(f(np.array([a]))[0]), float(edges[i]), float(edges[i + 1])))
        elif heights[i] < TOUCHING:
            out.append(w)
    return np.array(out)


def root(f: Callable[[float], float], low: float, high: float) -> float:
    """Zero of f between two numbers of which one gives more and the other less than 0: false position, Illinois'."""
    a, b, f_a, f_b = low, high, f(low), f(high)
    for _ in range(200):
        c = b - f_b * (b - a) / (f_b - f_a)
        f_c = f(c)
        converged = f_c == 0.0 or abs(c - b) <= 1e-14 * abs(c)
        a, f_a = (b, f_b) if f_c * f_b < 0 else (a, f_a / 2)  # an end that stays twice loses half its weight
        b, f_b = c, f_c
        if converged:
            break
    return b
