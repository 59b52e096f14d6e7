"""The laboratory: the experiments of the paper, run under one roof and taken up again where they were left."""

from __future__ import annotations

import json
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from upright._version import __version__
from upright.errors import BadInput, UprightError
from upright.experiments.abreast import run_abreast
from upright.experiments.hands_on.rig import RigAtHand
from upright.experiments.weighing_1a.run import Known
from upright.experiments.worn import worn as worn_twin
from upright.files import read_text, write_json
from upright.progress import Progress, silent
from upright.report.page import Book, Chapter, Step, as_plain, from_plain
from upright.report.symbols import typed
from upright.rig import Rig
from upright.rig.makes import MAKES, PENDULUMS, SHAFTS, make_rig
from upright.workers import HERE, Workers

CHAPTER_FILE = "chapter.json"
"""File of a finished experiment, taken up again as long as nothing it stands on has changed."""


@dataclass(frozen=True, kw_only=True)
class ExperimentInput:
    """What an experiment is given: rig and folder, what finished ones it builds on said and where they wrote.

    `hands` is the rig itself where one is at hand, of which `rig` is the description.
    """

    make: str
    rig: Rig
    seed: int
    folder: Path
    earlier: Mapping[str, Chapter]
    folders: Mapping[str, Path]
    progress: Progress
    stopped: Callable[[], bool]
    hands: RigAtHand | None = None

    @property
    def weighed(self) -> tuple[Known, ...]:
        """What experiment 1a hands on, as its chapter tells it."""
        chapter = self.earlier.get("1a")
        handed = chapter.numbers.get("handed_on", {}) if chapter else {}
        return tuple(Known(name=name, value=w["value"], stderr=w["stderr"]) for name, w in handed.items())

    @property
    def fit(self) -> Path:
        """The fit of experiment 1b."""
        if "1b" not in self.earlier:
            raise BadInput("It stands on the fit of experiment 1b, which could not be finished; its chapter says why.")
        return self.folders["1b"] / "fit.json"


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
    makes: tuple[str, ...]
    needs: tuple[str, ...]
    seconds: float
    tell: Callable[[ExperimentInput], tuple[Chapter, bool]]

    def make(self, asked: str) -> str:
        """Make that it is run on where one is asked for, or none."""
        return asked if asked in self.makes else self.makes[0]


