"""What an experiment is: what it needs of a rig, what it is given, and how any test stand runs it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from upright.declared import Declaration
from upright.errors import BadInput
from upright.experiments.stand.known import Known
from upright.experiments.stand.stand import TestStand
from upright.progress import Progress
from upright.report.page import Chapter
from upright.rig import Rig
from upright.rig.completion import completed
from upright.study.stored_rig import read_stored_rig


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

    @property
    def described(self) -> TestStand:
        """The stand, as that fit describes the rig to whoever watches its runs."""
        return self.stand.described_by(self.fit, self.folder)

    def identified(self, stand: TestStand) -> tuple[Rig, Rig]:
        """The rig of that fit, as it was identified and completed for a run; called as its owner calls it."""
        known = read_stored_rig(self.fit, seed=self.seed)
        model = completed(known, vendor=stand.vendor, who="an experiment", options=False)
        return known, model.replace(name=stand.rig.name)

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
class Experiment(Declaration):
    """One experiment: its `name` is that on the command line and of its folder, its `order` when it is run.

    Attributes
    ----------
    part_of : str, optional
        Asking for this brings it as well: ``1`` means 1a and 1b.
    makes : tuple of str
        Rig models on whose twins it can be made, the paper's first; empty of what only a live rig can have.
    on : callable
        Whether it can be made on a live rig.
    needs, live_needs : tuple of str
        Experiments whose numbers it takes, where the rig has them; likewise on a live rig.
    alone : bool
        Whether it is made only where it is named: no part of the whole.
    seconds : float
        How long it takes about, for the progress bar.
    tell : callable
        Runs it; the chapter, and whether it is whole.
    """

    title: str
    makes: tuple[str, ...]
    on: Callable[[TestStand], bool]
    tell: Callable[[ExperimentInput], tuple[Chapter, bool]]
    part_of: str | None = None
    needs: tuple[str, ...] = ()
    live_needs: tuple[str, ...] = ()
    alone: bool = False
    seconds: float = 5.0

    def make(self, requested: str) -> str:
        """Rig model that it is run on where one is requested, or none."""
        return requested if requested in self.makes else self.makes[0]


def carries_pendulum(stand: TestStand) -> bool:
    """Whether the rig is one driven body with a pendulum on it."""
    plant = stand.rig.plant
    return "inverted" in plant.equilibria and len(plant.coordinates) == 2
