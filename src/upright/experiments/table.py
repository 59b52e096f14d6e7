"""The experiments of the paper, each told once: what it needs of a rig, and how it is made on whichever test stand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from upright.errors import BadInput
from upright.experiments.hands_on.loaded import kind_of, run_loaded
from upright.experiments.stand.live import LiveStand
from upright.experiments.stand.protocol import TestStand
from upright.experiments.weighing_1a.run import Known
from upright.progress import Progress
from upright.quantities import with_unit
from upright.report.page import Chapter
from upright.report.symbols import typed
from upright.rig import Rig
from upright.rig.makes import MAKES, PENDULUMS, SHAFTS


@dataclass(frozen=True, kw_only=True)
class ExperimentInput:
    """What an experiment is given: test stand and folder, what finished ones it builds on said and where they wrote."""

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

    def estimate(self, key: str, body: str) -> dict[str, dict[str, Any]]:
        """What an earlier experiment says of a body's inertia, as a study has it."""
        chapter = self.earlier.get(key)
        told = chapter.numbers.get("parameters", {}).get(body) if chapter else None
        if not told or not told.get("stderr"):
            return {}
        unit = told["unit"]
        return {body: {"value": with_unit(told["value"], unit, 10), "uncertainty": with_unit(told["stderr"], unit, 4)}}


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """One experiment of the paper.

    Attributes
    ----------
    key : str
        As it is asked for and as its folder is named.
    part_of : str
        Asking for this brings it as well: ``1`` means 1a and 1b.
    title : str
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
    on: Callable[[LiveStand], bool]
    needs: tuple[str, ...]
    live_needs: tuple[str, ...]
    seconds: float
    tell: Callable[[ExperimentInput], tuple[Chapter, bool]]

    def make(self, asked: str) -> str:
        """Make that it is run on where one is asked for, or none."""
        return asked if asked in self.makes else self.makes[0]


def _weighing(at: ExperimentInput) -> tuple[Chapter, bool]:
    if isinstance(at.stand, LiveStand):
        from upright.experiments.hands_on.chapters import loaded_chapter

        return loaded_chapter(run_loaded(at.stand, at.folder, at.progress), at.folder), True
    from upright.experiments.weighing_1a.chapter import chapter
    from upright.experiments.weighing_1a.run import run_weighing

    return chapter(run_weighing(at.stand.rig, at.seed, at.folder, at.progress)), True


def _frequency(at: ExperimentInput) -> tuple[Chapter, bool]:
    if isinstance(at.stand, LiveStand):
        from upright.experiments.hands_on.chapters import hanging_chapter
        from upright.experiments.hands_on.hanging import run_hanging

        plant = at.stand.rig.plant
        weighed = at.estimate("1a", plant.names()[0]) if kind_of(plant) else {}
        hung = run_hanging(at.stand, at.folder, at.progress, weighed)
        return hanging_chapter(hung, at.folder, at.stand.truth), not hung.fit.interrupted
    from upright.experiments.frequency_1b.chapter import chapter
    from upright.experiments.frequency_1b.run import run_frequency

    done = run_frequency(at.stand.rig, at.seed, at.folder, at.progress, at.stopped, weighed=at.weighed)
    return chapter(done), True


def _identified(at: ExperimentInput, stand: TestStand) -> tuple[Rig, Rig]:
    """The rig as it was identified, as the fit has it and completed for a run."""
    from upright.rig.completion import completed
    from upright.study.stored_rig import read_stored_rig

    known = read_stored_rig(at.fit, seed=at.seed)
    return known, completed(known, vendor=stand.vendor, who="an experiment", form="")


def _regulation(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.regulation_2.chapter import chapter
    from upright.experiments.regulation_2.run import run_regulation

    stand = at.stand.described_by(at.fit, at.folder)
    _, model = _identified(at, stand)
    done = run_regulation(model, stand, at.seed, at.folder, at.progress, at.stopped, source=typed(at.fit))
    return chapter(done), not done.interrupted


def _swing_up(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.swing_up_2b.chapter import chapter
    from upright.experiments.swing_up_2b.run import known_of, run_swing_up

    stand = at.stand.described_by(at.fit, at.folder)
    known, model = _identified(at, stand)
    done = run_swing_up(
        model, stand, at.folder, at.progress, at.stopped, known=known_of(known), source=typed(at.fit)
    )  # fmt: skip
    return chapter(done), not at.stopped()


def _tracking(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.tracking_3.chapter import chapter
    from upright.experiments.tracking_3.run import follow, run_tracking

    if at.stand.simulated:
        done = run_tracking(at.stand.rig, at.seed, at.folder, at.progress, at.stopped, weighed=at.weighed)
    else:
        stand = at.stand.described_by(at.fit, at.folder)
        done = follow(stand.rig, stand, at.folder, None, None, at.progress, at.stopped)
    return chapter(done), not done.interrupted


def _free_swing(at: ExperimentInput) -> tuple[Chapter, bool]:
    if isinstance(at.stand, LiveStand):
        from upright.experiments.hands_on.chapters import fit_chapter
        from upright.experiments.hands_on.swings import carrier_of, run_swings

        study, fit = run_swings(at.stand, at.folder, at.progress, at.estimate("1b", carrier_of(at.stand)))
        return fit_chapter(study, fit, at.folder, at.stand.truth), not fit.interrupted
    from upright.experiments.free_swing_4.chapter import chapter
    from upright.experiments.free_swing_4.run import run_free_swing
    from upright.rig.makes import make_of
    from upright.study.results import write_fit

    rig = at.stand.rig
    weighed = next((k for k in at.weighed if k.name == make_of(rig.plant).body), None)
    done = run_free_swing(rig, at.seed, at.folder, at.progress, at.stopped, weighed=weighed)
    if "free_swing" in done.answers:
        first = done.answers["free_swing"]
        write_fit(first.fit, first.study, at.folder / "fit.json")
    return chapter(done), not done.interrupted


def _carries_pendulum(stand: LiveStand) -> bool:
    plant = stand.rig.plant
    return "inverted" in plant.equilibria and len(plant.coordinates) == 2


def _is_shaft(stand: LiveStand) -> bool:
    return any(isinstance(stand.rig.plant, type(MAKES[key].plant)) for key in SHAFTS)


EXPERIMENTS: tuple[Experiment, ...] = (
    Experiment(
        key="1a", part_of="1", title="Stiffness and inertia from added loads", makes=(*PENDULUMS, *SHAFTS),
        on=lambda stand: bool(kind_of(stand.rig.plant) and stand.file.added), needs=(), live_needs=(), seconds=1.5,
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
)  # fmt: skip
"""In the order in which they are run and told."""
