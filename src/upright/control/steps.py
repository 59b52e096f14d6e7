"""How well did it step? Rise, overshoot, settling and what is left, from what an encoder shows.

Dry friction stops a body beside its reference and an encoder shows steps: the motion is measured against where it came
to rest, what is missing there is told apart, and a band narrower than the encoder's steps is widened to them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class StepFigures:
    """Figures of one step, times from the moment of the step [s], lengths in the signal's unit.

    Attributes
    ----------
    change : float
        From rest before the step to rest after it, with its sign.
    rise : float
        From 10 to 90 % of the change.
    peak_time : float
        When it is farthest; the end where it creeps up to its rest.
    overshoot : float
        How far beyond its rest, as a share of the change; 0 where the encoder does not resolve it.
    settling_2, settling_5 : float
        After which it stays within 2 or 5 % of the change about its rest; inf where the record ends before it is
        known to stay.
    arrival : float
        After which it stays within 5 % of the step asked for about the reference itself; inf where friction or
        swinging keep it from there.
    error : float
        Reference less rest.
    resolution : float
        Step of the encoder over the change: what the shares cannot resolve.
    """

    change: float
    rise: float
    peak_time: float
    overshoot: float
    settling_2: float
    settling_5: float
    arrival: float
    error: float
    resolution: float


@dataclass(frozen=True, kw_only=True)
class Effort:
    """What the drive had to give: largest command [its unit], share of the limit, share of the samples at it."""

    peak: float
    share: float
    saturated: float


TAIL = 0.1
"""Share of the record that counts as rest; a median over it hears neither a bump nor an encoder that flickers."""


def step_figures(t: ArrayLike, y: ArrayLike, *, before: float, reference: float, quantum: float = 0.0) -> StepFigures:
    """Figures of a step of the reference at the first sample.

    Parameters
    ----------
    t : array, shape (N,)
        Time [s].
    y : array, shape (N,)
        What followed, from the step on.
    before : float
        Where it rested before.
    reference : float
        Where it should go.
    quantum : float
        Step of its encoder.

    Raises
    ------
    BadInput
        When there are too few samples, or it does not move by more than an encoder's step.
    """
    time, signal = np.asarray(t, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if time.ndim != 1 or time.shape != signal.shape or time.size < 20:
        raise BadInput(f"a step needs times and positions, 20 or more of each, got {time.shape} and {signal.shape}.")
    tail = max(3, math.ceil(TAIL * time.size))
    if reference == before:
        raise BadInput(f"a step goes somewhere else; it was at {before:g} and should stay there.")
    rest = float(np.median(signal[-tail:]))
    change = rest - before
    if abs(change) <= max(quantum, 1e-12 * float(np.abs(signal).max())):
        raise BadInput(
            f"nothing stepped: it rests {abs(change):.3g} from where it began, and its encoder shows steps of "
            f"{quantum:.3g}; ask for a larger step or look at friction."
        )
    clock, share = time - time[0], (signal - before) / change
    resolution = quantum / abs(change)
    top = int(np.argmax(share))
    beyond = float(share[top]) - 1.0
    return StepFigures(
        change=change,
        rise=_first(clock, share, 0.9) - _first(clock, share, 0.1),
        peak_time=float(clock[top]),
        overshoot=beyond if beyond > resolution else 0.0,
        settling_2=_settled(clock, share, max(0.02, resolution), tail),
        settling_5=_settled(clock, share, max(0.05, resolution), tail),
        arrival=_settled(clock, (signal - before) / (reference - before), max(0.05, resolution), tail),
        error=reference - rest,
        resolution=resolution,
    )


def effort(u: ArrayLike, limit: float, step: float = 0.0) -> Effort:
    """What the drive gave; `step` is the converter's, within which a command counts as at its limit."""
    size = np.abs(np.asarray(u, dtype=np.float64))
    if size.size == 0 or not limit > 0:
        raise BadInput(f"effort needs commands and a limit above 0, got {size.size} commands and a limit of {limit:g}.")
    peak = float(size.max())
    return Effort(peak=peak, share=peak / limit, saturated=float(np.mean(size >= limit - step / 2)))


def _first(t: Array, share: Array, level: float) -> float:
    """When a level is passed first, by a straight line between samples."""
    i = int(np.argmax(share >= level))  # its rest is at 1, so every level below is passed
    if i == 0:
        return float(t[0])
    return float(np.interp(level, share[i - 1 : i + 1], t[i - 1 : i + 1]))


def _settled(t: Array, share: Array, band: float, tail: int) -> float:
    """After which it stays in the band; inf unless it is seen to stay there for as long as the rest was taken from."""
    off = np.abs(share - 1.0)
    outside = np.flatnonzero(off > band * (1 + 1e-9))
    if outside.size == 0:
        return 0.0
    i = int(outside[-1])
    if i + 1 > t.size - tail:
        return math.inf
    return float(t[i] + (t[i + 1] - t[i]) * (off[i] - band) / (off[i] - off[i + 1]))
