"""The equations as a user of scipy, lmfit or a black box writes them: a fixed step, dry friction as a tanh."""

from __future__ import annotations

import math

import numpy as np
from numba import njit  # type: ignore[import-untyped]
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUNDED, STEPS = 0.002, 8
"""Speed over which a Furuta's dry friction changes its sign [rad/s], and steps in a sample that this needs."""


@njit(cache=True)
def _pendulum(x: Array, p: Array, mgl: float) -> Array:
    fall = -mgl * math.sin(x[0]) - p[1] * x[1] - p[2] * math.tanh(x[1] / 0.01) - p[3] * x[1] * abs(x[1])
    return np.array([x[1], fall / p[0]])


@njit(cache=True)
def pendulum(p: Array, start: Array, mgl: float, count: int, dt: float, steps: int) -> Array:
    """Angle (count, 1) of a pendulum on a fixed pivot; `p` is J_A, b_2, b_2c, b_2q."""
    y, x, h = np.empty((count, 1)), start.copy(), dt / steps
    for i in range(count):
        y[i, 0] = x[0]
        for _ in range(steps):
            k1 = _pendulum(x, p, mgl)
            k2 = _pendulum(x + h / 2 * k1, p, mgl)
            k3 = _pendulum(x + h / 2 * k2, p, mgl)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + _pendulum(x + h * k3, p, mgl))
    return y


@njit(cache=True)
def _furuta(x: Array, p: Array, known: Array, u: float, rounded: float, stribeck: float) -> Array:
    m_p, l_cg, r, g = known
    J_d, J_p, b_1, b_1c, b_2, b_2c, gain = p
    w1, w2, s, c = x[2], x[3], math.sin(x[1]), math.cos(x[1])
    J_A = J_p + m_p * l_cg**2
    dry1 = b_1c * (1 + stribeck * math.exp(-((w1 / 0.2) ** 2))) * math.tanh(w1 / rounded)
    dry2 = b_2c * (1 + stribeck * math.exp(-((w2 / 0.2) ** 2))) * math.tanh(w2 / rounded)
    m11, m12 = J_d + m_p * r**2 + J_A * s**2, -m_p * r * l_cg * c
    f1 = gain * u - b_1 * w1 - dry1 - 2 * J_A * s * c * w1 * w2 - m_p * r * l_cg * s * w2**2
    f2 = -b_2 * w2 - dry2 + J_A * s * c * w1**2 - m_p * g * l_cg * s
    D = m11 * J_A - m12**2
    return np.array([w1, w2, (J_A * f1 - m12 * f2) / D, (m11 * f2 - m12 * f1) / D])


@njit(cache=True)
def furuta(
    p: Array, known: Array, angles: Array, u: Array, dt: float, steps: int, rounded: float, stribeck: float
) -> Array:
    """Angles (N, 2) of a Furuta pendulum at rest at `angles`.

    `p` is J_d, J_p, b_1, b_1c, b_2, b_2c, gain; `known` is m_p, l_cg, r, g.
    """
    y, h = np.empty((u.size, 2)), dt / steps
    x = np.array([angles[0], angles[1], 0.0, 0.0])
    for i in range(u.size):
        y[i] = x[:2]
        for _ in range(steps):
            k1 = _furuta(x, p, known, u[i], rounded, stribeck)
            k2 = _furuta(x + h / 2 * k1, p, known, u[i], rounded, stribeck)
            k3 = _furuta(x + h / 2 * k2, p, known, u[i], rounded, stribeck)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + _furuta(x + h * k3, p, known, u[i], rounded, stribeck))
    return y
