"""What does a course do with it: the whole laboratory on twins, the paper's tables again, its survey?"""

from __future__ import annotations

import os
import re
import signal
import threading
from collections.abc import Callable, Generator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Unpack

from upright.errors import BadInput, nearest
from upright.files import keeps_its_inputs
from upright.progress import Progress, silent
from upright.renamed import WORN, renamed
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.options import LabOptions, known_options
from upright.verbs.pages import folder_if_given, write_page
from upright.verbs.values import texts

if TYPE_CHECKING:
    from pandas import DataFrame

    from upright.experiments.laboratory import Session
    from upright.experiments.stand.live import LiveStand
    from upright.files import PathLike
    from upright.paper.reproduce import Reproduced
    from upright.questionnaire.sheet import Means, Ratings, Shares
    from upright.realtime.session import RunState
    from upright.report.page import Book
    from upright.verbs.values import Workforce


@dataclass(frozen=True, kw_only=True, eq=False)
class Laboratory:
    """The experiments that were run, and the report on them.

    `interrupted` when Ctrl-C was pressed, were it only while the report was written.
    """

    session: Session
    book: Book
    interrupted: bool
    hints: tuple[str, ...] = ()

    def experiment(self, name: str) -> Answer[Any]:
        """One experiment's numbers and report, by its name: ``lab.experiment("3").plot("track-steps")``.

        Its `pictures` name what `plot` draws; in the `out` that was named, a folder has its logs and studies.

        Raises
        ------
        BadInput
            When it was not run.
        """
        chapters = {c.key: c for c in self.book.chapters}
        if name not in chapters:
            raise BadInput(f"experiment '{name}' was not run; {nearest(name, chapters)}")
        return Answer(chapters[name].numbers, chapters[name])


def _typed(typed: dict[str, Any]) -> dict[str, Any]:
    """A folder of its own for each rig; a twin asks nobody for anything, and its runs are not watched."""
    rig = typed["rig"] or ""
    if typed["out"] is None:
        of = (Path(rig).stem, str(typed["seed"] or ""), "nonideal" if typed["nonideal"] else "")
        typed["out"] = Path("-".join(["upright-lab", *filter(None, of)])) if not _is_port(rig) else Path()
    return typed if rig.endswith(".toml") else {**typed, "ask": None, "watching": None}


def _is_port(rig: str) -> bool:
    return rig.startswith("serial:")


