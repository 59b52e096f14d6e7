"""Which gains will hold this rig, and did they?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, progress_bar, tell
from upright.errors import BadInput
from upright.verbs.pages import write_page

if TYPE_CHECKING:
    from upright.experiments.regulation_2.run import RegulationRequest


def regulate(
    source: Annotated[
        Path | None, typer.Argument(metavar="[FIT]", help="fit.json or its folder; without it a twin is identified.")
    ] = None,
    rig: Annotated[str, typer.Option(metavar="MAKE", help="Twin to identify: furuta or linear.")] = "",
    seed: Annotated[
        int | None, typer.Option(min=0, help="Which twin of the make runs; with FIT and no seed nothing is run.")
    ] = None,
    which: Annotated[str, typer.Option("--set", metavar="N", help="Pole set of Table 1, 1 to 4, or all.")] = "",
    poles: Annotated[str, typer.Option(metavar="LIST", help='Poles [1/s] of your own: "-4.15+-1.63j, -16, -3".')] = "",
    speed: Annotated[str, typer.Option(help="Velocities by plain or filtered difference, or kalman.")] = "filtered",
    memory: Annotated[float, typer.Option(help="a of the filtered difference, 0 to 1.")] = 0.5,
    tilt: Annotated[str, typer.Option(metavar="ANGLE", help='From upright when let go, as in "12 deg".')] = "",
    push: Annotated[str, typer.Option(metavar="SPEED", help='Of the pendulum then, outwards: "1.5 rad/s".')] = "",
    seconds: Annotated[float, typer.Option(help="Length of a run.")] = 6.0,
    out: Out = Path("upright-regulate"),
    pdf: Pdf = False,
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
    from upright.experiments.identified import read_identified
    from upright.experiments.makes import make_rig
    from upright.experiments.regulation_2.chapter import chapter
    from upright.experiments.regulation_2.run import identify_make, run_regulation
    from upright.report.symbols import typed

    wish = _wish(which, poles, speed, memory, tilt, push, seconds)
    with progress_bar(quiet=as_json) as bar:
        if source is None:
            make, seed = rig or "furuta", seed or 0
            bar("identifying the hanging twin", 0.0)
            known = identify_make(make, seed, out / "identified", lambda step, share: bar(step, 0.6 * share))
            name = f"--rig {make}"
        else:
            known, name = read_identified(source, seed=seed or 0), typed(source)
            make = known.make.key
            if rig not in ("", make):
                raise BadInput(f"{source} is of the make '{make}', not '{rig}'; leave --rig out.")
        truth = None if seed is None else make_rig(make, seed)
        base = 0.6 if source is None else 0.0
        done = run_regulation(
            known, truth, seed or 0, out, lambda step, share: bar(step, base + (1 - base) * share), wish=wish,
            source=name,
        )  # fmt: skip
    told = chapter(done)
    files = write_page(told, out / "report.html", pdf)
    numbers = {**told.numbers, "verdict": told.verdict, "report": str(files[0])}
    tell(told, files, numbers if as_json else None)


def _wish(which: str, poles: str, speed: str, memory: float, tilt: str, push: str, seconds: float) -> RegulationRequest:
    from upright.experiments.regulation_2.run import SETS, RegulationRequest
    from upright.gains.requests import read_poles
    from upright.units import parse_if_given

    if which and poles:
        raise BadInput("give either --set, a set of Table 1, or --poles of your own.")
    if which not in ("", "all") and f"set {which}" not in SETS:
        raise BadInput(f"--set is 1 to {len(SETS)}, or all, got '{which}'.")
    texts = {"your poles": poles} if poles else {n: t for n, t in SETS.items() if which in ("", "all", n[4:])}
    return RegulationRequest(
        poles={n: read_poles(t) for n, t in texts.items()}, speed=speed, memory=memory, seconds=seconds,
        tilt=parse_if_given(tilt, "rad"), push=parse_if_given(push, "rad/s"),
    )  # fmt: skip
