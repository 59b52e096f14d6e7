"""Columns of a log that are not what their name says.

Each test answers a sentence, or nothing. They come from logs of real rigs: a "Control Effort" that holds the
reference, a "Commanded Pos" that follows the encoder, a "velocity" that somebody differenced from the position.
"""

from __future__ import annotations

import numpy as np

from upright.records import Array, Record

DAC_COUNTS_PER_VOLT = 819.0  # ECP's MATLAB front end: 409 is 0.5 V, 491 is 0.6 V, 573 is 0.7 V
_MOST_SAMPLES = 20000
_SAME = 0.75  # share of the changes explained; a sensor of its own, beside a position in counts, reaches 0 or less
_ROUGH = 0.5  # neighbouring changes of a quotient must differ that much: steps of an encoder, not a smooth curve


def lies(record: Record, name: str) -> tuple[str, ...]:
    """Sentences about one column of a record."""
    x = record.signals[name]
    if np.ptp(x) == 0:
        return ()
    found = [
        sample_index(x),
        time_copy(record.t, x),
        *(copy_of(x, other, y) for other, y in record.signals.items() if other != name),
        dac_levels(name, x, record.units[name]),
        follows_encoder(record, name, x),
        first_outlier(x),
        *(difference_of(record.t, other, y, x) for other, y in record.signals.items() if other != name),
    ]
    return tuple(sentence for sentence in found if sentence)


def sample_index(x: Array) -> str:
    """Whether a column counts the rows."""
    return "the sample index, not a measurement" if x.size > 3 and (np.diff(x) == 1).all() else ""


def time_copy(t: Array, x: Array) -> str:
    """Whether a column is the time again, perhaps as received."""
    late = x - t
    period = float(np.median(np.diff(t)))
    spread = float(np.percentile(np.abs(late - np.median(late)), 99))
    if x.size > 3 and (np.diff(x) >= 0).all() and spread < 2 * period and np.ptp(x) > 0.5 * np.ptp(t):
        return f"a copy of the time, {float(np.median(late)) * 1e3:.3g} ms later"
    return ""


def copy_of(x: Array, other: str, y: Array) -> str:
    """Whether a column repeats another one up to scale."""
    if np.array_equal(x, y):
        return f"the same as '{other}'"
    u, v = x - x.mean(), y - y.mean()
    power = float(v @ v)
    if power == 0:
        return ""
    gain = float(u @ v) / power
    exact = float(np.abs(u - gain * v).max()) < 1e-9 * float(np.abs(u).max())
    return f"'{other}' times {gain:.6g}" if exact and np.unique(x[:2000]).size > 2 else ""


def dac_levels(name: str, x: Array, unit: str) -> str:
    """Whether a column called effort holds converter counts or the reference."""
    if unit == "V" or not any(word in name.casefold() for word in ("effort", "target")):
        return ""
    if not (x == np.round(x)).all():
        return ""
    levels = np.unique(x[x != 0])
    if not 0 < levels.size <= 4 or float(np.abs(levels).min()) < 50:
        return ""
    tenths = levels / DAC_COUNTS_PER_VOLT * 10
    volts = np.round(tenths) / 10
    if (np.abs(tenths - np.round(tenths)) < 0.02).all() and (np.abs(levels) > 80).all():
        shown = ", ".join(f"{level:g} = {volt:g} V" for level, volt in zip(levels, volts, strict=True))
        return f"the command in DAC counts ({DAC_COUNTS_PER_VOLT:g} per V: {shown})"
    shown = ", ".join(f"{level:g}" for level in levels)
    return f"the reference (levels 0 and {shown}), not the effort the controller put out"


def follows_encoder(record: Record, name: str, x: Array) -> str:
    """Whether a commanded position is the measured one read a moment later."""
    if "command" not in name.casefold():
        return ""
    for other, y in record.signals.items():
        if "encoder" in other.casefold() and np.ptp(y) > 0:
            gap = np.abs(np.diff(x - y))
            if np.ptp(x) > 0.5 * np.ptp(y) and _correlation(x, y) > 0.97 and np.unique(x).size > 10:
                return f"follows '{other}' (steps differ by {np.median(gap):g} at the median); no reference, open loop"
    return ""


def first_outlier(x: Array) -> str:
    """Whether only the first samples are far outside the rest."""
    rest = float(np.abs(x[3:]).max()) if x.size > 10 else np.inf
    top = float(np.abs(x[:3]).max())
    return f"the first samples are outliers ({top:g} against {rest:g} after)" if top > 5 * rest > 0 else ""


def difference_of(t: Array, other: str, p: Array, v: Array) -> str:
    """Whether a speed is the difference quotient of a position, or that through a first-order filter.

    A true rate would not repeat the steps of the encoder, so changes are compared, not values.
    """
    n = min(t.size, _MOST_SAMPLES)
    if n < 20 or np.ptp(p[:n]) == 0 or np.ptp(v[:n]) == 0:
        return ""
    quotient = np.diff(p[:n]) / np.diff(t[:n])
    change = np.diff(quotient)
    if _share(change[1:], change[:-1]) > -_ROUGH:
        return ""  # too smooth to tell a true rate from a quotient
    for shift, word in ((1, "backward"), (0, "forward")):
        taken = v[shift : shift + quotient.size]
        if _share(taken, quotient) > 0.95 and _share(np.diff(taken), change) > _SAME:
            return f"the {word} difference quotient of '{other}', not a sensor of its own"
    central = (quotient[1:] + quotient[:-1]) / 2
    if _share(v[1 : n - 1], central) > 0.95 and _share(np.diff(v[1 : n - 1]), np.diff(central)) > _SAME:
        return f"the central difference quotient of '{other}', not a sensor of its own"
    # v[k] - v[k-1] = b (D[k] - v[k-1]), 0 < b < 1
    step, pull = np.diff(v[:n]), quotient - v[: n - 1]
    power = float(pull @ pull)
    b = float(step @ pull) / power if power > 0 else 0.0
    if 0.01 < b < 0.98 and _share(step, b * pull) > _SAME:
        return f"the difference quotient of '{other}' through a first-order filter (weight {b:.2g})"
    return ""


def _correlation(x: Array, y: Array) -> float:
    u, v = x - x.mean(), y - y.mean()
    size = float(np.linalg.norm(u)) * float(np.linalg.norm(v))
    return float(u @ v) / size if size > 0 else 0.0


def _share(x: Array, y: Array) -> float:
    """Share of the power of x that y explains without any scale of its own."""
    power = float(x @ x)
    return 1 - float((x - y) @ (x - y)) / power if power > 0 else 0.0
