"""Sines of about two periods with rests between them: too short to settle, yet what each starts dies away in its rest.

Over a time at whose ends a linear rig stands still, the Fourier sums of output and command stand in the ratio of its
response, whatever lies between (Pintelon and Schoukens 2012, section 2.6: the difference of the states at both ends is
all that leaks). An output that comes to rest elsewhere is summed on to infinity as the constant that it is then. What
still moves at either end, and what the command's and the outputs' noise adds, is the error that is stated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.identification.frequency.detection import PER_PERIOD, Tone, detect
from upright.signals.steps import smallest_step

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

PERIODS = (1.75, 4.5)
"""Periods of a sine that is measured so; of more, the last ones are measured by themselves."""
LIKE = 0.95
"""Share of a command's power that one sine explains at least, noise included."""
NEAR = 0.02
"""Share of a command's range within which noise about its rests is looked for."""
SURE = 5.0
"""Standard deviations of that noise within which a command rests."""
SHORTEST, SHARE = 12, 0.05
"""Samples of a rest at least, and, between two sines, its share of the longer: less is a sine that passes by."""
PARTS = 6
"""Parts of a rest whose sums say how fast a swing dies away."""
LINGERS = 0.98
"""Largest share of a swing that is taken to remain after one of them."""
ABOVE = np.array([1.0, 1.5, 2.0])
"""Frequencies at which noise is looked at, over that of a sine."""
UNSETTLED = 0.02
"""Share of a line that what still swings may be before the response says so."""


@dataclass(frozen=True, kw_only=True)
class RestedSine:
    """One sine between two rests of the command: its samples, its frequency [rad/s], and the rests."""

    first: int
    last: int
    omega: float
    period: float
    before: slice
    after: slice

    @property
    def samples(self) -> float:
        """Of a period."""
        return 2 * math.pi / self.omega / self.period


def rests(u: Array) -> list[slice]:
    """Where a command rests: on its median, which a sine only passes by."""
    off = np.abs(u - np.median(u))
    span = float(np.ptp(u))
    noise = 1.4826 * float(np.median(off[off <= NEAR * span])) if np.any(off <= NEAR * span) else 0.0
    still = np.concatenate([[False], off <= SURE * noise + 1e-9 * span, [False]])
    edges = np.flatnonzero(still[1:] != still[:-1]).reshape(-1, 2)
    edges = edges[np.diff(edges, axis=1)[:, 0] >= SHORTEST]
    edges = edges[np.array([_stays(u[a:b], noise) for a, b in edges.tolist()], dtype=bool)]
    if not edges.size:
        return []
    moves = np.diff(np.concatenate([[0], edges.ravel(), [u.size]]))[::2]
    beside = np.maximum(moves[:-1], moves[1:]) * (edges[:, 0] > 0) * (edges[:, 1] < u.size)
    return [slice(int(a), int(b)) for (a, b), m in zip(edges, beside, strict=True) if b - a >= SHARE * m]


def _stays(u: Array, noise: float) -> bool:
    """Whether a command stays where it is; a sine that passes goes from one bound of its noise to the other."""
    third = u.size // 3
    return abs(float(u[:third].mean() - u[-third:].mean())) <= SURE / 2 * noise + 1e-9 * float(np.ptp(u))


def rested_sines(t: Array, u: Array) -> list[RestedSine]:
    """Short sines of a command that lie between two rests."""
    out: list[RestedSine] = []
    tick = float(np.median(np.diff(t)))
    for before, after in pairwise(rests(u)):
        a, b = before.stop, after.start
        if b - a < PERIODS[0] * PER_PERIOD:
            continue
        omega, explained = _sine(t[a:b], u[a:b])
        if explained > LIKE:
            out.append(RestedSine(first=a, last=b, omega=omega, period=tick, before=before, after=after))
    return out


def _sine(t: Array, u: Array) -> tuple[float, float]:
    """Frequency [rad/s] of the sine that explains most of so few periods, and the share that it explains."""
    from scipy.optimize import minimize_scalar

    x, power = t - t.mean(), float(np.sum((u - u.mean()) ** 2))
    span = float(t[-1] - t[0]) * t.size / (t.size - 1)
    if not power > 0:
        return math.nan, 0.0

    def left(periods: float) -> float:
        w = 2 * math.pi * periods / span
        columns = np.column_stack([np.cos(w * x), np.sin(w * x), np.ones_like(x)])
        rest = u - columns @ np.linalg.lstsq(columns, u, rcond=None)[0]
        return float(rest @ rest) / power

    grid = np.linspace(*PERIODS, 56)
    best = int(np.argmin([left(float(p)) for p in grid]))
    if best in (0, grid.size - 1):
        return math.nan, 0.0
    top: Any = minimize_scalar(
        left, bounds=(grid[best - 1], grid[best + 1]), method="bounded", options={"xatol": 1e-10}
    )
    return 2 * math.pi * float(top.x) / span, 1 - float(top.fun)


