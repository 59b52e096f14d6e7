"""Stepped sines in one signal that is put out blindly: each point of the response is there as soon as its sine is over.

A rig that runs cannot wait for what it has shown, as `sweeps` does, so that every sine grows and dies away slowly:
about a lightly damped mode over some beats with it, else the free swing that it starts would be measured with it. What
is left of that shows in the scatter from period to period, and a point that had not settled is known by it.

Within a tenth of a mode beats do not help: there a sine waits until the free swing has decayed, where the model says
that it does in time. Smaller amplitudes do not help either, since the free swing shrinks with them and dry friction
weighs more: a driven body below a lightly damped pendulum stands still at what such a sine may move.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.experiments.frequency_1b.at_once import band_and_reach
from upright.experiments.frequency_1b.sweeps import grid
from upright.experiments.stand.stand import TestStand
from upright.experiments.stand.strength import SHARE, STILL, swinging
from upright.identification.frequency.detection import Tone, detect
from upright.identification.frequency.response import FrequencyResponse
from upright.identification.frequency.stepped import from_tones
from upright.records import Array
from upright.rig import Rig

Complex = NDArray[np.complex128]

COUNT = 10
"""Frequencies."""
PERIODS, LEAST = 5, 1.0
"""Whole periods that are measured of a sine, and time at least [s]."""
RISE, SLOWEST, BEATS = 3, (3.0, 6.0), 1.5
"""Periods in which a sine grows, and dies away, at least and at most [s]; beats with the nearest mode between these."""
SETTLED = 0.05
"""Standard error of each reading's line from period to period, beside it, up to which a sine counts as settled."""
CLEAR = 0.1
"""Logarithm of the ratio of a frequency to a mode, below which a sine cannot rely on beats with it."""
BESIDE = (0.95, 1.0, 1.05)
"""Frequencies beside that of a mode at which sines wait until they have settled."""
LEFT, LONGEST = 0.01, 10.0
"""Share of free swing in such a sine that may be left when it is measured, and longest time to wait for that [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SteppedSines:
    """Sines one after the other.

    Attributes
    ----------
    omega : (F,) array
        [rad/s]
    lengths : (F,) array of int
        Samples in a period of each.
    windows : tuple of (int, int)
        Samples of each that are measured: the first, and that after the last.
    samples : (N,) array
        Of the command [command unit], one each `period` [s].
    gaps : tuple of (float, float)
        Modes within the band near which there is no sine [rad/s], and how long one would take to settle [s].
    """

    omega: Array
    lengths: NDArray[np.int64]
    windows: tuple[tuple[int, int], ...]
    samples: Array
    period: float
    gaps: tuple[tuple[float, float], ...] = ()

    @property
    def seconds(self) -> float:
        """Time of all."""
        return self.samples.size * self.period


@dataclass(frozen=True, kw_only=True, eq=False)
class Sine:
    """One frequency: what the readings and the command had there, and whether it had settled."""

    tone: Tone
    command: Tone
    settled: bool


def stepped_sines(stand: TestStand, count: int = COUNT) -> SteppedSines:
    """Of a rig as its owner describes it, each as strong as reach, travel and drive allow by the guesses.

    Raises
    ------
    BadInput
        When it does not swing where it rests, or would fall there.
    """
    rig, linear = stand.rig, stand.rig.linear(stand.resting)
    if max(p.real for p in linear.poles()) > 0.1:
        raise BadInput(f"{rig.name} falls where its encoders are zeroed; a sweep needs a rig that hangs or stands.")
    band, reach = band_and_reach(stand)
    waits = {abs(p): settling(p) for p in swinging(linear.poles().tolist()) if p.imag > 0}
    lengths = _lengths(band, count, rig.period, waits)
    omega: Array = 2 * math.pi / (lengths * rig.period).astype(np.float64)
    near = [_near(w, waits) for w in omega.tolist()]
    moved = np.abs(linear.response(omega)[:, :, 0])
    # a mode is known to some percent, and its sines move a rig whose own mode lies there no further
    peaks = np.max([np.abs(linear.response(omega * share)[:, :, 0]) for share in BESIDE], axis=0)
    moved = np.where(np.array([bool(modes) for modes in near])[:, None], peaks, moved)
    if stand.make is not None:
        reach = np.minimum(reach, np.array(stand.make.fastest) / omega[:, None])
    level = np.minimum(SHARE * rig.limit, np.min(reach / moved, axis=1))
    parts, windows = [np.zeros(math.ceil(STILL / rig.period))], list[tuple[int, int]]()
    for w, length, most, modes in zip(omega.tolist(), lengths.tolist(), level.tolist(), near, strict=True):
        cycle, wait = length * rig.period, max((waits[mode] for mode in modes), default=0.0)
        beat = 2 * math.pi / min((abs(mode - w) for mode in waits), default=math.inf)
        wanted = SLOWEST[0] if modes else min(max(BEATS * beat, SLOWEST[0]), SLOWEST[1])
        ramp, hold = math.ceil(max(RISE, wanted / cycle)) * length, math.ceil(wait / cycle) * length
        whole = max(PERIODS, math.ceil(LEAST / cycle)) * length
        k = np.arange(2 * ramp + hold + whole)
        size = (1 - np.cos(math.pi * np.clip(np.minimum(k, k[::-1] + 1) / ramp, 0.0, 1.0))) / 2
        first = sum(part.size for part in parts) + ramp + hold
        windows.append((first, first + whole))
        rest = np.zeros(math.ceil(max(0.0, wait - SLOWEST[0]) / rig.period))  # the next sine's growth is a rest, too
        parts += [most * size * np.sin(2 * math.pi * k / length), rest]
    samples = np.concatenate([*parts, np.zeros(math.ceil(STILL / rig.period))])
    gaps = tuple((m, wait) for m, wait in waits.items() if band[0] <= m <= band[1] and wait > LONGEST)
    return SteppedSines(
        omega=omega, lengths=lengths, windows=tuple(windows), samples=samples, period=rig.period, gaps=gaps
    )


def settling(mode: complex) -> float:
    """How long a sine at a mode goes on, once it has grown, until `LEFT` of it is free swing [s].

    The amplitude a that a command of envelope e keeps up there obeys a' = s (e - a), with the decay s of the free
    swing; when e = (1 - cos(pi t / T)) / 2 has grown, (1 + exp(-s T)) / 2 / (1 + (s T / pi)^2) of it is still missing.
    """
    s = -mode.real
    if s <= 0:
        return math.inf
    missing = (1 + math.exp(-s * SLOWEST[0])) / 2 / (1 + (s * SLOWEST[0] / math.pi) ** 2)
    return max(0.0, math.log(missing / LEFT) / s)


def _near(omega: float, modes: Iterable[float]) -> list[float]:
    return [mode for mode in modes if abs(math.log(omega / mode)) <= CLEAR]


def _lengths(
    band: tuple[float, float], count: int, period: float, waits: Mapping[float, float]
) -> NDArray[np.int64]:  # fmt: skip
    """Samples in a period of each sine: of a grid clear of the modes, and beside those where one settles in time."""
    clear = [n for n in grid(*band, count, period).tolist() if not _near(2 * math.pi / (n * period), waits)]
    modes = [mode for mode in waits if band[0] <= mode <= band[1]]
    beside = [round(2 * math.pi / (mode * share * period)) for mode in modes for share in BESIDE]
    beside = [n for n in beside if max(waits[m] for m in _near(2 * math.pi / (n * period), waits)) <= LONGEST]
    return np.unique([*clear, *beside])[::-1]


def sine(plan: SteppedSines, k: int, rig: Rig, y: Array, u: Array) -> Sine:
    """What was measured of one of them.

    Parameters
    ----------
    k : int
        Which one.
    y, u : (W, n) and (W,) arrays
        Readings [rad or m] and command over its window.
    """
    omega, t = float(plan.omega[k]), np.arange(u.size, dtype=np.float64) * plan.period
    tone = detect(t, y, omega, resolution=np.abs(rig.resolution))
    scatter = np.sqrt(tone.variance) / np.maximum(np.abs(tone.lines[0]), 1e-300)
    return Sine(
        tone=tone, command=detect(t, u, omega, resolution=rig.converter), settled=bool(np.all(scatter <= SETTLED))
    )


def response_of_sines(sines: list[Sine], rig: Rig) -> FrequencyResponse:
    """Response of those that were measured so far."""
    late = [f"{s.tone.omega:.3g}" for s in sines if not s.settled]
    return from_tones(
        [s.tone for s in sines], [s.command for s in sines], outputs=[c.name for c in rig.plant.coordinates],
        units=(*(c.unit for c in rig.plant.coordinates), rig.unit), hold=rig.period,
        notes=(f"Not settled at {', '.join(late)} rad/s.",) if late else (),
    )  # fmt: skip


def modelled(rig: Rig, at: str, omega: Array) -> Complex:
    """Response (F, n) of a rig as it is known, dry friction aside: with the drive's lag, its delay and its hold."""
    s = 1j * omega[:, None]
    late = np.exp(-s * (rig.delay + rig.period / 2)) * np.sinc(omega[:, None] * rig.period / (2 * math.pi))
    return rig.linear(at).response(omega)[:, :, 0] * late / (1 + s * rig.lag)
