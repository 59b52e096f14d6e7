"""How far ahead a plant that would fall can be predicted at all: no better than the start state that readings give.

A filter knows the state to within the covariance P that the sensors' resolution and the random forces leave it
(Kalman 1960). Over h seconds the linear model makes ``Phi(h) P Phi(h)'`` of that, and a reading adds its own variance
R, so even a model without an error misses by the root of ``C Phi(h) P Phi(h)' C' + R``; of one unstable mode this grows
as exp(a h). What is missed beyond is the model's. A fit is judged as far ahead as this leaves it at least half of
what may be missed: nearer hardly anything is tested, and further every model fails for the want of a better encoder.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.problem.residuals import Problem

Array = NDArray[np.float64]

ENOUGH = 90.0
"""Fit percent that the start state has to allow where a fit is judged: half of what may be missed is then left."""


SLOW = 0.05
"""Growth over the horizon that is hardly any; that of a drift alone is rounding."""


@dataclass(frozen=True, kw_only=True)
class Judged:
    """How far ahead runs are judged [s], and the `growth` [1/s] of the fastest pole there, 0 where none grows."""

    seconds: float
    growth: float


def ceilings(problem: Problem, index: int, x: Array, samples: Sequence[int]) -> Array:
    """Fit percents (horizons, outputs) that a model without an error would reach so many `samples` ahead.

    Of a run that a filter predicts, at coordinates `x`; not a number for an output that does not move.
    """
    track = problem.tracks[index]
    assert track.ahead is not None
    Phi, P = problem.known_state(index, x)
    columns = list(track.columns)
    spread = np.std(track.y[track.restarts[0] :], axis=0)
    missed = np.empty((len(samples), len(columns)))
    for row, ahead in enumerate(samples):
        moved = np.linalg.matrix_power(Phi, ahead)
        variance = np.diag(moved @ P @ moved.T)[columns] + track.ahead.sensor
        missed[row] = np.sqrt(variance) / np.where(spread > 0, spread, np.nan)
    return 100 * (1 - missed)


def judged(problem: Problem, x: Array) -> Judged | None:
    """How far ahead the runs that a filter predicts are judged; None where there is none.

    The longest horizon, no longer than the requested one, at which every signal of every run may reach `ENOUGH`; one
    sample where none is.
    """
    seconds, growth = np.inf, 0.0
    for index, track in enumerate(problem.tracks):
        if not track.ahead:
            continue
        most = track.ahead.samples[-1]
        allowed = ceilings(problem, index, x, range(1, most + 1))[:, track.run.free]
        allowed = np.where(np.isnan(allowed), 100.0, allowed)
        short = np.flatnonzero(allowed.min(axis=1, initial=100.0) < ENOUGH)
        here = track.dt * max(1, int(short[0]) if short.size else most)
        seconds = min(seconds, here)
        Phi, _ = problem.known_state(index, x)
        if np.isfinite(Phi).all():
            growth = max(growth, float(np.log(np.abs(np.linalg.eigvals(Phi)).max())) / track.dt)
    if not np.isfinite(seconds):
        return None
    return Judged(seconds=float(seconds), growth=growth if growth * seconds > SLOW else 0.0)
