"""What is wrong with this log?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import Pdf, tell

WRONG = 3


def doctor(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log as its program wrote it.")],
    rig: Annotated[
        str,
        typer.Option(metavar="RIG", help="Plant (furuta, torsional-2, ...), study (TOML) or fit.json of the rig."),
    ] = "",
    html: Annotated[
        Path | None,
        typer.Option("-o", "--html", metavar="FILE", help="Write a page with a picture of every finding."),
    ] = None,
    pdf: Pdf = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was found as JSON.")] = False,
    reader: Annotated[str, typer.Option(metavar="NAME", help="Reader of the log, when it is not recognised.")] = "",
) -> None:
    r"""Say in plain sentences what looks wrong with a log, on which evidence, and what to do.

    Looks for dead, frozen, wrapping and spiking sensors, lost counts, gaps,
    jitter, doubled rows, resets of the clock, efforts that are none or at
    their limit, motion before the command, creeping bodies; knowing the rig, also
    for signs, scales and silent trips.

        upright doctor run.csv
        upright doctor run.csv --rig furuta
        upright doctor run.csv --rig study.toml -o run-doctor.html

    A plant's name tells signs; a study with known inertias, or the fit.json of
    `upright identify`, tells scales too.
    Exit code: 0 nothing looks wrong, 3 something does, 2 the log or the rig
    cannot be read.
    """
    from upright.verbs import log as verbs

    found = verbs.doctor(log, rig=rig, html=html, pdf=pdf, reader=reader)
    tell(found.chapter, found.files, found.numbers if as_json else None)
    if found.value.wrong:
        raise typer.Exit(WRONG)
