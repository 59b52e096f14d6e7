"""Do the known inertias and stiffnesses, the measured accelerations and the logged effort agree?

The force that each equation of motion needs, ``M(q) a - f(q, v)``, is computed from the measured motion; what friction
and the effort leave of it must be little. Then it is asked whether one sensor or the effort, times some factor, would
leave far less. No simulation, and no friction has to be known: it is regressed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from upright.diagnosis.motion import Motion
from upright.physics.equations import mass_and_force
from upright.records import Array

FLOOR = 0.004
"""Unexplained share that is as good as nothing: parameters are known to some percent."""
COARSE = 10.0 ** np.arange(-2.1, 2.11, 0.15)
"""Factors that are tried on a sensor, of either sign."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Explanation:
    """What one convention leaves: `unexplained` share of each row's inertial force, the effort's factor in it.

    `who` is a coordinate's name, ``"effort"``, or empty for the convention as declared; `factor` multiplies it.
    """

    who: str
    factor: float
    unexplained: Array
    gain: float

    @property
    def cost(self) -> float:
        """Mean logarithm of what is left."""
        return float(np.mean(np.log(self.unexplained + FLOOR)))


class Balance:
    """Equations of motion of one record; `force` (N,) is the effort as force, None when its gain is not known.

    Parameters
    ----------
    motion : Motion
    values : mapping of str to float
        Parameters of the plant [SI], friction zero.
    gain : float
        Force per unit of effort; nan when it is not known, any positive one is then as good.
    """

    def __init__(self, motion: Motion, values: Mapping[str, float], gain: float) -> None:
        self.motion, self.values, self.gain = motion, values, gain
        self.names = [c.name for c in motion.plant.coordinates]
        self.driven = self.names.index(motion.plant.inputs[0].on) if motion.plant.inputs else -1
        self.used = bool(np.ptp(motion.u) > 0) and self.driven in motion.rows
        self.friction = [self._friction(i) for i in motion.rows]

    def _friction(self, i: int) -> Array:
        """Orthonormal span (N, 3) of a constant, the speed's and its sign's forces."""
        m = self.motion
        columns = [np.ones(m.t.size), m.v[i], np.tanh(m.v[i] / m.fades[i])]
        columns = [c for c in columns if np.any(c)]
        return np.linalg.qr(np.column_stack([c / np.linalg.norm(c) for c in columns]))[0]

    def needed(self, factors: Array) -> tuple[Array, Array]:
        """Forces (H, rows, N) that the motion times `factors` (H, coordinates) needs, and the inertial ones alone."""
        m = self.motion
        h, n = factors.shape
        size = m.t.size
        q, v, a = ((factors.T[:, :, None] * x[:, None, :]).reshape(n, h * size) for x in (m.q, m.v, m.a))
        states = {n: x for i, c in enumerate(self.names) for n, x in ((c, q[i]), (f"{c}_dot", v[i]))}
        M, f = mass_and_force(m.plant.derived_for(self.values), {**self.values, **states})
        tau = (np.einsum("tij,jt->ti", M, a) - f).reshape(h, size, n)
        inertial = (np.einsum("tii->ti", M) * a.T).reshape(h, size, n)
        rows = list(m.rows)
        return np.moveaxis(tau[:, :, rows], 1, 2), np.moveaxis(inertial[:, :, rows], 1, 2)

    def explain(self, factors: Array, efforts: Array | None = None) -> tuple[Array, Array]:
        """Unexplained share (H, rows) and the effort's force per unit (H,), under `factors` (H, coordinates).

        `efforts` (H,) multiply the declared gain; nan, or no declared gain, leaves it to the regression, when it must
        not be negative.
        """
        tau, inertial = self.needed(factors)
        h = factors.shape[0]
        left = np.empty(tau.shape[:2])
        gains = np.zeros(h)
        for k, i in enumerate(self.motion.rows):
            Q = self.friction[k]
            need = tau[:, k]
            size = np.var(inertial[:, k], axis=1) + 1e-300
            u = self.motion.u if i == self.driven and self.used else None
            best, g = np.full(h, np.inf), np.zeros(h)
            for columns in (Q[:, :1], Q):
                rest = need - (need @ columns) @ columns.T
                if u is not None:
                    own = u - columns @ (columns.T @ u)
                    power = float(own @ own)
                    free = rest @ own / power if power > 1e-12 * float(u @ u) else np.zeros(h)
                    g = np.maximum(free, 0.0)
                    if efforts is not None and math.isfinite(self.gain):
                        g = np.where(np.isfinite(efforts), self.gain * efforts, free)
                    rest = rest - g[:, None] * own
                share = np.mean(rest**2, axis=1) / size
                better = share < best
                if columns.shape[1] > 1:  # friction must brake
                    power_in = np.einsum("ht,t->h", need - rest - (g[:, None] * u if u is not None else 0.0),
                                         self.motion.v[i]) * factors[:, i]  # fmt: skip
                    better &= power_in < 0
                best = np.where(better, share, best)
                if u is not None:
                    gains = np.where(better, g, gains)
            left[:, k] = best
        return left, gains

    def declared(self) -> Explanation:
        """The convention as it is."""
        one = np.ones((1, len(self.names)))
        efforts = np.ones(1) if math.isfinite(self.gain) else None
        left, gains = self.explain(one, efforts)
        return Explanation(who="", factor=1.0, unexplained=left[0], gain=float(gains[0]))

    def others(self) -> list[Explanation]:
        """The best factor on every sensor and on the effort, best first."""
        found: list[Explanation] = []
        n = len(self.names)
        both = np.concatenate([COARSE, -COARSE])
        for i in self.motion.rows:
            best = self._best(i, both, n)
            for k in range(8):  # disks that turn together tell a factor to a part in thousands
                step = 10 ** (0.15 / 4 ** (k + 1))
                finer = min(best, self._best(i, best.factor * step ** np.arange(-3.0, 4.0), n), key=lambda e: e.cost)
                settled = k > 0 and best.cost - finer.cost < 0.02
                best = finer
                if settled:
                    break
            found.append(best)
        if self.used:
            one = np.ones((1, n))
            left, gains = self.explain(one, np.array([np.nan]) if math.isfinite(self.gain) else None)
            if math.isfinite(self.gain):
                factor = float(gains[0]) / self.gain
                found.append(Explanation(who="effort", factor=factor, unexplained=left[0], gain=float(gains[0])))
        return sorted(found, key=lambda e: e.cost)

    def _best(self, i: int, tried: Array, n: int) -> Explanation:
        factors = np.ones((tried.size, n))
        factors[:, i] = tried
        efforts = np.ones(tried.size) if math.isfinite(self.gain) else None
        left, gains = self.explain(factors, efforts)
        k = int(np.argmin(np.mean(np.log(left + FLOOR), axis=1)))
        return Explanation(who=self.names[i], factor=float(tried[k]), unexplained=left[k], gain=float(gains[k]))
