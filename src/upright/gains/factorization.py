"""Which plant and which weights stand behind published sets of poles? Spectral factorization, read backwards.

LQR poles p satisfy ``p(s) p(-s) = a(s) a(-s) + N(s)/R`` with the plant's a, N from the weights of the states
and R the weight of the effort; all three products are polynomials in ``w = s^2``. Sets that differ in R alone lie on
one locus, and a few of them tell a and N/R.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from upright.errors import BadInput
from upright.gains.requests import Roots, matched
from upright.laws.linear import Array


@dataclass(frozen=True, kw_only=True)
class Locus:
    """A plant and what weighs its states, as far as poles tell.

    Attributes
    ----------
    a : array, shape (n + 1,)
        The plant's characteristic polynomial in s, from s^n down.
    N : array, shape (n,)
        ``N(w)/R`` of the first set, from w^(n-1) down.
    ratio : float
        R of each set over that of the next.
    """

    a: Array
    N: Array
    ratio: float

    def poles(self, cheaper: float) -> Roots:
        """Stable poles [1/s] with the effort `cheaper` times as cheap as in the first set."""
        product: Array = np.asarray(np.polyadd(_mirrored(self.a), cheaper * self.N), dtype=np.float64)
        w: Roots = np.asarray(np.roots(product), dtype=np.complex128)
        s: Roots = np.asarray(-np.sqrt(w), dtype=np.complex128)
        return s[np.lexsort((s.imag, s.real))]

    def sets(self, count: int) -> list[Roots]:
        """The sets, the first being the one with the dearest effort."""
        return [self.poles(self.ratio**k) for k in range(count)]


def effort_ratios(sets: Sequence[ArrayLike]) -> Array:
    """By which factor each step between sets exceeds the one before, shape (sets - 2,); equal ones speak for a locus.

    Each step is the difference of ``p(s) p(-s)``, a multiple of N; the multiple is taken where the polynomials are
    compared coefficient by coefficient, relative to their size.
    """
    squares = [_squares(s) for s in sets]
    steps = [b - a for a, b in pairwise(squares)]
    size = np.abs(steps[0]) + (np.abs(steps[0]) == 0)
    return np.array([
        float((a / size) @ (b / size) / ((a / size) @ (a / size))) for a, b in pairwise(steps)
    ])  # fmt: skip


def recover_locus(
    sets: Sequence[ArrayLike], rounding: Sequence[ArrayLike], *, free: Sequence[int], ratio: float = 2.0
) -> Locus:
    """Plant and weights from printed sets of poles, R divided by `ratio` from set to set.

    Parameters
    ----------
    sets : sequence of arrays, shape (n,)
        Poles [1/s].
    rounding : sequence of complex arrays, shape (n,)
        Half a unit of the last digit printed, of real and imaginary part; errors are measured in it.
    free : sequence of int
        Powers of s that a(s) has besides s^n; the others are zero, as for a body that nothing ties to ground.

    Raises
    ------
    BadInput
        When no such plant lies near.
    """
    printed = [np.asarray(s, dtype=np.complex128) for s in sets]
    n = printed[0].size
    weight = ratio ** np.arange(len(printed))
    table = np.array([_squares(s) for s in printed])
    fitted = np.linalg.lstsq(np.column_stack([np.ones(weight.size), weight]), table, rcond=None)[0]
    x = np.concatenate([_plant(fitted[0], n, free), fitted[1][1:]])
    scale = np.abs(x) + 1e-300

    def locus(x: Array) -> Locus:
        a = np.zeros(n + 1)
        a[0] = 1.0
        for power, value in zip(free, x, strict=False):
            a[n - power] = value
        return Locus(a=a, N=x[len(free) :], ratio=ratio)

    def misses(x: Array) -> Array:
        out: list[Array] = []
        for poles, published, half in zip(locus(x).sets(len(printed)), printed, rounding, strict=True):
            off, unit = matched(published, poles) - published, np.asarray(half, dtype=np.complex128)
            out += [off.real / unit.real, (off.imag / unit.imag)[published.imag != 0]]
        return np.concatenate(out)

    x = _least_largest(misses, x, scale)
    if not np.isfinite(x).all():
        raise BadInput("these sets of poles do not lie on one locus; check their order and the powers of s.")
    return locus(x)


def _least_largest(misses: Callable[[Array], Array], x: Array, scale: Array) -> Array:
    """Where the largest miss is least, as suits rounding, which knows no outliers.

    Lawson's algorithm: least squares again and again, each miss weighing more the larger it was.
    """
    weight, best, least = np.ones(misses(x).size), x, np.inf
    for round_ in range(150):
        base = misses(x)
        slope = np.column_stack([(misses(x + 1e-6 * e * scale) - base) / 1e-6 for e in np.eye(x.size)])
        root = np.sqrt(weight)
        x = x + np.linalg.lstsq(slope * root[:, None], -base * root, rcond=None)[0] * scale
        missed = np.abs(misses(x))
        if missed.max() < least:
            best, least = x, float(missed.max())
        if round_ >= 5:  # after plain least squares have settled
            weight = weight * missed / (weight @ missed) * weight.size
    return best


def _squares(poles: ArrayLike) -> Array:
    """``p(s) p(-s)`` in w = s^2, from w^n down, up to the sign that makes it monic."""
    return np.asarray(np.poly(np.asarray(poles, dtype=np.complex128) ** 2).real, dtype=np.float64)


def _mirrored(a: Array) -> Array:
    """``a(s) a(-s)`` in w, made monic."""
    n = a.size - 1
    signs = (-1.0) ** np.arange(n, -1, -1)
    return np.asarray(np.polymul(a, a * signs)[::2] * signs[0], dtype=np.float64)


def _plant(product: Array, n: int, free: Sequence[int]) -> Array:
    """Start for a(s) from a rough ``a(s) a(-s)``: its square root where a is even, else its stable roots."""
    if all((n - power) % 2 == 0 for power in free):
        root = [1.0]
        for k in range(1, n // 2 + 1):
            inner = sum(root[i] * root[k - i] for i in range(1, k))
            root.append((float(product[k]) - inner) / 2)
        return np.array([root[(n - power) // 2] for power in free])
    s = -np.sqrt(np.roots(product).astype(np.complex128))
    s[np.argsort(np.abs(s))[: min(free)]] = 0.0
    a = np.poly(s).real
    return np.array([a[n - power] for power in free])
