"""Which gains make a family of laws come nearest the recorded command, and how near on rows left out?"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.regressors import Columns, Family, Signals, columns

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]

BLOCKS = 40
"""Stretches of a log that are fitted and held out by turns."""

POLES = (0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.85, 0.9, 0.94, 0.97, 0.985, 0.993, 0.997)
"""Poles from which the search for a filter starts: the best one and its neighbours bracket the minimum."""


@dataclass(frozen=True, kw_only=True)
class Regression:
    """One family fitted to all rows used, `missed` the root mean square of what rows held out missed."""

    family: Family
    pole: float
    found: Columns
    gains: Array
    missed: float

    @property
    def predicted(self) -> Array:
        """Command (N,) by the regression, without limit."""
        return self.found.X @ self.gains

    @property
    def parameters(self) -> int:
        """How many numbers the family has to find."""
        return self.gains.size + self.family.extras


def held_out(n: int) -> Rows:
    """Rows that a comparison leaves out: every second stretch."""
    return (np.arange(n) * BLOCKS // n) % 2 == 1


def least_squares(X: Array, u: Array) -> Array:
    """Solution of a regression whose columns are of any size; one that is zero everywhere gets no gain."""
    size = np.sqrt(np.sum(X * X, axis=0))
    safe = np.where(size > 0, size, 1.0)
    return np.asarray(np.linalg.lstsq(X / safe, u, rcond=1e-13)[0]) / safe


def fit(
    signals: Signals, family: Family, u: Array, used: Rows, terms: Sequence[str], drop: frozenset[tuple[str, int]]
) -> Regression:
    """Gains of one family, without the terms in `drop`; the filter's pole, if any, by search."""
    out = held_out(u.size)
    inner, outer = used & ~out, used & out

    def at(pole: float) -> Columns:
        made = columns(signals, family, terms, pole)
        keep = [i for i, term in enumerate(made.terms) if term not in drop and _needed(term, drop)]
        return Columns(terms=tuple(made.terms[i] for i in keep), X=made.X[:, keep], slope=made.slope[:, keep])

    def pole_of(rows: Rows, start: float | None) -> float:
        if family.smoothing != "filter":
            return 0.0
        return refine(at, u, rows, bracket(at, u, rows) if start is None else start)

    pole = pole_of(used, None)
    inner_pole = pole_of(inner, pole)
    inside = at(inner_pole)
    gains = least_squares(inside.X[inner], u[inner])
    missed = float(np.sqrt(np.mean((u[outer] - inside.X[outer] @ gains) ** 2))) if outer.any() else math.inf
    found = at(pole)
    return Regression(family=family, pole=pole, found=found, gains=least_squares(found.X[used], u[used]), missed=missed)


def _needed(term: tuple[str, int], drop: frozenset[tuple[str, int]]) -> bool:
    """Whether a term has still the one it belongs to: a second tap or a start without its difference has not."""
    return term[0] not in ("kd2", "start") or ("kd", term[1]) not in drop


def bracket(at: Callable[[float], Columns], u: Array, rows: Rows) -> float:
    """Best pole to about a thousandth: a coarse row of poles, then golden section around the best."""

    def loss(pole: float) -> float:
        X = at(pole).X[rows]
        size = np.sqrt(np.sum(X * X, axis=0))
        X = X / np.where(size > 0, size, 1.0)
        # normal equations are quick and near enough to find a bracket
        G, b = X.T @ X, X.T @ u[rows]
        gains = np.linalg.lstsq(G, b, rcond=1e-12)[0]
        return float(np.sum((u[rows] - X @ gains) ** 2))

    losses = [loss(p) for p in POLES]
    best = int(np.argmin(losses))
    low, high = POLES[max(best - 1, 0)], POLES[best + 1] if best + 1 < len(POLES) else 0.9995
    ratio = (math.sqrt(5) - 1) / 2
    a, b = high - ratio * (high - low), low + ratio * (high - low)
    fa, fb = loss(a), loss(b)
    while high - low > 1e-3 * (1.001 - high):
        if fa < fb:
            high, b, fb = b, a, fa
            a = high - ratio * (high - low)
            fa = loss(a)
        else:
            low, a, fa = a, b, fb
            b = low + ratio * (high - low)
            fb = loss(b)
    return (low + high) / 2


def refine(at: Callable[[float], Columns], u: Array, rows: Rows, pole: float) -> float:
    """Pole to the last digit: Gauss-Newton steps with the gains free, while they improve."""
    best, loss = pole, math.inf
    for _ in range(12):
        made = at(pole)
        gains = least_squares(made.X[rows], u[rows])
        missed = u[rows] - made.X[rows] @ gains
        now = float(missed @ missed)
        if now >= loss * (1 - 1e-9):
            break
        best, loss = pole, now
        both = np.column_stack([made.X[rows], made.slope[rows] @ gains])
        step = float(least_squares(both, u[rows])[-1])
        pole = min(max(pole + step, 0.0), 0.9999)
    return best


def errors(regression: Regression, u: Array, used: Rows) -> Array:
    """Covariance (p + 1, p + 1) of gains and pole, residuals with a memory allowed for."""
    from upright.signals.memory import automatic_span, long_run

    X = regression.found.X[used]
    both = np.column_stack([X, regression.found.slope[used] @ regression.gains])
    size = np.sqrt(np.sum(both * both, axis=0))
    size[size == 0] = 1.0
    both = both / size
    missed = u[used] - X @ regression.gains
    inverse = np.linalg.pinv(both.T @ both, rcond=1e-12, hermitian=True)
    scores = both * missed[:, None]
    if not np.any(missed):
        return np.zeros_like(inverse)
    spread = long_run(scores, automatic_span(scores))
    return inverse @ spread @ inverse / np.outer(size, size)
