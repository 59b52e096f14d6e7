"""Which law closed the loop in this log?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import Out, Pdf, tell


def law(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log as its program wrote it.")],
    command: Annotated[str, typer.Option(metavar="COLUMN", help="Column that the law put out.")] = "",
    measured: Annotated[
        list[str] | None, typer.Option(metavar="COLUMN", help="Column that it read; once for each.")
    ] = None,
    reference: Annotated[
        list[str] | None, typer.Option(metavar="COLUMN", help="What a measured column followed, in the same order.")
    ] = None,
    feedforward: Annotated[
        list[str] | None, typer.Option(metavar="COLUMN", help="Column that was added to the law's output.")
    ] = None,
    every: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Samples of the servo per row, when it is known.")
    ] = None,
    out: Out = Path(),
    pdf: Pdf = False,
) -> None:
    """Recover the control law from a closed-loop log: structure, gains, limit, and what it leaves unexplained.

    P, PI, PD and PID are tried on error and measurement, with plain, two-tap
    and low-passed differences; the simplest that predicts rows held out wins.

    upright law run.csv --command u --measured theta --reference target
    """
    from upright.verbs import log as verbs

    found = verbs.law(
        log, command=command, measured=measured or (), reference=reference or (), feedforward=feedforward or (),
        every=every, out=out, pdf=pdf,
    )  # fmt: skip
    tell(found.chapter, found.files)
