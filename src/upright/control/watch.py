"""Does the running loop see what its model says it should, or does a sensor lie? A watch beside the law.

Each suspicion, such as "theta shows twice what is true", is a model with a Kalman filter of its own. At every sample
each filter is asked how likely the new reading is; the logarithms of the ratios add up and slowly fade (Wald's
sequential test of several hypotheses, with a memory). Where a suspicion has become `ODDS` times as likely as sound
sensors, something is wrong. What it is shows a little later, since two sensors seen only beside each other cannot tell
which of them is wrong: the drive is switched off once one suspicion leads the others, or the pendulum leaves `SAFE`,
or `PATIENCE` is over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.control.trial import ServoRig, Trial, trial
from upright.gains import hold, shaken
from upright.laws import Law

Array = NDArray[np.float64]

FACTORS = (-1.0, 0.25, 0.5, 2.0, 4.0)
"""What a suspected sensor may show over what is true: swapped channels, quadrature counted otherwise. A loop stands
with ten percent more or less, and so little is found by `sensors`, hanging."""
ODDS = 3e3
"""Ratio of likelihoods at which a suspicion is believed."""
UNKNOWN = 0.1
"""What the model does not know (dry friction, gain, the ratio of its inertias), as white accelerations of every
coordinate by itself, in shares of what the drive's limit gives it."""
NAMED = 100.0
"""Ratio of likelihoods at which the best suspicion leads the next."""
PATIENCE = 0.06
"""How long it may take to find out which [s]."""
SAFE = math.radians(6)
"""Deviation [rad] beyond which nobody waits to find out."""
FORGOTTEN = 0.4
"""Time constant with which evidence fades [s]: a little that the model always has wrong must not add up for ever."""
_SETTLING = 400


@dataclass(frozen=True, kw_only=True)
class Suspicion:
    """One sensor showing a factor times what is true; no sensor when all are sound."""

    name: str = ""
    factor: float = 1.0

    def __str__(self) -> str:
        """As a sentence has it."""
        if not self.name:
            return "all sensors sound"
        way = " the wrong way round" if self.factor == -1 else f" {abs(self.factor):g} times what is true"
        return f"{self.name} shown{way}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Alarm:
    """When a watch spoke, and of what, run by run.

    Attributes
    ----------
    sample : array of int, shape (lanes,)
        Sample at which it switches the drive off; -1 where it has no reason to.
    what : tuple of Suspicion
        The suspicion then; sound sensors where it kept still.
    odds : array, shape (N, lanes)
        Logarithm of the likelihood of the best suspicion over that of sound sensors.
    """

    sample: NDArray[np.int64]
    what: tuple[Suspicion, ...]
    odds: Array


def watched(
    watch: Watch, rig: ServoRig, law: Law, *, start: ArrayLike, seconds: float, rest: ArrayLike | None = None
) -> tuple[Trial, Alarm]:
    """Run a law on a rig beside a watch that switches the drive off, one sample after it has spoken.

    The run is made twice: until the watch speaks both are the same, sample for sample.

    Parameters
    ----------
    watch : Watch
    rig : ServoRig
        As it truly is.
    law : Law
    start, seconds, rest
        As of `trial`.
    """

    def run(off: float) -> Trial:
        return trial(rig, law, at=watch.at, start=start, seconds=seconds, rest=rest, off=off)

    free = run(math.inf)
    seen = np.column_stack([free.record[c.name] for c in rig.plant.coordinates]) - free.rest
    alarm = watch.over(seen, free.u)
    k = int(alarm.sample[0])
    return (free if k < 0 else run((k + 1) * rig.period)), alarm


