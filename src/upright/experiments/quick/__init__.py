"""A rig in a minute: wiring, fit, gains, swing-up and catch, without a hand at it."""

from __future__ import annotations

from upright.experiments.stand.experiment import Experiment, ExperimentInput, carries_pendulum
from upright.experiments.stand.live import LiveStand
from upright.experiments.stand.stand import TestStand
from upright.report.page import Chapter


def _can(stand: TestStand) -> bool:
    return isinstance(stand, LiveStand) and carries_pendulum(stand) and stand.fit is None


def _tell(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.quick.chapter import chapter
    from upright.experiments.quick.run import run_quick

    assert isinstance(at.stand, LiveStand)  # as `_can` has seen to
    return chapter(run_quick(at.stand, at.folder, at.seed, at.progress, at.stopped)), True


EXPERIMENT = Experiment(
    name="quick", title="A rig in a minute", makes=(), on=_can, alone=True, seconds=6.0, tell=_tell,
    order=70,
)  # fmt: skip
