"""Does the driven body's encoder show what its drive does? Tested by the command and by the pendulum it carries.

A loop stands for a while without that encoder, or against it, and the arm runs away under it: what a bank of filters
about an equilibrium sees last. Two witnesses say how the body must have moved. The command does, as far as dry friction
lets it. The pendulum does as well: eliminating the force between the rows of ``M q'' = ...`` leaves ``psi'' = rho
theta'' + kappa theta``, whatever force and friction act on the body. Friction that holds the body makes a liar of the
first, a hand at the pendulum one of the second; only what both say counts.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from upright.control.sensors import sticking
from upright.rig import Rig

HELD_BY, UNSEEN = 2.0, 100
"""A driven body is held at most by so many times the dry friction that the model knows of; it cannot have moved by so
many counts without its encoder showing one."""
DRY = 0.01
"""Share of the largest command that dry friction is taken for where the model knows of none."""

CORNER, MEMORY = 10.0, 0.16
"""Motions slower than this are not looked at [rad/s], and how long evidence is remembered [s]: offsets of the
pendulum's zero and of the frame, which look like a constant acceleration, make 1/`CORNER`^2 of themselves at most."""
LEAST_SHARE, LEAST_DRY, LEAST_COUNTS = 0.0012, 0.6, 8
"""Evidence begins where both witnesses say, for `MEMORY`, what so large a share of the largest command, or of the
command that dry friction takes, does to a body that is free; and where that is as many counts."""
AGAINST, NOTHING = -0.2, 0.35
"""Share of what both say that an encoder shows at most when it is the wrong way round, and when it is dead. None of
the 240 sound loops of `python -m benchmarks safety` comes so low, nor any of 480 whose references came in by the
readings, at full command; nor with `LEAST_SHARE` and `LEAST_DRY` a sixth smaller, or with `CORNER` at 14 rad/s.
"""
WAIT = 0.02
"""How long an encoder that is called dead has shown the same count [s]."""


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
        known = HELD_BY * sticking(model)
        self._held = abs(self._drive) * (known or DRY * model.limit)
        self._least = UNSEEN / model.per_unit[self.which]
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


class _Fast:
    """What is faster than `CORNER` of a motion: what an observer of a body that nothing drives does not foresee."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._gains = 2 * CORNER * period, CORNER**2 * period
        self.miss, self._speed, self._before = 0.0, 0.0, math.nan

    def of_acceleration(self, value: float) -> None:
        """A period later, of a motion that has this acceleration now."""
        miss = self.miss
        self.miss += self._speed * self._period - self._gains[0] * miss
        self._speed += value * self._period - self._gains[1] * miss

    def of_position(self, value: float) -> None:
        """Of a motion that is here now."""
        if not math.isnan(self._before):
            self.of_acceleration(0.0)
            self.miss += value - self._before
        self._before = value


class DrivenScale:
    """What the driven body's encoder shows over what command and pendulum say, by a regression that forgets.

    For a pendulum that is held upright on what is driven.
    """

    def __init__(self, model: Rig, at: str) -> None:
        linear, T = model.linear(at), model.period
        self.name = model.plant.coordinates[0].name
        (self._drive, toppling), A = linear.B[1::2, 0].tolist(), linear.A
        self._rho = self._drive / toppling
        self._pull, self._kappa = float(A[1, 2]), float(A[1, 2] - self._rho * A[3, 2])
        late = 1 + round((model.delay + model.lag) / T)
        self._commands = deque([0.0] * late, maxlen=late)
        self._shown, self._driven, self._leaned, self._falls = (_Fast(T) for _ in range(4))
        least = max(LEAST_SHARE * model.limit, LEAST_DRY * sticking(model)) * abs(self._drive) / CORNER**2
        self._needed = max(least, LEAST_COUNTS / model.per_unit[0]) ** 2 * MEMORY / T
        self._kept, self._period = math.exp(-T / MEMORY), T
        self._both, self._size, self._still, self._reading = 0.0, 0.0, 0.0, math.nan

    def sees(self, away: Sequence[float], command: float) -> str:
        """Take a sample as deviations and its command; what is wrong, as a sentence has it, or an empty one."""
        shown, lean = away
        self._still = self._still + self._period if shown == self._reading else 0.0
        self._reading = shown
        self._shown.of_position(shown)
        self._leaned.of_position(lean)
        say = self._driven.miss, self._rho * self._leaned.miss + self._falls.miss
        miss = min(say, key=abs) if say[0] * say[1] > 0 else 0.0
        self._both = self._kept * self._both + miss * self._shown.miss
        self._size = self._kept * self._size + miss**2
        self._commands.append(command)
        self._driven.of_acceleration(self._drive * self._commands[0] + self._pull * lean)
        self._falls.of_acceleration(self._kappa * lean)
        if self._size < self._needed:
            return ""
        if self._both < AGAINST * self._size:
            return "wrong way round"
        return "dead" if self._still > WAIT and self._both < NOTHING * self._size else ""
