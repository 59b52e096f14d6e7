"""In which steps do the times and the values of a log move, and what makes such steps?

A clock that is rounded to 1 ms shows steps of 1 and 2 ms where every sample was 1.1275 ms after the last.
Such a time base is rebuilt from the sample index; a true jitter is left as it is.

Levels of a quantized signal are multiples of one step. The step is found from the differences of the levels
that occur, then refined by least squares over all of them; a signal without steps answers 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation

import numpy as np

from upright.readers.source import Source
from upright.records import Array
from upright.signals.smoothing import white_noise

INDEX_NAMES = ("sample", "n", "index", "i", "k", "no", "step", "row")

# A rounding below one part in 50 of the period disturbs a fit less than the sensors do.
_MATTERS = 0.02
_EPOCH = 1e6  # s; a clock that reads more than 11 days counts from an epoch


def is_index(name: str, values: Array) -> bool:
    """Whether a column counts the samples: named so, whole numbers, increasing."""
    whole = bool((values == np.round(values)).all())
    return name.casefold() in INDEX_NAMES and whole and bool((np.diff(values) > 0).all())


def is_epoch(t: Array) -> bool:
    """Whether times count from 1970 or the like, where float64 resolves only parts of a microsecond."""
    return t.size > 0 and abs(float(t[0])) > _EPOCH


def epoch_digits(t: Array) -> int:
    """Digits behind the second of stamps without a point: 3 where they count milliseconds since 1970, 6 or 9.

    Of what falls between 2001 and 2106 only.
    """
    return next((n for n in (3, 6, 9) if 1e9 < float(t[0]) / 10**n < 2**32), 0)


def exact_seconds(
    source: Source, cells: Sequence[str], lines: Sequence[int], *, name: str, column: int, digits: int = 0
) -> tuple[Array, int]:
    """Seconds (N,) since the first cell, subtracted as whole nanoseconds, and that first cell in nanoseconds.

    A cell counts seconds, or parts of them of so many `digits`. An epoch stamp such as 1707681595.547459602 has 19
    digits; a float64 keeps 16.
    """
    nanoseconds: list[int] = []
    for text, line in zip(cells, lines, strict=True):
        try:
            value = Decimal(text.strip())
        except InvalidOperation:
            value = Decimal("nan")
        if not (value.is_finite() and value.copy_abs() < 10 ** (15 + digits)):
            raise source.bad(
                f"expected a time stamp in s, got {text.strip()[:40]!r}; mend or delete the row",
                line=line,
                column=column,
                name=name,
            )
        nanoseconds.append(int(value.scaleb(9 - digits)))
    first = nanoseconds[0]
    return np.array([value - first for value in nanoseconds], dtype=np.float64) * 1e-9, first


def rebuild(t: Array, index: Array | None = None) -> tuple[Array, str]:
    """Uniform times (N,) [s] where `t` is a rounded uniform clock, and the sentence that says so.

    Period = (t_last - t_first) / (i_last - i_first), with the sample index i of the log or a plain count. Without
    evidence of rounding, `t` comes back as it was with an empty sentence.

    The evidence: all times are multiples of 1, 0.1 or 0.01 ms (or 1 s, 0.1 s, 10 ms), the steps take two
    neighbouring multiples only, and the rounding is coarse beside the period. Or all have a few significant digits, so
    that late times are coarser than early ones, and one period explains them all.
    """
    n = t.size
    if n < 8 or not (np.diff(t) > 0).all():
        return t, ""
    count = np.arange(n, dtype=np.float64) if index is None else index - index[0]
    if (digits := _digits(t)) and (period := _one_period(t, count, _last_digit(t, digits))):
        uniform = t[0] + period * count
        return uniform, (
            f"Time has {digits} significant digits; rebuilt with the period of {period * 1e3:.6g} ms that explains "
            f"every stamp (they wander up to {float(np.abs(uniform - t).max()) * 1e3:.2g} ms from it)."
        )
    step = rounding(t)
    span = float(count[-1])
    period = float(t[-1] - t[0]) / span
    if step == 0 or step < _MATTERS * period:
        return t, ""
    ticks = np.round(np.diff(t) / step)
    advance = np.diff(count)
    low, high = math.floor(period / step + 1e-9), math.ceil(period / step - 1e-9)
    if low == high or not ((ticks >= low * advance - 1) & (ticks <= high * advance + 1)).all():
        return t, ""
    inner = ticks[advance == 1]
    if inner.size < 4 or not ((inner == low) | (inner == high)).all():
        return t, ""
    uniform = t[0] + period * count
    wander = float(np.abs(uniform - t).max())
    return uniform, (
        f"Time was rounded to {step * 1e3:g} ms; rebuilt from the sample index with a period of {period * 1e3:.6g} ms"
        f" (the logged stamps wander up to {wander * 1e3:.2g} ms from it)."
    )


def _last_digit(t: Array, digits: int) -> Array:
    """What one in the last of so many significant digits is worth, in each time."""
    return 10.0 ** (np.floor(np.log10(np.maximum(np.abs(t), 1e-9)) + 1e-12) + 1 - digits)


def _digits(t: Array) -> int:
    """Significant digits that every time has, where they are few and coarse beside a period; 0 otherwise."""
    period = float(t[-1] - t[0]) / (t.size - 1)
    for digits in range(3, 7):
        last = _last_digit(t, digits)
        if last[-1] < _MATTERS * period:
            return 0
        if last[-1] > 1.5 * last[t.size // 4] and (np.abs(t / last - np.round(t / last)) < 1e-6).all():
            return digits
    return 0


def _one_period(t: Array, count: Array, last: Array) -> float:
    """Period for which no time is off by more than half its last digit; 0 where there is none."""
    most, since = 0.5 * (last[1:] + last[0]) * (1 + 1e-6), t[1:] - t[0]
    low, high = float(((since - most) / count[1:]).max()), float(((since + most) / count[1:]).min())
    return (low + high) / 2 if low <= high else 0.0


def rounding(t: Array) -> float:
    """Coarsest of 1 s, 0.1 s ... 1 us of which every time is a multiple; 0 when none is [s]."""
    return decimal_step(t, 6, 1e-9)


def decimal_step(values: Array, digits: int, tolerance: float) -> float:
    """Coarsest of 1, 0.1, ... 10^-digits of which every value is a multiple within `tolerance`; 0 when none is."""
    exact = 8 * np.finfo(np.float64).eps * float(np.abs(values).max())
    for step in (10.0**-n for n in range(digits + 1)):
        if exact > 2 * step:  # float64 has no more digits
            return 0.0
        if (np.abs(values - np.round(values / step) * step) <= max(exact, tolerance * step)).all():
            return step
    return 0.0


_MOST_LEVELS = 4000  # as many as the fit needs
_FITS = 0.08  # rms distance from the grid in steps; 0.289 when there is no grid


@dataclass(frozen=True, kw_only=True)
class Resolution:
    """Step of a column in its unit, 0 when there is none; `decimals` says that it is the rounding of the text.

    `counts_per_rev` are those of an encoder with that step, where it is one. `hidden` is what no step shows: the
    largest that the text's digits, or the noise, could hide, in the same unit.
    """

    step: float = 0.0
    decimals: bool = False
    counts_per_rev: int | None = None
    hidden: float = 0.0

    def __str__(self) -> str:
        if not self.step:
            return ""
        if self.counts_per_rev is not None:
            return f"2 pi/{self.counts_per_rev} = {self.step:.4g}"
        return f"{self.step:.4g}" + (" (decimals)" if self.decimals else "")


def resolution_of(values: Array) -> Resolution:
    """Step of a column (N,)."""
    rounding = decimal_step(values, 7, 1e-6)
    if rounding >= 1:  # counts
        return Resolution(step=_common_divisor(values, rounding))
    levels = _levels(values, rounding)
    step = _grid(levels, rounding) if levels.size > 2 else 0.0
    if step >= 1.5 * rounding and step > 0:
        return Resolution(step=step, counts_per_rev=counts_per_rev(step))
    common = _common_divisor(values, rounding) if rounding else 0.0
    if levels.size > 8 and common > 1.5 * rounding:  # too fine beside its text for a fit, yet exact
        return Resolution(step=common)
    # Steps no coarser than the text's own digits tell about the text, not about the sensor.
    few = rounding > 0 and 2 < np.unique(values).size < 0.5 * values.size
    return Resolution(step=rounding, decimals=True) if few else Resolution(hidden=_hidden(values, rounding))


def _hidden(values: Array, digit: float) -> float:
    """Step that rounded text or noise hides, or a millionth of the range: rounding to q errs by q/sqrt(12), rms."""
    noise = math.sqrt(12) * white_noise(values)
    return max(digit, noise if noise > 2 * digit else 0.0, 1e-6 * float(np.ptp(values)))


def _common_divisor(values: Array, digit: float) -> float:
    """Greatest step of which all differences are multiples, for multiples of a digit; 0 below 3 levels."""
    whole = np.round(np.unique(values) / digit).astype(np.int64)
    return float(np.gcd.reduce(whole - whole[0])) * digit if whole.size > 2 else 0.0


def counts_per_rev(step: float) -> int | None:
    """Counts of an encoder whose step is `step` rad, when that is a number encoders are made in."""
    count = 2 * math.pi / step
    nearest = round(count)
    made = 200 <= nearest <= 1 << 20 and (nearest % 100 == 0 or (nearest & (nearest - 1)) == 0)
    return nearest if made and abs(count - nearest) < 2e-4 * nearest else None


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
