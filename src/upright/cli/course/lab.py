"""What does the whole paper look like when nothing is at hand but this program?"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.cli.control.run import view
from upright.cli.terminal import Processes, console, print_json, progress_bar, step_lines

if TYPE_CHECKING:
    from upright.verbs.course import Laboratory

INTERRUPTED = 130


def lab(
    experiment: Annotated[
        list[str] | None,
        typer.Option("--experiment", "-e", metavar="1|1a|1b|2|2b|3|4", help="Only this one, and what it stands on."),
    ] = None,
    rig: Annotated[
        str,
        typer.Option(
            "--rig",
            metavar="KIND|RIG.toml",
            help="linear, furuta, rectilinear or torsional, else the paper's; or a rig at hand.",
        ),
    ] = "",
    seed: Annotated[int, typer.Option(help="Which rig of the make; 0 is the one as designed.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="DIR", help="Folder; upright-lab[-KIND][-SEED][-worn] without it."),
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Make again what the folder holds already.")] = False,
    workers: Processes = 1,
    worn: Annotated[
        bool, typer.Option("--worn", help="Rigs with physics that no model has, such as stiction, ripple and play.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON instead of sentences.")] = False,
) -> None:
    r"""Run the experiments of the paper on simulated rigs, or on yours: identify, flip, design, hold, swing, report.

    1a weighs the rig with known added masses, 1b fits its frequency response hanging, 2 holds it upright with gains
    from that fit, 2b swings it up and catches it, 3 tracks through a flexible shaft, 4 lets the pendulum swing freely.

    With a RIG.toml they are made on the rig itself; you are asked for what no drive can do.

    Every log, study and fit is written to DIR for the ordinary commands, and one report.html tells it all (report.pdf
    with the pdf extra).
    Ctrl-C keeps and reports what is there; the same command goes on from there.

    \b
    upright lab
    upright lab --rig linear --seed 3
    upright lab --rig furuta --worn
    upright lab --experiment 1b --experiment 2 -o out
    upright lab --rig RIG.toml
    """
    from upright.verbs import course as verbs

    at_hand = rig.endswith(".toml")
    with step_lines(quiet=as_json) if at_hand else progress_bar(quiet=as_json) as progress:
        done = verbs.lab(
            experiment=experiment or (), rig=rig, seed=seed, out=out, fresh=fresh, workers=workers, worn=worn,
            progress=progress, ask=_asks if at_hand and sys.stdin.isatty() else None,
            watching=partial(view, quiet=as_json) if at_hand else None,
        )  # fmt: skip
    if as_json:
        print_json(done.numbers)
    else:
        _tell(done.value, done.files)
    if done.value.interrupted:
        raise typer.Exit(INTERRUPTED)


def _asks(sentence: str) -> bool:
    try:
        return typer.confirm(f"{sentence} Ready?", default=True, err=True)
    except typer.Abort:
        raise KeyboardInterrupt from None


def _tell(done: Laboratory, files: Sequence[Path]) -> None:
    """Verdicts, key numbers, where the report is and what to try next."""
    from upright.report.terminal import print_book

    took = {
        t.experiment.key: f"{t.rig}{', as kept from an earlier run' if t.state == 'kept' else ''}; {t.seconds:.1f} s"
        for t in done.session.results
    }
    timed = replace(done.book, chapters=tuple(replace(c, about=took[c.key]) for c in done.book.chapters))
    print_book(console(), timed, files)
    typer.echo("Each chapter of the report ends with the commands that repeat its steps.")
    if len(files) == 1:
        typer.echo("PDF: pip install 'upright[pdf]' and run the same again; nothing is computed twice.")
