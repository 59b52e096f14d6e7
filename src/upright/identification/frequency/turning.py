"""When does it turn round? Dry friction changes sign there, and bends the motion differently before and after.

About an extreme the position is a parabola on either side, with one apex and two curvatures. All periods are laid over
each other, so that an encoder's steps average out; what a few harmonics would say errs as one over their number.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REACH = 0.11
"""Share of a period about an extreme in which its shape is fitted."""
BINS = 120
NEAR = 0.03
"""Share of a period by which an apex may lie off its first guess."""


def sign_line(t: Array, y: Array, omega: float, guess: Array) -> complex | None:
    """First line of the speed's sign, from where a signal without drift turns; None when that cannot be told.

    Parameters
    ----------
    t, y : (N,) arrays
        Time [s] and position, drift taken out.
    omega : float
        [rad/s]
    guess : (P,) array
        Speed at P instants of one period from phase 0 on: its two changes of sign are where the search begins.
    """
    change = np.flatnonzero(np.sign(guess) != np.sign(np.roll(guess, -1)))
    if change.size != 2:
        return None
    phase = np.mod(omega * t, 2 * math.pi)
    found: list[float] = []
    for k in change:
        apex = _apex(phase, y, 2 * math.pi * (k + 0.5) / guess.size)
        if apex is None:
            return None
        found.append(apex)
    rising = found if guess[(change[0] + 1) % guess.size] > 0 else found[::-1]
    low, high = rising  # speed above zero from the least position on to the greatest
    return complex(2 / math.pi * 1j * (np.exp(-1j * high) - np.exp(-1j * low)))


def _averaged(x: Array, y: Array) -> tuple[Array, Array]:
    """Means over `BINS` equal parts of the range of x, where there are more samples than that."""
    if x.size <= BINS:
        return x, y
    width = 4 * math.pi * (REACH + NEAR) / BINS
    at = np.clip(((x + BINS / 2 * width) / width).astype(np.int64), 0, BINS - 1)
    count = np.bincount(at, minlength=BINS)
    full = count > 0
    weighed = (np.bincount(at, weights=v, minlength=BINS)[full] / count[full] for v in (x, y))
    mean_x, mean_y = weighed
    return mean_x, mean_y


def _apex(phase: Array, y: Array, near: float) -> float | None:
    """Phase of an extreme, by halving the interval about the best of a grid."""
    away = np.mod(phase - near + math.pi, 2 * math.pi) - math.pi
    there = np.abs(away) < 2 * math.pi * (REACH + NEAR)
    x, z = _averaged(away[there], y[there])
    if x.size < 12:
        return None
    scale = 2 * math.pi * REACH

    def misfit(shift: float) -> float:
        s = (x - shift) / scale
        inside = np.abs(s) < 1
        s, w = s[inside], z[inside]
        left, right = np.where(s < 0, s, 0.0), np.where(s >= 0, s, 0.0)
        columns = np.column_stack([np.ones_like(s), left**2, right**2, left**3, right**3])
        try:
            solution = np.linalg.solve(columns.T @ columns, columns.T @ w)
        except np.linalg.LinAlgError:  # no sample on one side
            return math.inf
        return float(np.mean((w - columns @ solution) ** 2))

    reach = 2 * math.pi * NEAR
    grid = np.linspace(-reach, reach, 13)
    costs = [misfit(float(g)) for g in grid]
    best = int(np.argmin(costs))
    if best in (0, grid.size - 1):
        return None
    a, b = float(grid[best - 1]), float(grid[best + 1])
    ratio = (math.sqrt(5) - 1) / 2  # golden section
    c, d = b - ratio * (b - a), a + ratio * (b - a)
    at_c, at_d = misfit(c), misfit(d)
    for _ in range(16):
        if at_c < at_d:
            b, d, at_d = d, c, at_c
            c = b - ratio * (b - a)
            at_c = misfit(c)
        else:
            a, c, at_c = c, d, at_d
            d = a + ratio * (b - a)
            at_d = misfit(d)
    return near + (a + b) / 2
