"""How well does the far end of a flexible shaft follow?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, progress_bar, tell
from upright.errors import BadInput
from upright.files import write_json
from upright.verbs.pages import write_page

if TYPE_CHECKING:
    pass

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
    from upright.experiments.makes import SHAFTS, make_rig
    from upright.experiments.tracking_3.chapter import chapter
    from upright.experiments.tracking_3.pulses import rig_of_file
    from upright.experiments.tracking_3.run import follow, run_tracking
    from upright.gains.requests import read_poles
    from upright.units import parse_if_given

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
    with progress_bar(quiet=as_json) as bar:
        if source is None:
            on = replace(on, limit=limit or on.limit)
            done = run_tracking(on, seed, out, bar, which=which, poles=own, step=size)
        else:
            done = follow(on, on, source, None, None, bar, which=which, poles=own, step=size)
    told = chapter(done)
    told = replace(told, title=f"Experiment 3: {told.title.lower()}, {done.rig.name}")
    numbers = {**told.numbers, "verdict": told.verdict}
    files = [write_json(out / "track.json", numbers), *write_page(told, out / "track.html", pdf)]
    tell(told, files, numbers if as_json else None)
    if done.interrupted:
        raise typer.Exit(INTERRUPTED)


def _which(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise BadInput(f'--set takes numbers of Table 2 separated by commas, as in "1,4", got {text[:40]!r}.') from None
