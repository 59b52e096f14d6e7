"""Step in which a column moves, and the encoder or converter that makes such steps.

Levels of a quantized signal are multiples of one step. The step is found from the differences of the levels
that occur, then refined by least squares over all of them; a signal without steps answers 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from upright.readers.timebase import decimal_step
from upright.records import Array

_MOST_LEVELS = 4000  # as many as the fit needs
_FITS = 0.08  # rms distance from the grid in steps; 0.289 when there is no grid


@dataclass(frozen=True, kw_only=True)
class Quantum:
    """Step of a column in its unit, 0 when there is none; `decimals` says that it is the rounding of the text."""

    step: float = 0.0
    decimals: bool = False
    counts_per_rev: int = 0

    def __str__(self) -> str:
        if not self.step:
            return ""
        if self.counts_per_rev:
            return f"2 pi/{self.counts_per_rev} = {self.step:.4g}"
        return f"{self.step:.4g}" + (" (decimals)" if self.decimals else "")


def find(values: Array) -> Quantum:
    """Step of a column (N,)."""
    rounding = decimal_step(values, 7, 1e-6)
    if rounding >= 1:  # counts
        return Quantum(step=_common_divisor(values, rounding))
    levels = _levels(values, rounding)
    if levels.size < 3:
        return Quantum()
    step = _grid(levels, rounding)
    if step >= 1.5 * rounding and step > 0:
        return Quantum(step=step, counts_per_rev=counts_per_rev(step))
    common = _common_divisor(values, rounding) if rounding else 0.0
    if levels.size > 8 and common > 1.5 * rounding:  # too fine beside its text for a fit, yet exact
        return Quantum(step=common)
    # Steps no coarser than the text's own digits tell about the text, not about the sensor.
    few = rounding > 0 and levels.size < 0.5 * values.size
    return Quantum(step=rounding, decimals=True) if few else Quantum()


def _common_divisor(values: Array, digit: float) -> float:
    """Greatest step of which all differences are multiples, for multiples of a digit; 0 below 3 levels."""
    whole = np.round(np.unique(values) / digit).astype(np.int64)
    return float(np.gcd.reduce(whole - whole[0])) * digit if whole.size > 2 else 0.0


def counts_per_rev(step: float) -> int:
    """Counts of an encoder whose step is `step` rad, when that is a number encoders are made in; else 0."""
    count = 2 * math.pi / step
    nearest = round(count)
    made = 200 <= nearest <= 1 << 20 and (nearest % 100 == 0 or (nearest & (nearest - 1)) == 0)
    return nearest if made and abs(count - nearest) < 2e-4 * nearest else 0


def _levels(values: Array, rounding: float) -> Array:
    """Distinct values; those closer than the rounding of text or float64 are one."""
    levels = np.unique(values)
    span = float(levels[-1] - levels[0])
    near = max(1.5 * rounding if rounding < 1 else 0.0, 1e-9 * span)
    if near and levels.size > 1:
        levels = levels[np.concatenate(([True], np.diff(levels) > near))]
    if levels.size > _MOST_LEVELS:
        middle = (levels.size - _MOST_LEVELS) // 2
        levels = levels[middle : middle + _MOST_LEVELS]
    return levels


def _grid(levels: Array, rounding: float) -> float:
    """Spacing q of the grid a + q k on which all levels lie; 0 when there is none."""
    steps = np.diff(levels)
    start = float(np.percentile(steps, 10))
    candidates = [float(steps.min()), start, start / 2, start / 3]
    for candidate in candidates:
        step = _refine(levels, steps, candidate, rounding)
        if step:
            return step
    return 0.0


def _refine(levels: Array, steps: Array, step: float, rounding: float) -> float:
    if step <= 0:
        return 0.0
    small = steps[steps < 3.5 * step]
    multiples = np.round(small / step)
    if not multiples.any():
        return 0.0
    step = float(small.sum() / multiples.sum())
    # Reach out from the middle, so that k is never counted further than the step is known.
    offsets = levels - levels[levels.size // 2]
    reach = 8.0
    while True:
        inside = np.abs(offsets) <= reach * step
        k = np.round(offsets[inside] / step)
        if k.any() and inside.sum() > 3:
            step = float(np.polyfit(k, offsets[inside], 1)[0])
        if inside.all() or step <= 0:
            break
        reach *= 2
    if step <= 0:
        return 0.0
    k = np.round(offsets / step)
    off = offsets - step * k
    off -= off.mean()
    # Rounded text adds an error of its own, uniform within half its last digit.
    allowed = max(_FITS * step, 0.6 * rounding)
    return step if float(np.sqrt(np.mean(off**2))) < allowed and allowed < 0.2 * step and np.unique(k).size > 2 else 0.0
