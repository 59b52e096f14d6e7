"""Experiment 3: the far inertia follows a step through a flexible shaft, within effort and travel."""

from __future__ import annotations

from upright.experiments.stand.experiment import Experiment, ExperimentInput
from upright.experiments.stand.stand import TestStand
from upright.report.page import Chapter
from upright.rig.makes import MAKES, SHAFTS


def _is_shaft(stand: TestStand) -> bool:
    return any(isinstance(stand.rig.plant, type(MAKES[key].rig.plant)) for key in SHAFTS)


def _tell(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.tracking_3.chapter import chapter
    from upright.experiments.tracking_3.run import run_tracking, track_on

    if not at.stand.attended:  # nobody waits while it is identified by pulses once more, and tried on another day
        result = run_tracking(at.stand.rig, at.seed, at.folder, at.progress, at.stopped, weighed=at.weighed)
    else:
        stand = at.described
        result = track_on(stand.rig, stand, at.folder, None, None, at.progress, at.stopped)
    return chapter(result), not result.interrupted


EXPERIMENT = Experiment(
    name="3", order=50, title="Tracking through a flexible shaft", makes=SHAFTS, on=_is_shaft,
    needs=("1a",), live_needs=("1b",), seconds=5.0, tell=_tell,
)  # fmt: skip
