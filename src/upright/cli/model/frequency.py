"""What does the rig answer to sines, and how fast will it fall?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.cli.terminal import AsJson, Data, Out, Pdf, progress_bar, tell, write_page
from upright.errors import BadInput
from upright.progress import Progress

if TYPE_CHECKING:
    from upright.report.page import Chapter

KINDS = ("sines", "multisine", "sweep")


def frequency(
    sources: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[LOG...]", help="Logs (repeats together), a frequency.csv, or a study; else a twin."),
    ] = None,
    rig: Annotated[
        str,
        typer.Option(metavar="KIND", help="Twin, or make of the logged rig: furuta, linear, rectilinear, torsional."),
    ] = "",
    seed: Annotated[int, typer.Option(min=0, help="Which twin of the make; 0 is the one as designed.")] = 0,
    ask: Annotated[str, typer.Option(metavar="HOW", help="Ask the twin by sines, multisine or sweep.")] = "sines",
    kind: Annotated[str, typer.Option(metavar="HOW", help="What a log holds, when it is not told rightly.")] = "",
    command: Annotated[str, typer.Option(metavar="COLUMN", help="Column that drives.")] = "",
    signal: Annotated[
        list[str] | None, typer.Option(metavar="NAME=COLUMN", help="Column of a coordinate, as in theta=enc2.")
    ] = None,
    counts: Annotated[
        list[str] | None, typer.Option(metavar="NAME=N", help="Counts per rad or m; negative if reversed.")
    ] = None,
    known: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help='As in "m_p=135 g +- 0.2 %"; fixes the scale.')
    ] = None,
    hold: Annotated[str, typer.Option(metavar="TIME", help="How long a command is held; one sample.")] = "",
    low: Annotated[float | None, typer.Option("--from", metavar="W", help="Least frequency, in rad/s.")] = None,
    high: Annotated[float | None, typer.Option("--to", metavar="W", help="Greatest frequency, in rad/s.")] = None,
    data: Data = None,
    out: Out = Path("frequency"),
    pdf: Pdf = False,
    as_json: AsJson = False,
) -> None:
    r"""Measure or read a frequency response and fit the rig to it (experiment 1b).

    Fits by the paper's simplex on squared dB and by least squares with phase, weights and dry friction, side by side;
    fit.json goes to upright design. A log without --rig gives the response alone.

    \b
    upright frequency --rig furuta --seed 3 -o out
    upright frequency sweep.csv --rig linear --known "m_p=135 g +- 0.2 %" -o out
    upright frequency one.txt two.txt --command v --signal theta=theta
    """
    for value, option in ((ask, "--ask"), (kind or "sines", "--kind")):
        if value not in KINDS:
            raise BadInput(f"{option} is one of {', '.join(KINDS)}, got '{value}'.")
    if sources:
        files, told = _of_logs(
            sources, out, data, rig=rig, command=command, kind=kind, seed=seed, hold=hold,
            signals=_pairs(signal, "--signal"), counts=_pairs(counts, "--counts"), known=_pairs(known, "--known"),
            band=(low or 0.0, high or float("inf")),
        )  # fmt: skip
    else:
        for value, option in ((signal, "--signal"), (counts, "--counts"), (known, "--known"), (command, "--command")):
            if value:
                raise BadInput(f"{option} belongs to a log, and none was named; name one, or leave the option out.")
        with progress_bar(quiet=as_json) as bar:
            files, told = _of_twin(rig or "furuta", seed, ask, out, bar)
    files += write_page(told, out / "report.html", pdf)
    numbers = {"verdict": told.verdict, "sound": told.sound, **told.numbers, "files": [str(f) for f in files]}
    tell(told, files, numbers if as_json else None)


def _of_twin(make: str, seed: int, ask: str, out: Path, progress: Progress) -> tuple[list[Path], Chapter]:
    from upright.experiments.frequency_1b.chapter import chapter
    from upright.experiments.frequency_1b.run import run_frequency
    from upright.experiments.makes import make_named

    make_named(make)
    done = run_frequency(make, seed, out, progress, kind=ask)
    return [out / "frequency.csv", out / "sweep.csv", out / "fit.json"], chapter(done)


def _of_logs(
    sources: list[Path], out: Path, data: Path | None, *, rig: str, command: str, kind: str, seed: int,
    hold: str, signals: dict[str, str], counts: dict[str, str], known: dict[str, str], band: tuple[float, float],
) -> tuple[list[Path], Chapter]:  # fmt: skip
    from upright.experiments.frequency_1b.chapter import log_chapter
    from upright.experiments.frequency_1b.run import LogRequest, response_of_logs
    from upright.units import parse_if_given

    wish = LogRequest(
        make=rig, command=command, signals=signals, kind=kind, seed=seed, hold=parse_if_given(hold, "s"),
        counts={n: _count(n, v) for n, v in counts.items()}, band=band if band != (0.0, float("inf")) else None,
        known={n: _known(n, v, rig) for n, v in known.items()},
    )  # fmt: skip
    found = response_of_logs(sources, wish, out, data=data)
    return [out / "frequency.csv", *([out / "fit.json"] if found.answer else [])], log_chapter(found)


def _pairs(texts: list[str] | None, option: str) -> dict[str, str]:
    out: dict[str, str] = {}
    for text in texts or ():
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise BadInput(f"{option} takes NAME=VALUE, got '{text}'.")
        out[name.strip()] = value.strip()
    return out


def _count(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if value == 0:
        raise BadInput(f"--counts {name} needs a number that is not 0, got '{text}'.")
    return value


def _known(name: str, text: str, make: str) -> tuple[float, float]:
    """Value and standard uncertainty [SI]."""
    from upright.experiments.makes import MAKES

    if make not in MAKES:
        raise BadInput("--known belongs to a fit; name the rig with --rig too.")
    from upright.units import measured

    plant = MAKES[make].plant
    if name in plant.names():
        return measured(text, plant.quantity(name).unit)
    return measured(text, "s" if name in ("actuator.delay", "actuator.lag") else "")
