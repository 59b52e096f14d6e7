"""Which gains hold this rig?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, tell
from upright.errors import BadInput, nearest
from upright.files import write_json
from upright.verbs.pages import write_page

if TYPE_CHECKING:
    from upright.experiments.identified import IdentifiedRig


def design(
    source: Annotated[Path, typer.Argument(metavar="STUDY_OR_FIT", help="fit.json, its folder, or a study (TOML).")],
    at: Annotated[str, typer.Option(metavar="NAME", help="Equilibrium; the last that the plant names.")] = "",
    poles: Annotated[str, typer.Option(metavar="LIST", help='Poles [1/s], as in "-4.15+-1.63j, -16.9, -3.2".')] = "",
    lqr: Annotated[str, typer.Option(metavar="LIST", help='Weights of the states, as in "1,0,1,0".')] = "",
    effort_weight: Annotated[
        float | None, typer.Option(metavar="R", help="Weight of the effort; without it --limit decides.")
    ] = None,
    limit: Annotated[float | None, typer.Option(metavar="U", help="Largest command, in the command's unit.")] = None,
    start: Annotated[
        str, typer.Option(metavar="LIST", help='Deviation to come back from, as in "theta=5 deg, psi_dot=0.2 rad/s".')
    ] = "",
    period: Annotated[str, typer.Option(metavar="TIME", help="Between samples.")] = "1 ms",
    delay: Annotated[float, typer.Option(metavar="SAMPLES", help="Computing a command takes so long.")] = 1.0,
    speed: Annotated[str, typer.Option(help="Velocities by plain or filtered difference, or kalman.")] = "filtered",
    memory: Annotated[float, typer.Option(help="a of the filtered difference, 0 to 1.")] = 0.5,
    lag: Annotated[str, typer.Option(metavar="TIME", help="Lag of the drive; the fit's if left out.")] = "",
    counts: Annotated[
        str,
        typer.Option(metavar="LIST", help='Encoder counts per turn or metre: one number, or "x=226629, theta=16000".'),
    ] = "16000",
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
    """
    from upright.experiments.designing.chapter import chapter
    from upright.experiments.designing.run import SPEEDS, DesignRequest, design_for
    from upright.experiments.identified import read_identified
    from upright.gains.requests import read_poles
    from upright.report.symbols import typed
    from upright.units import parse, parse_if_given

    if bool(poles) == bool(lqr):
        raise BadInput('give either --poles "-4+-2j, -10, -3" or --lqr "1,0,1,0" (weights of the states).')
    if speed not in SPEEDS:
        raise BadInput(f"--speed is plain, filtered or kalman, got '{speed}'.")
    rig = read_identified(source, seed=seed)
    here = at or list(rig.plant.equilibria)[-1]
    if here not in rig.plant.equilibria:
        raise BadInput(f"'{rig.name}' has no equilibrium '{here}'; {nearest(here, rig.plant.equilibria)}")
    wish = DesignRequest(
        at=here,
        poles=read_poles(poles) if poles else None,
        weights=_numbers(lqr) if lqr else None,
        R=effort_weight,
        period=parse(period, "s"),
        delay=delay,
        lag=parse_if_given(lag, "s"),
        speed=speed,
        memory=memory,
        quantum=_quanta(rig, counts),
        limit=limit,
        start=_start(rig, start),
        track=track,
        sampled=sampled,
    )
    done = design_for(rig, wish)
    told = chapter(done, source=typed(source), folder=typed(out))
    files = [write_json(out / "design.json", told.numbers), *write_page(told, out / "design.html", pdf)]
    tell(told, files, told.numbers if as_json else None)


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise BadInput(f'weights are numbers separated by commas, as in "1,0,1,0", got {text[:60]!r}.') from None


def _quanta(rig: IdentifiedRig, counts: str) -> tuple[float, ...]:
    """Step of every encoder [m or rad]; coordinates that the list does not name have 16000 counts."""
    from math import tau

    names = [c.name for c in rig.plant.coordinates]
    per = dict.fromkeys(names, 16_000.0)
    for part in counts.split(","):
        name, equals, value = part.rpartition("=")
        name = name.strip()
        if equals and name not in per:
            raise BadInput(
                f"--counts names coordinates as in \"{names[0]}=16000\", got '{name}'; {nearest(name, names)}"
            )
        try:
            number = float(value)
        except ValueError:
            number = 0.0
        if not 0 < number < 1e15:
            raise BadInput(
                f"--counts takes numbers above 0, got '{part.strip()[:40]}'; write 16000 or \"{names[0]}=16000\"."
            )
        per |= {name: number} if equals else dict.fromkeys(names, number)
    return tuple((tau if c.unit == "rad" else 1.0) / per[c.name] for c in rig.plant.coordinates)


def _start(rig: IdentifiedRig, text: str) -> tuple[float, ...]:
    """Deviation, state by state; empty when none was given."""
    from upright.units import parse

    if not text.strip():
        return ()
    names = rig.plant.state_names()
    units = dict(zip(names, (u for c in rig.plant.coordinates for u in (c.unit, f"{c.unit}/s")), strict=True))
    values = dict.fromkeys(names, 0.0)
    for part in text.split(","):
        name, _, value = part.partition("=")
        name = name.strip()
        if name not in values:
            raise BadInput(f"--start names states as in \"theta=5 deg\", got '{name}'; {nearest(name, names)}")
        values[name] = parse(value, units[name])
    if not any(values.values()):
        raise BadInput("--start must leave the equilibrium; give one state a value that is not 0.")
    return tuple(values.values())
