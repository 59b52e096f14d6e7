"""Counters, clocks and angles that went beyond their end and began again, as if they had gone on."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from upright.records import Array
from upright.records.columns import ANGLES

ABSOLUTE = (12, 13, 14)
"""Bits of sensors that tell an angle at once, as magnetic encoders do: they begin again after a turn."""
BITS = (8, *ABSOLUTE, 16, 32)
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


_COUNTER = "'{}' is a counter of {} bits and passed its end {}; it is counted on here."
_TURNS = "'{}' began again after a turn, {}; it is counted on here."


def unwrapped(values: Array) -> tuple[Array, int, int]:
    """Readings (N,) of a counter without its jumps from end to end, its bits, and how often it passed an end.

    The readings as they are, and 0 of each, where they are those of no such counter.
    """
    low, high = float(values.min()), float(values.max())
    for bits in BITS:
        whole = 2.0**bits
        if not _within(low, high, whole) or high - low < FULL * whole:
            continue
        if (values != np.round(values)).any():
            return values, 0, 0
        on, times = _without_jumps(values, whole)
        return on, bits if times else 0, times
    return values, 0, 0


def turned_on(values: Array, unit: str) -> tuple[Array, int]:
    """Angles (N,) without their jumps by a turn, and how often they began again; as they are, and 0, where none did.

    `unit` is that of an angle.
    """
    whole = 2 * np.pi / ANGLES[unit]
    low, high = float(values.min()), float(values.max())
    slack = SLACK * whole
    inside = (low >= -whole / 2 - slack and high <= whole / 2 + slack) or (low >= -slack and high <= whole + slack)
    if not inside or high - low < FULL * whole:
        return values, 0
    return _without_jumps(values, whole, fewest=FEWEST_PLACES)


SLACK = 1e-3
"""Of a turn, what digits and noise may add to it."""
FEWEST_PLACES = 4
"""Different readings of an angle: an encoder whose zero is upright has few while a loop balances."""


def may_turn_on(values: Array) -> bool:
    """Whether readings (N,) go through a turn in rad or deg, most of it at once; their unit has to say the rest."""
    swept, jump = float(np.ptp(values)), float(np.abs(np.diff(values)).max(initial=0.0))
    wholes = (2 * np.pi / ANGLES[unit] for unit in ("rad", "deg"))
    return any(FULL * whole <= swept <= (1 + 2 * SLACK) * whole and jump > (1 - SWIFT) * whole for whole in wholes)


def _without_jumps(values: Array, whole: float, *, fewest: int = FEWEST) -> tuple[Array, int]:
    steps = np.abs(np.diff(values))
    jumps = steps > (1 - SWIFT) * whole
    if not jumps.any() or (steps[~jumps] > SWIFT * whole).any() or np.unique(values).size < fewest:
        return values, 0
    turns = np.concatenate([[0.0], np.cumsum(-np.sign(np.diff(values)) * jumps)])
    return values + whole * turns, int(jumps.sum())


def counted_on(name: str, bits: int, times: int) -> str:
    """Note on a column: a counter of so many bits, or an angle where there are none."""
    often = "once" if times == 1 else f"{times} times"
    return _COUNTER.format(name, bits, often) if bits else _TURNS.format(name, often)


def counts_per_turn(name: str, notes: Iterable[str]) -> int:
    """Counts after which an absolute sensor began again, by the notes on its column; 0 for any other."""
    note_of_it = re.compile(re.escape(_COUNTER).replace(r"\{\}", "{}").format(re.escape(name), r"(\d+)", ".*"))
    bits = next((int(match[1]) for note in notes if (match := note_of_it.fullmatch(note))), 0)
    return 2**bits if bits in ABSOLUTE else 0


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
