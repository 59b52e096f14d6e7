"""Counters and clocks of few bits that went beyond their end, as if they had more."""

from __future__ import annotations

import numpy as np

from upright.records import Array

BITS = (8, 16, 32)
FULL = 0.9
"""Share of its range that a counter which passes its end has been through."""
SWIFT = 1 / 8
"""Of the range, the most that a body moves in a sample; a jump over an end looks like all but that much of it."""
CLOCKS = (16, 32)
"""Bits of an ``int`` and of Arduino's ``micros``, which begins again every 71.6 minutes."""
SOON = 10
"""Usual steps within which a clock that begins again goes on; a log of two runs hardly ever does."""
FEWEST = 50
"""Different readings: what bangs from end to end is a command."""


def unwrapped(values: Array) -> tuple[Array, int, int]:
    """Readings (N,) of a counter without its jumps from end to end, its bits, and how often it passed an end.

    The readings as they are, and 0 of each, where they are those of no such counter.
    """
    low, high = float(values.min()), float(values.max())
    for bits in BITS:
        whole = 2.0**bits
        if not _within(low, high, whole) or high - low < FULL * whole:
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


def counting_on(ticks: Array) -> tuple[Array, int, int]:
    """Ticks (N,) of a clock as if it never began again, its bits, and how often it did.

    The ticks as they are, and 0 of each, where they go back otherwise.
    """
    steps = np.diff(ticks)
    back = steps < 0
    if not back.any() or back.all() or (ticks != np.round(ticks)).any():
        return ticks, 0, 0
    most = SOON * max(float(np.median(steps[~back])), 1.0)
    for bits in CLOCKS:
        whole = 2.0**bits
        on = steps[back] + whole
        if _within(float(ticks.min()), float(ticks.max()), whole) and on.min() > 0 and on.max() <= most:
            return ticks + whole * np.concatenate([[0.0], np.cumsum(back)]), bits, int(back.sum())
    return ticks, 0, 0


def _within(low: float, high: float, whole: float) -> bool:
    """Whether values are those of a signed or unsigned number of so many."""
    return (low >= -whole / 2 and high < whole / 2) or (low >= 0 and high < whole)
