"""Experiment 3 at a rig: laws that are expected to stay within effort, travel and twist step its far inertia."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from upright.experiments.hands_on.rig import RigAtHand, trial_of
from upright.experiments.tracking_3.laws import AT, Tracker
from upright.experiments.tracking_3.run import StepTrial, Tracking, asked_of, figured, follow
from upright.laws import Law
from upright.progress import Progress
from upright.records import Array
from upright.rig import Rig
from upright.rig.makes import make_of


@dataclass(frozen=True, kw_only=True, eq=False)
class _Trier:
    """Steps the rig with a law."""

    rig: RigAtHand
    folder: Path

    def __call__(self, law: Tracker, expected: StepTrial, step: float) -> StepTrial | None:
        if math.isfinite(expected.tripped) or law.decay <= 0 or expected.effort.saturated:
            return None
        model = self.rig.model
        self.rig.requested(
            f"Next is {law.name}. Let everything rest with {self.rig.names[0]} in the middle of its "
            "travel; a small pulse comes first, then the step, then a steady push of the drive."
        )
        reference, pushes = asked_of(model, step)
        stem = f"tracking_{law.name.replace(' ', '_').replace(',', '')}"
        done = self.rig.hold(
            pushed(law.law, reference, pushes), self.folder, stem, reference.size * model.period
        )  # fmt: skip
        return figured(trial_of(done, AT), step)


def pushed(law: Law, reference: Array, pushes: Array) -> Law:
    """A law with its reference, and with what is added to its command before the limit as a second one."""
    B = np.column_stack([law.B, np.zeros(len(law.B))])
    D = np.column_stack([law.D, np.ones(len(law.D))])
    names = (*law.reference_names, "push")
    return replace(law, B=B, D=D, references=np.column_stack([reference, pushes]), reference_names=names)


def times_as_fast(rig: RigAtHand, model: Rig) -> float:
    """Pole sets of Table 2 are for the makers' rigs; those of one's own are as much faster as the shaft swings."""
    if rig.make is not None:
        return 1.0
    make = make_of(model.plant)
    swings = [float(p.linear(AT).poles().imag.max()) for p in (model.plant, make.plant)]
    return swings[0] / swings[1]


def run_shaft(
    rig: RigAtHand, fit: Path, folder: Path, progress: Progress, stopped: Callable[[], bool]
) -> Tracking:  # fmt: skip
    """Design with a fit and step the rig; leaves `rig.toml`, laws and logs.

    Raises
    ------
    RigStopped
        When a run did not begin.
    """
    held = rig.described_by(fit, folder / "rig.toml")
    return follow(
        held.model, held.model, folder, None, None, progress, stopped, faster=times_as_fast(rig, held.model),
        tried=_Trier(rig=held, folder=folder),
    )  # fmt: skip
