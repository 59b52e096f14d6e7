"""Which study fits this log? A commented draft with what could be recognised filled in."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import tell


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
    from upright.verbs import log as verbs

    study = out if out is not None else Path(f"{log.stem}.toml")
    written = verbs.init(log, out=study, plant=plant, reader=reader, force=force)
    tell(written.chapter, written.files)
