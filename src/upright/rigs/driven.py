"""Does the driven body's encoder show what its drive does?

A dead encoder there is what a bank of filters sees last: the loop stands, and the arm runs away under it slowly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from upright.control.sensors import sticking
from upright.control.trial import ServoRig

HELD_BY, UNSEEN = 2.0, 100
"""A driven body is held at most by so many times the dry friction that the model knows of; it cannot have moved by so
many counts without its encoder showing one."""
DRY = 0.01
"""Share of the largest command that dry friction is taken for where the model knows of none."""


class StillDrive:
    """Whether the driven body shows not a single count although what acts on it must have moved it."""

    def __init__(self, model: ServoRig, at: str) -> None:
        linear = model.linear(at)
        names = [c.name for c in model.plant.coordinates]
        self.name = model.plant.inputs[0].on
        self.which = names.index(self.name)
        row = 2 * self.which + 1
        self._pull = [float(a) for a in linear.A[row, 0::2]]
        self._drive, self._period = float(linear.B[row, 0]), model.period
        known = HELD_BY * sticking(model)
        self._held = abs(self._drive) * (known or DRY * model.limit)
        self._least = UNSEEN / model.counts[self.which]
        self._shown, self._speed, self._way = math.nan, 0.0, 0.0

    def sees(self, reading: float, away: Sequence[float], command: float) -> bool:
        """Take a sample with its deviations and command; whether the body must have moved since its last count."""
        if reading != self._shown:
            self._shown, self._speed, self._way = reading, 0.0, 0.0
        pushed = sum(a * q for a, q in zip(self._pull, away, strict=True)) + self._drive * command
        forward = math.copysign(1.0, self._speed or pushed)
        self._way += self._speed * self._period
        # friction takes what it can, and turns nothing round
        self._speed = forward * max(0.0, forward * self._speed + (forward * pushed - self._held) * self._period)
        return abs(self._way) > self._least
