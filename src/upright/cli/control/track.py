"""How well does the far end of a flexible shaft follow?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.errors import BadInput

if TYPE_CHECKING:
    from collections.abc import Sequence

    from upright.lab.tracking_3.run import Tracking
    from upright.report.advice import Step

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
        float | None, typer.Option(metavar="U", help="Largest command; the make's own if left out.")
    ] = None,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for all files.")] = Path("track"),
    as_json: Annotated[bool, typer.Option("--json", help="Print track.json instead of tables.")] = False,
) -> None:
    r"""Make the far inertia of a flexible shaft follow a step (experiment 3).

    Identifies a twin from a few pulses, places the poles of Table 2, sizes the step by
    effort, twist and travel, foretells its figures and runs it; PD control stands beside.
    With a fit of your own rig the figures are foretold on the fitted numbers.

    \b
    upright track --rig torsional --seed 3 -o out
    upright track out/fit.json --set 4 --step "6 mm"
    """
    from upright.cli.terminal import progress_line
    from upright.design.requests import read_poles
    from upright.json_file import json_text, write_json
    from upright.lab.makes import SHAFTS, make_rig
    from upright.lab.tracking_3.chapter import chapter
    from upright.lab.tracking_3.pulses import rig_of_file
    from upright.lab.tracking_3.run import follow, run_tracking
    from upright.lab.tracking_3.tables import as_json as content_of
    from upright.report.chapter import write_chapter
    from upright.units import parse_if_given

    if out.exists() and not out.is_dir():
        raise BadInput(f"--out needs a folder, and '{out}' is a file; name another folder.")
    own = read_poles(poles) if poles else None
    which = _which(sets) if sets else (() if poles else (1, 2, 3, 4))
    if limit is not None and not limit > 0:
        raise BadInput(f"--limit must be above 0, got {limit:g}.")
    if source is None and rig not in SHAFTS:
        raise BadInput(f"--rig is {' or '.join(SHAFTS)}, got '{rig}'.")
    on = make_rig(rig, seed) if source is None else rig_of_file(source, limit)
    size = parse_if_given(step, on.plant.coordinates[-1].unit)
    if size is not None and not size > 0:
        raise BadInput(f"--step needs a size above 0, got '{step}'.")
    with progress_line(quiet=as_json) as tell:
        if source is None:
            on = replace(on, limit=limit or on.limit)
            done = run_tracking(on, seed, out, tell, which=which, poles=own, step=size)
        else:
            done = follow(on, on, source, None, None, tell, which=which, poles=own, step=size)
    told = chapter(done)
    content = write_json(out / "track.json", content_of(done) | {"verdict": told.verdict})
    titled = replace(told, title=f"Experiment 3: {told.title.lower()}, {done.rig.name}")
    page = write_chapter(out / "track.html", titled)
    if as_json:
        typer.echo(json_text(content))
    else:
        _say(done, told.verdict, (out / "track.json", page), told.steps)
    if done.interrupted:
        raise typer.Exit(INTERRUPTED)


def _which(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise BadInput(f'--set takes numbers of Table 2 separated by commas, as in "1,4", got {text[:40]!r}.') from None


def _say(done: Tracking, verdict: str, files: tuple[Path, Path], steps: Sequence[Step]) -> None:
    from rich.markup import escape

    from upright.cli.terminal import console, on_terminal
    from upright.lab.tracking_3 import tables

    screen = console()
    if done.fit is not None:
        screen.print(on_terminal(tables.fit_table(done)))
    for table in (tables.gain_table(done), tables.step_table(done)):
        screen.print(on_terminal(table))
    if done.pd is not None:
        screen.print(on_terminal(tables.friction_table(done)))
    screen.print(f"\n[bold]Verdict[/bold]: {escape(verdict)}", soft_wrap=True)
    screen.print(f"\nWritten: {escape(', '.join(str(f) for f in files))}", soft_wrap=True)
    screen.print("What next:", style="bold")
    for s in steps:
        screen.print(f"- {s.sentence}", soft_wrap=True, markup=False)
        screen.print(f"    {s.command}", soft_wrap=True, markup=False)
