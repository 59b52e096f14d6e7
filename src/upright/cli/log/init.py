"""Which study fits this log? A commented draft with what could be recognised filled in."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import tell
from upright.errors import BadInput


def init(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a rig: CSV, MATLAB, ECP export, ROS bag as CSV.")],
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="STUDY.toml", help="Where to write; LOG.toml here if left out."),
    ] = None,
    plant: Annotated[
        str,
        typer.Option(metavar="NAME", help="Plant, when the columns do not tell: pendulum, furuta, torsional-2, ..."),
    ] = "",
    reader: Annotated[str, typer.Option(metavar="NAME", help="Reader of the log, when it is not recognised.")] = "",
    force: Annotated[bool, typer.Option("--force", help="Replace a study that exists.")] = False,
) -> None:
    r"""Write a commented study file from a log, filled in with what could be recognised.

    It guesses the plant, which columns measure and which one drives, units,
    encoder counts, rest levels, the sign of the drive, the window in which
    something happens, and where to start each parameter. For a pendulum let go
    from some angle nothing has to be added:

        upright show swing.csv
        upright init swing.csv -o swing.toml
        upright identify swing.toml -o swing-fit

    Lines marked MEASURE hold placeholders: weigh, measure, or look them up.
    """
    from upright.report.page import Chapter, Part, Points, Step
    from upright.report.symbols import typed

    study = out if out is not None else Path(f"{log.stem}.toml")
    if not log.is_file():
        wrong = "is a folder; name one file of it" if log.is_dir() else "does not exist; check the path"
        raise BadInput(f"the log {log} {wrong}")
    if study.is_dir():
        study = study / f"{log.stem}.toml"
    if study.exists() and not force:
        raise BadInput(f"{study} exists already; name another file with -o, or replace it with --force")
    from upright.physics import find
    from upright.readers import inspect, read
    from upright.study.draft.draft import draft

    if plant:
        find(plant)
    record = read(log, reader=reader or None)
    text = draft(record, inspect(record), log, study, plant=plant)
    if reader:
        text = text.replace("[defaults]\n", f'[defaults]\nreader = "{reader}"\n')
    study.parent.mkdir(parents=True, exist_ok=True)
    study.write_text(text, encoding="utf-8")
    guessed = [line.removeprefix("# ") for line in text.splitlines() if line.startswith("# GUESSED")]
    marked = (line.split(" =")[0] for line in text.splitlines() if "MEASURE" in line and " = " in line)
    measure = list(dict.fromkeys(marked))
    if measure:
        guessed.append(f"Placeholders to replace by what you measured: {', '.join(measure)}")
    onward = Step(
        "Read it, then fit it.",
        f"upright identify {typed(study)} -o {typed(study.with_name(f'{study.stem}-fit'))}",
    )
    parts = (Part("Recognised", (Points(tuple(guessed)),)),) if guessed else ()
    tell(Chapter(title=f"Draft of {study.name}", verdict="", parts=parts, steps=(onward,)), [study])
