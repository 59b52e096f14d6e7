"""Experiment 1a: inertia of a rig's first body, and its spring, from steps with known masses added."""

from __future__ import annotations

from upright.experiments.stand.experiment import Experiment, ExperimentInput
from upright.experiments.stand.stand import TestStand
from upright.report.page import Chapter
from upright.rig.makes import PENDULUMS, SHAFTS


def _can(stand: TestStand) -> bool:
    from upright.experiments.weighing_1a.run import kind_of

    return bool(kind_of(stand.rig.plant) and stand.added)


def _tell(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.weighing_1a.chapter import chapter
    from upright.experiments.weighing_1a.run import run_weighing

    return chapter(run_weighing(at.stand, at.seed, at.folder, at.progress)), True


EXPERIMENT = Experiment(
    name="1a", order=10, part_of="1", title="Stiffness and inertia from added loads", makes=(*PENDULUMS, *SHAFTS),
    on=_can, seconds=1.5, tell=_tell,
)  # fmt: skip
