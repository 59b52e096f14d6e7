"""How well did it go? The figures of a run, defined once, for what is predicted and for what happened."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.control.trial import Trial
from upright.errors import BadInput

Array = NDArray[np.float64]

FALLEN = math.radians(30)
"""Deviation of a pendulum from upright beyond which it counts as fallen and a person would switch off [rad]."""
BAND = math.radians(2)
"""Deviation of a pendulum within which it counts as settled [rad]: forty counts of its encoder."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """Figures of a run.

    Attributes
    ----------
    fell : float
        Time at which the watched coordinate left for good what can be held [s]; inf when it never did.
    settled : float
        Time from which it stayed within its band to the end [s]; inf when it did not.
    peaks : array, shape (coordinates,)
        Largest deviation of each coordinate [m or rad], up to the fall if there was one.
    final : array, shape (coordinates,)
        Largest deviation of each coordinate over the last quarter [m or rad]: what dry friction and counts leave.
    effort_peak, effort_rms : float
        Of the command [its unit], up to the fall.
    saturated : float
        Share of the samples at the limit, up to the fall, 0 to 1.
    """

    fell: float
    settled: float
    peaks: Array
    final: Array
    effort_peak: float
    effort_rms: float
    saturated: float

    @property
    def held(self) -> bool:
        """Whether it was held to the end."""
        return not math.isfinite(self.fell)


def score(run: Trial, *, watched: str = "theta", fallen: float = FALLEN, band: float = BAND) -> Score:
    """Figures of a trial that was to hold an equilibrium.

    Parameters
    ----------
    run : Trial
    watched : str
        Coordinate that falls and settles.
    fallen, band : float
        Deviations beyond which it counts as fallen, and within which as settled [m or rad].
    """
    names = [c.name for c in run.rig.plant.coordinates]
    if watched not in names:
        raise BadInput(f"nothing called '{watched}' moves there; watch one of {', '.join(names)}.")
    away = np.abs(run.deviation)
    main = away[:, names.index(watched)]
    beyond = np.flatnonzero(~(main <= fallen))
    last = int(beyond[0]) if beyond.size else main.size - 1
    outside = np.flatnonzero(~(main <= band))
    settled = 0.0 if outside.size == 0 else math.inf
    if outside.size and outside[-1] + 1 < main.size:
        settled = float(run.t[outside[-1] + 1])
    u = run.u[: last + 1]
    return Score(
        fell=float(run.t[last]) if beyond.size else math.inf,
        settled=math.inf if beyond.size else settled,
        peaks=away[: last + 1].max(axis=0),
        final=away[-max(1, away.shape[0] // 4) :].max(axis=0),
        effort_peak=float(np.abs(u).max()),
        effort_rms=float(np.sqrt(np.mean(u**2))),
        saturated=float(np.mean(np.abs(u) >= run.rig.limit * (1 - 1e-9))),
    )
