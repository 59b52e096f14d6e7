"""One small page of every kind, and how to look into it."""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path

import numpy as np

from tests.closed_loop.programs import Pid, closed_loop
from tests.report.conftest import make_fit
from upright.records import Record
from upright.report.page import Chapter

EXAMPLES = Path(__file__).parents[2] / "examples"
T = np.arange(1500) * 4e-3
SWING = np.round(0.8 * np.exp(-0.3 * T) * np.cos(7 * T), 4)


def fit_page(folder: Path) -> Chapter:
    from upright.report.fit.chapter import chapter

    return chapter(make_fit(), title="Free swing", provenance={"study": "swing.toml", "runs": {"release": "a.csv"}})


def log_page(folder: Path) -> Chapter:
    from upright.readers import inspect
    from upright.report.log import chapter

    record = Record(t=T, signals={"theta": SWING}, units={"theta": "rad"}, outputs=("theta",))
    return chapter(record, inspect(record))


def doctor_page(folder: Path) -> Chapter:
    from upright.diagnosis import examine
    from upright.diagnosis.chapter import chapter

    lost = Record(
        t=T, signals={"theta": SWING + np.where(T > 2.2, 0.15, 0.0)}, units={"theta": "rad"}, outputs=("theta",)
    )
    return chapter(examine(lost), log=Path("swing.csv"))


def law_page(folder: Path) -> Chapter:
    from upright.closed_loop import recover_law
    from upright.report.law import chapter

    record = closed_loop(Pid(kp=4.0, ki=3.0, kd=0.2, second=0.8, on="measurement"), rows=2000, step=0.01)
    return chapter(record, recover_law(record, measured=["y"], references=["r"], command="u"), "run.csv")


def survey_page(name: str, answers: int | None = None):
    def page(folder: Path) -> Chapter:
        from upright.questionnaire.chapter import chapter
        from upright.questionnaire.sheet import read_sheet

        return chapter(read_sheet(EXAMPLES / "survey" / name), title="Survey", source=name, answers=answers)

    return page


def design_page(**wish):
    def page(folder: Path) -> Chapter:
        from upright.designing.chapter import chapter
        from upright.designing.run import DesignRequest, design_for
        from upright.physics import Furuta
        from upright.rig import Rig

        plant = Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-4)
        others = tuple((plant.replace(m_p=m), 0.5) for m in (0.134, 0.136))
        rig = Rig(plant=plant, name="furuta", gain=0.5, unit="V", draws=others)
        return chapter(design_for(rig, DesignRequest(at="inverted", limit=1.0, resolution=(4e-4, 4e-4), **wish)))

    return page


def paper_page(folder: Path) -> Chapter:
    from upright.paper.chapter import chapter
    from upright.paper.reproduce import reproduce_tables
    from upright.rig.makes import NOMINAL

    return chapter(reproduce_tables(NOMINAL, seed=1))


def ladder_page(folder: Path) -> Chapter:
    from tests.identification.twins import PENDULUM, noisy, rig, swing
    from upright.identification.ladder.growth import climb
    from upright.physics import Pendulum
    from upright.report.ladder import chapter, ladder_steps

    guesses = {"J_p": 1.5e-3, "b_2": 1e-3, "b_2c": 1e-3}
    truth = {"b_2q": 0.0, "b_2c": 4e-3}
    runs = [noisy(swing(PENDULUM | truth, angle=a, label=f"from {a:g}"), 3e-3, seed=k) for k, a in enumerate((1.5, 1))]
    known = {n: v for n, v in (PENDULUM | truth).items() if n not in guesses}
    ladder = climb(rig(Pendulum, known, guesses), runs)
    steps = ladder_steps(ladder, study="swing.toml", folder="out", data="", trimmed=True)
    return chapter(ladder, title="Ladder", provenance={"study": "swing.toml"}, steps=steps)


def short_ladder_page(folder: Path) -> Chapter:
    """Two rungs made by hand: the second was refused."""
    from upright.identification.ladder.growth import Ladder, RungResult
    from upright.identification.ladder.repeats import Repeats
    from upright.identification.ladder.rungs import Rung
    from upright.report.ladder import chapter

    fit = make_fit()
    scores = {"release": fit.runs["tail"]}
    common = {"cost": 0.0312, "parameters": 4, "per_run": 2, "values": {}, "seconds": 1.26}
    viscous = RungResult(rung=Rung(name="viscous", adds=("b_1",)), accepted=True, reason="It is the first.",
                   fitted={"release": {"psi": 96.0, "theta": 97.0}},
                   predicted={"release": {"psi": 95.0, "theta": 94.5}}, **common)  # fmt: skip
    dry = RungResult(rung=Rung(name="dry", adds=("b_1c",), drops=("b_1",)), accepted=False,
               reason="It predicts no better.",
               fitted={"release": {"psi": 97.0, "theta": 97.5}}, predicted={"release": {"psi": -3.0, "theta": 1.0}},
               **common)  # fmt: skip
    twice = Repeats(labels=("release", "tail"), percents={"theta": (97.0, 98.0)}, errors={"release": 0.0, "tail": 0.0})
    ladder = Ladder(steps=(viscous, dry), rig=fit.model, runs=(), held_out="half of the runs", repeats=(twice,),
                    stopped="No rung is left.", scores=scores, left_out=("b_1c",))  # fmt: skip
    return chapter(ladder, title="Ladder", provenance={"study": "swing.toml"})


