"""Figures of the command: what a way back takes from the drive, what holding takes, and whether that is quiet.

They are defined once, for what is predicted (simulated with encoder counts and dry friction) and for what was logged.
At rest a command is kept busy by the rounding of encoders, which differencing amplifies, and by limit cycles of dry
friction and of the counts themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.quantities import two_figures
from upright.records import Array

RESTING = 1 / 3
"""Last share of a run that counts as rest."""
FELT = 5e-3
"""Time at the limit that counts as saturation [s]; what is shorter passes in the drive's own lag."""
QUIET_RMS = 0.1
"""Largest rms of a quiet command about its mean, as a share of the limit.

A law is there against disturbances, which the Kalman filter's design takes for a tenth of the limit
(`designing.run.velocities`): a command busier than that is the largest disturbance of its own rig. At a tenth a
Gaussian command stays within 0.3 of the limit (three standard deviations), so that 0.7 are left against pushes, and
heats the motor by 1 % of what the limit does (rms squared).
"""
QUIET_PEAK = 0.5
"""Largest peak of a quiet command, as a share of the limit.

Along an unstable mode ``z' = p z + b u`` with ``|u| <= U`` nothing brings back more than ``|z| = b U/p``: a command
that takes half of U at rest leaves a recoverable push half as large.
"""
REGULAR = 0.3
"""Largest scatter of the periods of a cycle, as a share of their mean; crossings of noise that remembers nothing come
at waiting times that scatter by as much as their mean."""


@dataclass(frozen=True, kw_only=True)
class Effort:
    """What the drive had to give: largest command [its unit], share of the limit, share of the samples at it."""

    peak: float
    share: float
    saturated: float


@dataclass(frozen=True, kw_only=True)
class Cycle:
    """A limit cycle: half of what it swings [the signal's unit], and its period [s]."""

    size: float
    period: float


@dataclass(frozen=True, kw_only=True)
class RestEffort:
    """What holding takes once the motion has died away.

    Attributes
    ----------
    rms : float
        Of the command about its mean, as a share of the limit.
    peak : float
        Largest command, as a share of the limit.
    command, body : Cycle or None
        Limit cycle of the command [its unit] and of the driven body [m or rad]; None where nothing repeats.
    """

    rms: float
    peak: float
    command: Cycle | None = None
    body: Cycle | None = None

    @property
    def quiet(self) -> bool:
        """Whether holding leaves the drive to what it is there for."""
        return bool(quiet(self.rms, self.peak))


def effort(u: ArrayLike, limit: float, step: float = 0.0) -> Effort:
    """What the drive gave; `step` is the converter's, within which a command counts as at its limit."""
    size = np.abs(np.asarray(u, dtype=np.float64))
    if size.size == 0 or not limit > 0:
        raise BadInput(f"effort needs commands and a limit above 0, got {size.size} commands and a limit of {limit:g}.")
    peak = float(size.max())
    return Effort(peak=peak, share=peak / limit, saturated=float(np.mean(size >= limit - step / 2)))


def quiet(rms: ArrayLike, peak: ArrayLike) -> NDArray[np.bool_]:
    """Whether commands at rest are quiet, by their rms and peak as shares of the limit."""
    return (np.asarray(rms) <= QUIET_RMS) & (np.asarray(peak) <= QUIET_PEAK)


def rest_samples(samples: Array) -> Array:
    """Samples of the rest, the last on the first axis."""
    return samples[-max(2, round(RESTING * len(samples))) :]


def busyness(u: Array, limit: ArrayLike) -> tuple[Array, Array]:
    """Rms about the mean and peak of commands at rest, as shares of the limit; u of shape (N,) or (N, lanes)."""
    still = rest_samples(u)
    return still.std(axis=0) / np.asarray(limit), np.abs(still).max(axis=0) / np.asarray(limit)


def rest_effort(t: Array, u: Array, limit: float, *, body: Array | None = None, count: float = 0.0) -> RestEffort:
    """What holding took over the last third of a run.

    Parameters
    ----------
    t, u : array, shape (N,)
        Time [s] and command.
    limit : float
        Of the command; infinite where there is none, which leaves every share at zero.
    body : array, shape (N,), optional
        Positions of the driven body.
    count : float
        Step of its encoder: what stays within it does not move.

    Raises
    ------
    BadInput
        When there is no command or no limit.
    """
    if u.size < 2 or t.shape != u.shape or not limit > 0:
        raise BadInput(
            f"the effort at rest needs two commands or more with their times and a limit above 0, got {u.size} "
            f"commands, {t.size} times and a limit of {limit:g}."
        )
    rms, peak = busyness(u, limit)
    clock = rest_samples(t)
    return RestEffort(
        rms=float(rms), peak=float(peak), command=cycle(clock, rest_samples(u)),
        body=None if body is None else cycle(clock, rest_samples(body), count),
    )  # fmt: skip


def cycle(t: Array, x: Array, step: float = 0.0) -> Cycle | None:
    """What repeats in a signal at rest; None where it moves by no more than a step, irregularly, or less than thrice.

    A period runs from one upward crossing of the upper quarter to the next, with a crossing of the lower quarter
    between them, so that an encoder's flicker and noise on top are no periods.
    """
    low, high = float(x.min()), float(x.max())
    swing = high - low
    if swing <= step * (1 + 1e-9) or swing <= 1e-12 * max(abs(low), abs(high)):
        return None
    # where it last was beyond a quarter: up, down, or neither yet
    side = np.where(x >= high - swing / 4, 1, np.where(x <= low + swing / 4, -1, 0))
    sided = np.flatnonzero(side)
    turns = sided[1:][(side[sided][1:] == 1) & (side[sided][:-1] == -1)]
    periods = np.diff(t[turns])
    if periods.size < 2 or periods.std() > REGULAR * periods.mean():
        return None
    return Cycle(size=swing / 2, period=float(periods.mean()))


def of_limit(share: float, bound: str = "") -> str:
    """A share of the limit in words, a bound such as "at most " before it."""
    return "less than 0.1 % of the limit" if share < 1e-3 else f"{bound}{two_figures(100 * share)} % of the limit"


def shown(effort: RestEffort, limit: float, unit: str) -> str:
    """The command at rest in words, as what comes after "the command at rest"."""
    described = (
        f"has an rms of {of_limit(effort.rms)} and peaks at {two_figures(effort.peak * limit)} of {limit:g} {unit}"
    )
    if effort.command is not None:
        described += f", every {_seconds(effort.command.period)}"
    return (
        described
        if effort.quiet
        else f"{described} (quiet: up to {100 * QUIET_RMS:.0f} % rms, {QUIET_PEAK * limit:.3g} {unit})"
    )


def _seconds(period: float) -> str:
    return f"{period:.2g} s" if period >= 0.1 else f"{1e3 * period:.2g} ms"
