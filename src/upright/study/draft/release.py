"""When does the hand that lifts a pendulum let go? From then on gravity, friction and the hinge alone move it."""

from __future__ import annotations

import math

import numpy as np

from upright.records import Array
from upright.signals.smoothing import savitzky_golay
from upright.signals.stretches import stretches

HAND = 0.25
"""Share of gravity's largest pull that neither it nor friction nor the hinge explains, from which a hand is told."""

LASTS = 0.1
"""Share of a period that a hand holds at least."""

FAR = 0.5
"""Share of its largest swing from which a pendulum still swings once a hand that lifted it has let go."""


def release_of(t: Array, theta: Array, w: float, hinge: Array | None = None) -> float:
    """Instant [s] from which a pendulum moves freely; the first one when it does all along.

    ``theta'' = c cos(theta) x'' - w^2 sin(theta) - d theta'`` is regressed on the later half of its swings, and held
    against the earlier ones: a pendulum that hangs in a hand is not accelerated as gravity would.

    Parameters
    ----------
    t : (N,) array
        Time [s].
    theta : (N,) array
        Angle from where it hangs [rad].
    w : float
        Angular frequency of its small swings [rad/s].
    hinge : (N,) array, optional
        Coordinate that moves its hinge.
    """
    begin = float(t[0])
    step = max(float(np.median(np.diff(t))), float(t[-1] - t[0]) / 20_000)
    if w <= 0:
        return begin
    width = max(7, int(2 * math.pi / w / 12 / step) | 1)
    grid = np.arange(t[0], t[-1], step)
    if grid.size < 10 * width:
        return begin
    motion = savitzky_golay(np.interp(grid, t, theta), step, width)
    columns = [-np.sin(motion.q), -motion.v]
    if hinge is not None:
        columns.append(np.cos(motion.q) * savitzky_golay(np.interp(grid, t, hinge), step, width).a)
    table = np.column_stack(columns)
    size = np.abs(motion.q)
    swings = np.flatnonzero(size[:-width] > 0.05 * float(size.max()))
    late = swings[swings.size // 2 :]
    slopes, *_ = np.linalg.lstsq(table[late], motion.a[late], rcond=None)
    if slopes[0] <= 0:
        return begin
    pull = float(slopes[0]) * float(np.abs(np.sin(motion.q)).max())
    for first, last in stretches(np.abs(motion.a - table @ slopes) > HAND * pull):
        after = size[last + 1 :]
        if (last - first) * step > LASTS * 2 * math.pi / w and after.size and after.max() > FAR * size.max():
            begin = float(grid[min(last + width // 2, grid.size - 1)])
    return begin
