"""Stretches of samples: where a condition holds, between cuts, from turn to turn of a motion."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def stretches(mask: NDArray[np.bool_], *, gap: int = 1) -> list[tuple[int, int]]:
    """First and last place of each stretch of a mask, stretches fewer than `gap` places apart being one."""
    places = np.flatnonzero(mask)
    if not places.size:
        return []
    cuts = np.flatnonzero(np.diff(places) > gap)
    return [(int(a), int(b)) for a, b in zip(places[np.r_[0, cuts + 1]], places[np.r_[cuts, -1]], strict=True)]


def pieces(cut: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First sample of each piece of a record, and the one after its last, longest first.

    `cut` (N - 1,) says between which neighbours it is cut.
    """
    edges = [0, *(np.flatnonzero(cut) + 1).tolist(), cut.size + 1]
    return sorted(pairwise(edges), key=lambda span: span[0] - span[1])


def turning_points(x: Array, least: float, *, ends: bool = False) -> NDArray[np.int64]:
    """Samples at which a signal (N,) turns back by at least `least`.

    The extremes before the first turn and after the last are left out, since nobody sees the motion turn there; with
    `ends` they are given too.
    """
    turns: list[int] = []
    low = high = 0
    direction = 0
    for i, value in enumerate(x.tolist()):
        if value > x[high]:
            high = i
        if value < x[low]:
            low = i
        if direction >= 0 and value <= x[high] - least:
            if direction > 0 or ends:
                turns.append(high)
            direction, low = -1, i
        elif direction <= 0 and value >= x[low] + least:
            if direction < 0 or ends:
                turns.append(low)
            direction, high = 1, i
    if ends and direction:
        turns.append(high if direction > 0 else low)
    return np.array(turns, dtype=np.int64)
