"""From when on does a pendulum move freely? Then gravity, friction and the hinge alone accelerate it, and no hand."""

from __future__ import annotations

import math

import numpy as np

from upright.records import Array
from upright.signals.smoothing import Motion, noise_gain, savitzky_golay, white_noise
from upright.signals.stretches import stretches

HAND = 0.25
"""Share of gravity's largest pull, not explained by it, by friction or by the hinge, from which a hand is detected."""

SURE = 5.0
"""Standard deviations of what noise makes of an acceleration that a hand has to exceed."""

LASTS = 0.1
"""Share of a period that a hand holds at least."""

FAR = 0.5
"""Share of its largest swing from which a pendulum still swings once a hand that lifted it has let go."""

WIDTHS = 1 / 12, 1 / 2
"""Shares of a period over which accelerations are smoothed: as few as noise allows. A polynomial of order 4 over half a
period bends a sine's acceleration by 1 %."""

STILL = 0.02
"""Share of its largest speed below which a pendulum stands still, rather than turns."""

LEFT = 0.1
"""Share of the motion that a free swing has at least: where less is left, what was taken for a hand was none."""

WHOLE = 0.8
"""Share of the later energy that a swing has from its beginning on when it only loses energy; noise hides the rest."""


def free_from(t: Array, theta: Array, w: float, swings: float, hinge: Array | None = None) -> float:
    """Instant [s] from which a pendulum moves freely.

    ``theta'' = c cos(theta) x'' - w^2 sin(theta) - d theta'`` is regressed on the later half of its swings, and
    compared with the earlier ones: a pendulum that hangs in a hand is not accelerated as gravity would. Noise may not
    pass for a hand, so accelerations are smoothed until it is small, and a hand has to exceed what is left of it.

    Parameters
    ----------
    t : (N,) array
        Time [s].
    theta : (N,) array
        Angle from where it hangs [rad].
    w : float
        Angular frequency of its small swings [rad/s].
    swings : float
        Instant [s] from which it surely swings, as far as amplitudes show: the answer where accelerations do not.
    hinge : (N,) array, optional
        Coordinate that moves its hinge.
    """
    step = max(float(np.median(np.diff(t))), float(t[-1] - t[0]) / 20_000)
    grid = np.arange(t[0], t[-1], step)
    angle = np.interp(grid, t, theta)
    if w <= 0:
        return swings
    motion, width = _smoothed(angle, step, w)
    edge = width // 2
    if grid.size < 10 * width:
        return swings
    columns = [-np.sin(motion.q), -motion.v]
    if hinge is not None:
        columns.append(np.cos(motion.q) * savitzky_golay(np.interp(grid, t, hinge), step, width).a)
    table = np.column_stack(columns)
    size = np.abs(motion.q)
    moving = np.flatnonzero(size[:-width] > 0.05 * float(size.max()))
    late = moving[moving.size // 2 :]
    slopes, *_ = np.linalg.lstsq(table[late], motion.a[late], rcond=None)
    if slopes[0] <= 0:
        return swings
    pull = float(slopes[0]) * float(np.abs(np.sin(motion.q)).max())
    unexplained = np.abs(motion.a - table @ slopes)
    noise = float(np.median(unexplained[late])) / 0.6745
    unexplained[:edge] = unexplained[-edge:] = 0.0  # one-sided polynomials amplify noise tenfold
    other = stretches(unexplained > max(HAND * pull, SURE * noise))
    least = LASTS * 2 * math.pi / w / step
    hands = [(a, b) for a, b in other if b - a > least and _swings_after(size, b)]
    speed = np.abs(motion.v)
    still = [
        (a, b) for a, b in stretches(speed < STILL * float(speed.max())) if b - a > least
    ]  # upright no hand is felt
    turning = speed > 0.05 * float(speed.max())
    hands = [(a, b) for a, b in hands if np.count_nonzero(turning[b:]) >= LEFT * np.count_nonzero(turning)]
    let_go = min(hands[-1][1] + edge, grid.size - 1) if hands else 0
    if hinge is not None or grid[let_go] >= swings:
        return float(grid[let_go]) if hands else swings
    before = [b for _, b in still if grid[b] < swings] + [b + edge for _, b in other if grid[b] < swings]
    first = max([let_go, *before])
    energy = 2 * (1 - np.cos(motion.q)) * float(slopes[0]) + motion.v**2
    inside = energy[first + edge : energy.size - edge]
    return float(grid[first]) if inside.size and inside[0] >= WHOLE * float(inside.max()) else swings


def _smoothed(angle: Array, step: float, w: float) -> tuple[Motion, int]:
    """Motion smoothed as little as its noise allows, and over how many samples."""
    period = 2 * math.pi / w / step
    noise = white_noise(angle)
    width, most = (max(7, int(share * period) | 1) for share in WIDTHS)
    pull = w**2 * float(np.abs(np.sin(angle)).max())
    while width < most and SURE * noise * noise_gain(width) / step**2 > HAND * pull:
        width = min(most, int(1.3 * width) | 1)
    return savitzky_golay(angle, step, width), width


def _swings_after(size: Array, last: int) -> bool:
    """Whether a pendulum still swings far after a sample."""
    after = size[last + 1 :]
    return bool(after.size and after.max() > FAR * size.max())
