"""A reference that somebody gives while a law runs, tick by tick: a step, a square wave or a sine."""

from __future__ import annotations

import math
from dataclasses import dataclass

STEP, SQUARE, SINE = "step", "square", "sine"
SHAPES = (STEP, SQUARE, SINE)


@dataclass(frozen=True, kw_only=True)
class Reference:
    """Where the law is to hold what follows, from where it was switched on.

    Attributes
    ----------
    size : float
        Of a step, or of a wave to either side [rad or m].
    shape : str
        One of `SHAPES`.
    period : float
        Of a wave [s]; a step has none.
    """

    size: float
    shape: str = STEP
    period: float = 0.0

    def at(self, tick: int, dt: float) -> float:
        """Its value so many ticks of `dt` [s] after it began; half a square wave is a whole number of ticks."""
        if self.shape == SINE:
            return self.size * math.sin(math.tau * tick * dt / self.period)
        if self.shape == SQUARE and tick // max(1, round(self.period / dt / 2)) % 2:
            return -self.size
        return self.size
