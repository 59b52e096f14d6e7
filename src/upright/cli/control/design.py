"""Which gains hold this rig?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, tell


def design(
    source: Annotated[
        Path | None, typer.Argument(metavar="STUDY_OR_FIT", help="fit.json, its folder, or a study (TOML).")
    ] = None,
    matrices: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Plain matrices instead: TOML with A and B; C, D, dt, names, units if any."),
    ] = None,
    at: Annotated[str, typer.Option(metavar="NAME", help="Equilibrium; the last that the plant names.")] = "",
    poles: Annotated[str, typer.Option(metavar="LIST", help='Poles [1/s], as in "-4.15+-1.63j, -16.9, -3.2".')] = "",
    lqr: Annotated[str, typer.Option(metavar="LIST", help='Weights of the states, as in "1,0,1,0".')] = "",
    effort_weight: Annotated[
        float | None, typer.Option(metavar="R", help="Weight of the effort; without it --limit decides.")
    ] = None,
    limit: Annotated[
        float | None, typer.Option(metavar="U", help="Largest command, in its unit; the study's if left out.")
    ] = None,
    start: Annotated[
        str, typer.Option(metavar="LIST", help='Deviation to come back from, as in "theta=5 deg, psi_dot=0.2 rad/s".')
    ] = "",
    period: Annotated[str, typer.Option(metavar="TIME", help="Between samples; the study's if left out.")] = "",
    delay: Annotated[
        float | None, typer.Option(metavar="SAMPLES", help="Commands act so late in all; the fit's, else 1.")
    ] = None,
    speed: Annotated[
        str,
        typer.Option(
            metavar="WAY",
            help="Velocities by plain or filtered difference, or kalman; filtered if left out. Of matrices measured, "
            "filtered, plain or observer; the first that fits if left out.",
        ),
    ] = "",
    memory: Annotated[float, typer.Option(help="a of the filtered difference, 0 to 1.")] = 0.5,
    lag: Annotated[str, typer.Option(metavar="TIME", help="Lag of the drive; the fit's if left out.")] = "",
    counts: Annotated[
        str,
        typer.Option(metavar="LIST", help='Encoder counts per turn or metre, "4096" or "x=20000, theta=4096".'),
    ] = "",
    vendor: Annotated[
        str, typer.Option(metavar="NAME", help='Whose data sheet says the rest: "ECP 205" or "ECP 210".')
    ] = "",
    track: Annotated[str, typer.Option(metavar="COORDINATE", help="Coordinate that follows a reference.")] = "",
    sampled: Annotated[bool, typer.Option("--sampled", help="Gains whose sampled loop has the poles asked.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the rigs drawn from the fit's covariance.")] = 0,
    out: Out = Path(),
    pdf: Pdf = False,
    as_json: AsJson = False,
) -> None:
    """Find the gains that hold a rig, and say what they are worth in the loop that a computer runs.

    The numbers are those identified (hanging, for instance); the model is the one
    about another equilibrium, upright. Poles are placed by Ackermann's formula, or
    chosen by least cost; period, delay and differenced encoders are then put in.

    upright design out/fit.json --at inverted --poles "-4.15+-1.63j, -16.9, -3.2"
    upright design --matrices model.toml --poles "-4, -5" --period "2 ms"
    """
    from upright.verbs import control as verbs

    done = verbs.design(
        source, matrices=matrices, at=at, poles=poles, lqr=lqr, effort_weight=effort_weight, limit=limit, start=start,
        period=period, delay=delay, speed=speed, memory=memory, lag=lag, counts=counts, vendor=vendor, track=track,
        sampled=sampled, seed=seed, out=out, pdf=pdf,
    )  # fmt: skip
    tell(done.chapter, done.files, done.numbers if as_json else None)
