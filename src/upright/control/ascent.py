"""How did the swing-up go? When it was upright for good, how often it fell, what it took of drive and travel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.control.rig import ServoRig
from upright.control.swing_up import SwingUp
from upright.control.swing_up_law import HOLDING, MODE, SWINGING, TRIPPED
from upright.control.trial import Trial, trial

Array = NDArray[np.float64]

UPRIGHT = math.radians(10)
"""Angle from upright within which the pendulum counts as up [rad]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ascent:
    """One swing-up; what is read off comes from the log, as on a rig.

    Attributes
    ----------
    trial : Trial
    law : SwingUp
    mode : array, shape (N,)
        What the law did: `SWINGING`, `HOLDING` or `TRIPPED`.
    angle : array, shape (N,)
        From the nearest upright, as shown [rad].
    speeds : array, shape (N, 2)
        As the law estimates them, of the driven body and of the pendulum.
    energy : array, shape (N,)
        Of the swing over that of rest upright [J].
    """

    trial: Trial
    law: SwingUp
    mode: Array
    angle: Array
    speeds: Array
    energy: Array

    @property
    def up(self) -> float:
        """Time from which the pendulum stands within ten degrees to the end [s]; inf when it does not."""
        out = np.flatnonzero(np.abs(self.angle) > UPRIGHT)
        last = int(out[-1]) + 1 if out.size else 0
        return float(self.trial.t[last]) if last < self.trial.t.size else math.inf

    @property
    def handovers(self) -> tuple[float, ...]:
        """When the feedback took over [s]."""
        return self._changes(SWINGING, HOLDING)

    @property
    def falls(self) -> tuple[float, ...]:
        """When it lost the pendulum again [s]."""
        return self._changes(HOLDING, SWINGING)

    @property
    def tripped(self) -> float:
        """When the travel's end switched the drive off [s]; inf when it did not."""
        off = np.flatnonzero(self.mode == TRIPPED)
        return float(self.trial.t[off[0]]) if off.size else math.inf

    @property
    def swings(self) -> int:
        """Half swings until the first handover, or to the end."""
        speed = self.speeds[:, 1]
        first = int(np.argmax(self.mode != SWINGING)) if np.any(self.mode != SWINGING) else self.mode.size
        sign = np.sign(np.where(np.abs(speed[:first]) > 0.2, speed[:first], 0.0))
        sign = sign[sign != 0.0]
        return int(np.sum(np.diff(sign) != 0)) + 1 if sign.size else 0

    @property
    def peak(self) -> float:
        """Largest command [its unit]."""
        return float(np.abs(self.trial.u).max())

    @property
    def saturated(self) -> float:
        """Share of the samples at the limit, 0 to 1."""
        return float(np.mean(np.abs(self.trial.u) >= self.trial.rig.limit * (1 - 1e-9)))

    @property
    def travel(self) -> float:
        """Farthest that the driven body truly went from the middle [m or rad]."""
        return float(np.abs(self.trial.x[:, 0]).max())

    def _changes(self, before: float, after: float) -> tuple[float, ...]:
        at = np.flatnonzero((self.mode[:-1] == before) & (self.mode[1:] == after)) + 1
        return tuple(self.trial.t[at].tolist())


def swing_up(
    rig: ServoRig,
    law: SwingUp,
    *,
    seconds: float = 10.0,
    start: ArrayLike | None = None,
    pushes: ArrayLike | None = None,
) -> Ascent:
    """Let a law swing a rig's pendulum up from where it hangs.

    Parameters
    ----------
    rig : ServoRig
        As it truly is.
    law : SwingUp
    seconds : float
    start : array, shape (states,), optional
        Where the rig is when the law is switched on; at rest, hanging, when omitted.
    pushes : array, shape (T,), optional
        What disturbs the drive, added to the command before its limit.
    """
    x0 = rig.plant.state("hanging") if start is None else np.asarray(start, dtype=np.float64)
    rule = law.rule(rig, x0)
    run = trial(
        rig, rule, at="inverted", start=x0 - rig.plant.state("inverted"), seconds=seconds, pushes=pushes
    )  # fmt: skip
    names = [c.name for c in rig.plant.coordinates]
    seen = np.column_stack([run.record[n] for n in names])
    memory = rule.follow(seen / rig.shown, rig.period)[1]
    memory = np.vstack([memory[1:], memory[-1:]])  # what it knew once it had read this sample
    theta = seen[:, 1]
    return Ascent(
        trial=run, law=law, mode=memory[:, MODE], angle=np.mod(theta, 2 * math.pi) - math.pi,
        speeds=memory[:, 2:4], energy=law.body.energy(theta, memory[:, 3]),
    )  # fmt: skip
