"""What does the rig answer to sines, and how fast will it fall?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.identification.frequency.answer import Answer
    from upright.report.chapter import Chapter

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
    data: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of a study's logs.")] = None,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for results.")] = Path("frequency"),
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON instead of tables.")] = False,
) -> None:
    r"""Measure or read a frequency response and fit the rig to it (experiment 1b).

    Fits by the paper's simplex on squared dB and by least squares with phase, weights and dry friction, side by side;
    fit.json goes to upright design. A log without --rig gives the response alone.

    \b
    upright frequency --rig furuta --seed 3 -o out
    upright frequency sweep.csv --rig linear --known "m_p=135 g +- 0.2 %" -o out
    upright frequency one.txt two.txt --command v --signal theta=theta
    """
    if out.exists() and not out.is_dir():
        raise BadInput(f"--out needs a folder, and '{out}' is a file; name another folder.")
    for value, option in ((ask, "--ask"), (kind or "sines", "--kind")):
        if value not in KINDS:
            raise BadInput(f"{option} is one of {', '.join(KINDS)}, got '{value}'.")
    if sources:
        _read(sources, out, data, as_json, rig=rig, command=command, kind=kind, seed=seed, hold=hold,
              signals=_pairs(signal, "--signal"), counts=_pairs(counts, "--counts"), known=_pairs(known, "--known"),
              band=(low or 0.0, high or float("inf")))  # fmt: skip
        return
    for value, option in ((signal, "--signal"), (counts, "--counts"), (known, "--known"), (command, "--command")):
        if value:
            raise BadInput(f"{option} belongs to a log, and none was named; name one, or leave the option out.")
    _twin(rig or "furuta", seed, ask, out, as_json)


def _twin(make: str, seed: int, ask: str, out: Path, as_json: bool) -> None:
    from upright.cli.terminal import progress_line
    from upright.lab.frequency_1b.chapter import chapter
    from upright.lab.frequency_1b.run import run_frequency
    from upright.lab.makes import make_named
    from upright.report.chapter import write_chapter

    make_named(make)
    with progress_line(quiet=as_json) as tell:
        done = run_frequency(make, seed, out, tell, kind=ask)
    told = chapter(done)
    page = write_chapter(out / "report.html", told)
    _say(told, done.answer, (out / "frequency.csv", out / "sweep.csv", out / "fit.json", page), as_json, done.truth)


def _read(
    sources: list[Path], out: Path, data: Path | None, as_json: bool, *, rig: str, command: str, kind: str, seed: int,
    hold: str, signals: dict[str, str], counts: dict[str, str], known: dict[str, str], band: tuple[float, float],
) -> None:  # fmt: skip
    from upright.lab.frequency_1b.chapter import of_log
    from upright.lab.frequency_1b.from_logs import LogRequest, response_of_logs
    from upright.report.chapter import write_chapter
    from upright.units import parse_if_given

    wish = LogRequest(
        make=rig, command=command, signals=signals, kind=kind, seed=seed, hold=parse_if_given(hold, "s"),
        counts={n: _count(n, v) for n, v in counts.items()}, band=band if band != (0.0, float("inf")) else None,
        known={n: _known(n, v, rig) for n, v in known.items()},
    )  # fmt: skip
    found = response_of_logs(sources, wish, out, data=data)
    told = of_log(found)
    page = write_chapter(out / "report.html", told)
    files = (out / "frequency.csv", *([out / "fit.json"] if found.answer else []), page)
    _say(told, found.answer, files, as_json, None)


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
    from upright.lab.makes import MAKES
    from upright.units import measured

    if make not in MAKES:
        raise BadInput("--known belongs to a fit; name the rig with --rig too.")
    plant = MAKES[make].plant
    if name in plant.names():
        return measured(text, plant.quantity(name).unit)
    return measured(text, "s" if name in ("actuator.delay", "actuator.lag") else "")


def _say(told: Chapter, answer: Answer | None, files: tuple[Path, ...], as_json: bool, truth: Any) -> None:
    from upright.cli.terminal import console, on_terminal
    from upright.json_file import json_text
    from upright.lab.frequency_1b.tables import parameter_table, pole_table, response_table, way_table

    if as_json:
        content = {"verdict": told.verdict, "sound": told.sound, **told.numbers, "files": [str(f) for f in files]}
        typer.echo(json_text(content))
        return
    screen = console()
    if answer is None:
        screen.print(on_terminal(response_table(told.numbers)))
    else:
        for table in (parameter_table(answer, truth), way_table(answer), pole_table(answer)):
            screen.print(on_terminal(table))
        for sentence in answer.left_out:
            screen.print(f"\n{sentence}", soft_wrap=True, markup=False)
    screen.print(f"\nVerdict: {told.verdict} {told.detail}", soft_wrap=True, markup=False)
    screen.print(f"\nWritten: {', '.join(str(f) for f in files)}\nWhat next:", soft_wrap=True, markup=False)
    for step in told.steps:
        screen.print(f"- {step.sentence}", soft_wrap=True, markup=False)
        if step.command:
            screen.print(f"    {step.command}", soft_wrap=True, markup=False)
