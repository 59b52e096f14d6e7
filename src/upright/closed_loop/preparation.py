"""At which rows of a log was the law evaluated, and at which was its command limited?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]

_LONGEST_HOLD = 50
_LEAST_CHANGES = 20


def held_for(u: Array) -> tuple[int, int]:
    """Rows for which each command is held, and the first row at which one is new; (1, 0) when each row has its own."""
    changes = np.flatnonzero(np.diff(u)) + 1
    changes = changes[changes > 3]  # the first rows of a log may be junk
    if changes.size < _LEAST_CHANGES:
        return 1, 0
    rows = int(np.gcd.reduce(changes - changes[0]))
    return (rows, int(changes[0] % rows)) if 1 < rows <= _LONGEST_HOLD else (1, 0)


def extremes(u: Array) -> tuple[Rows, Rows]:
    """Rows at the highest and at the lowest command, where the command stays there for three rows or more."""
    found: list[Rows] = []
    for level in (u.max(), u.min()):
        at = np.abs(u - level) <= 1e-9 * max(1.0, abs(float(level)))
        stays = at[2:] & at[1:-1] & at[:-2]
        found.append(at if stays.any() and level != 0 else np.zeros_like(at))
    return found[0], found[1]


def finer(values: Array, every: int) -> Array:
    """Samples of a signal (N,) at `every` times its rate, a cubic spline through them."""
    if every == 1:
        return values
    from scipy.interpolate import CubicSpline

    rows = np.arange(values.size)
    return np.asarray(CubicSpline(rows, values)(np.arange((values.size - 1) * every + 1) / every))


def stepped(values: Array, every: int) -> Array:
    """The same for a reference: it steps, and does so right after the row before."""
    if every == 1:
        return values
    k = np.arange((values.size - 1) * every + 1)
    return values[-(-k // every)]
