"""Where a sampled motion turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def turning_points(x: Array, least: float, *, ends: bool = False) -> NDArray[np.int64]:
    """Samples at which a signal (N,) turns back by at least `least`.

    The extremes before the first turn and after the last are left out, since nobody sees the motion turn there; with
    `ends` they are given too.
    """
    found: list[int] = []
    low = high = 0
    direction = 0
    for i, value in enumerate(x.tolist()):
        if value > x[high]:
            high = i
        if value < x[low]:
            low = i
        if direction >= 0 and value <= x[high] - least:
            if direction > 0 or ends:
                found.append(high)
            direction, low = -1, i
        elif direction <= 0 and value >= x[low] + least:
            if direction < 0 or ends:
                found.append(low)
            direction, high = 1, i
    if ends and direction:
        found.append(high if direction > 0 else low)
    return np.array(found, dtype=np.int64)
