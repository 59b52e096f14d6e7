"""Sines of about two periods with rests between them: too short to settle, yet what each starts dies away in its rest.

Over a time at whose ends a linear rig stands still, the Fourier sums of output and command stand in the ratio of its
response, whatever lies between (Pintelon and Schoukens 2012, section 2.6: the difference of the states at both ends is
all that leaks). What still moves at the end of a rest is continued as it swung and decayed within the rests
(`free_motion`): the sum goes on with it after the last, and what came from before the first is taken away. How unsure
that is, and what the noise of outputs and command adds, is the error that is stated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.identification.frequency.detection import PER_PERIOD, Tone, detect
from upright.identification.frequency.free_motion import FreeMotion, free_motion, motionless
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
FLOOR = 1e-6
"""Share of a response that is never sure: frequency and rates are sought to about that."""
UNSETTLED = 0.02
"""Share of a line that what is continued after a rest may be before the response says so."""


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

    @property
    def periods(self) -> float:
        """That it lasts."""
        return (self.last - self.first) / self.samples


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


@dataclass(frozen=True, kw_only=True)
class RestedLog:
    """A log whose command rests now and then.

    Attributes
    ----------
    t, u : (N,) arrays
        Time [s] and command.
    y : (N, m) array
        Outputs.
    quiet : tuple of slice
        Rests of the command.
    quanta : (m,) array
        Resolution of the outputs.
    motions : tuple of FreeMotion
        How each output moves in these rests.
    """

    t: Array
    y: Array
    u: Array
    quiet: tuple[slice, ...]
    quanta: Array
    motions: tuple[FreeMotion, ...]

    @classmethod
    def of(cls, t: Array, y: Array, u: Array, quanta: Array) -> RestedLog:
        """The log as its rests show it."""
        quiet, tick = rests(u), float(np.median(np.diff(t)))
        return cls(
            t=t, y=y, u=u, quiet=tuple(quiet), motions=tuple(free_motion(column, quiet, tick) for column in y.T),
            quanta=np.maximum(quanta, [smallest_step(column) for column in y.T]),
        )  # fmt: skip

    @cached_property
    def command(self) -> FreeMotion:
        """The command in its rests: a constant, and noise."""
        return motionless(self.u, self.quiet, self.motions[0].period)

    @cached_property
    def level(self) -> float:
        """Where the command rests."""
        return float(np.median(np.concatenate([self.u[q] for q in self.quiet])))


def rested_answer(log: RestedLog, sine: RestedSine) -> tuple[Tone, Tone, bool]:
    """Answer to one sine, the sine, and whether its swing had not died away.

    By its own time, from its rest before to the end of that after, or by the whole log.

    The whole log needs less of the free motion where rests are too short for it to die away, and adds the noise of a
    longer time.
    """
    spans = [(log.quiet.index(sine.before), log.quiet.index(sine.after)), (0, len(log.quiet) - 1)]
    answers = [_ratio(log, sine, *span) for span in spans]
    best = np.argmin([variance for _, variance, _ in answers], axis=0)
    pick = np.arange(log.y.shape[1])
    G, variance, left = (np.array(part)[best, pick] for part in zip(*answers, strict=True))
    part = slice(sine.first, sine.last)
    drive = detect(log.t[part], log.u[part], sine.omega)
    line = drive.lines[0, 0]
    # friction and overtones are those of a sine that goes on: so short a one does not show them
    steady = np.real(np.exp(1j * sine.omega * log.t[part])[:, None] * (G * line))
    answer = detect(log.t[part], steady, sine.omega)
    noise = np.array([motion.density(sine.omega) for motion in log.motions]) + log.quanta**2 / 12
    late = bool(np.any(left > np.maximum(UNSETTLED * np.abs(G), SURE * np.sqrt(variance))))
    return replace(answer, variance=variance * np.abs(line) ** 2, noise=noise), drive, late


def _ratio(log: RestedLog, sine: RestedSine, before: int, after: int) -> tuple[Complex, Array, Array]:
    """Response from one rest to the end of another, its variance, and how much of it is continued after the ends."""
    omega, part = sine.omega, slice(log.quiet[before].stop, log.quiet[after].stop)
    count = part.stop - part.start
    turn = np.exp(-1j * omega * sine.period * np.arange(count + 1))
    turn, end = turn[:-1], complex(turn[-1])
    U = turn @ (log.u[part] - log.level)
    drive = log.command.density(omega) * count
    G = np.empty(len(log.motions), dtype=np.complex128)
    variance, left = np.empty(G.size), np.empty(G.size)
    for k, motion in enumerate(log.motions):
        ends = ((before, -1.0 + 0.0j), (after, end))
        first, last = (factor * motion.onward(rest, omega) for rest, factor in ends)
        swings = [motion.onward(rest, omega, swings=True) @ motion.y[rest] for rest, _ in ends]
        G[k] = (turn @ log.y[part, k] + first @ motion.y[before] + last @ motion.y[after]) / U
        through, weights = motion.by_rates(omega, ends), np.zeros(log.t.size, dtype=np.complex128)
        for rest, own in zip(motion.parts, through, strict=True):
            weights[rest] = own
        far = float(np.sum(np.abs(weights) ** 2))
        weights[part] += turn
        weights[motion.parts[before]] += first
        weights[motion.parts[after]] += last
        near = max(0.0, float(np.sum(np.abs(weights) ** 2)) - far)
        noise = motion.widening * (motion.density(omega) * near + motion.density(motion.fastest) * far)
        noise += log.quanta[k] ** 2 / 12 * _rounded(log.y[:, k], sine, part, turn, end)
        variance[k] = (noise + abs(G[k]) ** 2 * drive) / abs(U) ** 2 + (FLOOR * abs(G[k])) ** 2
        left[k] = np.abs(swings).max() / abs(U)
    return G, variance, left


def _rounded(y: Array, sine: RestedSine, part: slice, turn: Complex, end: complex) -> float:
    """Factor on the variance of one reading's rounding that a sum over a part has.

    Rounding repeats from period to period of a sine. A reading that stands still is off by the same all the time, and
    by as much in both rests where it is the same in both.
    """
    count = part.stop - part.start
    periodic = (sine.last - sine.first) ** 2 / sine.samples
    ends = y[part.start - SHORTEST // 2 : part.start], y[part.stop - SHORTEST // 2 : part.stop]
    stuck = [float(np.ptp(z)) == 0 for z in ends]
    if all(stuck) and ends[0][0] == ends[1][0]:
        return count + periodic + abs((1 - end) / (1 - turn[1])) ** 2
    return count + periodic + sum(stuck) / abs(1 - turn[1]) ** 2
