"""Encoders as they are coupled and mounted: with play, and off the centre of their shafts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from upright.records import Array


@dataclass(frozen=True, kw_only=True)
class Mounting:
    """What encoders show besides the motion, coordinate by coordinate; each was zeroed where its coordinate is zero.

    Attributes
    ----------
    play : tuple of float
        How far the body moves after a reversal before its encoder follows [m or rad].
    off_centre : tuple of float
        Amplitude of the error that comes again with every turn of the shaft [m or rad].
    phase : tuple of float
        Of that error where the coordinate is zero [rad].
    turn : tuple of float
        Motion per turn of the shaft [m or rad].
    """

    play: tuple[float, ...]
    off_centre: tuple[float, ...]
    phase: tuple[float, ...]
    turn: tuple[float, ...]

    def felt(self, q: ArrayLike) -> Array:
        """What the discs show of motions that begin in the middle of the play, shape (N, ..., coordinates)."""
        moved = np.array(q, dtype=np.float64)
        half = np.array(self.play) / 2
        low, high, last = moved - half, moved + half, moved[0]
        for k in range(1, len(moved)):
            last = np.minimum(np.maximum(last, low[k]), high[k])
            moved[k] = last
        return self.turned(moved)

    def turned(self, q: ArrayLike) -> Array:
        """The same without play, shape (..., coordinates)."""
        error, phase = np.array(self.off_centre), np.array(self.phase)
        angle = np.asarray(q, dtype=np.float64) * self._per
        return np.asarray(q) + error * (np.sin(angle + phase) - np.sin(phase))

    def slope(self, q: ArrayLike) -> Array:
        """How much more than the motion the encoders show about coordinates, shape (..., coordinates)."""
        angle = np.asarray(q, dtype=np.float64) * self._per
        return 1 + np.array(self.off_centre) * self._per * np.cos(angle + np.array(self.phase))

    @property
    def _per(self) -> Array:
        return 2 * math.pi / np.array(self.turn)
