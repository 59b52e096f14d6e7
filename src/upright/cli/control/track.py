"""How well does the far end of a flexible shaft follow?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, progress_bar, tell

INTERRUPTED = 130


def track(
    source: Annotated[
        Path | None, typer.Argument(metavar="[FIT]", help="fit.json, its folder, or a study; a twin without it.")
    ] = None,
    rig: Annotated[
        str, typer.Option(help="Twin to run on: rectilinear (ECP 210) or torsional (ECP 205).")
    ] = "rectilinear",
    seed: Annotated[int, typer.Option(min=0, help="Which twin of the make; 0 is the one as designed.")] = 0,
    sets: Annotated[str, typer.Option("--set", metavar="LIST", help="Sets of Table 2, as in 1,4.")] = "",
    poles: Annotated[str, typer.Option(metavar="LIST", help='Poles [1/s] of your own: "-10+-20j, -25+-10j".')] = "",
    step: Annotated[str, typer.Option(metavar="SIZE", help='Size of the step, as in "5 mm" or "10 deg".')] = "",
    limit: Annotated[
        float | None, typer.Option(metavar="U", help="Largest command; the make's own, or the study's, if left out.")
    ] = None,
    period: Annotated[str, typer.Option(metavar="TIME", help="Servo period; the study's if left out.")] = "",
    counts: Annotated[
        str, typer.Option(metavar="LIST", help='Encoder counts per turn or metre, "4096" or "x=20000, theta=4096".')
    ] = "",
    vendor: Annotated[
        str, typer.Option(metavar="NAME", help='Whose data sheet says the rest: "ECP 205" or "ECP 210".')
    ] = "",
    out: Out = Path("track"),
    pdf: Pdf = False,
    as_json: AsJson = False,
) -> None:
    r"""Make the far inertia of a flexible shaft follow a step (experiment 3).

    Identifies a twin from a few pulses, places the poles of Table 2, sizes the step by
    effort, twist and travel, foretells its figures and runs it; PD control stands beside.
    With a fit of your own rig the figures are foretold on the fitted numbers.

    \b
    upright track --rig torsional --seed 3 -o out
    upright track out/fit.json --set 4 --step "6 mm"
    """
    from upright.verbs import control as verbs

    with progress_bar(quiet=as_json) as bar:
        done = verbs.track(
            source,
            rig=rig,
            seed=seed,
            sets=sets,
            poles=poles,
            step=step,
            limit=limit,
            period=period,
            counts=counts,
            vendor=vendor,
            out=out,
            pdf=pdf,
            progress=bar,
        )
    tell(done.chapter, done.files, done.numbers if as_json else None)
    if done.value.interrupted:
        raise typer.Exit(INTERRUPTED)
