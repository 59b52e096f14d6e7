"""Counters of 8, 16 or 32 bits that a body has turned beyond their end, as if they had more."""

from __future__ import annotations

import numpy as np

from upright.records import Array

BITS = (8, 16, 32)
FULL = 0.9
"""Share of its range that a counter which passes its end has been through."""
SWIFT = 1 / 8
"""Of the range, the most that a body moves in a sample; a jump over an end looks like all but that much of it."""
FEWEST = 50
"""Different readings: what bangs from end to end is a command."""


def unwrapped(values: Array) -> tuple[Array, int, int]:
    """Readings (N,) of a counter without its jumps from end to end, its bits, and how often it passed an end.

    The readings as they are, and 0 of each, where they are those of no such counter.
    """
    low, high = float(values.min()), float(values.max())
    for bits in BITS:
        whole = 2.0**bits
        within = (low >= -whole / 2 and high < whole / 2) or (low >= 0 and high < whole)
        if not within or high - low < FULL * whole:
            continue
        steps = np.abs(np.diff(values))
        jumps = steps > (1 - SWIFT) * whole
        if not jumps.any() or (steps[~jumps] > SWIFT * whole).any() or (values != np.round(values)).any():
            return values, 0, 0
        if np.unique(values).size < FEWEST:
            return values, 0, 0
        turns = np.concatenate([[0.0], np.cumsum(-np.sign(np.diff(values)) * jumps)])
        return values + whole * turns, bits, int(jumps.sum())
    return values, 0, 0
