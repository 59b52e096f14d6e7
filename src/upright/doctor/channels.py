"""Does a sensor do what a sensor on a body with inertia can do? Dead, frozen, wrapping, losing counts, spiking.

Nothing here knows a plant: a body cannot jump, and it cannot stop within a sample.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.records import Array

REACH = 6
"""Changes to either side that tell how a body moved around a sample."""


@dataclass(frozen=True, kw_only=True)
class Jumps:
    """Samples at which a column jumps: whole turns of its counter, lasting steps, single outliers.

    `wraps` and `steps` are samples before which the jump lies, `spikes` the outlying samples themselves; sizes are in
    the column's unit.
    """

    wraps: NDArray[np.int64]
    modulus: float
    steps: NDArray[np.int64]
    step_sizes: Array
    spikes: NDArray[np.int64]
    spike_sizes: Array


def jumps(t: Array, x: Array, quantum: float, moduli: Sequence[float] = ()) -> Jumps:
    """Jumps of a column (N,) at instants `t` (N,), in steps of `quantum`; `moduli` are turns its counter may make.

    A change counts as a jump when it differs from the changes around it by four times their own spread, by more than
    noise and quantum allow, and by more than a few missed samples would explain.
    """
    nothing = np.zeros(0, np.int64)
    if x.size < 4 * REACH:
        return Jumps(wraps=nothing, modulus=0.0, steps=nothing, step_sizes=x[:0], spikes=nothing, spike_sizes=x[:0])
    d, steps_of = np.diff(x), np.diff(t)
    ratio = steps_of / float(np.median(steps_of))
    around = _around(d / ratio)
    middle = np.median(around, axis=0) * ratio
    off = d - middle
    spread = (around.max(axis=0) - around.min(axis=0)) * np.maximum(ratio, 1.0)
    noise = 1.4826 * float(np.median(np.abs(off)))
    found = np.abs(off) > 4 * spread + max(8 * noise, 6 * quantum, 2e-4 * float(np.ptp(x)))
    # a reading that came late is caught up at once: what jumps was missing just before, or is missing just after
    caught = np.abs(np.convolve(off, np.ones(2 * REACH + 1), "same")) < 0.35 * np.abs(off)
    single = np.zeros_like(found)
    single[1:] |= np.abs(off[1:] + off[:-1]) < 0.3 * np.abs(off[1:])
    single[:-1] |= np.abs(off[1:] + off[:-1]) < 0.3 * np.abs(off[:-1])
    repeated = d == 0
    repeated[1:] |= d[:-1] == 0
    repeated[:-1] |= d[1:] == 0
    late = repeated & (np.abs(middle) > quantum) & (np.abs(off) < 3 * np.abs(middle))
    found &= (~caught & (np.abs(off) > 4 * np.abs(middle))) | (single & ~late)
    at = np.flatnonzero(found)
    spikes: list[int] = []
    steps: list[int] = []
    k = 0
    while k < at.size:
        i = int(at[k])
        if k + 1 < at.size and at[k + 1] == i + 1 and abs(off[i] + off[i + 1]) < 0.4 * abs(off[i]):
            spikes.append(i + 1)
            k += 2
        else:
            steps.append(i + 1)
            k += 1
    sizes = off[np.array(steps, np.int64) - 1] if steps else x[:0]
    turn = _modulus(x, np.array(steps, np.int64), sizes, spread, moduli)
    wrapped = np.abs(np.abs(sizes) - turn) < 0.1 * turn if turn else np.zeros(sizes.size, bool)
    lasting = np.array(steps, np.int64)
    peaks = np.array(spikes, np.int64)
    # noise at the edge of a counter turns it there and back
    there = np.abs(np.abs(off[peaks - 1]) - turn) < 0.1 * turn if turn and peaks.size else np.zeros(peaks.size, bool)
    back_and_forth = np.concatenate([peaks[there], peaks[there] + 1])
    peaks = peaks[~there]
    return Jumps(
        wraps=np.sort(np.concatenate([lasting[wrapped], back_and_forth])),
        modulus=turn,
        steps=lasting[~wrapped],
        step_sizes=sizes[~wrapped],
        spikes=peaks,
        spike_sizes=off[peaks - 1] if peaks.size else x[:0],
    )


def _around(d: Array) -> Array:
    """Changes 2 to `REACH` samples before and after each change, (2 (REACH - 1), N - 1); ends repeat the nearest."""
    n = d.size
    at = np.arange(n)
    offsets = [o for o in range(-REACH, REACH + 1) if abs(o) > 1]
    out = np.empty((len(offsets), n))
    for row, o in enumerate(offsets):
        place = at + o
        outside = (place < 0) | (place >= n)
        place = np.where(outside, at - o, place)
        out[row] = d[place]
    return out


def _modulus(x: Array, steps: NDArray[np.int64], sizes: Array, spread: Array, moduli: Sequence[float]) -> float:
    """Turn of the counter that the jumps amount to; 0 when they do not."""
    if not steps.size:
        return 0.0
    span = float(np.ptp(x))
    slack = spread[steps - 1] + 0.02 * np.abs(sizes)
    for turn in moduli:
        if (np.abs(np.abs(sizes) - turn) < np.minimum(slack, 0.1 * turn)).any():
            return turn
    # an unknown counter: jumps from one end of everything that was read to the other
    largest = float(np.abs(sizes).max())
    low, high = float(x.min()), float(x.max())
    whole = 0
    for i, size in zip(steps.tolist(), sizes.tolist(), strict=True):
        before, after = float(x[i - 1]), float(x[i])
        ends = (before - low, high - after) if size > 0 else (high - before, after - low)
        whole += abs(size) > 0.9 * span and max(ends) < 0.05 * span
    alike = (np.abs(np.abs(sizes) - largest) < 0.05 * largest).all()
    power = math.log2(largest) if largest > 0 else 0.0
    round_count = abs(power - round(power)) < 0.02 and largest >= 200
    return largest if whole == sizes.size and alike and (whole > 1 or round_count) else 0.0


def frozen_from(x: Array, quantum: float) -> tuple[int, float]:
    """Sample from which a column never changes again after it stopped dead in full motion, and how sudden that was.

    The second number is the speed lost at once, beside the largest change of speed within as short a time before;
    the sample is -1 when the column does not end so.
    """
    changes = np.flatnonzero(np.diff(x))
    if changes.size < 4 * REACH:
        return -1, 0.0
    last = int(changes[-1]) + 1
    if x.size - last < max(8, 0.02 * x.size):
        return -1, 0.0
    w = 5
    slope = (x[w : last + 1] - x[: last + 1 - w]) / w
    before = float(np.abs(np.diff(x[last - w : last + 1])).mean())
    changed = np.abs(slope[w:] - slope[:-w])
    usual = max(float(np.percentile(changed, 99.5)), 0.5 * quantum) if changed.size else 0.0
    noise = float(np.median(np.abs(np.diff(x[: last + 1], n=2)))) / w
    sudden = abs(float(slope[-1])) / max(usual, noise, 1e-300)
    moving = before > 1.2 * quantum
    return (last, sudden) if moving and sudden > 0.9 else (-1, sudden)


def doubled_rows(columns: Sequence[tuple[Array, float]]) -> NDArray[np.int64]:
    """Rows in which every moving column (values, quantum) repeats the row before although all were on their way."""
    repeats: NDArray[np.bool_] | None = None
    on_the_way: NDArray[np.bool_] | None = None
    for x, quantum in columns:
        d = np.diff(x)
        if d.size < 6 or not d.any():
            continue
        same = d == 0
        going = np.zeros(d.size, bool)
        near = np.stack([d[:-4], d[1:-3], d[3:-1], d[4:]])
        least = max(3.5 * quantum, 2 * float(np.median(np.abs(np.diff(d)))))
        going[2:-2] = (near.min(axis=0) > least) | (near.max(axis=0) < -least)
        repeats = same if repeats is None else repeats & same
        on_the_way = going if on_the_way is None else on_the_way | going
    if repeats is None or on_the_way is None:
        return np.zeros(0, np.int64)
    return np.flatnonzero(repeats & on_the_way) + 1


def clipped(x: Array, quantum: float, *, inertia: bool) -> tuple[float, float, float]:
    """Lowest and highest value of a column if it is cut off there, else nan, and the share of samples cut off.

    A signal that turns by itself slows down before its extreme and leaves it slowly; one that is cut off comes or
    leaves at the pace it has before or after, and what has `inertia` does both.
    """
    share, ends = 0.0, [math.nan, math.nan]
    if np.unique(x[:: max(x.size // 5000, 1)]).size < 12:
        return ends[0], ends[1], share
    for k, level in enumerate((float(x.min()), float(x.max()))):
        if not inertia and abs(level) < 0.8 * float(np.abs(x).max()):
            continue  # a drive's limits are alike; this one only paused there
        at = x == level
        edges = np.flatnonzero(np.diff(np.concatenate(([0], at.astype(np.int8), [0]))))
        first, after = edges[::2], edges[1::2]
        inside = (first > 6) & (after < x.size - 7)
        if not inertia:  # an effort may begin or end at its limit
            inside |= (first == 0) | (after == x.size)
        long = (after - first >= 3) & inside
        if not long.any():
            continue
        first, after = first[long], after[long]
        came, left = _abrupt(x, first, -1, quantum), _abrupt(x, after - 1, 1, quantum)
        hard = came & left if inertia else came | left
        if hard.any():
            ends[k] = level
            share += float((after - first)[hard].sum()) / x.size
    return ends[0], ends[1], share


def _abrupt(x: Array, at: NDArray[np.int64], way: int, quantum: float) -> NDArray[np.bool_]:
    """Whether a column leaves its value at samples `at`, going `way`, at the pace it has a few samples on."""
    place = np.clip(at, 6, None) if way < 0 else np.clip(at, None, x.size - 7)
    near = np.abs(x[place + 2 * way] - x[place]) / 2
    far = np.abs(x[place + 6 * way] - x[place + 4 * way]) / 2
    return (at == place) & (near > 1.25 * quantum) & (near > 0.5 * far) & (near < 3 * far)
