"""How a driven body is stopped within its travel: where braking has to begin, and with what command.

Zero output does not brake: an arm on ball bearings coasts for turns. While the drive obeys, body and pendulum are
brought to rest as a whole with at most `SHARE` of what the drive can do, and the output goes to zero then. What comes
to rest is ``p = psi' + (M_12/M_11) cos(theta) theta'``, the momentum over the body's inertia, which only drive and
friction change: a body at rest under a pendulum that falls would be carried on. That takes ``p^2/(2 a)`` and what is
travelled before the drive answers; then the falling pendulum sways its body, by ``|M_12|/M_11`` to either side. One
that whirls on walks its body farther, as far as dry friction lets it: that is beyond what is looked ahead to here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from upright.records import Array
from upright.rig import Rig

SHARE = 0.5
"""Of the largest command's deceleration: gains are off by ten per cent, supplies sag, and a law may still push."""
SWAY = 1.5
"""Times as far as by the model may a pendulum's fall sway its body: masses and lengths are off, and it is not at rest.
"""
RESERVED = 0.5
"""Share of the travel that is kept for that sway at most: a loop needs room to run."""
SLOWING = 0.03
"""Time constant by which the body is slowed once the command is no longer at its limit [s]."""
LONGEST = 0.3
"""After which braking ends, whatever is left [s]."""
GRACE = 0.01
"""A body that is faster than when braking began, by what that command does in so long [s], is driven on and not braked:
its encoder or the drive does the opposite of what it should."""
REST = 0.02
"""Share of the speed at which braking began that counts as rest."""
SPAN = 4
"""Samples to either end of which a speed is the difference."""


class Braking:
    """Of the body that a model's drive moves.

    Parameters
    ----------
    model : Rig
    at : str
        Equilibrium that is held.
    command : float
        Largest that is allowed [command unit].
    falls : bool
        Whether a pendulum falls once the loop is stopped.
    """

    def __init__(self, model: Rig, at: str, command: float, *, falls: bool) -> None:
        self._at = list(model.plant.equilibrium(at).values())
        i = self.which = [c.name for c in model.plant.coordinates].index(model.plant.inputs[0].on)
        M = model.plant.mass_matrix(at)[i]
        self._other = 1 - i if falls else i
        self._carried = float(M[self._other] / M[i]) if falls else 0.0
        self._per_command, self._most = model.gain / float(M[i]), SHARE * command
        self._late = model.delay + model.lag + (SPAN + 2) * model.period
        self._least = 1 / (model.per_unit[i] * SPAN * model.period)  # a count in all the samples that are looked at
        self._period = model.period

    def momentum(self, away: Sequence[Sequence[float]], *, alone: bool = False) -> float:
        """Over the body's inertia, from its last samples as deviations; of the body alone where no other is trusted."""
        for_ = max(1, len(away) - 1) * self._period
        speed, other = ((away[-1][i] - away[0][i]) / for_ for i in (self.which, self._other))
        return speed if alone else speed + self._carried * math.cos(away[-1][self._other]) * other

    def distance(self, momentum: Any, travel: float) -> Any:
        """From where braking begins to the farthest [rad or m], for a momentum outwards, within a travel."""
        v = np.maximum(0.0, momentum)
        sway = min(SWAY * abs(self._carried), RESERVED * travel)
        return v * self._late + v**2 / (2 * abs(self._per_command) * self._most) + sway

    def farthest(self, x: Array, travel: float) -> Array:
        """Where the body comes to rest when it is braked from each of the states, shape (N, 4, ...), within a travel.

        Shape (N, ...); [rad or m], from the middle.
        """
        q, v, w = x[:, 2 * self.which], x[:, 2 * self.which + 1], x[:, 2 * self._other + 1]
        p = v + self._carried * np.cos(x[:, 2 * self._other] - self._at[self._other]) * w if self._carried else v
        return np.abs(q) + self.distance(np.sign(q) * p, travel)

    def goes_on(self, momentum: float, first: float) -> bool:
        """Whether to brake on at a momentum, when it was another at first."""
        most = abs(first) + abs(self._per_command) * self._most * GRACE
        return max(REST * abs(first), self._least) < abs(momentum) <= most

    def command(self, momentum: float) -> float:
        """That brakes it."""
        braking = -momentum / (SLOWING * self._per_command)
        return min(max(braking, -self._most), self._most)
