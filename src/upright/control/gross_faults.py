"""Faults so gross that no hand explains them: how hard would a hand have to push, if nothing were wrong?

A sound rig moves as it is seen to (`control.witnesses`) when something pushes its body by ``d = X - Z`` and its
pendulum by ``h = (Y - X)/rho``. Both are counted in strengths of a stated hand, less what friction, rounding and
errors of the model explain, and averaged over `WINDOW`. Where a sound rig needs more than that hand, and a single
wrong factor of an encoder needs less than `SPARED` of it, nobody waits for statistics.

No blow to a rig at rest passes, however hard: it is an impulse in one witness alone, which every factor leaves as large
as it is. A rig that is moving already is accelerated by some X, and a blow that the low-pass spreads to about X, or to
-2 X, looks like a factor of 2, or of -1, while its answer ``w^2 t exp(-w t)`` lasts; so what is needed has to be needed
for that long, unless it is more than a blow makes of it. What passes has two witnesses agree, sample by sample, about a
motion that the third shows by that factor, and a hand would have to follow the law to imitate it. Factors below 1 are
left to the slow watch: a hand that holds a pendulum looks like them, as hard as it likes.

Rounding needs no statistics either, for it is bounded. An encoder is wrong by half a count at most, and the absolute
integral of what ``(s/(s + w))^2`` answers to an impulse is ``2 + 2/e^2``: its acceleration is wrong by
``(1 + 1/e^2) w^2`` counts at most. The corner w is where the worst encoder's is the stated hand.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.control.witnesses import Witnesses
from upright.records import Array
from upright.rig import Rig

WEIGHT_SHARE, DRIVE_SHARE = 0.1, 0.03
"""The stated hand. At the pendulum it pushes with that share of the weight, enough to hold it 5.7 degrees from upright;
at the body with that share of the drive's largest force."""
WINDOW = 0.02
"""Time constant of the average [s]: as long as a board waits for a host."""
SPARED = 0.2
"""Share of what a sound rig needs that a gross fault may need. The model is allowed to be wrong by half as much."""
RELATIVE = 0.1
"""Error of the model, over the largest witness."""
FACTORS = (-1.0, 2.0, 4.0)
"""What an encoder may show over what is true: swapped channels, quadrature counted otherwise."""
STRUCK, BEGUN, HARDEST = 3.0, 0.5, 6.0
"""Time constants of the low-pass for which a blow is answered (0.4 of its largest is left, and falling); strengths of
the hand from which that is counted; and strengths that no blow reaches: one of 1.5 rad/s, at a body of which the hand
makes 12.9 rad/s^2, adds 5.8."""
ROUNDING = 1.0 + math.exp(-2.0)
_EVERY = 2e-3  # s between looks


class GrossFaults:
    """The hand that a sound rig needs, and one with a wrong encoder, of many lanes, fed sample by sample.

    Parameters
    ----------
    model : Rig
        As identified; a pendulum on a driven body.
    at : str
        Equilibrium that is held.
    held : float
        Acceleration of the body that dry friction takes at most.
    """

    def __init__(self, model: Rig, at: str, held: float) -> None:
        see = Witnesses(model, at, 1.0)
        pair = [see.body, see.other]
        self._hand = np.array([DRIVE_SHARE * abs(see.drive) * model.limit, WEIGHT_SHARE * abs(see.rows[1][1])])
        count = np.asarray(model.resolution)[pair]
        corner = math.sqrt(float(np.min(self._hand / count)) / ROUNDING)
        rounding = ROUNDING * corner**2 * count
        self._band = np.array([held + rounding[0], rounding[1] + rounding[0] / abs(see.rho)])
        self._witnesses = Witnesses(model, at, corner)
        names = [model.plant.coordinates[i].name for i in pair]
        self.kinds = tuple((name, f) for name in names for f in FACTORS)
        ones = [1.0] * len(FACTORS)
        self._of_body, self._of_other = np.array([[1.0, *FACTORS, *ones], [1.0, *ones, *FACTORS]])[:, :, None]
        self._shown = np.abs(self._of_body * self._of_other)  # a blow is as large as the wrong encoder shows it
        self._look = max(1, round(_EVERY / model.period))
        self._step = self._look * model.period
        self._new = 1 - math.exp(-self._step / WINDOW)
        self._blow = STRUCK / corner
        self.begin(1)

    def begin(self, lanes: int) -> None:
        """Forget all that was seen."""
        self._witnesses.begin(lanes)
        self._for = np.zeros(lanes)  # s that a sound rig has needed `BEGUN` or more
        self.needed: Array = np.zeros((1 + len(self.kinds), lanes))
        """Strengths of the stated hand: of a sound rig, and of each of `kinds`."""
        self._left = self.needed.copy()  # the same with nothing explained away

    def see(self, y: Array, command: ArrayLike) -> None:
        """Take one reading, shape (lanes, coordinates), as deviation from rest, and the command put out after it."""
        if len(y) != self.needed.shape[1]:
            self.begin(len(y))
        self._witnesses.see(y, command)
        if self._witnesses.samples % self._look == 0:
            of_body, by_other, of_other, by_body, Z = self._witnesses.parts()
            X = of_body / self._of_body + by_other / self._of_other
            Y = of_other / self._of_other + by_body / self._of_body
            wrong = RELATIVE * np.maximum(np.maximum(np.abs(X), np.abs(Y)), np.abs(Z))
            rho = abs(self._witnesses.rho)
            pushes = np.array([self._shown * np.abs(X - Z), self._shown * np.abs(Y - X) / rho])
            excused = np.array([self._shown * wrong + self._band[0], self._shown * wrong / rho + self._band[1]])
            needed = np.tensordot(1 / self._hand, np.maximum(pushes - excused, 0.0), 1)
            self.needed += self._new * (needed - self.needed)
            self._left += self._new * (np.tensordot(1 / self._hand, pushes, 1) - self._left)
            self._for = np.where(self.needed[0] > BEGUN, self._for + self._step, 0.0)

    def speaks(self) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Whether no hand explains what is seen, and which of `kinds` explains it best, lane by lane."""
        enough = (self.needed[1:] < SPARED * self.needed[0]) & (self._left[1:] < self._left[0] / 2)
        blow = (self._for < self._blow) & (self.needed[0] < HARDEST)
        return (self.needed[0] > 1.0) & ~blow & enough.any(axis=0), np.where(enough, self._left[1:], np.inf).argmin(
            axis=0
        )
