"""Which numbers has the law, and how sure are they? Intervals from averaged residuals, or from rounded rows."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.assembled import gains_of
from upright.closed_loop.bounded import nearest, range_of
from upright.closed_loop.recovery import Gain
from upright.closed_loop.regression import Regression, errors
from upright.closed_loop.regressors import Signals

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]
HalfWidth = Callable[[Array], tuple[float, float]]
"""How far a combination of the numbers (gains, then the pole) may lie below and above its value."""

_MEANING = {"kp": "on {}", "ki": "on the sum of {} [1/s]", "kd": "on the rate of {} [s]"}


def averaged(best: Regression, u: Array, used: Rows) -> HalfWidth:
    """95 % of a normal distribution, residuals with a memory allowed for."""
    covariance = errors(best, u, used)

    def width(v: Array) -> tuple[float, float]:
        half = 1.96 * math.sqrt(max(float(v @ covariance @ v), 0.0))
        return half, half

    return width


def sharpen(best: Regression, u: Array, used: Rows, quantum: float) -> tuple[Regression, HalfWidth]:
    """Gains that come nearest every rounded row, and how far they may go until one row is missed by half a step.

    Where even the nearest miss by more than that, such as under a clock that jitters, they are given twice the excess.
    """
    X, recorded = best.found.X[used], u[used]
    gains, largest = nearest(X, recorded)
    within = max(0.5 * quantum, largest + max(largest - 0.5 * quantum, 0.0)) * (1 + 1e-6)

    def width(v: Array) -> tuple[float, float]:
        value = float(v[:-1] @ gains)
        low, high = range_of(X, recorded, v[:-1], within)
        return max(value - low, 0.0), max(high - value, 0.0)

    return replace(best, gains=gains), width


def numbers(best: Regression, signals: Signals, width: HalfWidth) -> dict[str, Gain]:
    """Every number of the law with its interval."""
    gains = gains_of(best)
    place = {term: k for k, term in enumerate(best.found.terms)}
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
