"""Experiment 2b, from hanging to upright: encoders first, then pump, catch and hold."""

from __future__ import annotations

from upright.experiments.stand.experiment import Experiment, ExperimentInput, carries_pendulum
from upright.report.page import Chapter
from upright.report.symbols import typed
from upright.rig.makes import PENDULUMS


def _tell(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.swing_up_2b.chapter import chapter
    from upright.experiments.swing_up_2b.run import known_of, run_swing_up
    from upright.files import write_json

    stand = at.described
    known, model = at.identified(stand)
    result = run_swing_up(
        model, stand, at.folder, at.progress, at.stopped, known=known_of(known), source=typed(at.fit)
    )  # fmt: skip
    page = chapter(result, typed(at.folder))
    write_json(at.folder / "swing_up.json", page.numbers)
    return page, not at.stopped()


EXPERIMENT = Experiment(
    name="2b", order=40, part_of="2", title="Swinging up and catching", makes=PENDULUMS, on=carries_pendulum,
    needs=("1b",), live_needs=("1b",), seconds=3.0, tell=_tell,
)  # fmt: skip
