"""Which single samples jump away and back? A lost count, a transmission error, a flash on an optical disk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.runs import Run

Array = NDArray[np.float64]

FAR = 12.0
"""A spike stands out by this factor over what the largest ordinary samples do, and"""

LEAST = 0.02
"""by this share of how much the signal varies."""

WIDTH = 2
"""Samples in a row that still count as a spike."""


def without_spikes(run: Run) -> tuple[Run, list[tuple[float, str]]]:
    """The run with its spikes replaced by what stands beside them, and when they were in which coordinate."""
    y = run.y.copy()
    found: list[tuple[float, str]] = []
    for k, c in enumerate(run.measured):
        quantum = run.quantum[k] if run.quantum else 0.0
        at = spikes(run.y[:, k], quantum)
        beside = np.setdiff1d(np.arange(run.t.size), at)
        y[at, k] = np.interp(at, beside, y[beside, k])
        found += [(float(t), c) for t in run.t[at]]
    return (replace(run, y=y) if found else run), found


def spikes(x: Array, quantum: float = 0.0) -> NDArray[np.int64]:
    """Places of single samples of a signal (N,) that jump away and back.

    They are compared with the upper percent of what a running median of five takes away, so that neither noise nor
    fast motion, which bends at every turn, counts.
    """
    padded = np.concatenate([x[:1].repeat(2), x, x[-1:].repeat(2)])
    calm = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    off = np.abs(x - calm)
    usual = float(np.quantile(off, 0.99))
    far = off > max(FAR * usual, LEAST * float(np.std(calm)), 4 * quantum, 1e-300)
    keep: list[int] = []
    for first, last in merged(far, gap=1):
        here = np.arange(first, last + 1)
        # a spike also moves the median of its neighbours, by what the signal does in one sample
        high = here[off[here] > 0.5 * off[here].max()]
        if high.size <= WIDTH and here.size <= WIDTH + 4:
            keep += [int(i) for i in high]
    return np.array(keep, dtype=np.int64)


def merged(mask: NDArray[np.bool_], *, gap: int) -> list[tuple[int, int]]:
    """First and last place of each stretch of a mask, stretches fewer than `gap` places apart being one."""
    places = np.flatnonzero(mask)
    if not places.size:
        return []
    cuts = np.flatnonzero(np.diff(places) > gap)
    return [(int(a), int(b)) for a, b in zip(places[np.r_[0, cuts + 1]], places[np.r_[cuts, -1]], strict=True)]
