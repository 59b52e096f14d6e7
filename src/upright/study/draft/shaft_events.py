"""When did a hand let go, and when did a drive stop answering? Events in the log of carts or disks."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from upright.signals.smoothing import savitzky_golay
from upright.study.sensors import Array

HALVES = 4
"""Half swings that make a free swing: fewer may be a hand."""

STEADY = 0.25
"""Share by which the half periods of one free swing may differ; dry friction leaves them equal."""


def releases(t: Array, x: Array) -> list[tuple[float, float]]:
    """Stretches (start, stop) [s] in which a body swings freely and only loses amplitude.

    A hand pulls, holds and lets go; what follows are half swings of equal length, each smaller than the one before.
    A stretch begins where the body has left the hand by a quarter of the first half swing.
    """
    turns = turning_points(x, 0.03 * float(np.ptp(x)))
    if len(turns) < HALVES:
        return []
    at = [_leaves(x, a, b) for a, b in pairwise(turns)]
    length = np.array([t[b] - t[a] for a, b in zip(at, turns[1:], strict=True)])
    size = np.array([abs(x[b] - x[a]) for a, b in pairwise(turns)])
    out: list[tuple[float, float]] = []
    i = 0
    while i < size.size - HALVES + 1:
        j = i
        while j + 1 < size.size and size[j + 1] < 1.02 * size[j] and _steady(length[i : j + 2]):
            j += 1
        if j - i + 1 >= HALVES:
            half = float(np.median(length[i : j + 1]))
            follows = float(t[at[j + 1]]) if j + 1 < size.size else float(t[-1])
            last = float(t[turns[j + 1]])
            out.append((float(t[at[i]]) + 0.25 * half, min(last + half, follows, float(t[-1]))))
            i = j + 1
        else:
            i += 1
    longest = max(out, key=lambda span: span[1] - span[0], default=(0.0, 0.0))
    # the body swings with one period; what is much faster is a hand that shakes
    return [span for span in out if span[1] - span[0] > 0.3 * (longest[1] - longest[0])]


def turning_points(x: Array, least: float) -> list[int]:
    """Samples at which a signal turns by more than `least`, first and last one included."""
    found: list[int] = []
    low = high = 0
    rising: bool | None = None
    for i, value in enumerate(x.tolist()):
        low = i if value < x[low] else low
        high = i if value > x[high] else high
        if rising is not False and x[high] - value > least:
            found, rising, low = [*found, high], False, i
        elif rising is not True and value - x[low] > least:
            found, rising, high = [*found, low], True, i
    return found + ([high if rising else low] if rising is not None else [])


def _leaves(x: Array, a: int, b: int) -> int:
    """Last sample near the turning point a before the way to b: a held body leaves late."""
    near = np.flatnonzero(np.abs(x[a : b + 1] - x[a]) < 0.02 * abs(x[b] - x[a]))
    return a + int(near[-1])


def _steady(lengths: Array) -> bool:
    """Whether half periods are equal but for the first, which a hand may have lengthened."""
    middle = float(np.median(lengths))
    return bool(np.all(np.abs(lengths - middle) < STEADY * middle))


def steps(u: Array) -> list[int]:
    """Samples at which a signal of few levels changes."""
    return [int(i) + 1 for i in np.flatnonzero(np.diff(u))]


def follows(t: Array, u: Array, x: Array, at: int) -> bool:
    """Whether a body goes up when the command goes up, judged by the first motion after sample `at`."""
    stop = min(at + max(int(2.0 / float(np.median(np.diff(t)))), 5), t.size)
    moved = x[at:stop] - x[at]
    far = np.flatnonzero(np.abs(moved) > 0.03 * np.ptp(x))
    if not far.size:
        return True
    before = float(u[at - 2]) if at > 2 else 0.0
    push = float(np.mean(u[at + 1 : at + 1 + max(int(far[0]), 1)])) - before
    return bool(moved[far[0]] * push >= 0)


def goes_dead(t: Array, u: Array, x: Array, at: int) -> bool:
    """Whether the drive no longer answers after sample `at`, judged by how it answered before.

    The acceleration is regressed on command, place, speed and its sign before `at`, with one constant. Where it moves
    afterwards, or rests against a command that moved it before, either the command explains it or it does not.
    """
    if at < 50 or t.size - at < 50:
        return False
    dt = float(t[-1] - t[0]) / (t.size - 1)
    width = max(7, int(0.06 / dt) | 1)
    both = [savitzky_golay(part, dt, width) for part in (x[:at], x[at:])]
    pushed = [savitzky_golay(part, dt, width).q for part in (u[:at], u[at:])]
    tables = [np.column_stack([c, m.q, m.v, np.sign(m.v), np.ones_like(c)]) for c, m in zip(pushed, both, strict=True)]
    fast = 0.05 * max(float(np.abs(m.v).max()) for m in both)
    before = np.abs(both[0].v) > fast
    if before.sum() < 3 * width:
        return False
    slopes, *_ = np.linalg.lstsq(tables[0][before], both[0].a[before], rcond=None)
    if slopes[0] == 0:
        return False
    after = np.abs(both[1].v) > fast
    dead = slopes * np.array([0.0, 1.0, 1.0, 1.0, 0.0])
    level = abs(slopes[3] / slopes[0])
    resting = ~after & (np.abs(pushed[1] + slopes[1] / slopes[0] * both[1].q) > 2 * level + 0.1 * np.ptp(pushed[0]))
    if resting.sum() > 0.5 / dt:
        return True
    if after.sum() < 3 * width:
        return False
    missed = [float(np.sum((both[1].a[after] - tables[1][after] @ s) ** 2)) for s in (slopes, dead)]
    return missed[1] < 0.5 * missed[0]
