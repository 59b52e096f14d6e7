"""Which gains will hold this rig, and did they?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.lab.regulation_2.run import Regulation, RegulationRequest


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
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="For logs and report.")] = Path(
        "upright-regulate"
    ),
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON instead of tables.")] = False,
) -> None:
    r"""Hold an identified rig upright; say beforehand what each pole set will come to, then run it.

    Gains are placed on the numbers identified while the rig hung. What will come is
    simulated with limit, counts, delay and dry friction, on rigs as the fit's covariance
    allows; the laws then run on a twin, and both are put side by side.

    \b
    upright regulate --rig furuta --seed 3
    upright regulate out/fit.json --seed 3 --set 2 --tilt "20 deg"
    """
    from upright.cli.terminal import step_bar
    from upright.json_file import json_text
    from upright.lab.identified import read_identified
    from upright.lab.makes import make_rig
    from upright.lab.regulation_2 import chapter as regulation_page
    from upright.lab.regulation_2.run import identify_make, run_regulation
    from upright.report.chapter import write_chapter
    from upright.report.symbols import typed

    if out.exists() and not out.is_dir():
        raise BadInput(f"--out needs a folder, and '{out}' is a file; name another folder.")
    wish = _wish(which, poles, speed, memory, tilt, push, seconds)
    with step_bar(quiet=as_json) as tell:
        if source is None:
            make, seed = rig or "furuta", seed or 0
            tell("identifying the hanging twin", 0.0)
            known = identify_make(make, seed, out / "identified", lambda step, share: tell(step, 0.6 * share))
            name = f"--rig {make}"
        else:
            known, name = read_identified(source, seed=seed or 0), typed(source)
            make = known.make.key
            if rig not in ("", make):
                raise BadInput(f"{source} is of the make '{make}', not '{rig}'; leave --rig out.")
        truth = None if seed is None else make_rig(make, seed)
        base = 0.6 if source is None else 0.0
        done = run_regulation(
            known, truth, seed or 0, out, lambda step, share: tell(step, base + (1 - base) * share), wish=wish,
            source=name,
        )  # fmt: skip
        chapter = regulation_page.chapter(done)
        report = write_chapter(out / "report.html", chapter)
    if as_json:
        content: dict[str, Any] = {**chapter.numbers, "verdict": chapter.verdict, "report": str(report)}
        typer.echo(json_text(content))
        return
    _say(done, chapter, report)


def _wish(which: str, poles: str, speed: str, memory: float, tilt: str, push: str, seconds: float) -> RegulationRequest:
    from upright.design.requests import read_poles
    from upright.lab.regulation_2.run import SETS, RegulationRequest
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


def _say(done: Regulation, chapter: Any, report: Path) -> None:
    from rich.markup import escape

    from upright.cli.terminal import console, on_terminal
    from upright.lab.regulation_2 import chapter as regulation_page
    from upright.lab.regulation_2 import sentences as regulation_told

    screen = console()
    tables = [regulation_page.gain_table(done), regulation_page.told_table(done)]
    for table in tables + ([regulation_page.way_table(done)] if done.ways else []):
        screen.print(on_terminal(table))
    screen.print()
    for a in done.attempts:
        screen.print(f"- {escape(regulation_told.sentence(done, a))}", soft_wrap=True)
    screen.print(f"\n[bold]Verdict[/bold]: {escape(chapter.verdict)} {escape(chapter.detail)}", soft_wrap=True)
    screen.print(f"\nReport: {escape(str(report))} (open it in a browser)\nWhat next:", soft_wrap=True)
    for step in chapter.steps:
        screen.print(f"- {step.sentence}", soft_wrap=True, markup=False)
        if step.command:
            screen.print(f"    {step.command}", soft_wrap=True, markup=False)
