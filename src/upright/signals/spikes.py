"""Samples that a body with inertia cannot produce: single outliers, lasting jumps, turns of a counter.

A body cannot jump, whatever it is; a lost count, a transmission error or a flash on an optical disk can.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.signals.stretches import stretches

Array = NDArray[np.float64]

FAR = 12.0
"""A spike stands out by this factor over what the largest ordinary samples do, and"""

LEAST = 0.02
"""by this share of how much the signal varies."""

WIDTH = 2
"""Samples in a row that still count as a spike."""

_BLOCK = 1 << 16  # samples whose surroundings are looked at together, so that a long log needs little memory
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

    def __bool__(self) -> bool:
        return bool(self.wraps.size or self.steps.size or self.spikes.size)

    def mended(self, x: Array) -> Array:
        """The column (N,) without them."""
        out = x.copy()
        for i, size in zip(self.steps.tolist(), self.step_sizes.tolist(), strict=True):
            out[i:] -= size
        for i in self.wraps.tolist():
            out[i:] -= self.modulus * np.sign(x[i] - x[i - 1])
        return without(out, self.spikes)


def spikes(x: Array, resolution: float = 0.0) -> NDArray[np.int64]:
    """Places of single samples of a signal (N,) that jump away and back.

    They are compared with the upper percent of what a running median of five takes away, so that neither noise nor
    fast motion, which bends at every turn, counts.
    """
    calm = _running_median(x)
    off = np.abs(x - calm)
    usual = float(np.quantile(off, 0.99))
    far = off > max(FAR * usual, LEAST * float(np.std(calm)), 4 * _step(x, resolution), 1e-300)
    keep: list[int] = []
    for first, last in stretches(far):
        here = np.arange(first, last + 1)
        # a spike also moves the median of its neighbours, by what the signal does in one sample
        high = here[off[here] > 0.5 * off[here].max()]
        if high.size <= WIDTH and here.size <= WIDTH + 4 and _returns(x, int(high[0]), int(high[-1])):
            keep += [int(i) for i in high]
    return np.array(keep, dtype=np.int64)


def _step(x: Array, resolution: float) -> float:
    """Step of a signal (N,); two values alone do not tell theirs: 1 between counts, else all that they differ by."""
    low, high = float(x.min()), float(x.max())
    if resolution or not ((x == low) | (x == high)).all():
        return resolution
    return min(high - low, 1.0) if low.is_integer() and high.is_integer() else high - low


def _returns(x: Array, first: int, last: int) -> bool:
    """Whether a signal comes back from samples `first` to `last` by about as much as it went there."""
    away = x[first] - x[max(first - 1, 0)]
    back = x[last] - x[min(last + 1, x.size - 1)]
    return abs(away - back) < 0.4 * max(abs(away), abs(back)) or first == 0 or last == x.size - 1


def without(x: Array, at: NDArray[np.int64]) -> Array:
    """A signal (N,) with samples replaced by straight lines between their neighbours."""
    if not at.size:
        return x
    good = np.ones(x.size, dtype=bool)
    good[at] = False
    beside = np.flatnonzero(good)
    out = x.copy()
    out[at] = np.interp(at, beside, x[beside])
    return out


def jumps(t: Array, x: Array, resolution: float, moduli: Sequence[float] = ()) -> Jumps:
    """Jumps of a column (N,) at instants `t` (N,), in steps of `resolution`; `moduli` are turns its counter may make.

    A change counts as a lasting jump when it differs from the changes around it by four times their own spread, by
    more than noise and resolution allow, and by more than a few missed samples would explain.
    """
    nothing = np.zeros(0, np.int64)
    if x.size < 4 * REACH:
        return Jumps(wraps=nothing, modulus=0.0, steps=nothing, step_sizes=x[:0], spikes=nothing, spike_sizes=x[:0])
    resolution = _step(x, resolution)
    ratio = np.diff(t)
    ratio /= float(np.median(ratio))
    peaks = spikes(x, resolution)
    peaks = peaks[np.pad(ratio, 1, constant_values=1.0)[peaks + np.array([[0], [1]])].max(axis=0) < 1.5]
    calm = without(x, peaks)
    heights = x[peaks] - calm[peaks]
    off = np.diff(calm)
    usual, spread = _surroundings(off / ratio)
    usual *= ratio
    off -= usual
    spread *= np.maximum(ratio, 1.0)
    noise = 1.4826 * float(np.median(np.abs(off), overwrite_input=True))
    far = np.abs(off) > 4 * spread + max(8 * noise, 6 * resolution, 2e-4 * float(np.ptp(calm)))
    # a reading that came late is caught up at once: what jumps was missing just before, or is missing just after
    caught = np.abs(np.convolve(off, np.ones(2 * REACH + 1), "same")) < 0.35 * np.abs(off)
    steps = np.flatnonzero(far & ~caught)
    steps = steps[np.abs(off[steps]) > 4 * np.abs(usual[steps])] + 1
    sizes = off[steps - 1]
    turn = _modulus(calm, steps, sizes, spread, moduli)
    wrapped, there = (np.abs(np.abs(size) - turn) < 0.1 * turn for size in (sizes, heights))
    # noise at the edge of a counter turns it there and back
    return Jumps(
        wraps=np.sort(np.concatenate([steps[wrapped], peaks[there], peaks[there] + 1])),
        modulus=turn, steps=steps[~wrapped], step_sizes=sizes[~wrapped],
        spikes=peaks[~there], spike_sizes=heights[~there],
    )  # fmt: skip


def _running_median(x: Array) -> Array:
    """Median of each sample and the two before and after it (N,); ends repeat themselves."""
    padded = np.concatenate([x[:1].repeat(2), x, x[-1:].repeat(2)])
    out = np.empty(x.size)
    for first in range(0, x.size, _BLOCK):
        rows = padded[first : first + _BLOCK + 4]
        out[first : first + _BLOCK] = np.median(np.lib.stride_tricks.sliding_window_view(rows, 5), axis=1)
    return out


def _surroundings(d: Array) -> tuple[Array, Array]:
    """Median and range (N - 1,) of the changes around each change."""
    middle, spread = np.empty(d.size), np.empty(d.size)
    for first in range(0, d.size, _BLOCK):
        around = _around(d, np.arange(first, min(first + _BLOCK, d.size)))
        here = slice(first, first + _BLOCK)
        middle[here], spread[here] = np.median(around, axis=0), np.ptp(around, axis=0)
    return middle, spread


def _around(d: Array, at: NDArray[np.int64]) -> Array:
    """Changes 2 to `REACH` samples before and after the changes `at`, (2 (REACH - 1), n); ends repeat the nearest."""
    offsets = np.array([o for o in range(-REACH, REACH + 1) if abs(o) > 1])[:, None]
    place = at + offsets
    return d[np.where((place < 0) | (place >= d.size), at - offsets, place)]


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
