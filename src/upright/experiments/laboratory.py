"""The laboratory: the experiments of the paper, run under one roof and taken up again where they were left."""

from __future__ import annotations

import inspect
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
from upright.basis import SIMULATED
from upright.errors import BadInput, UprightError
from upright.experiments.nonideal import nonideal as nonideal_twin
from upright.experiments.parallel import run_parallel
from upright.experiments.stand.experiment import Experiment, ExperimentInput
from upright.experiments.stand.live import LiveStand
from upright.experiments.stand.stand import TestStand
from upright.experiments.stand.twin import TwinStand
from upright.experiments.table import EXPERIMENTS
from upright.files import read_text, write_json
from upright.progress import Progress, silent
from upright.report.page import PAPER, Book, Chapter, Step, as_plain, from_plain
from upright.report.symbols import typed
from upright.rig.makes import MAKES, make_rig
from upright.workers import HERE, Workers

CHAPTER_FILE = "chapter.json"
"""File of a finished experiment, taken up again as long as nothing it stands on has changed."""


@dataclass(frozen=True, kw_only=True)
class ExperimentResult:
    """An experiment with its chapter.

    Attributes
    ----------
    make, rig : str
        Kind of rig, and its name.
    state : str
        ``"done"``, ``"kept"`` from an earlier run, ``"stopped"`` half-way, or ``"failed"``.
    """

    experiment: Experiment
    make: str
    rig: str
    chapter: Chapter
    state: str
    seconds: float


@dataclass(kw_only=True, eq=False)
class Session:
    """Results so far; they are filled in experiment by experiment, so that an interrupted one can be reported."""

    make: str
    seed: int
    folder: Path
    requested: tuple[Experiment, ...]
    nonideal: bool = False
    live: LiveStand | None = None
    results: list[ExperimentResult] = field(default_factory=list[ExperimentResult])
    interrupted: bool = False
    seconds: float = 0.0

    @property
    def there(self) -> list[Experiment]:
        """Experiments that the rig can have."""
        return _there(self.make, self.live)

    def needs(self, e: Experiment) -> list[str]:
        """Earlier experiments from which it takes numbers."""
        return _needs(e, self.make, self.live)

    def make_for(self, e: Experiment) -> str:
        """Make on whose twin an experiment is run, or the name of the live rig."""
        return self.make if self.live is not None else e.make(self.make)

    def stand(self, make: str) -> TestStand:
        """The test stand of a make's twin, or the live one."""
        if self.live is not None:
            return self.live
        rig = make_rig(make, self.seed)
        return TwinStand(rig=nonideal_twin(rig, self.seed) if self.nonideal else rig, make=MAKES[make])

    @property
    def missing(self) -> tuple[Experiment, ...]:
        """What was requested and not begun."""
        return tuple(e for e in self.requested if e.name not in {t.experiment.name for t in self.results})


def chosen_experiments(requested: Sequence[str], make: str, live: LiveStand | None = None) -> tuple[Experiment, ...]:
    """The requested experiments, with those whose numbers they take; all that the rig has when none is named.

    Raises
    ------
    BadInput
        When there is no such experiment, or not on this rig.
    """
    for name in requested:
        if name in EXPERIMENTS:
            EXPERIMENTS.named(name)  # refuses one of another package that does not load
    there = _there(make, live)
    if live is not None and not there:
        raise BadInput(
            f"{live.file.path} names a fit of a rig with neither pendulum nor shaft; identification begins with a "
            "study: name that."
        )
    wanted: set[str] = set()
    for name in requested:
        known = EXPERIMENTS.sound().values()
        named = [e for e in known if name in (e.name, e.part_of)]
        if not named:
            valid = dict.fromkeys(n for e in known for n in (e.part_of, e.name) if n)
            raise BadInput(f"there is no experiment '{name}'; take one of {', '.join(sorted(valid))}.")
        if not any(e in there for e in named):
            has = f"has experiments {', '.join(e.name for e in there)}"
            if live is not None:
                raise BadInput(
                    f"experiment {name} cannot be made on {make}, which {has}; "
                    "docs/howto/lab.md says what each asks of a rig."
                )
            wanted_rig = " or ".join(named[0].makes) or "RIG.toml, a rig of your own"
            raise BadInput(f"experiment {name} is for --rig {wanted_rig}; {make or 'a simulated one'} {has}.")
        wanted |= {e.name for e in named if e in there}
    if not requested:
        wanted = {e.name for e in there if not e.alone}
    for e in reversed(there):  # who builds on another comes after it
        if e.name in wanted:
            wanted |= set(_needs(e, make, live))
    return tuple(e for e in there if e.name in wanted)