OMEGA = np.array([2.0, 5.0, 9.0])
ANSWER = np.array([0.4 - 0.1j, -1.3 - 0.6j, -0.05 + 0.002j])


def measured_response_page(folder: Path) -> Chapter:
    """A response that was measured, of a rig that nobody named."""
    from upright.experiments.frequency_1b.chapter import log_chapter
    from upright.identification.frequency.response import FrequencyResponse

    response = FrequencyResponse(
        omega=OMEGA, response=ANSWER[:, None], outputs=("theta",), units=("rad", "V"),
        variance=np.full((3, 1), 1e-8), coherence=np.array([[0.999], [0.98], [0.97]]),
    )  # fmt: skip
    from upright.experiments.frequency_1b.run import LoggedResponse

    return log_chapter(LoggedResponse(sources=("sines.csv",), response=response, answer=None, folder=folder))


def run_page(folder: Path) -> Chapter:
    from tests.report.test_run import log
    from upright.logs.whole import RunEvent
    from upright.report.run import chapter

    return chapter(log(complaint="It ends at byte 5.", events=[RunEvent(t=10.5, kind="stop", text="asked", row=3)]))


def compare_page(folder: Path) -> Chapter:
    from tests.report.fit.test_compare import compared, told

    return told(compared())


class Rising:
    """Takes progress that never goes back and never says more than all; a fit's own starts may begin anew."""

    def __init__(self) -> None:
        self.share = 0.0

    def __call__(self, step: str, share: float) -> None:
        least = 0.0 if ": " in step else self.share - 1e-12
        assert least <= share <= 1.0, f"{step}: {share:.3g} after {self.share:.3g}"
        self.share = max(share, self.share)


def loadings_page(folder: Path) -> Chapter:
    from upright.experiments.stand.twin import TwinStand
    from upright.experiments.weighing_1a.chapter import chapter
    from upright.experiments.weighing_1a.run import run_weighing
    from upright.rig.makes import make_rig

    return chapter(run_weighing(TwinStand(rig=make_rig("rectilinear", 2)), 2, folder, Rising()))


def frequency_page(folder: Path) -> Chapter:
    from upright.experiments.frequency_1b.chapter import chapter
    from upright.experiments.frequency_1b.run import run_frequency

    return chapter(run_frequency("linear", 4, folder, Rising()))


def own_frequency_page(folder: Path) -> Chapter:
    from upright.experiments.frequency_1b.chapter import log_chapter
    from upright.experiments.frequency_1b.run import LogRequest, response_of_logs, run_frequency

    run_frequency("linear", 4, folder)
    request = LogRequest(signals={}, counts={}, known={})
    return log_chapter(response_of_logs([folder / "frequency.csv"], request, folder / "own"))


def regulation_page(folder: Path) -> Chapter:
    from upright.experiments.regulation_2.chapter import chapter
    from upright.experiments.regulation_2.run import RegulationRequest, identify_make, run_regulation
    from upright.experiments.stand.twin import TwinStand
    from upright.rig.completion import completed
    from upright.rig.makes import make_rig

    wish = RegulationRequest(draws=16, seconds=2.0)
    known = completed(identify_make("linear", 1, folder))
    stand = TwinStand(rig=make_rig("linear", 1))
    return chapter(run_regulation(known, stand, 1, folder, Rising(), request=wish))


def swing_up_page(folder: Path) -> Chapter:
    from upright.experiments.stand.twin import TwinStand
    from upright.experiments.swing_up_2b.chapter import chapter
    from upright.experiments.swing_up_2b.run import run_swing_up
    from upright.rig.makes import make_rig

    return chapter(run_swing_up(make_rig("furuta"), TwinStand(rig=make_rig("furuta", 3)), folder, Rising()))


def minute_page(folder: Path) -> Chapter:
    from upright.experiments.quick.chapter import chapter
    from upright.experiments.quick.run import run_quick
    from upright.experiments.stand.live import live_stand

    (folder / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\nseed = 3\n', encoding="utf-8")
    return chapter(run_quick(live_stand(folder / "RIG.toml"), folder / "out"))


def tracking_page(folder: Path) -> Chapter:
    from upright.experiments.tracking_3.chapter import chapter
    from upright.experiments.tracking_3.run import run_tracking

    return chapter(run_tracking("rectilinear", 1, folder, Rising()))


def free_swing_page(folder: Path) -> Chapter:
    from upright.experiments.free_swing_4.chapter import chapter
    from upright.experiments.free_swing_4.run import run_free_swing
    from upright.rig.makes import make_rig

    return chapter(run_free_swing(make_rig("furuta", 1), 1, folder, Rising()))


def blocks(chapter: Chapter, kind: type, *, aside: bool = True) -> list:
    return [b for part in chapter.parts if aside or not part.aside for b in part.content if isinstance(b, kind)]


def squeezed(text: str) -> str:
    """Text without blanks, ligatures and raised figures, which every medium sets in its own way."""
    return re.sub(r"\s", "", unicodedata.normalize("NFKC", text))
