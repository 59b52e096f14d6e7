"""Which gains will hold this rig, and did they?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, Cluster, Out, Pdf, Processes, progress_bar, tell


def regulate(
    source: Annotated[
        Path | None, typer.Argument(metavar="[FIT]", help="fit.json or its folder; without it a twin is identified.")
    ] = None,
    rig: Annotated[
        str, typer.Option(metavar="MAKE", help="Twin to identify: furuta or linear; with FIT, whose data sheet counts.")
    ] = "",
    seed: Annotated[
        int | None, typer.Option(min=0, help="Which twin, or rig that FIT allows, runs; with FIT and no seed none.")
    ] = None,
    which: Annotated[str, typer.Option("--set", metavar="N", help="Pole set of Table 1, 1 to 4, or all.")] = "",
    poles: Annotated[str, typer.Option(metavar="LIST", help='Poles [1/s] of your own: "-4.15+-1.63j, -16, -3".')] = "",
    speed: Annotated[str, typer.Option(help="Velocities by plain or filtered difference, or kalman.")] = "filtered",
    memory: Annotated[float, typer.Option(help="a of the filtered difference, 0 to 1.")] = 0.5,
    tilt: Annotated[str, typer.Option(metavar="ANGLE", help='From upright when let go, as in "12 deg".')] = "",
    push: Annotated[str, typer.Option(metavar="SPEED", help='Of the pendulum then, outwards: "1.5 rad/s".')] = "",
    seconds: Annotated[float, typer.Option(help="Length of a run.")] = 6.0,
    draws: Annotated[int, typer.Option(min=1, help="Rigs that the fit allows, for the chance.")] = 200,
    limit: Annotated[
        float | None, typer.Option(metavar="U", help="Largest command, in its unit; the study's if left out.")
    ] = None,
    period: Annotated[str, typer.Option(metavar="TIME", help="Servo period; the study's if left out.")] = "",
    counts: Annotated[
        str, typer.Option(metavar="LIST", help='Encoder counts per turn or metre, "4096" or "x=20000, theta=4096".')
    ] = "",
    travel: Annotated[
        float | None, typer.Option(metavar="M_OR_RAD", help="How far the driven body may go; the study's if left out.")
    ] = None,
    vendor: Annotated[
        str, typer.Option(metavar="NAME", help='Whose data sheet says the rest: "ECP 205" or "ECP 210".')
    ] = "",
    out: Out = Path("upright-regulate"),
    pdf: Pdf = False,
    workers: Processes = 1,
    cluster: Cluster = "",
    as_json: AsJson = False,
) -> None:
    r"""Hold an identified rig upright; say beforehand what each pole set will come to, then run it.

    Gains are placed on the numbers identified while the rig hung. What will come is
    simulated with limit, counts, delay and dry friction, on rigs as the fit's covariance
    allows; the laws then run on a twin, and both are put side by side.

    \b
    upright regulate --rig furuta --seed 3
    upright regulate out/fit.json --seed 3 --set 2 --tilt "20 deg"
    """
    from upright.verbs import control as verbs

    with progress_bar(quiet=as_json) as bar:
        done = verbs.regulate(
            source, rig=rig, seed=seed, which=which, poles=poles, speed=speed, memory=memory, tilt=tilt, push=push,
            seconds=seconds, draws=draws, limit=limit, period=period, counts=counts, travel=travel, vendor=vendor,
            out=out, pdf=pdf, workers=workers, cluster=cluster, progress=bar,
        )  # fmt: skip
    numbers = {**done.numbers, "verdict": done.chapter.verdict, "report": str(done.files[0])}
    tell(done.chapter, done.files, numbers if as_json else None)
