"""Time base and columns of a log, before any model: are its times true, what is each?

Some columns are not what their name says. Each test of that answers a sentence, or nothing. They come from logs of
real rigs: a "Control Effort" that holds the reference, a "Commanded Pos" that follows the encoder, a "velocity" that
somebody differenced from the position.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace

import numpy as np

from upright import units
from upright.errors import BadInput, nearest
from upright.readers.resolution import Resolution, counts_per_rev, resolution_of, rounding
from upright.readers.wrapped import counts_per_turn
from upright.records import Array, Record
from upright.renamed import former
from upright.signals.stretches import stretches

_SHOWN = 12  # switches, gaps and rests beyond these tell nothing new
# What names have in common, in the logs of many laboratories.
_ANGLE = re.compile(r"theta|phi|psi|alpha|beta|angle|arm|joint.*position|pend|(?<![a-z])pole(?![a-z])", re.IGNORECASE)
_RATE = re.compile(r"velocity|speed|rate|_dot|omega|qd", re.IGNORECASE)
_COUNTS = re.compile(r"enc|count|cart\d*pos|\bpos\b", re.IGNORECASE)
_LENGTH = re.compile(r"^(z|x|pos(ition)?|distance|displacement|cart|carriage)\d*$", re.IGNORECASE)
# cart_position, trolley.x, and the joint slider_to_cart of a robot's description
_SLIDES = re.compile(
    r"(?:^|[^a-z0-9])(?:cart|carriage|trolley|slider)[^a-z0-9]*(?:x|pos(?:ition)?|displacement)?$", re.IGNORECASE
)
_FARTHEST = 10.0
"""What is called a cart and goes farther than this is not in metres."""
_PLACE = re.compile(r"(?P<stem>.+)_(?P<unit>rad|deg|m|cm|mm)", re.IGNORECASE)
_LASTS = re.compile(r".+_(?P<unit>us|ms|ns)|(?P<bare>dt|latency|jitter)", re.IGNORECASE)
_SUPPLY = re.compile(r"batt|supply|v_?(cc|dd|bus|bat|in)\b", re.IGNORECASE)
_VOLTS = re.compile(r"volt|plant_input|control_output|feedforward|^(u|v)$", re.IGNORECASE)
_EFFORT = re.compile(
    r"(?i:u|v|i|f|t|tau|motor|force|moment)_?(?i:\d|m|motor)?(?:\s*[\[(]\s*([^\[\]()]+?)\s*[\])]|_(m?[VA]|Nm?))\s*"
)
LOADS = ("N", "N m")
EFFORTS = ("V", "A", *LOADS)
_DRIVE = re.compile(
    r"^([uv]_?m?|i)$|effort|control|command|cmd|input|volt|current|torque|target|duty|feedforward|pwm|ref",
    re.IGNORECASE,
)


@dataclass(frozen=True, kw_only=True)
class Gap:
    """Samples missing after `start` [s], over `length` [s]."""

    start: float
    length: float
    missing: int


@dataclass(frozen=True, kw_only=True)
class TimeBase:
    """Sampling of a record.

    `period`: mean without gaps [s]; `rounding`: of the logged stamps, 0 when finer than 1 us [s];
    `jitter`: 99th percentile of |step - period| [s]; `late`: first time when it is not 0 [s];
    `rebuilt`: the reader replaced rounded stamps by a uniform grid.
    """

    samples: int
    period: float
    duration: float
    late: float
    rounding: float
    jitter: float
    gaps: tuple[Gap, ...]
    rebuilt: bool


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column, in the unit of the log.

    `unit` is stated by the log, `guess` ours when it is not; `low_share` and `high_share`: share of the samples
    pinned at the lowest and highest value (0 unless they stay there); `turns`: whole revolutions in the offset;
    `switches`: (time [s], new value) of a drive, at every step when it is `stepwise`, else where it leaves 0 and
    returns; `idle`: a drive that never leaves 0; `remarks`: what it is besides a measurement (derived, mislabelled);
    `counts_per_turn`: after which an absolute sensor began again, 0 where none did.
    """

    name: str
    unit: str
    guess: str
    low: float
    high: float
    resolution: Resolution
    constant: bool
    low_share: float
    high_share: float
    turns: int
    drive: bool
    idle: bool
    switches: tuple[tuple[float, float], ...]
    stepwise: bool
    remarks: tuple[str, ...]
    counts_per_turn: int = 0
    lies = former("remarks")


@dataclass(frozen=True, kw_only=True)
class Inspection:
    """Time base, columns in the order of the log, and spans (start, stop) [s] in which nothing moves."""

    file: str
    reader: str
    time: TimeBase
    columns: tuple[Column, ...]
    rests: tuple[tuple[float, float], ...]
    notes: tuple[str, ...]

    def column(self, name: str) -> Column:
        """One column by name."""
        for column in self.columns:
            if column.name == name:
                return column
        raise BadInput(f"The log has no column '{name}': {nearest(name, [c.name for c in self.columns])}")