def rested_answer(t: Array, y: Array, u: Array, sine: RestedSine, quanta: Array) -> tuple[Tone, Tone, bool]:
    """Answer to one sine, the sine, and whether its swing had not died away.

    By its own time, from its rest before to the end of that after, or by the whole log.

    The whole log is exact where rests are too short for the swing to die away, and adds the noise of a longer time.
    """
    quiet = rests(u)
    quanta = np.maximum(quanta, [smallest_step(column) for column in y.T])
    spans = [(sine.before, sine.after), (quiet[0], quiet[-1])]
    answers = [_ratio(t, y, u, sine, span, quiet, quanta) for span in spans]
    best = np.argmin([variance for _, variance, _ in answers], axis=0)
    pick = np.arange(y.shape[1])
    G, variance, left = (np.array(part)[best, pick] for part in zip(*answers, strict=True))
    part = slice(sine.first, sine.last)
    drive = detect(t[part], u[part], sine.omega)
    line = drive.lines[0, 0]
    # friction and overtones are those of a sine that goes on: so short a one does not show them
    steady = np.real(np.exp(1j * sine.omega * t[part])[:, None] * (G * line))
    answer = detect(t[part], steady, sine.omega)
    noise = _density(t, y, sine.omega, quiet) + quanta**2 / 12
    late = bool(np.any(left > np.maximum(UNSETTLED * np.abs(G), np.sqrt(variance) / 2)))
    return replace(answer, variance=variance * np.abs(line) ** 2, noise=noise), drive, late


def _ratio(
    t: Array, y: Array, u: Array, sine: RestedSine, span: tuple[slice, slice], quiet: Sequence[slice], quanta: Array
) -> tuple[Complex, Array, Array]:
    """Response from one rest to the end of another, its variance, and the part of its error by what still moves."""
    omega, (before, after) = sine.omega, span
    part = slice(before.stop, after.stop)
    count = part.stop - part.start
    turn = np.exp(-1j * omega * (t[part] - t[part.start]))
    further = np.exp(-1j * omega * sine.period)
    constant = further / (1 - further) * turn[-1]  # the sum of a constant from the next sample on to infinity
    rest = float(np.median(np.concatenate([u[q] for q in quiet])))
    level, last = _level(y, before), _level(y, after)
    U = turn @ (u[part] - rest)
    Y = turn @ (y[part] - level) + (last - level) * constant
    left = np.hypot(*(_left(t, y, omega, q, quanta) for q in span))
    unsure = np.hypot(*(_unsure(y, q) for q in span)) * abs(constant)
    # rounding repeats from period to period of a sine
    rounding = quanta**2 / 12 * (count + (sine.last - sine.first) ** 2 / sine.samples)
    noise, drive = (_density(t, x, omega, quiet) * count for x in (y, u[:, None]))
    G = Y / U
    variance = (noise + rounding + unsure**2 + left**2 + np.abs(G) ** 2 * drive) / abs(U) ** 2
    return G, variance, left / abs(U)


def _level(y: Array, rest: slice) -> Array:
    """Where the outputs stand at the end of a rest: their mean over its second half."""
    return y[(rest.start + rest.stop) // 2 : rest.stop].mean(axis=0)


def _unsure(y: Array, rest: slice) -> Array:
    """By how much that differs from one half of this half to the other."""
    quarter = (rest.stop - rest.start) // 4
    third, fourth = (y[rest.stop - k * quarter : rest.stop - (k - 1) * quarter].mean(axis=0) for k in (2, 1))
    return np.abs(third - fourth)


def _density(t: Array, y: Array, omega: float, quiet: Sequence[slice]) -> Array:
    """Power of noise about a frequency, as the variance of white noise that has as much there.

    Of the second halves of all rests, by their Fourier sums there and above, or from the lowest that they hold.
    """
    powers: list[Array] = []
    for rest in quiet:
        part = slice((rest.start + rest.stop) // 2, rest.stop)
        x = t[part] - t[part].mean()
        columns = np.column_stack([np.ones_like(x), x])
        z = y[part] - columns @ np.linalg.lstsq(columns, y[part], rcond=None)[0]
        lowest = max(omega, 4 * math.pi / float(x[-1] - x[0]))
        window = np.hanning(x.size)  # else a swing would leak into other frequencies
        powers += [np.abs((window * np.exp(-1j * w * x)) @ z) ** 2 / (window @ window) for w in lowest * ABOVE]
    return np.mean(powers, axis=0)


def _left(t: Array, y: Array, omega: float, rest: slice, quanta: Array) -> Array:
    """Size of the Fourier sum of what the outputs still do after a rest, by how their swing dies away within it.

    Sums over successive parts of a swing fall by a common factor. Noise, from third differences, is no swing, and
    neither is a reading that is half a step off.
    """
    length = (rest.stop - rest.start) // PARTS
    part = slice(rest.stop - PARTS * length, rest.stop)
    z = y[part] - _level(y, rest)
    noise = np.mean(np.diff(z, 3, axis=0) ** 2, axis=0) / 20
    turned = np.exp(-1j * omega * (t[part] - t[part.start]))[:, None] * z
    sums = np.abs(turned.reshape(PARTS, length, -1).sum(axis=1)) ** 2 - 3 * noise * length
    sums -= (quanta / 2 * min(length, 2 / omega / float(t[1] - t[0]))) ** 2
    early, late = (np.maximum(half.mean(axis=0), 0.0) for half in np.split(sums, 2))
    fall = np.clip(late / np.maximum(early, 1e-300), 1e-12, LINGERS**PARTS) ** (1 / PARTS)
    return np.sqrt(late) * fall**2 / (1 - fall)
