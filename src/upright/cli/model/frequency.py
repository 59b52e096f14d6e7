"""What does the rig answer to sines, and how fast will it fall?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, Data, Out, Pdf, progress_bar, tell


def frequency(
    sources: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[LOG...]", help="Logs (repeats together), a frequency.csv, or a study; else a twin."),
    ] = None,
    rig: Annotated[
        str,
        typer.Option(metavar="KIND", help="Twin, or make of the logged rig: furuta, linear, rectilinear, torsional."),
    ] = "",
    seed: Annotated[int, typer.Option(min=0, help="Which twin of the make; 0 is the one as designed.")] = 0,
    ask: Annotated[str, typer.Option(metavar="HOW", help="Ask the twin by sines, multisine or sweep.")] = "sines",
    kind: Annotated[str, typer.Option(metavar="HOW", help="What a log holds, when it is not told rightly.")] = "",
    command: Annotated[str, typer.Option(metavar="COLUMN", help="Column that drives.")] = "",
    signal: Annotated[
        list[str] | None, typer.Option(metavar="NAME=COLUMN", help="Column of a coordinate, as in theta=enc2.")
    ] = None,
    counts: Annotated[
        list[str] | None, typer.Option(metavar="NAME=N", help="Counts per rad or m; negative if reversed.")
    ] = None,
    known: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help='As in "m_p=135 g +- 0.2 %"; fixes the scale.')
    ] = None,
    hold: Annotated[str, typer.Option(metavar="TIME", help="How long a command is held; one sample.")] = "",
    low: Annotated[float | None, typer.Option("--from", metavar="W", help="Least frequency, in rad/s.")] = None,
    high: Annotated[float | None, typer.Option("--to", metavar="W", help="Greatest frequency, in rad/s.")] = None,
    data: Data = None,
    out: Out = Path("frequency"),
    pdf: Pdf = False,
    as_json: AsJson = False,
) -> None:
    r"""Measure or read a frequency response and fit the rig to it (experiment 1b).

    Fits by the paper's simplex on squared dB and by least squares with phase, weights and dry friction, side by side;
    fit.json goes to upright design. A log without --rig gives the response alone.

    \b
    upright frequency --rig furuta --seed 3 -o out
    upright frequency sweep.csv --rig linear --known "m_p=135 g +- 0.2 %" -o out
    upright frequency one.txt two.txt --command v --signal theta=theta
    """
    from upright.verbs import model as verbs

    with progress_bar(quiet=as_json or bool(sources)) as bar:
        found = verbs.frequency(
            sources or (), rig=rig, seed=seed, ask=ask, kind=kind, command=command, signal=signal or (),
            counts=counts or (), known=known or (), hold=hold, low=low, high=high, data=data, out=out, pdf=pdf,
            progress=bar,
        )  # fmt: skip
    told, files = found.chapter, found.files
    numbers = {"verdict": told.verdict, "sound": told.sound, **told.numbers, "files": [str(f) for f in files]}
    tell(told, files, numbers if as_json else None)
