"""Stepped sines in one signal that is put out blindly: each point of the response is there as soon as its sine is over.

A rig that runs cannot wait for what it has shown, as `sweeps` does, so that every sine grows and dies away slowly:
about a lightly damped mode over some beats with it, else the free swing that it starts would be measured with it. What
is left of that shows in the scatter from period to period, and a point that had not settled is known by it.
"""

from __future__ import annotations

import math
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
from upright.identification.frequency.spectra import from_tones
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
"""Logarithm of the ratio of a frequency to a lightly damped mode, below which it is left out: it would not settle."""


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
    """

    omega: Array
    lengths: NDArray[np.int64]
    windows: tuple[tuple[int, int], ...]
    samples: Array
    period: float

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
    lengths = grid(*band, count, rig.period)
    omega: Array = 2 * math.pi / (lengths * rig.period).astype(np.float64)
    modes = np.abs(swinging(linear.poles().tolist()))
    clear = np.all(np.abs(np.log(omega[:, None] / modes)) > CLEAR, axis=1)
    lengths, omega = lengths[clear], omega[clear]
    moved = np.abs(linear.response(omega)[:, :, 0])
    if stand.make is not None:
        reach = np.minimum(reach, np.array(stand.make.fastest) / omega[:, None])
    level = np.minimum(SHARE * rig.limit, np.min(reach / moved, axis=1))
    parts, windows = [np.zeros(math.ceil(STILL / rig.period))], list[tuple[int, int]]()
    for w, length, most in zip(omega.tolist(), lengths.tolist(), level.tolist(), strict=True):
        beat = 2 * math.pi / float(np.min(np.abs(modes - w), initial=math.inf))
        wanted = min(max(BEATS * beat, SLOWEST[0]), SLOWEST[1])
        ramp = math.ceil(max(RISE, wanted / (length * rig.period))) * length
        whole = max(PERIODS, math.ceil(LEAST / (length * rig.period))) * length
        k = np.arange(2 * ramp + whole)
        size = (1 - np.cos(math.pi * np.clip(np.minimum(k, k[::-1] + 1) / ramp, 0.0, 1.0))) / 2
        first = sum(part.size for part in parts) + ramp
        windows.append((first, first + whole))
        parts.append(most * size * np.sin(2 * math.pi * k / length))
    samples = np.concatenate([*parts, np.zeros(math.ceil(STILL / rig.period))])
    return SteppedSines(omega=omega, lengths=lengths, windows=tuple(windows), samples=samples, period=rig.period)


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