class Watch:
    """Bank of Kalman filters about an equilibrium, for one loop or many lanes of it, fed sample by sample."""

    def __init__(
        self,
        model: ServoRig,
        at: str = "inverted",
        *,
        odds: float = ODDS,
        unknown: float = UNKNOWN,
        forgotten: float = FORGOTTEN,
    ) -> None:
        names = [c.name for c in model.plant.coordinates]
        self.model, self.at = model, at
        self.suspicions = (Suspicion(), *(Suspicion(name=n, factor=f) for f in FACTORS for n in names))
        linear = model.linear(at)
        sampled = hold(linear, model.period, (model.delay + model.lag) / model.period)
        self._A, self._B, n = sampled.A, sampled.B[:, 0], sampled.A.shape[0]
        scales = np.ones((len(self.suspicions), len(names)))
        for i, s in enumerate(self.suspicions[1:], start=1):
            scales[i, names.index(s.name)] = s.factor
        self._C = scales[:, :, None] * sampled.C
        self._bound, self._kept = math.log(odds), math.exp(-model.period / forgotten)
        noise = model.quantum**2 / 12
        # in what is shown, all suspicions expect the same disturbance: they are told apart by motions, not by noise
        shaking = unknown * model.limit * np.abs(linear.B[1::2, 0]) / np.abs(scales)
        W = np.array([shaken(sampled, a) for a in shaking])
        # the start is known to a rad or m, and at rest to a rad/s or m/s; commands on their way are known
        P = np.zeros((len(scales), n, n))
        P[:, range(4), range(4)] = np.repeat(scales, 2, axis=1) ** -2.0
        gains: list[Array] = []
        weights: list[Array] = []
        sizes: list[Array] = []
        for _ in range(_SETTLING):  # covariances depend on no reading
            CP = self._C @ P
            S = CP @ self._C.transpose(0, 2, 1) + np.diag(noise)
            L = np.linalg.solve(S, CP).transpose(0, 2, 1)
            gains.append(np.asarray(L, dtype=np.float64))
            weights.append(np.asarray(np.linalg.inv(S), dtype=np.float64))
            sizes.append(np.asarray(np.linalg.slogdet(S)[1], dtype=np.float64))
            P = self._A @ (P - L @ CP) @ self._A.T + W
            P = 0.5 * (P + P.transpose(0, 2, 1))
        self.gains, self._S, self._size = np.array(gains), np.array(weights), np.array(sizes)
        self._x: Array = np.zeros((0, len(scales), n))
        self._k = 0
        self.likelihood: Array = np.zeros((0, len(scales)))

    def see(self, reading: ArrayLike, command: ArrayLike) -> Array:
        """Take one reading, shape (lanes, coordinates), as deviation from rest, and the command put out after it.

        Returns
        -------
        array, shape (lanes,)
            Logarithm of the odds of the best suspicion.
        """
        y = np.atleast_2d(np.asarray(reading, dtype=np.float64))
        if self._k == 0:
            self._x = np.zeros((len(y), *self._x.shape[1:]))
            self.likelihood = np.zeros((len(y), self._x.shape[1]))
        k = min(self._k, _SETTLING - 1)
        miss = y[:, None] - np.einsum("hpn,lhn->lhp", self._C, self._x)
        square = np.einsum("lhp,hpq,lhq->lh", miss, self._S[k], miss)
        if self._k > 1:  # the first two readings are the start, of which nothing is known
            self.likelihood = self._kept * self.likelihood - 0.5 * (square + self._size[k])
        x = self._x + np.einsum("hnp,lhp->lhn", self.gains[k], miss)
        u = np.broadcast_to(np.asarray(command, dtype=np.float64), len(y))
        self._x = x @ self._A.T + u[:, None, None] * self._B
        self._k += 1
        return self.likelihood[:, 1:].max(axis=1) - self.likelihood[:, 0]

    def over(self, readings: Array, commands: Array) -> Alarm:
        """Watch whole runs: deviations from rest, shape (N, coordinates[, lanes]), and commands, shape (N[, lanes])."""
        y = readings[:, :, None] if readings.ndim == 2 else readings
        u = commands[:, None] if commands.ndim == 1 else commands
        lanes, every = y.shape[2], np.arange(y.shape[2])
        sample, since = np.full(lanes, -1, dtype=np.int64), np.full(lanes, len(y), dtype=np.int64)
        which = np.zeros(lanes, dtype=np.int64)
        odds = np.empty((len(y), lanes))
        self._k = 0
        for k in range(len(y)):
            odds[k] = self.see(y[k].T, u[k])
            since = np.where(odds[k] > self._bound, np.minimum(since, k), len(y))
            best = 1 + np.argmax(self.likelihood[:, 1:], axis=1)
            second = np.partition(self.likelihood, -2, axis=1)[:, -2]
            leads = self.likelihood[every, best] - second > math.log(NAMED)
            far = np.abs(self._x[every, best, 2]) > SAFE
            late = k - since >= PATIENCE / self.model.period
            now = (sample < 0) & (since <= k) & (leads | far | late)
            sample[now], which[now] = k, best[now]
        return Alarm(sample=sample, what=tuple(self.suspicions[i] for i in which.tolist()), odds=odds)
