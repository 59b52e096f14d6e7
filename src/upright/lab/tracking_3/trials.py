"""What does a law do to a rig? A step, then a steady push, and the figures of both; beforehand and afterwards."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from upright.control import Rig, Trial, trial
from upright.control.steps import Effort, StepFigures, effort, step_figures
from upright.errors import BadInput
from upright.lab.tracking_3.laws import AT, Tracker
from upright.lab.tracking_3.shaft import SHAFTS, kind_of

BEFORE, DWELL, PUSHED = 0.1, 2.0, 1.5
"""Time before the step, at the reference, and under the push that follows [s]."""
PUSH = -0.1
"""Steady push on the drive that comes after the step, as a share of the limit."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Run:
    """One law on one rig: the trial and its figures.

    Attributes
    ----------
    trial : Trial
        As if nothing tripped.
    figures : StepFigures or None
        Of the far body; None where the rig trips or nothing moves.
    effort : Effort
        Of the step, up to the push.
    twist, travel : float
        Largest distance between the bodies, and from where they began, up to the push [m or rad].
    give : float
        How far the push moves the far body [m or rad].
    tripped : float
        When twist or travel is left and a person, a stop or a trip ends the run [s]; inf if never.
    """

    trial: Trial
    figures: StepFigures | None
    effort: Effort
    twist: float
    travel: float
    give: float
    tripped: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcome:
    """A law, what the fitted model says it will do, and what the rig did."""

    law: Tracker
    foreseen: Run
    found: Run

    @property
    def within(self) -> bool:
        """Whether the rig stayed within limit, travel and twist."""
        return math.isinf(self.found.tripped) and self.found.effort.saturated == 0


def twist_of(rig: Rig) -> float:
    """Distance of the bodies at which the shaft trips."""
    return SHAFTS[kind_of(rig)].twist


def outcome(rig: Rig, model: Rig, law: Tracker, step: float) -> Outcome:
    """A law on the model and on the rig."""
    foreseen = attempt(model, law, step)
    return Outcome(law=law, foreseen=foreseen, found=foreseen if rig is model else attempt(rig, law, step))


def attempt(rig: Rig, law: Tracker, step: float) -> Run:
    """Zero, the step, then a steady push while the reference stays."""
    before, at, end = (round(s / rig.period) for s in (BEFORE, BEFORE + DWELL, BEFORE + DWELL + PUSHED))
    pushes = np.zeros(end + 1)
    pushes[at:] = PUSH * rig.limit
    done = trial(
        rig, law.law, at=AT, start=np.zeros(2 * len(rig.plant.coordinates)), seconds=end * rig.period,
        reference=np.append(np.zeros(before), step), pushes=pushes,
    )  # fmt: skip
    q = done.x[:, ::2]
    apart, away = np.abs(q[:, -1] - q[:, 0]), np.abs(q).max(axis=1)
    beyond = np.flatnonzero((apart > twist_of(rig)) | (away > rig.travel))
    tripped = float(done.t[beyond[0]]) if beyond.size else math.inf
    last = min(at, int(beyond[0]) if beyond.size else at)
    y = done.record[done.record.outputs[-1]]
    figures = None
    if not beyond.size:
        try:
            figures = step_figures(
                done.t[before:at], y[before:at], before=0.0, reference=step, quantum=float(rig.quantum[-1])
            )
        except BadInput:  # friction held it where it was
            figures = None
    return Run(
        trial=done, figures=figures, effort=effort(done.u[before : last + 1], rig.limit, rig.converter),
        twist=float(apart[: last + 1].max()), travel=float(away[: last + 1].max()),
        give=math.inf if beyond.size else float(abs(np.mean(y[-50:]) - np.mean(y[at - 50 : at]))), tripped=tripped,
    )  # fmt: skip
