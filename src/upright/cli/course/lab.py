"""What does the whole paper look like when nothing is at hand but this program?"""

from __future__ import annotations

import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.cli.terminal import console, print_json, progress_bar
from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.experiments.laboratory import Session
    from upright.report.page import Book

INTERRUPTED = 130


def lab(
    experiment: Annotated[
        list[str] | None,
        typer.Option("--experiment", "-e", metavar="1|1a|1b|2|2b|3|4", help="Only this one, and what it stands on."),
    ] = None,
    rig: Annotated[
        str, typer.Option("--rig", metavar="KIND", help="linear, furuta, rectilinear or torsional; else the paper's.")
    ] = "",
    seed: Annotated[int, typer.Option(help="Which rig of the make; 0 is the one as designed.")] = 0,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder; upright-lab[-KIND][-SEED] without it.")
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Make again what the folder holds already.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON instead of sentences.")] = False,
) -> None:
    r"""Run the experiments of the paper on simulated rigs: identify, flip, design, hold, track, swing, and report.

    1a weighs the rig with known added masses, 1b fits its frequency response hanging, 2 holds it upright with gains
    from that fit, 2b swings it up and catches it, 3 tracks through a flexible shaft, 4 lets the pendulum swing freely.

    Every log, study and fit is written to DIR for the ordinary commands, and one report.html tells it all (report.pdf
    with the pdf extra).
    Ctrl-C keeps and reports what is there; the same command goes on from there.

    \b
    upright lab
    upright lab --rig linear --seed 3
    upright lab --experiment 1b --experiment 2 -o out
    """
    from upright.experiments.makes import make_named

    if seed < 0:
        raise BadInput(f"--seed needs a whole number of at least 0, got {seed}.")
    if rig:
        make_named(rig)
    folder = out or Path("-".join(["upright-lab", *([rig] if rig else []), *([str(seed)] if seed else [])]))
    if folder.exists() and not folder.is_dir():
        raise BadInput(f"results need a folder, but {folder} is a file; name another with -o.")
    from datetime import date

    from upright.experiments import laboratory
    from upright.report.html import write_html
    from upright.report.pdf import available, write_pdf

    laboratory.choose(experiment or (), rig)  # says what is wrong with the call before anything is written
    _say_first_time()
    with _ctrl_c() as pressed, progress_bar(quiet=as_json) as bar:
        session = laboratory.run_laboratory(
            experiment or (), rig, seed, folder, bar, stopped=lambda: pressed.times > 0, fresh=fresh
        )
        pressed.patient = True
        bar("writing the report", 1.0)
        told = laboratory.book(session, date.today())
        report = write_html(folder / "report.html", told)
        pdf = write_pdf(folder / "report.pdf", told) if available() else None
    if as_json:
        print_json(laboratory.summary(session, report, pdf))
    else:
        _tell(session, told, [report] if pdf is None else [report, pdf])
    if session.interrupted or pressed.times:
        raise typer.Exit(INTERRUPTED)


def _say_first_time() -> None:
    """Why the first run takes longer, where nothing is compiled yet."""
    from upright.simulation.kernel.compiled import folder

    if len(list(folder().glob("*.py"))) < 10:  # the whole laboratory needs 15
        typer.echo(
            "The first time, the equations of motion are compiled for this machine, about two minutes; afterwards the "
            "laboratory takes some 20 s.",
            err=True,
        )


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


def _tell(session: Session, told: Book, files: list[Path]) -> None:
    """Verdicts, key numbers, where the report is and what to try next."""
    from upright.report.terminal import print_book

    took = {
        t.experiment.key: f"{t.rig}{', as kept from an earlier run' if t.state == 'kept' else ''}; {t.seconds:.1f} s"
        for t in session.results
    }
    timed = replace(told, chapters=tuple(replace(c, about=took[c.key]) for c in told.chapters))
    print_book(console(), timed, files)
    typer.echo("Each chapter of the report ends with the commands that repeat its steps.")
    if len(files) == 1:
        typer.echo("PDF: pip install 'upright[pdf]' and run the same again; nothing is computed twice.")