@command(
    "Course",
    names={"experiment": "--experiment -e", "rig": "--rig", "nonideal": "--nonideal --worn"},
    metavars={"experiment": "1|1a|1b|2|2b|3|4", "rig": "KIND|RIG.toml", "accept": "REASON"},
    helps={
        "experiment": "Only this one, and those it depends on.",
        "rig": "linear, furuta, rectilinear or torsional, else the paper's; or RIG.toml.",
        "out": "Folder; upright-lab[-KIND][-SEED][-nonideal] when omitted.",
        "nonideal": "Rigs with unmodelled effects: stiction, ripple and play.",
    },
    ranges={"seed": (None, None)},
    prepare=_typed,
    resumes=True,  # goes on in the folder that it reads
    more="""
    1a weighs the rig with known added masses, 1b fits its frequency response hanging, 2 holds it upright with gains
    from that fit, 2b swings it up and catches it, 3 tracks through a flexible shaft, 4 lets the pendulum swing freely.

    With a RIG.toml they run on the rig itself; you are prompted for what the drive cannot do.

    upright lab
    upright lab --rig linear --seed 3
    upright lab --rig furuta --nonideal
    upright lab --experiment 1b --experiment 2 -o out
    upright lab --rig RIG.toml
    upright lab --rig RIG.toml --quick
    """,
)
@renamed(WORN)
def lab(
    *, experiment: Sequence[str] | str | None = None, rig: str | None = None, out: PathLike | None = None,
    fresh: bool = False, quick: bool = False, workers: Workforce = 1, progress: Progress = silent,
    ask: Callable[[str], bool] | None = None,
    watching: Callable[[], AbstractContextManager[Callable[[RunState], str]]] | None = None,
    **on: Unpack[LabOptions],
) -> Answer[Laboratory]:  # fmt: skip
    """Run the paper's experiments, on simulated rigs or on hardware, and write one report.

    Every log, study and fit is written to the folder, where the other commands read them; report.html has all results
    (report.pdf with the pdf extra). Ctrl-C keeps and reports what is finished; the same call continues from there.

    Parameters
    ----------
    experiment : str or sequence of str, optional
        Only these of 1, 1a, 1b, 2, 2b, 3, 4, and those they depend on.
    rig : str, optional
        Twin of a rig model, linear, furuta, rectilinear or torsional, else the paper's; or the RIG.toml of hardware
        (all experiments that it can have); ``"serial:PORT"`` writes one, and a study, to be filled in.
    out : path, optional
        Folder; when omitted, twins leave no file, and a rig of RIG.toml is not run.
    fresh : bool
        Run again what the folder has already.
    quick : bool
        A minute at the rig of RIG.toml instead of the experiments, without hands: wiring, dead zone, drive and delay, a
        fit, gains, swing-up and catch.
    workers : int, str or executor
        Number of processes for independent experiments, the address of a Dask
        scheduler, or an executor of `concurrent.futures`.
    progress : callable, optional
        Called with the current step and the share completed.
    ask : callable, optional
        Asks the person beside a rig for something, in a sentence; answers whether it was done. Hardware needs it.
    watching : callable, optional
        Opens a view for each run at a rig: shown how it goes, it answers with a sentence to end the run.
    **on
        Of the rig: seed, nonideal, accept; see `LabOptions`.

    Returns
    -------
    Answer
        Of a `Laboratory`.

    Raises
    ------
    BadInput
        When there is no such experiment or rig.
    """
    from upright.rig.makes import make_named

    on = known_options(LabOptions, on, "lab")
    seed, nonideal, accept = on.get("seed", 0), on.get("nonideal", False), on.get("accept")
    if seed < 0:
        raise BadInput(f"--seed needs a whole number of at least 0, got {seed}.")
    rig = os.fspath(rig) if isinstance(rig, os.PathLike) else "" if rig is None else rig
    if not isinstance(rig, str):  # type: ignore[reportUnnecessaryIsInstance]
        raise BadInput(f"a laboratory's rig is a rig model, a RIG.toml or serial:PORT, got {type(rig).__name__}.")
    itself = rig.endswith(".toml") or _is_port(rig)
    if rig and not itself:
        make_named(rig)
    at = folder_if_given(out)
    from datetime import date

    from upright.experiments import laboratory
    from upright.report.html import write_html
    from upright.report.page import Chapter
    from upright.report.pdf import available, write_pdf
    from upright.report.symbols import typed
    from upright.workers import Workers

    shared = Workers.of(workers)
    requested = _requested(texts(experiment), itself, quick=quick)
    live = _live(rig, at, ask, watching, nonideal=nonideal, alone=shared.alone, accept=accept) if itself else None
    rig = rig if live is None else typed(live.file.path)
    laboratory.chosen_experiments(requested, rig, live)  # says what is wrong with the call before anything is written
    with nullcontext(at) if at is not None else TemporaryDirectory(prefix="upright-") as folder, _ctrl_c() as pressed:
        session = laboratory.run_laboratory(
            requested, rig, seed, Path(folder), progress, stopped=lambda: pressed.times > 0, fresh=fresh,
            workers=shared, nonideal=nonideal, live=live,
        )  # fmt: skip
        pressed.patient = True
        progress("writing the report", 1.0)
        book = laboratory.book(session, date.today())
        files: list[Path] = []
        if at is not None:
            files.append(write_html(at / "report.html", book))
            if available():
                files.append(write_pdf(at / "report.pdf", book))
    if at is None:  # commands that read the folder again are not proposed
        book = replace(book, steps=(), chapters=tuple(replace(c, steps=()) for c in book.chapters))
    kept = {
        "folder": str(at), "report": str(files[0]), "pdf": next((str(f) for f in files[1:]), None),
    } if files else {}  # fmt: skip
    sound = sum(t.chapter.sound for t in session.results)
    page = Chapter(
        title=book.title, verdict=f"{sound} of {len(session.results)} verdicts are sound.",
        sound=sound == len(session.results), parts=book.cover, warnings=book.notes, steps=book.steps,
        numbers=laboratory.session_summary(session, kept), finished=not session.interrupted,
    )  # fmt: skip
    took = {
        t.experiment.name: f"{t.rig}{', as kept from an earlier run' if t.state == 'kept' else ''}; {t.seconds:.1f} s"
        for t in session.results
    }
    hints = ["Each chapter of the report ends with the commands that repeat its steps."]
    if len(files) == 1:
        hints.append("PDF: pip install 'upright[pdf]' and run the same again; nothing is computed twice.")
    answer = Laboratory(
        session=session, book=replace(book, chapters=tuple(replace(c, about=took[c.key]) for c in book.chapters)),
        interrupted=session.interrupted or pressed.times > 0, hints=tuple(hints),
    )  # fmt: skip
    return Answer(answer, page, files)


