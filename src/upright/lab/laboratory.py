"""How are all experiments run under one roof, and taken up again where they were left?"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from upright.errors import BadInput, UprightError
from upright.lab.experiments import EXPERIMENTS, Experiment, Task
from upright.lab.kept import keep, kept, made_of
from upright.lab.rigs.makes import Make, make_rig
from upright.progress import Progress
from upright.report.page import Chapter


@dataclass(frozen=True, kw_only=True)
class Told:
    """An experiment with its chapter.

    Attributes
    ----------
    experiment : Experiment
    make, rig : str
        Kind of rig, and its name.
    chapter : Chapter
    state : str
        ``"done"``, ``"kept"`` from an earlier run, ``"stopped"`` half-way, or ``"failed"``.
    seconds : float
    """

    experiment: Experiment
    make: str
    rig: str
    chapter: Chapter
    state: str
    seconds: float


@dataclass(kw_only=True, eq=False)
class Session:
    """What has been told so far; it is filled experiment by experiment, so that an interrupted one can be reported."""

    make: str
    seed: int
    folder: Path
    asked: tuple[Experiment, ...]
    told: list[Told] = field(default_factory=list[Told])
    interrupted: bool = False
    seconds: float = 0.0

    @property
    def missing(self) -> tuple[Experiment, ...]:
        """What was asked for and not begun."""
        return tuple(e for e in self.asked if e.key not in {t.experiment.key for t in self.told})


def choose(asked: Sequence[str], make: str) -> tuple[Experiment, ...]:
    """The experiments asked for, with those whose numbers they take; all that the rig has when none is named.

    Raises
    ------
    BadInput
        When there is no such experiment, or not on this rig.
    """
    there = _there(make)
    wanted: set[str] = set()
    for name in asked:
        found = [e for e in EXPERIMENTS if name in (e.key, e.part_of)]
        if not found:
            valid = dict.fromkeys(n for e in EXPERIMENTS for n in (e.part_of, e.key))
            raise BadInput(f"there is no experiment '{name}'; take one of {', '.join(sorted(valid))}.")
        if not any(e in there for e in found):
            raise BadInput(
                f"experiment {name} is for --rig {' or '.join(found[0].makes)}; "
                f"{make} has experiments {', '.join(e.key for e in there)}."
            )
        wanted |= {e.key for e in found if e in there}
    if not asked:
        wanted = {e.key for e in there}
    for e in reversed(there):  # who builds on another comes after it
        if e.key in wanted:
            wanted |= set(_needs(e, make))
    return tuple(e for e in there if e.key in wanted)


def _there(make: str) -> list[Experiment]:
    """Experiments that a rig can have; all for the paper's."""
    return [e for e in EXPERIMENTS if not make or make in e.makes]


def _needs(e: Experiment, make: str) -> list[str]:
    """What it takes numbers from: earlier experiments on the same rig."""
    return [n.key for n in _there(make) if n.key in e.needs and _make(n, make) == _make(e, make)]


def _make(e: Experiment, make: str) -> Make:
    of: dict[str, Make] = {m: m for m in e.makes}
    return of.get(make, e.makes[0])


def run(
    asked: Sequence[str],
    make: str,
    seed: int,
    folder: Path,
    progress: Progress | None = None,
    stopped: Callable[[], bool] = lambda: False,
    *,
    fresh: bool = False,
) -> Session:
    """Run experiments on a seeded rig; Ctrl-C stops and keeps what is there.

    Parameters
    ----------
    asked : sequence of str
        Experiments by name, all when empty.
    make : str
        Kind of rig; empty for the one on which the paper did each.
    seed : int
        Which rig of the make.
    folder : Path
        Takes a folder for each experiment. What is there and still holds is not made again.
    progress : callable, optional
        Told the step at work and the share of the whole.
    stopped : callable, optional
        Whether Ctrl-C was pressed, for what has swallowed it.
    fresh : bool
        Make everything again.

    Raises
    ------
    BadInput
        When there is no such experiment, or not on this rig.
    """  # fmt: skip
    began = time.perf_counter()
    session = Session(make=make, seed=seed, folder=folder, asked=choose(asked, make))
    digests = _digests(make, seed)
    whole = sum(e.seconds for e in session.asked)
    behind = 0.0
    for e in session.asked:

        def tell(step: str, share: float, e: Experiment = e, behind: float = behind) -> None:
            if progress:
                progress(f"experiment {e.key}: {step}", (behind + e.seconds * min(share, 1.0)) / whole)

        try:
            session.told.append(_one(session, e, digests[e.key], tell, stopped, fresh))
            session.interrupted = session.told[-1].state == "stopped"
        except KeyboardInterrupt:
            session.interrupted = True
        if session.interrupted:
            break
        behind += e.seconds
    session.told = _with_kept(session, digests)
    session.seconds = time.perf_counter() - began
    return session


def _digests(make: str, seed: int) -> dict[str, str]:
    """What each experiment that this rig can have is made of."""
    digests: dict[str, str] = {}
    for e in _there(make):
        digests[e.key] = made_of(e.key, _make(e, make), seed, needs=[digests[n] for n in _needs(e, make)])
    return digests


def _with_kept(session: Session, digests: Mapping[str, str]) -> list[Told]:
    """What was told, and what else is there from an earlier run on the same rig."""
    told = {t.experiment.key: t for t in session.told}
    for e in _there(session.make):
        found = None if e.key in told else kept(session.folder / e.key, digests[e.key])
        if found:
            make = _make(e, session.make)
            name = make_rig(make, session.seed).name
            told[e.key] = Told(experiment=e, make=make, rig=name, chapter=found, state="kept", seconds=0.0)
    return [told[e.key] for e in _there(session.make) if e.key in told]


def _one(
    session: Session, e: Experiment, digest: str, progress: Progress, stopped: Callable[[], bool], fresh: bool
) -> Told:
    """One experiment, from an earlier run where that still holds."""
    began = time.perf_counter()
    make, needs = _make(e, session.make), _needs(e, session.make)
    rig, folder = make_rig(make, session.seed), session.folder / e.key
    folder.mkdir(parents=True, exist_ok=True)
    progress("starting", 0.0)
    state, chapter = "kept", None if fresh else kept(folder, digest)
    if chapter is None:
        task = Task(
            make=make, rig=rig, seed=session.seed, folder=folder, progress=progress, stopped=stopped,
            earlier={
                t.experiment.key: t.chapter
                for t in session.told
                if t.experiment.key in needs and t.state in ("done", "kept")
            },
            folders={n: session.folder / n for n in needs},
        )  # fmt: skip
        try:
            chapter, whole = e.tell(task)
            chapter = replace(chapter, key=e.key, title=e.title)
            state = "done" if whole and not stopped() else "stopped"
        except UprightError as error:
            state, chapter = "failed", _failed(e, str(error))
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            state, chapter = "failed", _failed(e, f"Its numbers broke down ({error}), which is a fault of the program.")
        if state == "done":
            keep(folder, digest, chapter)
    return Told(
        experiment=e, make=make, rig=rig.name, chapter=chapter, state=state, seconds=time.perf_counter() - began
    )


def _failed(e: Experiment, why: str) -> Chapter:
    return Chapter(key=e.key, title=e.title, verdict="This experiment could not be finished.", detail=why, sound=False)