def _there(make: str, live: LiveStand | None) -> list[Experiment]:
    """Experiments that a rig can have; all for the paper's."""
    if live is not None:
        return [e for e in EXPERIMENTS.sound().values() if e.on(live)]
    return [e for e in EXPERIMENTS.sound().values() if make in e.makes or (not make and e.makes)]


def _needs(e: Experiment, make: str, live: LiveStand | None) -> list[str]:
    """What it takes numbers from: earlier experiments on the same rig."""
    if live is not None:
        return [n.name for n in _there(make, live) if n.name in e.live_needs]
    return [n.name for n in _there(make, live) if n.name in e.needs and n.make(make) == e.make(make)]


def run_laboratory(
    requested: Sequence[str],
    make: str,
    seed: int,
    folder: Path,
    progress: Progress = silent,
    stopped: Callable[[], bool] = lambda: False,
    *,
    fresh: bool = False,
    workers: Workers = HERE,
    nonideal: bool = False,
    live: LiveStand | None = None,
) -> Session:
    """Run experiments on a seeded rig; Ctrl-C stops and keeps what is there.

    Parameters
    ----------
    requested : sequence of str
        Experiments by name, all when empty.
    make : str
        Kind of rig; empty for the one on which the paper did each.
    seed : int
        Which rig of the make.
    folder : Path
        Takes a folder for each experiment. What is there and still holds is not made again.
    progress : callable, optional
        Called with the current step and the share of the whole.
    stopped : callable, optional
        Whether Ctrl-C was pressed, for what has swallowed it.
    fresh : bool
        Make everything again.
    workers : Workers, optional
        Who runs experiments that need nothing of each other; processes of this machine, since they share the folder.
    nonideal : bool
        Take twins with physics that models leave out; see `upright.experiments.nonideal`.
    live : LiveStand, optional
        The rig itself, where it is no twin that is simulated here; `make` is then its name.

    Raises
    ------
    BadInput
        When there is no such experiment, or not on this rig.
    """
    began = time.perf_counter()
    session = Session(
        make=make,
        seed=seed,
        folder=folder,
        requested=chosen_experiments(requested, make, live),
        nonideal=nonideal,
        live=live,
    )
    digests = _digests(session)
    whole = sum(e.seconds for e in session.requested)
    behind = 0.0
    if not workers.alone:
        _run_parallel(session, digests, workers, progress, stopped, fresh)
    for e in session.requested if workers.alone else ():

        def tell(step: str, share: float, e: Experiment = e, behind: float = behind) -> None:
            progress(f"experiment {e.name}: {step}", (behind + e.seconds * min(share, 1.0)) / whole)

        try:
            session.results.append(_one(session, e, digests[e.name], tell, stopped, fresh))
            session.interrupted = session.results[-1].state == "stopped"
        except KeyboardInterrupt:
            session.interrupted = True
        if session.interrupted:
            break
        behind += e.seconds
    session.results = _with_stored(session, digests)
    session.seconds = time.perf_counter() - began
    return session


def _run_parallel(
    session: Session, digests: Mapping[str, str], workers: Workers, progress: Progress, stopped: Callable[[], bool],
    fresh: bool,
) -> None:  # fmt: skip
    requested = {e.name: e for e in session.requested}
    needs = {key: session.needs(e) for key, e in requested.items()}
    run = partial(_apart, replace(session, requested=()), digests, stopped, fresh)
    contents, interrupted = run_parallel({k: e.seconds for k, e in requested.items()}, needs, run, workers, progress)
    session.results += [_brought(key, content) for key, content in contents.items()]
    session.interrupted = interrupted or any(t.state == "stopped" for t in session.results)


def _apart(
    session: Session, digests: Mapping[str, str], stopped: Callable[[], bool], fresh: bool, key: str,
    earlier: Mapping[str, Mapping[str, Any]], progress: Progress,
) -> dict[str, Any]:  # fmt: skip
    """One experiment in another process: an `ExperimentResult` as plain values, its pictures drawn."""
    results = [_brought(k, content) for k, content in earlier.items()]
    e = EXPERIMENTS[key]
    result = _one(replace(session, results=results), e, digests[key], progress, stopped, fresh)
    return {**vars(result), "experiment": key, "chapter": as_plain(result.chapter)}