def _weighing(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.weighing_1a.chapter import chapter
    from upright.experiments.weighing_1a.run import run_weighing

    return chapter(run_weighing(at.rig, at.seed, at.folder, at.progress)), True


def _frequency(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.frequency_1b.chapter import chapter
    from upright.experiments.frequency_1b.run import run_frequency

    done = run_frequency(at.rig, at.seed, at.folder, at.progress, at.stopped, weighed=at.weighed)
    return chapter(done), True


def _regulation(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.regulation_2.chapter import chapter
    from upright.experiments.regulation_2.run import run_regulation
    from upright.rig.completion import completed
    from upright.study.stored_rig import read_stored_rig

    known = completed(read_stored_rig(at.fit, seed=at.seed), who="regulate")
    done = run_regulation(known, at.rig, at.seed, at.folder, at.progress, at.stopped, source=typed(at.fit))
    return chapter(done), not done.interrupted


def _swing_up(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.swing_up_2b.chapter import chapter
    from upright.experiments.swing_up_2b.run import known_of, run_swing_up
    from upright.rig.completion import completed
    from upright.study.stored_rig import read_stored_rig

    known = read_stored_rig(at.fit, seed=at.seed)
    done = run_swing_up(
        completed(known), at.rig, at.folder, at.progress, at.stopped, known=known_of(known), source=typed(at.fit)
    )
    return chapter(done), not at.stopped()


def _tracking(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.tracking_3.chapter import chapter
    from upright.experiments.tracking_3.run import run_tracking

    done = run_tracking(at.rig, at.seed, at.folder, at.progress, at.stopped, weighed=at.weighed)
    return chapter(done), not done.interrupted


def _free_swing(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.free_swing_4.chapter import chapter
    from upright.experiments.free_swing_4.run import run_free_swing
    from upright.study.results import write_fit

    weighed = next((k for k in at.weighed if k.name == MAKES[at.make].body), None)
    done = run_free_swing(at.rig, at.seed, at.folder, at.progress, at.stopped, weighed=weighed)
    if "free_swing" in done.answers:
        first = done.answers["free_swing"]
        write_fit(first.fit, first.study, at.folder / "fit.json")
    return chapter(done), not done.interrupted


EXPERIMENTS: tuple[Experiment, ...] = (
    Experiment(
        key="1a", part_of="1", title="Stiffness and inertia from added loads", makes=(*PENDULUMS, *SHAFTS), needs=(),
        seconds=1.5, tell=_weighing,
    ),
    Experiment(
        key="1b", part_of="1", title="Frequency response", makes=(*PENDULUMS, *SHAFTS), needs=("1a",),
        seconds=5.0, tell=_frequency,
    ),
    Experiment(
        key="2", part_of="2", title="Holding it upright", makes=PENDULUMS, needs=("1b",), seconds=4.0, tell=_regulation,
    ),
    Experiment(
        key="2b", part_of="2", title="Swinging up and catching", makes=PENDULUMS, needs=("1b",), seconds=3.0,
        tell=_swing_up,
    ),
    Experiment(
        key="3", part_of="3", title="Tracking through a flexible shaft", makes=SHAFTS, needs=("1a",), seconds=5.0,
        tell=_tracking,
    ),
    Experiment(
        key="4", part_of="4", title="Large free swing", makes=PENDULUMS, needs=("1a",), seconds=9.0, tell=_free_swing,
    ),
)  # fmt: skip
"""In the order in which they are run and told."""


@dataclass(frozen=True, kw_only=True)
class ExperimentResult:
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
    table: tuple[Experiment, ...]
    worn: bool = False
    hands: RigAtHand | None = None
    results: list[ExperimentResult] = field(default_factory=list[ExperimentResult])
    interrupted: bool = False
    seconds: float = 0.0

    def rig(self, make: str) -> Rig:
        """The twin that is run on, or what is known of the rig at hand."""
        if self.hands is not None:
            return self.hands.model
        rig = make_rig(make, self.seed)
        return worn_twin(rig, self.seed) if self.worn else rig

    @property
    def missing(self) -> tuple[Experiment, ...]:
        """What was asked for and not begun."""
        return tuple(e for e in self.asked if e.key not in {t.experiment.key for t in self.results})


def choose(
    asked: Sequence[str], make: str, table: tuple[Experiment, ...] | None = None
) -> tuple[Experiment, ...]:  # fmt: skip
    """The experiments asked for, with those whose numbers they take; all that the rig has when none is named.

    Raises
    ------
    BadInput
        When there is no such experiment, or not on this rig.
    """
    table = EXPERIMENTS if table is None else table
    there = _there(make, table)
    wanted: set[str] = set()
    for name in asked:
        found = [e for e in table if name in (e.key, e.part_of)]
        if not found:
            valid = dict.fromkeys(n for e in table for n in (e.part_of, e.key))
            if any(name in (e.key, e.part_of) for e in EXPERIMENTS):
                raise BadInput(
                    f"experiment {name} cannot be made on {make}, which has experiments "
                    f"{', '.join(e.key for e in there)}; docs/lab.md says what each asks of a rig."
                )
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
            wanted |= set(_needs(e, make, table))
    return tuple(e for e in there if e.key in wanted)


def _there(make: str, table: tuple[Experiment, ...]) -> list[Experiment]:
    """Experiments that a rig can have; all for the paper's."""
    return [e for e in table if not make or make in e.makes]


def _needs(e: Experiment, make: str, table: tuple[Experiment, ...]) -> list[str]:
    """What it takes numbers from: earlier experiments on the same rig."""
    return [n.key for n in _there(make, table) if n.key in e.needs and n.make(make) == e.make(make)]


def run_laboratory(
    asked: Sequence[str],
    make: str,
    seed: int,
    folder: Path,
    progress: Progress = silent,
    stopped: Callable[[], bool] = lambda: False,
    *,
    fresh: bool = False,
    workers: Workers = HERE,
    worn: bool = False,
    table: tuple[Experiment, ...] | None = None,
    hands: RigAtHand | None = None,
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
    workers : Workers, optional
        Who runs experiments that need nothing of each other; processes of this machine, since they share the folder.
    worn : bool
        Take twins with physics that models leave out; see `upright.experiments.worn`.
    table : tuple of Experiment, optional
        What can be run; `EXPERIMENTS` when omitted.
    hands : RigAtHand, optional
        The rig itself, where one is at hand; `make` is then what it is asked for by.

    Raises
    ------
    BadInput
        When there is no such experiment, or not on this rig.
    """
    began = time.perf_counter()
    table = EXPERIMENTS if table is None else table
    session = Session(make=make, seed=seed, folder=folder, asked=choose(asked, make, table), worn=worn, table=table,
                      hands=hands)  # fmt: skip
    digests = _digests(session)
    whole = sum(e.seconds for e in session.asked)
    behind = 0.0
    if not workers.alone:
        _run_abreast(session, digests, workers, progress, stopped, fresh)
    for e in session.asked if workers.alone else ():

        def tell(step: str, share: float, e: Experiment = e, behind: float = behind) -> None:
            progress(f"experiment {e.key}: {step}", (behind + e.seconds * min(share, 1.0)) / whole)

        try:
            session.results.append(_one(session, e, digests[e.key], tell, stopped, fresh))
            session.interrupted = session.results[-1].state == "stopped"
        except KeyboardInterrupt:
            session.interrupted = True
        if session.interrupted:
            break
        behind += e.seconds
    session.results = _with_kept(session, digests)
    session.seconds = time.perf_counter() - began
    return session


def _run_abreast(
    session: Session, digests: Mapping[str, str], workers: Workers, progress: Progress, stopped: Callable[[], bool],
    fresh: bool,
) -> None:  # fmt: skip
    asked = {e.key: e for e in session.asked}
    needs = {key: _needs(e, session.make, session.table) for key, e in asked.items()}
    run = partial(_apart, replace(session, asked=()), digests, stopped, fresh)
    found, interrupted = run_abreast({k: e.seconds for k, e in asked.items()}, needs, run, workers, progress)
    session.results += [_brought(key, told) for key, told in found.items()]
    session.interrupted = interrupted or any(t.state == "stopped" for t in session.results)


def _apart(
    session: Session, digests: Mapping[str, str], stopped: Callable[[], bool], fresh: bool, key: str,
    earlier: Mapping[str, Mapping[str, Any]], progress: Progress,
) -> dict[str, Any]:  # fmt: skip
    """One experiment in another process: an `ExperimentResult` as plain values, its pictures drawn."""
    results = [_brought(k, told) for k, told in earlier.items()]
    e = next(e for e in EXPERIMENTS if e.key == key)
    done = _one(replace(session, results=results), e, digests[key], progress, stopped, fresh)
    return {**vars(done), "experiment": key, "chapter": as_plain(done.chapter)}


def _brought(key: str, told: Mapping[str, Any]) -> ExperimentResult:
    """The result that came from there."""
    e = next(e for e in EXPERIMENTS if e.key == key)
    values: dict[str, Any] = {**told, "experiment": e, "chapter": from_plain(told["chapter"])}
    return ExperimentResult(**values)


def _digests(session: Session) -> dict[str, str]:
    """Digest of what each experiment is made of: the program, its rig and seed, the experiments it builds on.

    What was measured on a rig outlasts another version of the program.
    """
    digests: dict[str, str] = {}
    for e in _there(session.make, session.table):
        parts = (
            _program() if session.hands is None else session.hands.text,
            e.key,
            e.make(session.make),
            str(session.seed),
            "worn" if session.worn else "",
            *(digests[n] for n in _needs(e, session.make, session.table)),
        )
        digests[e.key] = sha256("\n".join(parts).encode()).hexdigest()
    return digests


def _with_measured(session: Session, e: Experiment, digest: str) -> str:
    """The digest with the fits that it takes numbers from: a rig that is measured again answers otherwise."""
    if session.hands is None:
        return digest
    fits = [session.folder / n / "fit.json" for n in _needs(e, session.make, session.table)]
    return sha256(b"".join([digest.encode(), *(f.read_bytes() for f in fits if f.exists())])).hexdigest()


@cache
def _program() -> str:
    """Digest of the program as it stands: another version, or a changed line, is another experiment."""
    source = Path(__file__).parent.parent
    digest = sha256()
    for path in sorted(source.rglob("*.py")):
        digest.update(path.relative_to(source).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _kept(folder: Path, digest: str) -> Chapter | None:
    """The chapter of an earlier run, or nothing when there is none or it was made of something else."""
    try:
        content: Any = json.loads(read_text(folder / CHAPTER_FILE))
        return from_plain(content["chapter"]) if content["made_of"] == digest else None
    except (OSError, ValueError, KeyError, TypeError):  # none, torn, or another program's: it is made again
        return None


def _with_kept(session: Session, digests: Mapping[str, str]) -> list[ExperimentResult]:
    """What was told, and what else is there from an earlier run on the same rig."""
    told = {t.experiment.key: t for t in session.results}
    for e in _there(session.make, session.table):
        found = None if e.key in told else _kept(session.folder / e.key, _with_measured(session, e, digests[e.key]))
        if found:
            make = e.make(session.make)
            name = session.rig(make).name
            told[e.key] = ExperimentResult(experiment=e, make=make, rig=name, chapter=found, state="kept", seconds=0.0)
    return [told[e.key] for e in _there(session.make, session.table) if e.key in told]


def _one(
    session: Session, e: Experiment, digest: str, progress: Progress, stopped: Callable[[], bool], fresh: bool
) -> ExperimentResult:
    """One experiment, from an earlier run where that still holds."""
    began = time.perf_counter()
    make, needs = e.make(session.make), _needs(e, session.make, session.table)
    rig, folder = session.rig(make), session.folder / e.key
    digest = _with_measured(session, e, digest)
    folder.mkdir(parents=True, exist_ok=True)
    progress("starting", 0.0)
    state, chapter = "kept", None if fresh else _kept(folder, digest)
    if chapter is None:
        at = ExperimentInput(
            make=make, rig=rig, seed=session.seed, folder=folder, progress=progress, stopped=stopped,
            earlier={
                t.experiment.key: t.chapter
                for t in session.results
                if t.experiment.key in needs and t.state in ("done", "kept")
            },
            folders={n: session.folder / n for n in needs}, hands=session.hands,
        )  # fmt: skip
        try:
            chapter, whole = e.tell(at)
            chapter = replace(chapter, key=e.key, title=e.title)
            state = "done" if whole and not stopped() else "stopped"
        except UprightError as error:
            state, chapter = "failed", _failed(e, str(error))
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            state, chapter = "failed", _failed(e, f"Its numbers broke down ({error}), which is a fault of the program.")
        if state == "done":
            write_json(folder / CHAPTER_FILE, {"made_of": digest, "chapter": as_plain(chapter)})
    return ExperimentResult(
        experiment=e, make=make, rig=rig.name, chapter=chapter, state=state, seconds=time.perf_counter() - began
    )


def _failed(e: Experiment, why: str) -> Chapter:
    return Chapter(key=e.key, title=e.title, verdict="This experiment could not be finished.", detail=why, sound=False)


WORN = (
    "They are worn: friction larger close to rest, a drive that ripples and comes late, a frame out of level, encoders "
    "with play and off centre. No model has this, and what remains of it is told."
)
TWINS = "Digital twins: dry friction, encoder counts, delay and limits as on rigs; none was touched."
TITLE = "The laboratory: identify it hanging, hold it upright"


def book(session: Session, day: date) -> Book:
    """Everything the session has to say."""
    hands = session.hands
    seeded = "" if hands is not None else f" (seed {session.seed})"
    rigs = dict.fromkeys(f"{t.rig}{seeded}" for t in session.results)
    notes: list[str] = []
    if session.interrupted:
        left = ", ".join(e.key for e in session.missing)
        notes.append(
            "Stopped by Ctrl-C; this report holds what was there by then"
            + (f", and not yet experiments {left}." if left else ".")
        )
    return Book(
        title=TITLE,
        facts=(
            ("Rig", "; ".join(rigs) or (session.make if hands is not None else f"seed {session.seed}")),
            ("Data", hands.source if hands is not None else TWINS + (f" {WORN}" if session.worn else "")),
            ("Experiments", ", ".join(t.experiment.key for t in session.results) or "none"),
            ("Made", f"{day.isoformat()}, upright {__version__}, Python {platform.python_version()}"),
            ("Again", command(session)),
        ),
        chapters=tuple(
            replace(t.chapter, about=t.rig, finished=t.state in ("done", "kept")) for t in session.results
        ),
        notes=tuple(notes),
        missing=tuple((e.key, e.title) for e in session.missing),
        steps=next_steps(session),
    )  # fmt: skip


def command(session: Session, seed: int | None = None) -> str:
    """What to type for this session, or for the same on another rig."""
    seed = session.seed if seed is None else seed
    shown = ["upright lab"]
    if session.make:
        shown.append(f"--rig {session.make}")
    there = _there(session.make, session.table)
    told = {e.key for e in session.asked} | {t.experiment.key for t in session.results}
    if len(told) < len(there):
        shown += [f"--experiment {e.key}" for e in there if e.key in told]
    if seed:
        shown.append(f"--seed {seed}")
    if session.worn:
        shown.append("--worn")
    return " ".join(shown)


def next_steps(session: Session) -> tuple[Step, ...]:
    """What to do with the whole: go on, take another rig, or a log of one's own."""
    steps: list[Step] = []
    if session.interrupted or any(t.state == "failed" for t in session.results):
        steps.append(
            Step("Go on where this stopped; what is finished is kept.",
                 f"{command(session)} -o {typed(session.folder)}")
        )  # fmt: skip
    if session.hands is not None:
        held = next((t.chapter.numbers for t in session.results if t.experiment.key == "2"), {})
        if "recommended" in held:
            rig, stem = session.folder / "2" / "rig.toml", held["recommended"].replace(" ", "_")
            law = rig.with_name(f"law_regulation_{stem}.json")
            again = f"upright run --rig {typed(rig)} --law {typed(law)} --duration 60"
            steps.append(Step("Run the best law for longer.", again))
        return tuple(steps)
    steps.append(Step("Take another rig of the same make.", command(session, session.seed + 1)))
    other = "linear" if session.make != "linear" else "furuta"
    steps.append(Step("Run the laboratory on another kind of rig.", f"upright lab --rig {other}"))
    steps.append(Step("Start on a log of your own.", "upright init LOG"))
    return tuple(steps)


def summary(session: Session, report: Path, pdf: Path | None) -> dict[str, Any]:
    """The session as plain values for another program: SI."""
    return {
        "seed": session.seed,
        "rig": session.make or None,
        "worn": session.worn,
        "folder": str(session.folder),
        "report": str(report),
        "pdf": str(pdf) if pdf else None,
        "interrupted": session.interrupted,
        "missing": [e.key for e in session.missing],
        "seconds": session.seconds,
        "experiments": {
            t.experiment.key: {
                "title": t.chapter.title,
                "rig": t.rig,
                "make": t.make,
                "state": t.state,
                "seconds": t.seconds,
                "sound": t.chapter.sound,
                "verdict": t.chapter.verdict,
                "detail": t.chapter.detail,
                "numbers": t.chapter.numbers,
                "steps": [s.command for s in t.chapter.steps if s.command],
            }
            for t in session.results
        },
    }
