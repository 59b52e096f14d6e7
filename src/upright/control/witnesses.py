"""Three witnesses of how what carries a pendulum is accelerated: its own encoder, the pendulum on it, the command.

With the model's rows about the equilibrium, ``psi'' = a_11 psi' + a_12 theta + a_13 theta' + b_1 u + d`` and
``theta'' = ... + (b_1 u + d)/rho + h``, where d is friction or a hand at the body and h a hand at the pendulum,

    X = psi'' - a_11 psi' - ...          = b_1 u + d            what its own encoder shows
    Y = rho (theta'' - a_31 psi' - ...)  = b_1 u + d + rho h    what the pendulum on it shows
    Z = b_1 u                                                   what the command says,

each behind the same low-pass ``(w/(s + w))^2``, so that nothing is differentiated.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import ArrayLike

from upright.records import Array
from upright.rig import Rig


class Witnesses:
    """The three of one loop, or of many lanes of it, fed sample by sample.

    Parameters
    ----------
    model : Rig
        As identified; a pendulum on a driven body.
    at : str
        Equilibrium that is held.
    corner : float
        Of the low-pass [rad/s].
    """

    def __init__(self, model: Rig, at: str, corner: float) -> None:
        self.body = [c.name for c in model.plant.coordinates].index(model.plant.inputs[0].on)
        self.other = 1 - self.body
        A, B = model.linear(at).A, model.linear(at).B[:, 0]
        body, other = 2 * self.body + 1, 2 * self.other + 1
        self.drive, self.rho = float(B[body]), float(B[body] / B[other])
        # of the body's row and the other's: by speed of the body, by place and speed of the other
        self.rows = [[float(A[row, k]) for k in (body, other - 1, other)] for row in (body, other)]
        step = corner * model.period
        self._corner, self._pass = corner, step / (1 + step)  # backward, so that s/(s + w) is w times what is left
        self._late = 1 + round((model.delay + model.lag) / model.period)
        self.begin(1)

    def begin(self, lanes: int) -> None:
        """Forget all that was seen."""
        self.samples = 0
        self._now, self._first = np.zeros((3, lanes)), np.zeros((3, lanes))
        self._passed = np.zeros((2, 3, lanes))
        self._commands: deque[Array] = deque([np.zeros(lanes)] * self._late, maxlen=self._late)

    def see(self, y: Array, command: ArrayLike) -> None:
        """Take one reading, shape (lanes, coordinates), as deviation from rest, and the command put out after it."""
        if self.samples == 0:
            self._first[:2] = y[:, [self.body, self.other]].T
        self._now = np.array([y[:, self.body], y[:, self.other], self._commands[0]]) - self._first
        self._commands.append(np.broadcast_to(np.asarray(command, dtype=np.float64), len(y)))
        once, twice = self._passed
        once += self._pass * (self._now - once)
        twice += self._pass * (once - twice)
        self.samples += 1

    @property
    def lean(self) -> Array:
        """Of the pendulum, behind the low-pass, shape (lanes,)."""
        return self._passed[1, 1] + self._first[1]

    @property
    def speed(self) -> Array:
        """Of body and pendulum, behind the low-pass, shape (2, lanes)."""
        once, twice = self._passed[:, :2]
        return self._corner * (once - twice)

    def parts(self) -> Array:
        """X, Y and Z by the encoder that they are read from, shape (5, lanes).

        X of the body's and of the pendulum's, Y of the pendulum's and of the body's, Z.
        """
        once, twice = self._passed
        acceleration = self._corner**2 * (self._now - 2 * once + twice)
        speed, lean = self.speed, self.lean
        (a, b, c), (d, e, f) = self.rows
        return np.array([
            acceleration[0] - a * speed[0], -b * lean - c * speed[1],
            self.rho * (acceleration[1] - e * lean - f * speed[1]), -self.rho * d * speed[0], self.drive * twice[2],
        ])  # fmt: skip