def _requested(experiments: Sequence[str], itself: bool, *, quick: bool) -> Sequence[str]:
    """Experiments to make; `quick` is one by itself."""
    if quick and experiments:
        raise BadInput("--quick is a minute by itself; leave the experiments out, or --quick.")
    if (quick or "quick" in experiments) and not itself:
        raise BadInput("a minute at a rig needs the rig: upright lab --rig RIG.toml --quick.")
    return ("quick",) if quick else experiments


def _live(
    rig: str, folder: Path | None, ask: Callable[[str], bool] | None,
    watching: Callable[[], AbstractContextManager[Callable[[RunState], str]]] | None, *, nonideal: bool, alone: bool,
    accept: str | None,
) -> LiveStand:  # fmt: skip
    """The rig of a RIG.toml; what it cannot do is reported first."""
    from upright.experiments.stand.live import live_stand, nobody, nobody_watches
    from upright.experiments.stand.templates import write_templates
    from upright.report.symbols import typed

    if nonideal or not alone:
        raise BadInput("--nonideal and --workers are for twins of makes; on hardware there is one rig, as it is.")
    if not Path(rig).exists() and not _is_port(rig):
        raise BadInput(f"there is no file '{rig}'; name the RIG.toml of a rig, or a rig model: linear, furuta, ...")
    if folder is None:
        raise BadInput("what is measured on a rig is kept: name a folder for it, such as out='laboratory'.")
    if _is_port(rig):
        path = write_templates(folder, rig.removeprefix("serial:"))
        raise BadInput(
            "a rig of hardware needs a description and limits, which only you know: fill in "
            f"{path.with_name('study.toml')} and {path}, then run upright lab --rig {typed(path)}"
        )
    live = live_stand(Path(rig), ask or nobody, watching or nobody_watches, accept)
    if live.file.hardware and ask is None:
        raise BadInput("experiments on hardware need a person beside it: run upright lab in a terminal, or give ask.")
    return live


@dataclass
class _Pressed:
    """How often Ctrl-C was pressed; once `patient`, the first press lets the report be written."""

    times: int = 0
    patient: bool = False


@contextmanager
def _ctrl_c() -> Generator[_Pressed]:
    """Count Ctrl-C besides raising it, for the time of the experiments."""
    pressed = _Pressed()

    def note(_signal: int, _frame: object) -> None:
        pressed.times += 1
        if not pressed.patient or pressed.times > 1:
            raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield pressed
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, before)


@command("Course", defaults={"out": "."}, more="upright reproduce -o out")
def reproduce(
    *, seed: int = 0, out: PathLike | None = None, pdf: bool = False
) -> Answer[Reproduced]:  # fmt: skip
    """Regenerate the paper's pole tables from a few numbers, and show its misprints.

    The printed poles lie on an LQR locus: plant and weights are recovered from them, and all poles follow
    again, to less than the print's rounding.

    Parameters
    ----------
    seed : int
        Seed of the rigs on which formulas are tried.
    out : path, optional
        Folder for reproduce.html.
    pdf : bool
        Write the page as PDF too.

    Returns
    -------
    Answer
        Of a `Reproduced`.
    """
    from upright.paper.chapter import chapter
    from upright.paper.reproduce import reproduce_tables
    from upright.rig.makes import NOMINAL

    at = folder_if_given(out, pdf)
    result = reproduce_tables(NOMINAL, seed)
    page = chapter(result)
    return Answer(result, page, [] if at is None else write_page(page, at / "reproduce.html", pdf))


