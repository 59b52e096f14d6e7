"""Times of the samples where a log rounds them or counts them from an epoch.

A clock that is rounded to 1 ms shows steps of 1 and 2 ms where every sample was 1.1275 ms after the last.
Such a time base is rebuilt from the sample index; a true jitter is left as it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal, InvalidOperation

import numpy as np

from upright.readers.source import Source
from upright.records import Array

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


def exact_seconds(
    source: Source, cells: Sequence[str], lines: Sequence[int], *, name: str, column: int
) -> tuple[Array, int]:
    """Seconds (N,) since the first cell, subtracted as whole nanoseconds, and that first cell in nanoseconds.

    An epoch stamp such as 1707681595.547459602 has 19 digits; a float64 keeps 16.
    """
    nanoseconds: list[int] = []
    for text, line in zip(cells, lines, strict=True):
        try:
            value = Decimal(text.strip())
        except InvalidOperation:
            value = Decimal("nan")
        if not (value.is_finite() and abs(value) < 10**15):
            raise source.bad(
                f"expected a time stamp in s, got {text.strip()[:40]!r}; mend or delete the row",
                line=line,
                column=column,
                name=name,
            )
        nanoseconds.append(int(value.scaleb(9)))
    first = nanoseconds[0]
    return np.array([value - first for value in nanoseconds], dtype=np.float64) * 1e-9, first


def rebuild(t: Array, index: Array | None = None) -> tuple[Array, str]:
    """Uniform times (N,) [s] where `t` is a rounded uniform clock, and the sentence that says so.

    Period = (t_last - t_first) / (i_last - i_first), with the sample index i of the log or a plain count. Without
    evidence of rounding, `t` comes back as it was with an empty sentence.

    The evidence: all times are multiples of 1, 0.1 or 0.01 ms (or 1 s, 0.1 s, 10 ms), the steps take two
    neighbouring multiples only, and the rounding is coarse beside the period.
    """
    n = t.size
    if n < 8 or not (np.diff(t) > 0).all():
        return t, ""
    count = np.arange(n, dtype=np.float64) if index is None else index - index[0]
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
