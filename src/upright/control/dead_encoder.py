"""Must an encoder that shows not a single count have moved? Distinguishes friction from a dead counter.

The driven body stands still where its command is within friction, for as long as it likes; beyond `HELD_BY` times the
friction that the model knows of, it moves, and disturbs the pendulum on it. That pendulum stands still, to a count,
only while what carries it is accelerated against what its lean makes of it: ``theta'' = psi''/rho + g/l theta``, with
g/l that of a pendulum on a wall, where hinges hold little and the lean is known to `OUT_OF_TRUE`. What else holds
either is a hand; and where nothing moves at all, nobody can tell. By the same equation the pendulum shows whether what
carries it stands still, so that its drive is dead, or moves unseen.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from upright.control.watch import OUT_OF_TRUE, held_by
from upright.rig import Rig

UNSEEN, EXCESS, FOR = 40, 0.5, 0.1
"""A driven body cannot have moved by so many counts without its encoder showing one; nor as far as half of what holds
it at most takes it in so long [s], since a hand and friction of the day may be so much more."""
DISTURBED = 2
"""Nor without that the pendulum on it goes up or down by so many counts: where both stand still, to a count, friction
and a hand hold them. Upright nothing balances by itself, and a body that moves has a law that answers."""
SWUNG, LEAST_SWUNG = 0.02, 12
"""Nor a pendulum by such an angle [rad], and by so many counts."""
STIRRED = 0.25
"""Share of that angle by which what carries it must have left its line: where both stand still, friction holds the one
and a hand that leans on it the other, however far it leans."""
WITHIN = 0.3
"""And it must have swung within so long [s]: a hinge that sticks holds it while the body drifts slowly."""
WITNESS, LEAST_WITNESS, LIKELIER = 0.15, 8, 4.0
"""A body stands still where the pendulum's motion in so long [s], of so many samples and more, is that of one on a body
at rest, and that of one on a body that its command moves is off by so many times as much. Of 13 encoders that were dead
the largest was 2.0, of 9 drives the least 5.9 and, within a blow to the pendulum, of 3 more 1.4 (seeds 1001 to 1008 of
the false stops). Of seeds 3001 to 3008 none of 10 dead encoders is taken for a drive, and 4 of 9 drives are named."""
_SPEED = 60.0  # rad/s, corner behind which the body's speed is taken


class StillDrive:
    """Whether the driven body shows not a single count although what acts on it must have moved it."""

    def __init__(self, model: Rig, at: str) -> None:
        linear = model.linear(at)
        names = [c.name for c in model.plant.coordinates]
        self.name = model.plant.inputs[0].on
        self.which = names.index(self.name)
        row = 2 * self.which + 1
        self._pull = [float(a) for a in linear.A[row, 0::2]]
        self._drive, self._period = float(linear.B[row, 0]), model.period
        self._held = held_by(model, at)
        self._least = max(UNSEEN / model.per_unit[self.which], EXCESS * self._held * FOR**2 / 2)
        self._disturbed = (DISTURBED - 0.5) / model.per_unit[1 - self.which]
        self._rho, self._gravity = _on_a_body(model, at)
        self._past = deque[tuple[float, float]](maxlen=round(WITNESS / self._period))
        self._shown, self._speed, self._way = math.nan, 0.0, 0.0
        self._lowest, self._highest = 0.0, 0.0

    def sees(self, reading: float, away: Sequence[float], command: float) -> bool:
        """Take a sample with its deviations and command; whether the body must have moved since its last count."""
        pendulum = away[1 - self.which]
        if reading != self._shown:
            self._shown, self._speed, self._way = reading, 0.0, 0.0
            self._lowest = self._highest = pendulum
            self._past.clear()
        self._lowest, self._highest = min(self._lowest, pendulum), max(self._highest, pendulum)
        pushed = sum(a * q for a, q in zip(self._pull, away, strict=True)) + self._drive * command
        forward = math.copysign(1.0, self._speed or pushed)
        self._way += self._speed * self._period
        # friction takes what it can, and turns nothing round
        self._speed = forward * max(0.0, forward * self._speed + (forward * pushed - self._held) * self._period)
        self._past.append((pendulum, self._way))
        return abs(self._way) > self._least and self._highest - self._lowest > self._disturbed

    @property
    def rests(self) -> bool:
        """Whether the pendulum has lately moved as on a body at rest, and not as on one that its command moves."""
        if len(self._past) < LEAST_WITNESS:
            return False
        pendulum, way = np.array(self._past).T
        since = self._period * np.arange(len(way))
        # what is not its weight's, up to the place and speed with which it began
        carried = pendulum - self._gravity * self._period**2 * np.cumsum(np.cumsum(pendulum))
        at_rest, moved = (float(np.std(off - np.polyval(np.polyfit(since, off, 1), since)))
                          for off in (carried, carried - way / self._rho))  # fmt: skip
        return LIKELIER * at_rest < moved


class StillPendulum:
    """Whether a pendulum shows not a single count although what carries it left the straight line that it was on."""

    def __init__(self, model: Rig, at: str) -> None:
        self._body = [c.name for c in model.plant.coordinates].index(model.plant.inputs[0].on)
        self.which, self._period = 1 - self._body, model.period
        self._rho, self._gravity = _on_a_body(model, at)
        self.name = model.plant.coordinates[self.which].name
        self._least = max(SWUNG, LEAST_SWUNG / model.per_unit[self.which])
        self._shown, self._behind = math.nan, math.nan
        self._from, self._speed, self._for, self._seconds = 0.0, 0.0, 0.0, 0.0

    def sees(self, away: Sequence[float]) -> bool:
        """Take a sample as deviations; whether the pendulum must have moved since its last count."""
        body, shown = away[self._body], away[self.which]
        self._behind = body if math.isnan(self._behind) else self._behind
        speed = _SPEED * (body - self._behind)
        self._behind += speed * self._period
        self._seconds += self._period
        if shown != self._shown or self._for > WITHIN or self._seconds < 6 / _SPEED:
            self._shown, self._from, self._speed, self._for = shown, self._behind, speed, 0.0
        self._for += self._period
        off = self._behind - self._from - self._speed * self._for
        falls = 0.5 * self._gravity * self._for**2
        carried = off / self._rho
        left = abs(carried + falls * shown) - abs(falls) * OUT_OF_TRUE > self._least
        return left and abs(carried) > STIRRED * self._least


def _on_a_body(model: Rig, at: str) -> tuple[float, float]:
    """Acceleration of the body over the pendulum's that it makes, and g/l of a pendulum on a body at rest."""
    linear = model.linear(at)
    body = [c.name for c in model.plant.coordinates].index(model.plant.inputs[0].on)
    B, pull = linear.B[1::2, 0], linear.A[1::2, 2 * (1 - body)]  # of a lean; a body that is free gives way to it
    rho = float(B[body] / B[1 - body])
    return rho, float(pull[1 - body] - pull[body] / rho)
