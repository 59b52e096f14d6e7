"""What a fit promises of its predictions: bands that should hold 90 % of what is measured, and how far it was tried."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEVEL = 0.9
"""Share of unseen samples that should lie inside a band."""

NORMAL = 1.645
"""Standard deviations of normal errors that hold as many."""


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Root mean square [SI] of what a fit leaves of one signal: at a restart, and `horizon` seconds later.

    Of free runs it is the same throughout, and the horizon 0.
    """

    horizon: float
    start: float
    end: float

    def at(self, age: Array) -> Array:
        """Root mean square `age` seconds (N,) after a restart; what grows with time grows in proportion to it."""
        if not self.horizon:
            return np.full(age.shape, self.end)
        return np.sqrt(self.start**2 + (self.end**2 - self.start**2) * (age / self.horizon) ** 2)


@dataclass(frozen=True, kw_only=True)
class SlowFriction:
    """Dry friction `coulomb` [SI] of a joint below the peak `speed` [SI] of the slowest swing that was fitted.

    Each unit [SI] that it is larger there `moves` (names,) the fitted numbers [SI].
    """

    coulomb: str
    speed: float
    moves: Array


@dataclass(frozen=True, kw_only=True)
class Bands:
    """How wide a band around a prediction is: `quantile` times the root of two variances.

    One is that of what the fit leaves over, `spreads` by signal; the other what the uncertainty of the numbers `names`,
    with the `covariance` [SI], does to this prediction. `reached` is the largest size of every command, speed, position
    and horizon of the fitted runs, see `upright.identification.inference.unseen.reach`, `logs` are the logs they
    are from, and `slow` is friction at speeds below theirs.
    """

    quantile: float
    spreads: Mapping[str, tuple[Spread, ...]]
    names: tuple[str, ...] = ()
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))
    reached: Mapping[str, float] = field(default_factory=dict[str, float])
    logs: tuple[str, ...] = ()
    slow: tuple[SlowFriction, ...] = ()
    level: float = LEVEL

    def spread(self, signal: str, horizon: float | None) -> Spread | None:
        """What is left over of a signal, of the runs that were predicted most alike; None when none showed it."""
        there = self.spreads.get(signal, ())
        if not there:
            return None
        if horizon is None:  # a free run, or else the longest horizon
            return min(there, key=lambda s: -math.inf if s.horizon == 0 else -s.horizon)
        return min(there, key=lambda s: math.inf if s.horizon == 0 else abs(math.log(s.horizon / horizon)))
