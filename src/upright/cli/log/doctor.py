"""What is wrong with this log?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upright.cli.terminal import Pdf, tell, write_page
from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.diagnosis import Diagnosis

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
    from upright.diagnosis import examine, read_known
    from upright.diagnosis.chapter import chapter
    from upright.diagnosis.clock import read_mended
    from upright.files import json_text

    if pdf and html is None:
        html = Path(f"{log.stem}-doctor.html")
    if html is not None and html.is_dir():
        raise BadInput(f"--html needs a file, and {html} is a folder; name one in it, such as {html / 'doctor.html'}")
    if not log.is_file():
        wrong = "is a folder; name one file of it" if log.is_dir() else "does not exist; check the path"
        raise BadInput(f"the log {log} {wrong}")
    known = read_known(rig, str(log)) if rig else None
    record, mended = read_mended(log, reader=reader)
    diagnosis = examine(record, known, before=mended)
    told = chapter(diagnosis, log=log, rig=rig, page=html is not None)
    written = [] if html is None else write_page(told, html, pdf)
    if as_json:
        typer.echo(json_text(as_plain(diagnosis, html)))
    else:
        tell(told, written)
    if diagnosis.wrong:
        raise typer.Exit(WRONG)


def as_plain(diagnosis: Diagnosis, html: Path | None) -> dict[str, Any]:
    """A diagnosis as plain dicts, lists, text and numbers; pictures stay in the page."""
    return {
        "file": diagnosis.file,
        "rig": diagnosis.rig,
        "samples": diagnosis.samples,
        "duration": diagnosis.duration,
        "wrong": bool(diagnosis.wrong),
        "findings": [
            {
                "kind": f.kind,
                "columns": list(f.columns),
                "severity": f.severity,
                "sentence": f.sentence,
                "evidence": dict(f.evidence),
                "advice": f.advice,
                "key": f.key,
            }
            for f in diagnosis.findings
        ],
        "checked": list(diagnosis.checked),
        "unchecked": dict(diagnosis.unchecked),
        "page": str(html) if html is not None else "",
    }
