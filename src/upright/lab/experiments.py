"""Which experiments are there, on which rigs, and which stands on which?"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from upright.control.rig import Rig
from upright.errors import BadInput
from upright.lab.rigs.makes import Make
from upright.lab.weighing_1a.run import Known
from upright.progress import Progress
from upright.report.page import Chapter
from upright.report.symbols import typed


@dataclass(frozen=True, kw_only=True)
class Task:
    """What an experiment is given: rig and folder, what finished ones it builds on said and where they wrote."""

    make: Make
    rig: Rig
    seed: int
    folder: Path
    earlier: Mapping[str, Chapter]
    folders: Mapping[str, Path]
    progress: Progress
    stopped: Callable[[], bool]


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
    makes : tuple of Make
        Rigs it can be run on; the first is the paper's.
    needs : tuple of str
        Experiments whose numbers it takes, where the rig has them.
    seconds : float
        How long it takes about, for the progress bar.
    tell : callable
        Runs it; the chapter, and whether it is whole.
    """

    key: str
    part_of: str
    title: str
    makes: tuple[Make, ...]
    needs: tuple[str, ...]
    seconds: float
    tell: Callable[[Task], tuple[Chapter, bool]]


def _weigh(task: Task) -> tuple[Chapter, bool]:
    from upright.lab.weighing_1a import chapter as weighing_page
    from upright.lab.weighing_1a import run as weighing

    return weighing_page.chapter(weighing.run(task.rig, task.seed, task.folder, task.progress)), True


def _sweep(task: Task) -> tuple[Chapter, bool]:
    from upright.lab.frequency_1b import chapter as frequency_page
    from upright.lab.frequency_1b import run as frequency

    done = frequency.run(
        task.rig, task.seed, task.folder, task.progress, task.stopped, weighed=known_from(task.earlier.get("1a"))
    )
    return frequency_page.chapter(done), True


def _hold(task: Task) -> tuple[Chapter, bool]:
    from upright.lab.regulation_2 import chapter as regulation_page
    from upright.lab.regulation_2 import run as regulation
    from upright.lab.rigs.rig_file import read_rig_file

    fit = _fitted(task)
    found = read_rig_file(fit, seed=task.seed)
    done = regulation.run(found, task.rig, task.seed, task.folder, task.progress, task.stopped, source=typed(fit))
    return regulation_page.chapter(done), not done.interrupted


def _swing_up(task: Task) -> tuple[Chapter, bool]:
    from upright.lab.rigs.believed import believed
    from upright.lab.rigs.rig_file import read_rig_file
    from upright.lab.swing_up_2b import chapter as swing_up_page
    from upright.lab.swing_up_2b import run as swing_up

    fit = _fitted(task)
    found = read_rig_file(fit, seed=task.seed)
    done = swing_up.run(
        believed(found), task.rig, task.seed, task.folder, task.progress, task.stopped, known=swing_up.known_of(found),
        source=typed(fit),
    )  # fmt: skip
    return swing_up_page.chapter(done), not task.stopped()


def _track(task: Task) -> tuple[Chapter, bool]:
    from upright.lab.tracking_3 import chapter as tracking_page
    from upright.lab.tracking_3 import run as tracking

    done = tracking.run(
        task.rig, task.seed, task.folder, task.progress, task.stopped, weighed=known_from(task.earlier.get("1a"))
    )
    return tracking_page.chapter(done), not done.interrupted


def _swing(task: Task) -> tuple[Chapter, bool]:
    from upright.lab.free_swing_4 import chapter as release_page
    from upright.lab.free_swing_4 import run as release
    from upright.study.fit_file import write_fit

    known = {k.name: k for k in known_from(task.earlier.get("1a"))}
    done = release.run(
        task.rig, task.seed, task.folder, task.progress, task.stopped, weighed=known.get("J_d") or known.get("m_c")
    )
    if "free_swing" in done.answers:
        first = done.answers["free_swing"]
        write_fit(first.fit, first.study, task.folder / "fit.json")
    return release_page.chapter(done), not done.interrupted


def _fitted(task: Task) -> Path:
    if "1b" not in task.earlier:
        raise BadInput("It stands on the fit of experiment 1b, which could not be finished; its chapter says why.")
    return task.folders["1b"] / "fit.json"


def known_from(chapter: Chapter | None) -> tuple[Known, ...]:
    """What experiment 1a hands on, as its chapter tells it."""
    handed = chapter.numbers.get("handed_on", {}) if chapter else {}
    return tuple(Known(name=name, value=w["value"], stderr=w["stderr"]) for name, w in handed.items())


PENDULUMS: tuple[Make, ...] = ("furuta", "linear")
SHAFTS: tuple[Make, ...] = ("rectilinear", "torsional")
EXPERIMENTS: tuple[Experiment, ...] = (
    Experiment(
        key="1a", part_of="1", title="Stiffness and inertia from added loads", makes=(*PENDULUMS, *SHAFTS), needs=(),
        seconds=1.5, tell=_weigh,
    ),
    Experiment(
        key="1b", part_of="1", title="Frequency response", makes=(*PENDULUMS, *SHAFTS), needs=("1a",),
        seconds=5.0, tell=_sweep,
    ),
    Experiment(
        key="2", part_of="2", title="Holding it upright", makes=PENDULUMS, needs=("1b",), seconds=4.0, tell=_hold,
    ),
    Experiment(
        key="2b", part_of="2", title="Swinging up and catching", makes=PENDULUMS, needs=("1b",), seconds=3.0,
        tell=_swing_up,
    ),
    Experiment(
        key="3", part_of="3", title="Tracking through a flexible shaft", makes=SHAFTS, needs=("1a",), seconds=5.0,
        tell=_track,
    ),
    Experiment(
        key="4", part_of="4", title="Large free swing", makes=PENDULUMS, needs=("1a",), seconds=9.0, tell=_swing,
    ),
)  # fmt: skip
"""In the order in which they are run and told."""