def _brought(key: str, content: Mapping[str, Any]) -> ExperimentResult:
    """The result that came from there."""
    e = EXPERIMENTS[key]
    values: dict[str, Any] = {**content, "experiment": e, "chapter": from_plain(content["chapter"])}
    return ExperimentResult(**values)


def _digests(session: Session) -> dict[str, str]:
    """Digest of what each experiment is made of: the program, its rig and seed, the experiments it builds on.

    What was measured on a rig outlasts another version of the program.
    """
    digests: dict[str, str] = {}
    for e in session.there:
        parts = (
            _program() if session.live is None else session.live.text,
            "" if e.name in EXPERIMENTS.own else read_text(Path(inspect.getfile(e.tell))),
            e.name,
            session.make_for(e),
            str(session.seed),
            "nonideal" if session.nonideal else "",
            *(digests[n] for n in session.needs(e)),
        )
        digests[e.name] = sha256("\n".join(parts).encode()).hexdigest()
    return digests


def _with_measured(session: Session, e: Experiment, digest: str) -> str:
    """The digest with the fits that it takes numbers from: a rig that is measured again answers otherwise."""
    if session.live is None:
        return digest
    fits = [session.folder / n / "fit.json" for n in session.needs(e)]
    return sha256(b"".join([digest.encode(), *(f.read_bytes() for f in fits if f.exists())])).hexdigest()


