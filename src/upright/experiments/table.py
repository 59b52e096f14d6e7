"""The experiments of the paper, each declared once: what it needs of a rig, and how any test stand runs it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from upright.errors import BadInput
from upright.experiments.stand.known import Known
from upright.experiments.stand.live import LiveStand
from upright.experiments.stand.stand import TestStand
from upright.experiments.weighing_1a.run import kind_of, run_weighing
from upright.progress import Progress
from upright.report.page import Chapter
from upright.report.symbols import typed
from upright.rig import Rig
from upright.rig.makes import MAKES, PENDULUMS, SHAFTS

QUICK = "quick"
"""Key of the one experiment that is made by itself, and only when it is asked for."""


@dataclass(frozen=True, kw_only=True)
class ExperimentInput:
    """What an experiment is given: test stand and folder, results and folders of those it builds on."""

    stand: TestStand
    seed: int
    folder: Path
    earlier: Mapping[str, Chapter]
    folders: Mapping[str, Path]
    progress: Progress
    stopped: Callable[[], bool]

    @property
    def weighed(self) -> tuple[Known, ...]:
        """What experiment 1a hands on, as its chapter tells it."""
        chapter = self.earlier.get("1a")
        handed = chapter.numbers.get("handed_on", {}) if chapter else {}
        return tuple(Known(name=name, value=w["value"], stderr=w["stderr"]) for name, w in handed.items())

    @property
    def fit(self) -> Path:
        """The fit that describes the rig, or that of experiment 1b."""
        if self.stand.fit is not None:
            return self.stand.fit
        if "1b" not in self.earlier:
            raise BadInput("It stands on the fit of experiment 1b, which could not be finished; its chapter says why.")
        return self.folders["1b"] / "fit.json"

    def estimated(self, key: str, name: str) -> tuple[Known, ...]:
        """What the fit of an earlier experiment says of a parameter, if anything."""
        chapter = self.earlier.get(key)
        estimate = chapter.numbers.get("parameters", {}).get(name) if chapter else None
        return (
            (Known(name=name, value=estimate["value"], stderr=estimate["stderr"]),)
            if estimate and estimate.get("stderr")
            else ()
        )


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """One experiment of the paper.

    Attributes
    ----------
    key : str
        Its name on the command line and of its folder.
    part_of : str
        Asking for this brings it as well: ``1`` means 1a and 1b.
    makes : tuple of str
        Makes on whose twins it can be made; the first is the paper's.
    on : callable
        Whether it can be made on a live rig.
    needs, live_needs : tuple of str
        Experiments whose numbers it takes, where the rig has them; likewise on a live rig.
    seconds : float
        How long it takes about, for the progress bar.
    tell : callable
        Runs it; the chapter, and whether it is whole.
    """

    key: str
    part_of: str
    title: str
    makes: tuple[str, ...]
    on: Callable[[TestStand], bool]
    needs: tuple[str, ...]
    live_needs: tuple[str, ...]
    seconds: float
    tell: Callable[[ExperimentInput], tuple[Chapter, bool]]

    def make(self, requested: str) -> str:
        """Rig model that it is run on where one is requested, or none."""
        return requested if requested in self.makes or not self.makes else self.makes[0]


def _weighing(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.weighing_1a.chapter import chapter

    return chapter(run_weighing(at.stand, at.seed, at.folder, at.progress)), True


def _frequency(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.frequency_1b.at_once import run_at_once
    from upright.experiments.frequency_1b.chapter import at_once_chapter, chapter
    from upright.experiments.frequency_1b.run import run_frequency

    if at.stand.simulated:  # where nobody waits for sines, one after the other
        result = run_frequency(at.stand.rig, at.seed, at.folder, at.progress, at.stopped, weighed=at.weighed)
        return chapter(result), True
    measured = run_at_once(at.stand, at.folder, at.progress, at.weighed)
    return at_once_chapter(measured, at.folder, at.stand.truth), not measured.fit.interrupted


def _identified(at: ExperimentInput, stand: TestStand) -> tuple[Rig, Rig]:
    """The rig as it was identified, as the fit has it and completed for a run; a live one called as its owner does."""
    from upright.rig.completion import completed
    from upright.study.stored_rig import read_stored_rig

    known = read_stored_rig(at.fit, seed=at.seed)
    model = completed(known, vendor=stand.vendor, who="an experiment", form="")
    return known, model if stand.simulated else model.replace(name=stand.rig.name)


def _regulation(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.regulation_2.chapter import chapter
    from upright.experiments.regulation_2.run import run_regulation

    stand = at.stand.described_by(at.fit, at.folder)
    _, model = _identified(at, stand)
    result = run_regulation(model, stand, at.seed, at.folder, at.progress, at.stopped, source=typed(at.fit))
    return chapter(result), not result.interrupted


def _swing_up(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.swing_up_2b.chapter import chapter
    from upright.experiments.swing_up_2b.run import known_of, run_swing_up
    from upright.files import write_json

    stand = at.stand.described_by(at.fit, at.folder)
    known, model = _identified(at, stand)
    result = run_swing_up(
        model, stand, at.folder, at.progress, at.stopped, known=known_of(known), source=typed(at.fit)
    )  # fmt: skip
    page = chapter(result, typed(at.folder))
    write_json(at.folder / "swing_up.json", page.numbers)
    return page, not at.stopped()


def _tracking(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.tracking_3.chapter import chapter
    from upright.experiments.tracking_3.run import run_tracking, track_on

    if at.stand.simulated:
        result = run_tracking(at.stand.rig, at.seed, at.folder, at.progress, at.stopped, weighed=at.weighed)
    else:
        stand = at.stand.described_by(at.fit, at.folder)
        result = track_on(stand.rig, stand, at.folder, None, None, at.progress, at.stopped)
    return chapter(result), not result.interrupted


def _free_swing(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.free_swing_4.by_hand import carrier_of, run_by_hand
    from upright.experiments.free_swing_4.chapter import chapter
    from upright.experiments.free_swing_4.run import run_free_swing
    from upright.experiments.stand.fits import fit_chapter
    from upright.study.results import write_fit

    body = carrier_of(at.stand)
    if not at.stand.simulated:
        study, fit = run_by_hand(at.stand, at.folder, at.progress, at.estimated("1b", body))
        return fit_chapter(study, fit, at.folder, at.stand.truth), not fit.interrupted
    weighed = next((k for k in at.weighed if k.name == body), None)
    result = run_free_swing(at.stand.rig, at.seed, at.folder, at.progress, at.stopped, weighed=weighed)
    if "free_swing" in result.answers:
        first = result.answers["free_swing"]
        write_fit(first.fit, first.study, at.folder / "fit.json")
    return chapter(result), not result.interrupted


def _quick(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.quick.chapter import chapter
    from upright.experiments.quick.run import run_quick

    assert isinstance(at.stand, LiveStand)  # as `on` has seen to
    return chapter(run_quick(at.stand, at.folder, at.seed, at.progress, at.stopped)), True


def _carries_pendulum(stand: TestStand) -> bool:
    plant = stand.rig.plant
    return "inverted" in plant.equilibria and len(plant.coordinates) == 2


def _is_shaft(stand: TestStand) -> bool:
    return any(isinstance(stand.rig.plant, type(MAKES[key].rig.plant)) for key in SHAFTS)


EXPERIMENTS: tuple[Experiment, ...] = (
    Experiment(
        key="1a", part_of="1", title="Stiffness and inertia from added loads", makes=(*PENDULUMS, *SHAFTS),
        on=lambda stand: bool(kind_of(stand.rig.plant) and stand.added), needs=(), live_needs=(), seconds=1.5,
        tell=_weighing,
    ),
    Experiment(
        key="1b", part_of="1", title="Frequency response", makes=(*PENDULUMS, *SHAFTS),
        on=lambda stand: stand.fit is None, needs=("1a",), live_needs=("1a",), seconds=5.0, tell=_frequency,
    ),
    Experiment(
        key="2", part_of="2", title="Holding it upright", makes=PENDULUMS, on=_carries_pendulum, needs=("1b",),
        live_needs=("1b",), seconds=4.0, tell=_regulation,
    ),
    Experiment(
        key="2b", part_of="2", title="Swinging up and catching", makes=PENDULUMS, on=_carries_pendulum, needs=("1b",),
        live_needs=("1b",), seconds=3.0, tell=_swing_up,
    ),
    Experiment(
        key="3", part_of="3", title="Tracking through a flexible shaft", makes=SHAFTS, on=_is_shaft, needs=("1a",),
        live_needs=("1b",), seconds=5.0, tell=_tracking,
    ),
    Experiment(
        key="4", part_of="4", title="Large free swing", makes=PENDULUMS,
        on=lambda stand: _carries_pendulum(stand) and stand.fit is None, needs=("1a",), live_needs=("1b",),
        seconds=9.0, tell=_free_swing,
    ),
    Experiment(
        key=QUICK, part_of=QUICK, title="A rig in a minute", makes=(),
        on=lambda stand: isinstance(stand, LiveStand) and _carries_pendulum(stand) and stand.fit is None, needs=(),
        live_needs=(), seconds=6.0, tell=_quick,
    ),
)  # fmt: skip
"""In the order in which they are run and reported."""