def inspect_record(record: Record) -> Inspection:
    """Inspection of a record."""
    columns = tuple(inspect_column(record, name) for name in record.names)
    moving = [
        record[c.name]
        for c in columns
        if not (c.drive or c.constant or any("time" in s or "index" in s for s in c.remarks))
    ]
    return Inspection(
        file=record.provenance.file or "",
        reader=record.provenance.reader or "",
        time=time_base(record),
        columns=columns,
        rests=_rests(record.t, moving),
        notes=record.provenance.notes,
    )


def time_base(record: Record) -> TimeBase:
    """Sampling of a record; a gap is a step of more than 1.9 medians."""
    t = record.t
    steps = np.diff(t)
    middle = float(np.median(steps))
    wide = np.flatnonzero(steps > 1.9 * middle)
    regular = steps[steps <= 1.9 * middle]
    period = float(regular.mean()) if wide.size else float(t[-1] - t[0]) / steps.size
    gaps = tuple(
        Gap(start=float(t[i]), length=float(steps[i]), missing=max(round(float(steps[i]) / period) - 1, 1))
        for i in wide.tolist()
    )
    logged = re.search(r"Time was rounded to ([\d.e-]+) ms; rebuilt", " ".join(record.provenance.notes))
    jitter = float(np.percentile(np.abs(regular - period), 99))
    return TimeBase(
        samples=t.size,
        period=period,
        duration=float(t[-1] - t[0]),
        late=float(t[0]),
        rounding=float(logged[1]) * 1e-3 if logged else rounding(t),
        jitter=jitter if jitter > 1e-9 * max(float(np.abs(t).max()), 1.0) else 0.0,
        gaps=gaps,
        rebuilt=logged is not None,
    )


def inspect_column(record: Record, name: str) -> Column:
    """Inspection of one column."""
    x = record.signals[name]
    low, high = float(x.min()), float(x.max())
    step = resolution_of(x)
    unit = record.units[name]
    guess = unit or ("1" if sample_index(x) else effort_unit(name) or _guess_unit(name, x, step))
    constant = low == high
    drive = _is_drive(name, x, guess)
    turn = {"rad": 1.0, "deg": math.pi / 180}.get(guess, 0.0)
    exact = turn and step.step and not step.decimals
    step = replace(step, counts_per_rev=counts_per_rev(turn * step.step) if exact else None)
    return Column(
        name=name,
        unit=unit,
        guess=guess,
        low=low,
        high=high,
        resolution=step,
        constant=constant,
        low_share=0.0 if constant else _pinned(x, low, step.step),
        high_share=0.0 if constant else _pinned(x, high, step.step),
        turns=min((round(float(end) / (2 * math.pi)) for end in (x[0], x[-1])), key=abs) if guess == "rad" else 0,
        drive=drive,
        idle=drive and constant and low == 0,
        switches=_switches(record.t, x) if drive and not constant else (),
        stepwise=0 < int(np.count_nonzero(np.diff(x))) <= _SHOWN,
        remarks=remarks(record, name),
        counts_per_turn=counts_per_turn(name, record.provenance.notes),
    )


def _guess_unit(name: str, values: Array, step: Resolution) -> str:
    """Unit from name and step; empty when neither tells."""
    whole = bool((values == np.round(values)).all()) and np.ptp(values) > 0
    if lasts := _LASTS.fullmatch(name):
        return (lasts["unit"] or "s").lower()
    if _RATE.search(name):
        return "" if whole else "rad/s" if _ANGLE.search(name) or "joint" in name else ""
    if (unit := _place_unit(name)) and not step.counts_per_rev:
        return unit
    if whole and (np.ptp(values) >= 20 or _COUNTS.search(name)):
        return "counts"
    if _SLIDES.search(name):
        return "m" if float(np.abs(values).max()) < _FARTHEST else ""
    if step.counts_per_rev:
        return "rad"
    if _ANGLE.search(name) and float(np.abs(values).max()) < 2000 and "effort" not in name:
        return "rad"
    if _VOLTS.search(name):
        return "V"
    return "m" if _LENGTH.search(name) else ""


def _place_unit(name: str) -> str:
    """Unit behind a place's name, ``tilt_deg`` or ``cart_cm``; a metre only of a length: ``theta_m`` is a motor's."""
    match = _PLACE.fullmatch(name)
    if match is None:
        return ""
    unit = match["unit"].lower()
    return unit if unit != "m" or _LENGTH.search(match["stem"]) else ""


def effort_unit(name: str) -> str:
    """Unit of a column called like an effort with the unit of one, ``u [V]`` or ``tau_Nm``; empty for another."""
    match = _EFFORT.fullmatch(name)
    unit = (match[1] or match[2]).replace("Nm", "N m") if match else ""
    known = unit and units.known(unit)
    return unit if known and any(units.same_dimension(unit, effort) for effort in EFFORTS) else ""