@cache
def _program() -> str:
    """Digest of the program as it stands: another version, or a changed line, is another experiment."""
    source = Path(__file__).parent.parent
    digest = sha256()
    for path in sorted(p for p in source.rglob("*") if p.suffix in (".py", ".md")):
        digest.update(path.relative_to(source).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _stored(folder: Path, digest: str) -> Chapter | None:
    """The chapter of an earlier run, or nothing when there is none or it was made of something else."""
    try:
        content: Any = json.loads(read_text(folder / CHAPTER_FILE))
        return from_plain(content["chapter"]) if content["made_of"] == digest else None
    except (OSError, ValueError, KeyError, TypeError):  # none, torn, or another program's: it is made again
        return None


def _with_stored(session: Session, digests: Mapping[str, str]) -> list[ExperimentResult]:
    """The results, and what else is stored of an earlier run on the same rig."""
    results = {t.experiment.name: t for t in session.results}
    for e in session.there:
        stored = (
            None if e.name in results else _stored(session.folder / e.name, _with_measured(session, e, digests[e.name]))
        )
        if stored:
            make = session.make_for(e)
            name = session.stand(make).rig.name
            results[e.name] = ExperimentResult(
                experiment=e, make=make, rig=name, chapter=stored, state="kept", seconds=0.0
            )
    return [results[e.name] for e in session.there if e.name in results]


def _one(
    session: Session, e: Experiment, digest: str, progress: Progress, stopped: Callable[[], bool], fresh: bool
) -> ExperimentResult:
    """One experiment, from an earlier run where that still holds."""
    began = time.perf_counter()
    make, needs = session.make_for(e), session.needs(e)
    stand, folder = session.stand(make), session.folder / e.name
    digest = _with_measured(session, e, digest)
    folder.mkdir(parents=True, exist_ok=True)
    progress("starting", 0.0)
    state, chapter = "kept", None if fresh else _stored(folder, digest)
    if chapter is None:
        at = ExperimentInput(
            stand=stand, seed=session.seed, folder=folder, progress=progress, stopped=stopped,
            earlier={
                t.experiment.name: t.chapter
                for t in session.results
                if t.experiment.name in needs and t.state in ("done", "kept")
            },
            folders={n: session.folder / n for n in needs},
        )  # fmt: skip
        try:
            chapter, whole = e.tell(at)
            chapter = replace(chapter, key=e.name, title=e.title)
            state = "done" if whole and not stopped() else "stopped"
        except UprightError as error:
            state, chapter = "failed", _failed(e, str(error))
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            state, chapter = "failed", _failed(e, f"Its numbers broke down ({error}), which is a fault of the program.")
        if state == "done":
            write_json(folder / CHAPTER_FILE, {"made_of": digest, "chapter": as_plain(chapter)})
    return ExperimentResult(
        experiment=e, make=make, rig=stand.rig.name, chapter=chapter, state=state, seconds=time.perf_counter() - began
    )


def _failed(e: Experiment, why: str) -> Chapter:
    return Chapter(key=e.name, title=e.title, verdict="This experiment could not be finished.", detail=why, sound=False)


NONIDEAL = (
    "They have unmodelled effects: friction larger close to rest, a drive that ripples and lags, a tilted frame, "
    "encoders with play and off centre. No model has this; what remains of it is reported."
)
TWINS = "Digital twins: dry friction, encoder counts, delay and limits as on rigs; none was touched."
TITLE = "The laboratory: identify it hanging, hold it upright"


def book(session: Session, day: date) -> Book:
    """Everything the session has to say."""
    live = session.live
    seeded = "" if live is not None else f" (seed {session.seed})"
    rigs = dict.fromkeys(f"{t.rig}{seeded}" for t in session.results)
    notes: list[str] = []
    if session.interrupted:
        left = ", ".join(e.name for e in session.missing)
        notes.append(
            "Stopped by Ctrl-C; this report holds what was there by then"
            + (f", and not yet experiments {left}." if left else ".")
        )
    return Book(
        title=TITLE,
        facts=(
            ("Rig", "; ".join(rigs) or (session.make if live is not None else f"seed {session.seed}")),
            ("Data", live.source if live is not None else TWINS + (f" {NONIDEAL}" if session.nonideal else "")),
            ("Experiments", ", ".join(t.experiment.name for t in session.results) or "none"),
            ("Made", f"{day.isoformat()}, upright {__version__}, Python {platform.python_version()}"),
            ("Again", typed_again(session)),
        ),
        chapters=tuple(
            replace(t.chapter, about=t.rig, finished=t.state in ("done", "kept")) for t in session.results
        ),
        first_line=SIMULATED if live is None else live.performed, notes=tuple(notes),
        missing=tuple((e.name, e.title) for e in session.missing),
        steps=next_steps(session), sources=(PAPER,),
    )  # fmt: skip


def typed_again(session: Session, seed: int | None = None) -> str:
    """What to type for this session, or for the same on another rig."""
    seed = session.seed if seed is None else seed
    shown = ["upright lab"]
    if session.make:
        shown.append(f"--rig {session.make}")
    whole = {e.name for e in session.there if not e.alone}
    made = {e.name for e in session.requested} | {t.experiment.name for t in session.results}
    if made != whole:
        shown += [f"--experiment {e.name}" for e in session.there if e.name in made]
    if seed:
        shown.append(f"--seed {seed}")
    if session.nonideal:
        shown.append("--nonideal")
    return " ".join(shown)


def next_steps(session: Session) -> tuple[Step, ...]:
    """What to do with the whole: go on, take another rig, or a log of one's own."""
    steps: list[Step] = []
    if session.interrupted or any(t.state == "failed" for t in session.results):
        steps.append(
            Step("Go on where this stopped; what is finished is kept.",
                 f"{typed_again(session)} -o {typed(session.folder)}")
        )  # fmt: skip
    if session.live is not None:
        held = next((t.chapter.numbers for t in session.results if t.experiment.name == "2"), {})
        if "recommended" in held:
            rig, stem = session.folder / "2" / "rig.toml", held["recommended"].replace(" ", "_")
            law = rig.with_name(f"law_regulation_{stem}.json")
            again = f"upright run --rig {typed(rig)} --law {typed(law)} --duration 60"
            steps.append(Step("Run the best law for longer.", again))
        return tuple(steps)
    steps.append(Step("Take another rig of the same model.", typed_again(session, session.seed + 1)))
    other = "linear" if session.make != "linear" else "furuta"
    steps.append(Step("Run the laboratory on another kind of rig.", f"upright lab --rig {other}"))
    steps.append(Step("Start on a log of your own.", "upright init LOG"))
    return tuple(steps)


def session_summary(session: Session, files: Mapping[str, str | None]) -> dict[str, Any]:
    """The session as plain values for another program: SI; `files` that it left, none where its folder is gone."""
    return {
        "seed": session.seed,
        "rig": session.make or None,
        "nonideal": session.nonideal,
        **files,
        "interrupted": session.interrupted,
        "missing": [e.name for e in session.missing],
        "seconds": session.seconds,
        "experiments": {
            t.experiment.name: {
                "title": t.chapter.title,
                "rig": t.rig,
                "make": t.make,
                "state": t.state,
                "seconds": t.seconds,
                "sound": t.chapter.sound,
                "verdict": t.chapter.verdict,
                "detail": t.chapter.detail,
                "numbers": t.chapter.numbers,
                "steps": [s.command for s in t.chapter.steps if s.command and files],
            }
            for t in session.results
        },
    }
