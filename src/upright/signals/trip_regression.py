"""How well do a command, speeds, positions and dry friction explain an acceleration, if the command ended early?

Linear regression on the smoothed motion; what is regressed on has gone through the same smoothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.signals.smoothing import savitzky_golay, spread

Array = NDArray[np.float64]

LEAST = 30
"""Independent stretches (record over smoothing) that a record needs before anything is said about it."""

ROUGH = 0.1
"""Noise of a smoothed acceleration as a share of its spread, at most; the smoothing is as narrow as this allows."""

STUCK = 0.02
"""Share of the largest speed below which a body may stick, where nothing can be said about its drive."""

ROWS = 800
"""Samples that enter the regression."""


@dataclass(frozen=True, kw_only=True)
class Regression:
    """What an acceleration is explained by, with a command that may have ended early.

    Attributes
    ----------
    rows : (T,) array
        Samples that enter.
    acceleration : (T,) array
        Measured there.
    base : (T, columns) array
        What a trip leaves as it is.
    switched : (N, 2) array
        What a trip cuts off: command, and speed while commanded; `whole` (T, 2) is that, smoothed by `weights`.
    speed : (N,) array
        Of the driven coordinate.
    levels : bool
        Whether the command has more than one level besides zero.
    """

    rows: NDArray[np.int64]
    acceleration: Array
    base: Array
    switched: Array
    whole: Array
    weights: Array
    speed: Array
    levels: bool
    dt: float

    @classmethod
    def of(cls, u: Array, y: Array, others: Sequence[Array], dt: float, width: int, *, late: bool) -> Regression | None:
        """Regression of the acceleration of `y`, driven by `u`, None when there is too little motion."""
        motion = savitzky_golay(y, dt, width, order=3)
        if not np.ptp(motion.a) > 0:
            return None
        weights = np.linalg.pinv(np.vander(np.linspace(-1.0, 1.0, width), 4, increasing=True))[0]
        sign = np.tanh(motion.v / (0.02 * spread(motion.v)))
        columns = [np.ones_like(y), sign, motion.v, y - y[0]]
        for z in others:
            other = savitzky_golay(z, dt, width, order=3, derivatives=1)
            columns += [other.v, z - z[0]]
        half = width // 2
        levels = bool(np.ptp(u[u != 0]))
        moving = np.abs(motion.v) > STUCK * float(np.abs(motion.v).max())
        # a body that sticks hides what pushes it, but under a constant command it cannot set out late
        moving |= late and not levels
        rows = half + np.flatnonzero(moving[half : y.size - half])
        rows = rows[:: max(1, rows.size // ROWS)]
        if rows.size < LEAST:
            return None
        # damping that is there with the command on goes with it
        switched = np.stack([u, motion.v * (u != 0)], axis=1)
        return cls(
            rows=rows, acceleration=motion.a[rows], base=_smoothed(np.stack(columns, axis=1), weights)[rows],
            switched=switched, whole=_smoothed(switched, weights)[rows], weights=weights, speed=motion.v,
            levels=levels, dt=dt,
        )  # fmt: skip

    def missed(self, m: int, *, late: bool, backwards: bool = False) -> float:
        """Share of the acceleration's variance that is left when the command acts before sample `m` only, or after.

        All of it when the command would have to push backwards, unless that is allowed.
        """
        half = self.weights.size // 2
        acting = np.where((self.rows < m)[:, None], self.whole, 0.0)
        for i in np.flatnonzero(np.abs(self.rows - m) <= half):
            here = self.rows[i]
            inside = np.arange(here - half, here + half + 1) < m
            acting[i] = (self.weights * inside) @ self.switched[here - half : here + half + 1]
        A = np.column_stack([self.base, self.whole - acting if late else acting])
        size = np.linalg.norm(A, axis=0)
        A = A[:, size > 0] / size[size > 0]
        x = np.linalg.lstsq(A.T @ A, A.T @ self.acceleration, rcond=1e-10)[0]
        left = self.acceleration - A @ x
        away = self.acceleration - self.acceleration.mean()
        force, damping = (np.bincount(np.flatnonzero(size > 0), x / size[size > 0], size.size))[-2:]
        i = m if late else m - 1
        u, v = self.switched[i]
        if backwards:
            return float(left @ left) / float(away @ away)
        # the force at no speed is an extrapolation unless the command has several levels
        pushed = (force * u + damping * v) * u > 0 and (force > 0 or not self.levels)
        return float(left @ left) / float(away @ away) if pushed else 1.0

    def around(self, at: int, *ends: int) -> tuple[float, float]:
        """Mean acceleration on both sides of sample `at`, half way to the nearer end of the logged command."""
        reach = max(2, min(abs(at - end) for end in ends) // 2)
        low, high = max(0, at - reach), min(self.speed.size - 1, at + reach)
        slope = [np.polyfit(np.arange(v.size) * self.dt, v, 1)[0] for v in (self.speed[low:at], self.speed[at:high])]
        return float(slope[0]), float(slope[1])


def _smoothed(columns: Array, weights: Array) -> Array:
    from scipy.ndimage import correlate1d

    return correlate1d(columns, weights, axis=0, mode="nearest")


def smoothing_width_for(y: Array, dt: float, quantum: float) -> int:
    """Samples over which a cubic gives an acceleration that counts and noise do not drown; odd."""
    rough = float(np.median(np.abs(np.diff(y, 2)))) / (0.6745 * math.sqrt(6))
    noise = max(quantum / math.sqrt(12), rough)
    width = 9
    while width < y.size // 8:
        a = savitzky_golay(y, dt, width, order=3).a
        s = np.linspace(-1.0, 1.0, width)
        weights = np.linalg.pinv(np.vander(s, 4, increasing=True))[2] * 2 / (width // 2 * dt) ** 2
        if noise * float(np.linalg.norm(weights)) < ROUGH * float(np.std(a)):
            break
        width = int(width * 1.3) | 1
    return width
