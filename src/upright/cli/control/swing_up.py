"""Does the pendulum get up by itself?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, tell


def swing_up(
    source: Annotated[
        Path | None, typer.Argument(metavar="[FIT]", help="fit.json that the law is designed from; data sheet if none.")
    ] = None,
    rig: Annotated[str, typer.Option(help="furuta or linear; with FIT, whose data sheet counts.")] = "",
    seed: Annotated[int, typer.Option(min=0, help="Which rig of the make, 0 as designed, or that FIT allows.")] = 1,
    seconds: Annotated[float, typer.Option(min=1.0, max=120.0, help="Time for the way up and for holding.")] = 12.0,
    travel: Annotated[
        float | None,
        typer.Option(metavar="M_OR_RAD", help="How far the driven body may go; else what the rig says."),
    ] = None,
    limit: Annotated[
        float | None, typer.Option(metavar="U", help="Largest command, in its unit; the study's if left out.")
    ] = None,
    period: Annotated[str, typer.Option(metavar="TIME", help="Servo period; the study's if left out.")] = "",
    counts: Annotated[
        str, typer.Option(metavar="LIST", help='Encoder counts per turn or metre, "4096" or "x=20000, theta=4096".')
    ] = "",
    vendor: Annotated[
        str, typer.Option(metavar="NAME", help='Whose data sheet says the rest: "ECP 205" or "ECP 210".')
    ] = "",
    lie: Annotated[
        str, typer.Option(metavar="NAME=FACTOR", help='An encoder shows a multiple of what is true: "theta=2".')
    ] = "",
    check: Annotated[
        Path | None,
        typer.Option(metavar="LOG", help="Only say what this log of a hanging, driven rig tells of its encoders."),
    ] = None,
    out: Out = Path("swing-up"),
    pdf: Pdf = False,
    as_json: AsJson = False,
) -> None:
    """Swing a hanging pendulum up within the drive's limit and travel, and catch it; its encoders are asked first.

    The law is designed from a fit, or from the make's data sheet, and meets a twin
    with numbers of its own. Logs can be shown, identified and predicted as any other.

    upright swing-up --rig linear --seed 3

    With your own rig: drive it from rest, hanging, until it swings to 60 degrees or
    more, let it coast, and have its encoders checked (columns u, theta, psi or x).

    upright swing-up out/fit.json --check swings.csv
    """
    from upright.verbs import control as verbs

    done = verbs.swing_up(
        source,
        rig=rig,
        seed=seed,
        seconds=seconds,
        travel=travel,
        limit=limit,
        period=period,
        counts=counts,
        vendor=vendor,
        lie=lie,
        check=check,
        out=out,
        pdf=pdf,
    )
    tell(done.chapter, done.files, done.numbers if as_json else None)
    if not done.value.sound:  # whatever its model is worth
        raise typer.Exit(3)
