"""Numbers of a law with their 95 % intervals: from averaged residuals, or from the rounding of every row.

Where the law is exact but for the steps of the command's column, a rounded row says more than its mean: the command
before rounding lay within half a step. No noise is averaged; every row bounds the gains, as Milanese and Vicino (1991)
do with errors that are unknown but bounded.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.recovery import Gain
from upright.closed_loop.regression import Regression, Signals
from upright.signals.memory import automatic_span, long_run

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]
HalfWidth = Callable[[Array], tuple[float, float]]
"""How far a combination of the numbers (gains, then the pole) may lie below and above its value."""

SLACK = 1e-10  # of the command, for the arithmetic
FEW = 400  # rows to begin with, and to add at most
LARGEST = 1e9  # times the command; a gain that nothing bounds stops there

_MEANING = {"kp": "on {}", "ki": "on the sum of {} [1/s]", "kd": "on the rate of {} [s]"}


def averaged(best: Regression, u: Array, used: Rows) -> HalfWidth:
    """95 % of a normal distribution, residuals with a memory allowed for."""
    covariance = errors(best, u, used)

    def width(v: Array) -> tuple[float, float]:
        half = 1.96 * math.sqrt(max(float(v @ covariance @ v), 0.0))
        return half, half

    return width


def errors(regression: Regression, u: Array, used: Rows) -> Array:
    """Covariance (p + 1, p + 1) of gains and pole, residuals with a memory allowed for."""
    X = regression.columns.X[used]
    both = np.column_stack([X, regression.columns.slope[used] @ regression.gains])
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


def sharpen(best: Regression, u: Array, used: Rows, resolution: float) -> tuple[Regression, HalfWidth]:
    """Gains that come nearest every rounded row, and how far they may go until one row is missed by half a step.

    Where even the nearest miss by more than that, such as under a clock that jitters, they are given twice the excess.
    """
    X, recorded = best.columns.X[used], u[used]
    gains, largest = least_worst(X, recorded)
    within = max(0.5 * resolution, largest + max(largest - 0.5 * resolution, 0.0)) * (1 + 1e-6)

    def width(v: Array) -> tuple[float, float]:
        value = float(v[:-1] @ gains)
        low, high = range_of(X, recorded, v[:-1], within)
        return max(value - low, 0.0), max(high - value, 0.0)

    return replace(best, gains=gains), width


def gains_with_intervals(best: Regression, signals: Signals, width: HalfWidth) -> dict[str, Gain]:
    """Every number of the law with its interval."""
    gains = best.by_term
    place = {term: k for k, term in enumerate(best.columns.terms)}
    several = len(signals.names) > 1
    out: dict[str, Gain] = {}

    def put(name: str, value: float, weights: Mapping[int, float], meaning: str) -> None:
        v = np.zeros(len(place) + 1)
        for k, weight in weights.items():
            v[k] = weight
        below, above = width(v)
        out[name] = Gain(
            value=value, stderr=(below + above) / (2 * 1.96), interval=(value - below, value + above), meaning=meaning
        )

    for (kind, i), value in gains.items():
        if kind not in _MEANING:
            continue
        signal = signals.names[i]
        what = signal if kind == "kd" and best.family.on == "measurement" else f"the error of {signal}"
        weights, second = {place[(kind, i)]: 1.0}, gains.get(("kd2", i), 0.0) if kind == "kd" else 0.0
        if second:
            weights[place[("kd2", i)]] = 1.0
        put(f"{kind} {signal}" if several else kind, value + second, weights, _MEANING[kind].format(what))
        if second:
            kd = value + second
            weights = {place[("kd2", i)]: value / kd**2, place[("kd", i)]: -second / kd**2}
            share = "share of the quotient before in the difference"
            put(f"second tap {signal}" if several else "second tap", second / kd, weights, share)
    if best.family.smoothing == "filter":
        slope, tau = signals.period / (1 - best.pole) ** 2, signals.period * best.pole / (1 - best.pole)
        corner = f", corner {1 / (2 * math.pi * tau):.4g} Hz" if tau > 0 else ""
        put("tau", tau, {len(place): slope}, f"low pass of the difference [s]{corner}")
    for j, (name, _) in enumerate(signals.feedforward):
        put(f"factor {name}", gains[("ff", j)], {place[("ff", j)]: 1.0}, "added to the law")
    return out


def least_worst(X: Array, u: Array) -> tuple[Array, float]:
    """Gains (p,) whose largest residual is least, and that residual."""
    size = _size(X)
    A, p = X / size, X.shape[1]
    one = np.ones((len(A), 1))
    cost = np.concatenate([np.zeros(p), [1.0]])
    solution = _least(cost, np.block([[A, -one], [-A, -one]]), np.concatenate([u, -u]))
    return solution[:p] / size, float(solution[p])


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
        result = linprog(cost, A_ub=G[rows], b_ub=h[rows], bounds=(-LARGEST, LARGEST), method="highs")
        if result.x is None:
            return x
        x = np.asarray(result.x, dtype=np.float64)
        over = G @ x - h
        if over.max() <= slack:
            return x
        worst = np.argpartition(over, -FEW)[-FEW:] if over.size > FEW else np.arange(over.size)
        rows = np.union1d(rows, worst[over[worst] > slack])
    return x
