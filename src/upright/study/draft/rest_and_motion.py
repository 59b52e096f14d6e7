"""When does something happen in a log, where is rest, and how fast does it swing?"""

from __future__ import annotations

import math

import numpy as np

from upright.readers.inspection import Column, Inspection
from upright.records import Record
from upright.study.sensors import Array


def zero_reading(
    record: Record, seen: Inspection, c: Column, drive: Column | None, window: tuple[float, float]
) -> float:
    """Reading at which a coordinate is taken to be zero: before the first command, else where it comes to rest."""
    x = record[c.name]
    if drive is not None:
        u = record[drive.name]
        first = int(np.argmax(u != u[0]))
        if u[0] == 0 and first >= 5:
            return float(np.median(x[max(0, first - 50) : first]))
        return float(x[np.searchsorted(record.t, window[0])]) if c.guess != "rad" else rest_level(x, seen, record.t)
    return rest_level(x, seen, record.t)


def rest_level(x: Array, seen: Inspection, t: Array) -> float:
    """Reading at rest: where it lies still at the end, else at the start, else the middle of the last swings."""
    for start, stop in reversed(seen.rests):
        if stop >= t[-1] - 0.05 * (t[-1] - t[0]):
            return float(np.median(x[(t >= start) & (t <= stop)]))
    late = x[-max(x.size // 5, 2) :]
    middle = (float(late.max()) + float(late.min())) / 2
    start = next((span for span in seen.rests if span[0] <= t[0] + 0.02 * (t[-1] - t[0])), None)
    held = float(np.median(x[(t >= start[0]) & (t <= start[1])])) if start else middle
    # lying still away from the middle is a hand that holds it before release
    return held if abs(held - middle) < 0.1 * float(np.ptp(x)) else middle


def moving_window(
    record: Record, seen: Inspection, signals: list[Array], drive: Column | None, *, pushed: bool
) -> tuple[float, float]:
    """From shortly before the first command, or the release, to where everything has come to rest.

    `pushed`: something moved the first body, and no column says what; its first motion then counts.
    """
    t = record.t
    start, stop = float(t[0]), float(t[-1])
    length = stop - start
    last = next((span for span in reversed(seen.rests) if span[1] >= stop - 0.05 * length), None)
    still = next((span for span in seen.rests if span[0] <= start + 0.02 * length), None)
    if drive is not None:
        if still is not None and drive.switches:
            start = max(start, drive.switches[0][0] - 0.1)
    elif pushed:
        start = max(start, still[1] - 0.1) if still is not None else start
    else:
        x = signals[-1]
        swing = np.abs(x - rest_level(x, seen, t))
        # a free swing only loses amplitude: it begins where it is last as large as ever
        start = float(t[np.flatnonzero(swing >= 0.95 * swing.max())[-1]])
        moving = np.flatnonzero(swing >= 0.03 * swing.max())[-1]
        stop = min(stop, float(t[moving]) + 0.5)
    if last is not None and last[0] > start + 0.1 * length:
        stop = min(stop, last[0] + 0.5)
    if stop - start < 0.1 * length and stop - start < 1.0:
        return float(t[0]), float(t[-1])
    return start, stop


def moves_against(t: Array, u: Array, x: Array) -> bool:
    """Whether the driven column moves against the first command."""
    live = np.flatnonzero(u != u[0])
    if not live.size:
        return False
    i = int(live[0])
    changes = np.flatnonzero(np.sign(u[i:]) != np.sign(u[i]))
    most = max(int(2.0 / float(np.median(np.diff(t)))), 5)
    moved = x[i : i + min(int(changes[0]) if changes.size else most, most)] - x[i]
    far = np.flatnonzero(np.abs(moved) > 0.03 * np.ptp(x))
    return bool(far.size and moved[far[0]] * (u[i] - u[0]) < 0)


def swing_frequency(t: Array, x: Array) -> float:
    """Angular frequency [rad/s] of the last swings about zero, where they are small; 0 without three crossings."""
    far = np.flatnonzero(np.abs(x) > 0.3 * np.std(x))  # hysteresis: noise about zero is no swing
    if far.size < 2:
        return 0.0
    turns = np.flatnonzero(np.diff(np.signbit(x[far])))
    if turns.size < 4:
        return 0.0
    before, after = far[turns], far[turns + 1]
    at = (t[before] * np.abs(x[after]) + t[after] * np.abs(x[before])) / (np.abs(x[before]) + np.abs(x[after]))
    half = float(np.median(np.diff(at[-21:])))
    return math.pi / half if half > 0 else 0.0


def coupling(t: Array, x: Array, theta: Array) -> float:
    """Acceleration of a pendulum per acceleration of its hinge, 0 when the data do not tell.

    From ``theta'' = c cos(theta) x'' - w^2 sin(theta)`` by linear regression; c is negative on a cart along x, positive
    on an arm of fig. 3a. Angles are zero hanging, and accelerations slopes of fourth-order polynomials over 0.1 s.
    """
    from scipy.signal import savgol_filter

    step = max(float(np.median(np.diff(t))), 2e-3)
    grid = np.arange(t[0], t[-1], step)
    width = max(7, int(0.1 / step) | 1)
    if grid.size < 4 * width:
        return 0.0
    angle, place = np.interp(grid, t, theta), np.interp(grid, t, x)
    accelerations = (np.asarray(savgol_filter(v, width, 4, deriv=2, delta=step)) for v in (angle, place))
    a, b = (v[width:-width] for v in accelerations)
    angle = angle[width:-width]
    both = np.column_stack([np.cos(angle) * b, -np.sin(angle)])
    slopes, *_ = np.linalg.lstsq(both, a, rcond=None)
    alone, *_ = np.linalg.lstsq(both[:, 1:], a, rcond=None)
    left, without = np.sum((a - both @ slopes) ** 2), np.sum((a - both[:, 1:] @ alone) ** 2)
    return float(slopes[0]) if left < 0.7 * without else 0.0
