"""Stamps of a board's samples by its own clock and by that of a busy host: would the watch of its tick stop the run?

The watch sees nothing of a rig but these two times. A board's clock is a crystal within 100 ppm or a Mega's ceramic
resonator within 0.5 %, and wanders by a fifth of that with its temperature; a host's is slewed by up to 500 ppm where
it follows a time server. A sample waits for its link (up to 1 ms, or 4 where the host answers every fourth tick) and
for its host, whose lateness is that of a loop of ordinary priority (`jitter.md`): 60 us in the median, and of 1000
samples 1.5 wait for a Pareto's time, half of these beyond 1 ms, one in 40 beyond the watchdog's 20 ms. There the board
stops the run by itself, after the sample that was late, and another begins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from upright.records import Array
from upright.rigs import Limits
from upright.rigs.tick_length import TickLength

BOARDS = {"crystal, 100 ppm": 1e-4, "ceramic resonator, 0.5 %": 5e-3}
WANDERS, WITHIN = 0.2, (60.0, 1800.0)
"""Share of what a clock may be off by that it wanders by, and in how long [s]."""
SLEWED = 5e-4
TICK, EVERY = 1e-3, (1, 4)
"""Of the board [s], and how many of them pass between two samples."""
WOKEN, SPREAD = 60e-6, 0.5
"""Median of the lateness of a host [s], and deviation of its logarithm."""
PAUSES, LEAST, MOST = 1.5e-3, 0.5e-3, 10.0
"""Share of the samples before which a host pauses, and the shortest and longest of it [s]; longer ones than any time
are as many as that is short."""
WATCHDOG = Limits(travel=(1.0,), speed=(1.0,), start=(1.0,), command=1.0).watchdog


@dataclass(frozen=True, kw_only=True)
class Watched:
    """What became of hours of samples: how long they were, runs that the board ended, and those that the watch did."""

    hours: float
    ended: int
    stopped: tuple[tuple[float, float], ...]
    """When, by the host [s], and what the watch gave for the board's tick, over what it should be."""


def lateness(samples: int, link: float, rng: np.random.Generator) -> Array:
    """How late a busy host takes samples [s]."""
    late = rng.uniform(0.0, link, samples) + WOKEN * np.exp(SPREAD * rng.standard_normal(samples))
    paused = rng.random(samples) < PAUSES
    late[paused] += np.minimum(LEAST / (1.0 - rng.random(int(paused.sum()))), MOST)
    return late


def watched(board: str, seed: int, seconds: float, tick: float = 1.0, after: float = 0.0) -> Watched:
    """Samples of a clock, one watch after the other.

    Parameters
    ----------
    board : str
        Of `BOARDS`.
    tick : float
        Length of the board's tick over what it should be, besides what its clock is off by.
    after : float
        When it begins to last so long, by the board [s].
    """
    rng = np.random.default_rng([seed, 17])
    every = EVERY[seed % len(EVERY)]
    off, turn, phase = BOARDS[board], math.tau / rng.uniform(*WITHIN), rng.uniform(0, math.tau)
    rate = (1.0 + off * rng.uniform(-1, 1)) * (1.0 + rng.uniform(-SLEWED, SLEWED))
    shown = every * TICK * np.arange(round(seconds / (every * TICK)))
    true = rate * shown + off * WANDERS / turn * (np.sin(turn * shown + phase) - math.sin(phase))
    true += (tick - 1.0) * np.maximum(0.0, shown - after)
    late = lateness(len(shown), every * TICK, rng)
    watch, ended, stopped = TickLength(WATCHDOG), 0, list[tuple[float, float]]()
    for by_board, by_host, waited in zip(shown.tolist(), (true + late).tolist(), late.tolist(), strict=True):
        length = watch.sees(by_board, by_host)
        if length != 1.0:
            stopped.append((by_host, length))
        if length != 1.0 or waited > WATCHDOG:
            watch, ended = TickLength(WATCHDOG), ended + (length == 1.0)
    return Watched(hours=seconds / 3600, ended=ended, stopped=tuple(stopped))
