"""Does the pendulum get up by itself?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, tell
from upright.errors import BadInput, nearest
from upright.files import write_json
from upright.verbs.pages import write_page

if TYPE_CHECKING:
    from collections.abc import Mapping

    from upright.control import ServoRig


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
    from upright.experiments.identified import read_identified
    from upright.experiments.makes import make_rig
    from upright.experiments.swing_up_2b.chapter import chapter
    from upright.experiments.swing_up_2b.run import known_of, run_swing_up
    from upright.report.symbols import typed

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
        _check(model, check, known, out, pdf, as_json, typed(source) if source else "FIT.json")
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
    told = chapter(done)
    files = [*write_page(told, out / "swing_up.html", pdf), write_json(out / "swing_up.json", told.numbers)]
    tell(told, files, told.numbers if as_json else None)
    if not done.caught:
        raise typer.Exit(3)


def _check(
    model: ServoRig, log: Path, known: Mapping[str, float] | None, out: Path, pdf: bool, as_json: bool, source: str
) -> None:
    from upright.experiments.swing_up_2b.chapter import check_chapter
    from upright.experiments.swing_up_2b.run import scales_of_log
    from upright.readers import read

    told = check_chapter(model, scales_of_log(model, read(log), known), log.name, source)
    tell(told, write_page(told, out / "encoders.html", pdf), told.numbers if as_json else None)
    if not told.sound:
        raise typer.Exit(3)


def _lying(rig: ServoRig, text: str) -> ServoRig:
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
