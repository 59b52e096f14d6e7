"""Frequency responses of a twin: stepped sines, each as strong as motion and drive allow, a multisine, or a sweep.

A probe at every frequency shows what a volt does there; the stepped sines then ask for the amplitude that keeps clear
of stiction, of the encoders' resolution, of the drive's limit and of the ends of travel. Each sine goes on until its
transient has decayed, detected in the data, and is then measured over whole periods. A periodic multisine, or a sweep
up and down, is quicker, at a price: each frequency moves the rig less, so dry friction weighs more, and what it adds
at one frequency stands under the answer at another.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.control.trial import readings, twin_log
from upright.errors import BadInput
from upright.experiments.stand.strength import SHARE
from upright.identification.frequency.detection import Tone, by_period, detect, settled
from upright.identification.frequency.response import FrequencyResponse
from upright.identification.frequency.spectra import chirp, multisine, odd_lines, response_of
from upright.identification.frequency.stepped import from_tones
from upright.records import Array, Record
from upright.rig import Rig
from upright.rig.makes import Make, make_rig

EVERY = 4  # servo periods per logged sample
RISE = 4.0
"""A command grows so slowly that it hardly starts the free swing [s], three periods at least."""
PROBES = 6
LENGTH = 4096
"""Logged samples in one period of a multisine."""
LINES = 20
PERIODS = 10
SWEEP = 40.0
"""Time for one sweep, up or down [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Dwell:
    """One frequency: its command, how long it took to settle, what was logged after that."""

    omega: float
    amplitude: float
    settle: float
    """Until the transient had died away [s]; NaN when it had not."""
    record: Record
    tone: Tone
    command: Tone


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep:
    """A rig excited frequency by frequency.

    Attributes
    ----------
    dwells : tuple of Dwell
        Sines, one after the other; empty when all were excited at once.
    seconds : float
        Time at the rig.
    log : Record
        What was measured, in one log; between two sines, while the next settles, nothing is kept.
    """

    dwells: tuple[Dwell, ...]
    response: FrequencyResponse
    seconds: float
    log: Record


def _joined(dwells: tuple[Dwell, ...]) -> Record:
    parts: list[Array] = []
    begin = 0.0
    for d in dwells:
        begin += d.settle if math.isfinite(d.settle) else float(d.record.t[0])
        parts.append(begin + d.record.t - d.record.t[0])
        begin = float(parts[-1][-1]) + d.record.period
    first = dwells[0].record
    columns = {n: np.concatenate([d.record[n] for d in dwells]) for n in first.names}
    return first.replace(t=np.concatenate(parts), signals=columns)


def grid(low: float, high: float, count: int, period: float) -> NDArray[np.int64]:
    """Logged samples per period of `count` frequencies between `low` and `high` [rad/s], evenly on a log scale."""
    length = np.round(2 * math.pi / np.geomspace(low, high, count) / period).astype(np.int64)
    return np.unique(length)[::-1]


def sines(rig: Rig, lengths: NDArray[np.int64], amplitude: Array, seconds: float) -> tuple[Array, Array]:
    """Commands (N, lanes) and what the encoders show of them (N, coordinates, lanes), logged every `EVERY` periods."""
    from upright.simulation import simulate

    lanes, tick = lengths.size, rig.period * EVERY
    rows = round(seconds / tick)
    k = np.arange(rows * EVERY)
    phase = 2 * math.pi * k[:, None] / (EVERY * lengths)
    ramp = np.minimum(1.0, k[:, None] / (EVERY * np.maximum(3 * lengths, RISE / tick)))
    u = amplitude * (1 - np.cos(math.pi * ramp)) / 2 * np.sin(phase)
    if rig.converter:
        u = np.round(u / rig.converter) * rig.converter
    pad = 16  # what a late drive looks back on
    tape = np.zeros((lanes, pad + rows * EVERY))
    tape[:, pad:] = u.T
    start = pad + np.arange(lanes) * tape.shape[1]
    x = simulate(
        rig.plant, rig.drive, rig.plant.state(), tape.ravel(), rig.period, samples=rows, every=EVERY, start=start
    )
    return u[::EVERY], readings(rig, x[:, 0::2].swapaxes(1, 2)).swapaxes(1, 2)


def stepped_sine(rig: Rig, make: Make, *, count: int = 28, seconds: float = 40.0, periods: int = 6) -> Sweep:
    """Sweep a rig over the band of its make, sine after sine.

    Parameters
    ----------
    rig : Rig
        The twin.
    make : Make
        The rig as designed: all that is known when the first amplitude is chosen.
    count : int
        Frequencies, rounded to whole logged samples per period.
    seconds : float
        Longest time spent on one of them.
    periods : int
        Least number of whole periods that are measured.
    """
    tick = rig.period * EVERY
    lengths = grid(*make.band, count, tick)
    omega = 2 * math.pi / (lengths * tick)
    goal = np.minimum(np.array(make.reach), np.array(make.fastest) / omega[:, None])
    amplitude = np.minimum(SHARE * rig.limit, np.min(goal / _expected(make, omega), axis=1))
    amplitude = _probed(rig, lengths, amplitude, goal, seconds / 2)
    u, y = sines(rig, lengths, amplitude, seconds)
    dwells = tuple(
        _dwell(rig, float(omega[i]), int(n), u[:, i], y[:, :, i], float(amplitude[i]), periods)
        for i, n in enumerate(lengths)
    )
    response = collect(dwells, rig)
    spent = sum(float(d.record.t[-1]) for d in dwells)
    return Sweep(dwells=dwells, response=response, seconds=spent, log=_joined(dwells))


def _probed(rig: Rig, lengths: NDArray[np.int64], amplitude: Array, goal: Array, seconds: float) -> Array:
    """Commands that come closest to the wanted motion, closed in from both sides because friction makes it jump."""
    low, high = np.zeros(lengths.size), np.full(lengths.size, SHARE * rig.limit)
    best, miss = amplitude, np.full(lengths.size, math.inf)
    for _ in range(PROBES):
        y = sines(rig, lengths, amplitude, seconds)[1]
        peaks = np.array([_peak(y[:, :, i], int(n), rig.period * EVERY) for i, n in enumerate(lengths)])
        over = np.max(np.maximum(peaks, rig.resolution) / goal, axis=1)  # above 1: more than was asked
        off = np.abs(np.log(over))
        best, miss = np.where(off < miss, amplitude, best), np.minimum(off, miss)
        low, high = np.where(over < 1, amplitude, low), np.where(over < 1, high, amplitude)
        step = amplitude * np.clip(1 / over, 0.5, 1.5)
        amplitude = np.where((step > low) & (step < high), step, np.where(low > 0, np.sqrt(low * high), high / 2))
    return best


def _peak(y: Array, length: int, tick: float) -> Array:
    """Amplitude over the last periods."""
    lines = np.abs(by_period(y, length, tick))
    return np.median(lines[-min(4, len(lines)) :], axis=0)


def _dwell(rig: Rig, omega: float, length: int, u: Array, y: Array, amplitude: float, periods: int) -> Dwell:
    tick = rig.period * EVERY
    lines = by_period(y, length, tick)
    rounding = rig.resolution / math.sqrt(12) * math.sqrt(4 / length)
    wanted = max(periods, math.ceil(1.0 / (length * tick)))
    at = settled(lines[: len(lines) - wanted], noise=rounding)
    first = (len(lines) - wanted if at is None else at) * length
    part = slice(first, first + wanted * length)
    t = np.arange(y.shape[0]) * tick
    record = twin_log(rig, t[part], y[part], u[part])
    return Dwell(
        omega=omega, amplitude=amplitude, settle=math.nan if at is None else first * tick, record=record,
        tone=detect(record.t, record.y, omega, resolution=rig.resolution),
        command=detect(record.t, record.u, omega, resolution=rig.converter),
    )  # fmt: skip


def collect(dwells: tuple[Dwell, ...], rig: Rig) -> FrequencyResponse:
    """Response of sines measured one after the other."""
    late = [f"{d.omega:.3g}" for d in dwells if not math.isfinite(d.settle)]
    notes = (f"Not settled at {', '.join(late)} rad/s.",) if late else ()
    return from_tones(
        [d.tone for d in dwells], [d.command for d in dwells], outputs=dwells[0].record.outputs,
        units=(*(c.unit for c in rig.plant.coordinates), rig.unit), hold=rig.period, notes=notes,
    )  # fmt: skip


def broadband(rig: Rig, make: Make, kind: str, *, seed: int = 0) -> Sweep:
    """Log and response of a twin excited at all frequencies of its make's band at once, from rest.

    Parameters
    ----------
    make : Make
        The rig as designed, from which the command is shaped.
    kind : {"multisine", "sweep"}
    seed : int
        Of the phases.
    """
    if kind not in ("multisine", "sweep"):
        raise BadInput(f"a rig is excited by 'sines', a 'multisine' or a 'sweep', not by '{kind}'.")
    tick, (low, high) = rig.period * EVERY, make.band
    if kind == "multisine":
        base = 2 * math.pi / (LENGTH * tick)
        lines = odd_lines(low, high, LINES, base)
        level = _level(make, lines * base)
        wave = multisine(lines, level, LENGTH, seed=seed)
        u = np.tile(wave, PERIODS)
    else:
        one = chirp(low, high, SWEEP, tick)
        w = low * (high / low) ** (np.arange(one.size) / one.size)
        one = one * _level(make, w)
        u = np.concatenate([one, one[::-1]] * 3)
    most = SHARE * rig.limit / float(np.abs(u).max())
    scale = min(most, 1.0 if kind == "sweep" else 0.3)
    for _ in range(6):  # probes: friction makes the motion less than in proportion
        y = _moved(rig, scale * u)
        over = float(np.max(np.ptp(y[y.shape[0] // 3 :], axis=0) / (2.5 * np.array(make.reach))))
        scale = min(scale / float(np.clip(over, 0.4, 2.5)), most)
    u = np.round(scale * u / rig.converter) * rig.converter if rig.converter else scale * u
    y = _moved(rig, u)
    record = twin_log(rig, np.arange(u.size, dtype=np.float64) * tick, y, u)
    response = response_of(
        [record],
        command="u",
        outputs=record.outputs,
        kind=kind,
        hold=tick,
        resolution=rig.resolution.tolist(),
        band=(low, high),
    )
    return Sweep(dwells=(), response=response, seconds=float(np.ptp(record.t)), log=record)


def _expected(make: Make, omega: ArrayLike) -> Array:
    """Motion per volt of the rig as designed, its dry friction left out, shape (frequencies, coordinates)."""
    design = make_rig(make.key)
    return np.abs(design.linear(next(iter(design.plant.equilibria))).response(omega)[:, :, 0])


def _level(make: Make, omega: ArrayLike) -> Array:
    """Relative command at each frequency: as much as the most mobile coordinate stands."""
    return np.minimum(make.rig.limit, np.min(np.array(make.reach) / _expected(make, omega), axis=1))


def _moved(rig: Rig, u: Array) -> Array:
    """What the encoders show (N, coordinates), the command held for a logged sample."""
    from upright.simulation import simulate

    held = np.repeat(u, EVERY)
    x = simulate(rig.plant, rig.drive, rig.plant.state(), held, rig.period, samples=u.size, every=EVERY)[:, 0::2, 0]
    return readings(rig, x)