@command(
    "Course",
    metavars={"file": "FILE", "n": "N", "scale": "LOW-HIGH"},
    ranges={"n": (2, None)},
    defaults={"out": "survey"},
    more="""
    upright survey ratings.csv -o out
    upright survey means.csv --n 53
    """,
)
@keeps_its_inputs
def survey(
    file: PathLike | DataFrame, *, n: int | None = None, scale: str | tuple[int, int] = "1-4",
    out: PathLike | None = None, pdf: bool = False,
) -> Answer[Ratings | Means | Shares]:  # fmt: skip
    """Evaluate ratings before and after a course, or check printed means and percentages.

    One row per person ('feedback pre', 'feedback post', ...), one row per answer (id, item, time, rating), or what was
    printed: means (concept, pre, post) and percentages, with the number of answers.

    Parameters
    ----------
    file : path or pandas.DataFrame
        CSV as a spreadsheet writes it: one row per person, one per answer, or what was printed.
    n : int, optional
        Answers behind printed means or shares, at least 2.
    scale : str or (int, int)
        Ends of the scale of the ratings, ``"1-4"`` or ``"0-100"``; people may rate between its whole numbers.
    out : path, optional
        Folder for report.html.
    pdf : bool
        Write the page as PDF too.

    Returns
    -------
    Answer
        Of the sheet as it was read; what follows from it is in `numbers`.

    Raises
    ------
    BadInput
        When the sheet cannot be read, or the number of answers is not specified.
    """
    from upright.questionnaire.chapter import chapter
    from upright.questionnaire.sheet import Ratings, read_sheet, read_table
    from upright.report.page import Step
    from upright.report.symbols import typed

    at = folder_if_given(out, pdf)
    if n is not None and n < 2:
        raise BadInput(f"--n needs a whole number of at least 2, got {n}.")
    scale_text = scale if isinstance(scale, str) else f"{scale[0]}-{scale[1]}"
    ends = re.fullmatch(r"\s*(\d{1,3})\s*(?:-|to)\s*(\d{1,3})\s*", scale_text)
    if ends is None or int(ends[1]) >= int(ends[2]):
        raise BadInput(f"--scale needs its two ends, such as 1-4, got '{scale_text}'.")
    limits = (int(ends[1]), int(ends[2]))
    if isinstance(file, str | os.PathLike):
        file = Path(file)
        if not file.exists():
            from upright.readers.source import neighbour

            raise BadInput(f"There is no file '{file}';{neighbour(file)}")
        sheet, name, command = read_sheet(file, scale=limits), file.name, f"upright survey {typed(file)}"
    elif hasattr(file, "to_csv") and hasattr(file, "iloc"):
        sheet, name, command = read_table(file.to_csv(index=bool(file.index.name)), "frame", scale=limits), "frame", ""
    else:
        raise BadInput(f"survey takes a CSV file or a pandas DataFrame, got {type(file).__name__}.")
    if isinstance(sheet, Ratings):
        if n is not None:
            raise BadInput(f"--n is for printed summaries; '{name}' holds single answers, which are counted.")
    elif n is None:
        raise BadInput(f"'{name}' holds printed numbers; say with --n how many answers they rest on.")
    again = f"{command}{'' if n is None else f' --n {n}'} --json"
    page = chapter(
        sheet, title=f"Survey: {Path(name).stem.replace('_', ' ')}", source=name, answers=n, scale=limits,
        steps=(Step("Hand the numbers on.", again),) if command else (),
    )  # fmt: skip
    files = [] if at is None else write_page(page, at / "report.html", pdf)
    return Answer(sheet, replace(page, numbers={**page.numbers, "report": str(files[0]) if files else ""}), files)
