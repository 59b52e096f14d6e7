"""Experiment 1b: frequency response of the hanging rig, and the fits that say by which pole it will fall."""

from __future__ import annotations

from upright.experiments.stand.experiment import Experiment, ExperimentInput
from upright.report.page import Chapter
from upright.rig.makes import PENDULUMS, SHAFTS


def _tell(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.frequency_1b.at_once import run_at_once
    from upright.experiments.frequency_1b.chapter import at_once_chapter, chapter
    from upright.experiments.frequency_1b.run import run_frequency

    if not at.stand.attended:  # nobody waits for sines, one after the other
        result = run_frequency(at.stand.rig, at.seed, at.folder, at.progress, at.stopped, weighed=at.weighed)
        return chapter(result), True
    measured = run_at_once(at.stand, at.folder, at.progress, at.weighed)
    return at_once_chapter(measured, at.folder, at.stand.truth), not measured.fit.interrupted


EXPERIMENT = Experiment(
    name="1b", order=20, part_of="1", title="Frequency response", makes=(*PENDULUMS, *SHAFTS),
    on=lambda stand: stand.fit is None, needs=("1a",), live_needs=("1a",), seconds=5.0, tell=_tell,
)  # fmt: skip