def is_supply(name: str) -> bool:
    """Whether a column is called like the voltage of a battery or a power supply."""
    return _SUPPLY.search(name) is not None


def _is_drive(name: str, values: Array, unit: str) -> bool:
    """Whether a column drives rather than is measured: by name, or because it moves in a few steps only."""
    if is_supply(name):
        return False
    if _DRIVE.search(name) or effort_unit(name):
        return True
    if unit not in ("", "1") and any(units.same_dimension(unit, load) for load in LOADS):
        return bool(np.ptp(values) > 0)  # no rig here measures one that it does not apply
    changes = int(np.count_nonzero(np.diff(values)))
    if unit not in ("", "1") and any(units.same_dimension(unit, effort) for effort in EFFORTS):
        return 0 < changes <= 0.1 * values.size  # a potentiometer's volts change with every sample
    levels = np.unique(values).size
    return unit not in ("rad", "m", "counts") and 2 <= levels <= 5 and 0 < changes <= 0.1 * values.size


ROUND_TOP = 3.0
"""Times as long that a smooth signal stays on its last step as on the one before, at most: 1/(sqrt(2) - 1) on top of a
parabola, and somewhat more where few samples tell."""


def _pinned(x: Array, level: float, step: float) -> float:
    """Share of samples at an extreme that a signal with many levels is cut off at, for 3 samples or more."""
    if np.unique(x[:: max(x.size // 5000, 1)]).size < 12:
        return 0.0
    at = np.abs(x - level) <= 0.25 * step
    longest = max(last - first for first, last in stretches(at))
    before = level + math.copysign(step, float(np.median(x)) - level)
    smooth = step > 0 and np.count_nonzero(at) < ROUND_TOP * np.count_nonzero(np.abs(x - before) <= 0.25 * step)
    return float(at.mean()) if longest >= 2 and not smooth else 0.0


def _switches(t: Array, x: Array) -> tuple[tuple[float, float], ...]:
    """Times and new values where a piecewise constant signal changes; for others when it leaves 0 and returns."""
    changes = np.flatnonzero(np.diff(x)) + 1
    if changes.size <= _SHOWN:
        return tuple((float(t[i]), float(x[i])) for i in changes.tolist())
    live = np.flatnonzero(x != 0)
    first, last = int(live[0]), int(live[-1])
    out = [(float(t[first]), float(x[first]))] if first > 0 else []
    return tuple(out + ([(float(t[last + 1]), 0.0)] if last + 1 < t.size else []))


def _rests(t: Array, signals: list[Array]) -> tuple[tuple[float, float], ...]:
    """Spans of at least 0.5 s and 1 % of the record in which no signal moves by more than 1 % of its range."""
    width = max(int(0.25 / float(np.median(np.diff(t)))), 2)
    starts = np.arange(0, t.size - width + 1, width)
    if not signals or starts.size < 2:
        return ()
    still = np.ones(starts.size, dtype=bool)
    for x in signals:
        swing = np.maximum.reduceat(x, starts) - np.minimum.reduceat(x, starts)
        still &= swing <= 0.01 * np.ptp(x)
    least = max(0.5, 0.01 * float(t[-1] - t[0]))
    ends = np.append(starts, t.size)[1:] - 1
    spans = [(float(t[starts[a]]), float(t[ends[b]])) for a, b in stretches(still)]
    return tuple(span for span in spans if span[1] - span[0] >= least)[:_SHOWN]


DAC_COUNTS_PER_VOLT = 819.0  # ECP's MATLAB front end: 409 is 0.5 V, 491 is 0.6 V, 573 is 0.7 V
_MOST_SAMPLES = 20000
_SAME = 0.75  # share of the changes explained; a sensor of its own, beside a position in counts, reaches 0 or less
_ROUGH = 0.5  # neighbouring changes of a quotient must differ that much: steps of an encoder, not a smooth curve


def remarks(record: Record, name: str) -> tuple[str, ...]:
    """Sentences about one column of a record."""
    x = record.signals[name]
    if np.ptp(x) == 0:
        return ()
    sentences = [
        sample_index(x),
        time_copy(record.t, x),
        *(copy_of(x, other, y) for other, y in record.signals.items() if other != name),
        dac_levels(name, x, record.units[name]),
        follows_encoder(record, name, x),
        first_outlier(x),
        *(difference_of(record.t, other, y, x) for other, y in record.signals.items() if other != name),
    ]
    return tuple(sentence for sentence in sentences if sentence)


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
        shifted = v[shift : shift + quotient.size]
        if _share(shifted, quotient) > 0.95 and _share(np.diff(shifted), change) > _SAME:
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
