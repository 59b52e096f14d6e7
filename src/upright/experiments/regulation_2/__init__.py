"""Experiment 2: the rig held upright with the numbers it was identified by, and beforehand what will come of it."""

from __future__ import annotations

from upright.experiments.stand.experiment import Experiment, ExperimentInput, carries_pendulum
from upright.report.page import Chapter
from upright.report.symbols import typed
from upright.rig.makes import PENDULUMS


def _tell(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.regulation_2.chapter import chapter
    from upright.experiments.regulation_2.run import run_regulation

    stand = at.described
    _, model = at.identified(stand)
    result = run_regulation(model, stand, at.seed, at.folder, at.progress, at.stopped, source=typed(at.fit))
    return chapter(result), not result.interrupted


EXPERIMENT = Experiment(
    name="2", order=30, title="Holding it upright", makes=PENDULUMS, on=carries_pendulum, needs=("1b",),
    live_needs=("1b",), seconds=4.0, tell=_tell,
)  # fmt: skip
