"""Does the pendulum get up by itself?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.errors import BadInput, nearest

if TYPE_CHECKING:
    from collections.abc import Mapping

    from upright.control import Rig


def swing_up(
    source: Annotated[
        Path | None, typer.Argument(metavar="[FIT]", help="fit.json that the law is designed from; data sheet if none.")
    ] = None,
    rig: Annotated[str, typer.Option(help="furuta or linear; a fit says which.")] = "",
    seed: Annotated[int, typer.Option(min=0, help="Which rig of the make; 0 is the one as designed.")] = 1,
    seconds: Annotated[float, typer.Option(min=1.0, max=120.0, help="Time for the way up and for holding.")] = 12.0,
    travel: Annotated[
        float | None,
        typer.Option(metavar="M_OR_RAD", help="How far the driven body may go; else what the rig says."),
    ] = None,
    lie: Annotated[
        str, typer.Option(metavar="NAME=FACTOR", help='An encoder shows a multiple of what is true: "theta=2".')
    ] = "",
    check: Annotated[
        Path | None,
        typer.Option(metavar="LOG", help="Only say what this log of a hanging, driven rig tells of its encoders."),
    ] = None,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Logs, page, JSON.")] = Path("swing-up"),
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers instead of sentences.")] = False,
) -> None:
    """Swing a hanging pendulum up within the drive's limit and travel, and catch it; its encoders are asked first.

    The law is designed from a fit, or from the make's data sheet, and meets a twin
    with numbers of its own. Logs can be shown, identified and predicted as any other.

    upright swing-up --rig linear --seed 3

    With your own rig: drive it from rest, hanging, until it swings to 60 degrees or
    more, let it coast, and have its encoders checked (columns u, theta, psi or x).

    upright swing-up out/fit.json --check swings.csv
    """
    from upright.cli.terminal import typed
    from upright.json_file import json_text, write_json
    from upright.lab.identified import read_identified
    from upright.lab.makes import make_rig
    from upright.lab.swing_up_2b import chapter as swing_up_page
    from upright.lab.swing_up_2b.run import known_of, run_swing_up
    from upright.report.chapter import write_chapter

    if out.exists() and not out.is_dir():
        raise BadInput(f"--out needs a folder, and '{out}' is a file; name another folder.")
    if travel is not None and not travel > 0:
        raise BadInput(f"--travel must be above 0, got {travel:g}; give it in m or rad.")
    known = None
    if source is None:
        make = rig or "furuta"
        model = make_rig(make)
    else:
        identified = read_identified(source, seed=seed)
        make, known = identified.make.key, known_of(identified)
        if rig and rig != make:
            raise BadInput(f"the fit is of the make {make}, and --rig says {rig}; leave --rig out.")
        model = identified.rig()
    if check is not None:
        _check(model, check, known, out, as_json, typed(source) if source else "FIT.json")
        return
    done = run_swing_up(
        model,
        _lying(make_rig(make, seed), lie),
        out,
        known=known,
        seconds=seconds,
        travel=travel,
        source=typed(source) if source else "",
    )
    told = swing_up_page.chapter(done)
    page = write_chapter(out / "swing_up.html", told)
    write_json(out / "swing_up.json", told.numbers)
    if as_json:
        typer.echo(json_text(told.numbers))
    else:
        _say(done.check.verdict, told.verdict, page, [(s.sentence, s.command) for s in told.steps])
    if not done.caught:
        raise typer.Exit(3)


def _check(model: Rig, log: Path, known: Mapping[str, float] | None, out: Path, as_json: bool, source: str) -> None:
    from upright.json_file import json_text
    from upright.lab.swing_up_2b import chapter as swing_up_page
    from upright.lab.swing_up_2b.run import scales_of_log
    from upright.readers import read
    from upright.report.chapter import write_chapter

    told = swing_up_page.check_chapter(model, scales_of_log(model, read(log), known), log.name, source)
    page = write_chapter(out / "encoders.html", told)
    if as_json:
        typer.echo(json_text(told.numbers))
    else:
        _say(told.verdict, "", page, [(s.sentence, s.command) for s in told.steps])
    if not told.sound:
        raise typer.Exit(3)


def _lying(rig: Rig, text: str) -> Rig:
    """The rig with one encoder that shows a multiple of what is true."""
    from dataclasses import replace

    if not text.strip():
        return rig
    names = [c.name for c in rig.plant.coordinates]
    name, _, value = (part.strip() for part in text.partition("="))
    if name not in names:
        raise BadInput(f"--lie names a coordinate as in \"theta=2\", got '{name}'; {nearest(name, names)}")
    try:
        factor = float(value)
    except ValueError:
        factor = 0.0
    if not 0.01 <= abs(factor) <= 100:
        raise BadInput(f"--lie needs a factor between 0.01 and 100, or negative for swapped channels, got '{value}'.")
    return replace(rig, scales=tuple(factor if n == name else 1.0 for n in names))


def _say(sensors: str, verdict: str, page: Path, steps: list[tuple[str, str]]) -> None:
    from upright.cli.terminal import console

    screen = console()
    screen.print(f"Encoders: {sensors}", soft_wrap=True, markup=False)
    if verdict:
        screen.print(f"\nVerdict: {verdict}", soft_wrap=True, markup=False)
    screen.print(f"\nReport: {page}\nWhat next:", soft_wrap=True, markup=False)
    for sentence, command in steps:
        screen.print(f"- {sentence}\n    {command}", soft_wrap=True, markup=False)
