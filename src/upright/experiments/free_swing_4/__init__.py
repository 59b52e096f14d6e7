"""Experiment 4: a large free swing, what it says of the rig, and the drift of what carries the pendulum."""

from __future__ import annotations

from upright.experiments.stand.experiment import Experiment, ExperimentInput, carries_pendulum
from upright.report.page import Chapter
from upright.rig.makes import PENDULUMS


def _tell(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.free_swing_4.by_hand import carrier_of, run_by_hand
    from upright.experiments.free_swing_4.chapter import chapter
    from upright.experiments.free_swing_4.run import run_free_swing
    from upright.experiments.stand.fits import fit_chapter
    from upright.study.results import write_fit

    body = carrier_of(at.stand)
    if not at.stand.starts_anywhere:
        study, fit = run_by_hand(at.stand, at.folder, at.progress, at.estimated("1b", body))
        return fit_chapter(study, fit, at.folder, at.stand.truth), not fit.interrupted
    weighed = next((k for k in at.weighed if k.name == body), None)
    result = run_free_swing(at.stand.rig, at.seed, at.folder, at.progress, at.stopped, weighed=weighed)
    if "free_swing" in result.answers:
        first = result.answers["free_swing"]
        write_fit(first.fit, first.study, at.folder / "fit.json")
    return chapter(result), not result.interrupted


EXPERIMENT = Experiment(
    name="4", order=60, title="Large free swing", makes=PENDULUMS,
    on=lambda stand: carries_pendulum(stand) and stand.fit is None, needs=("1a",), live_needs=("1b",), seconds=9.0,
    tell=_tell,
)  # fmt: skip
