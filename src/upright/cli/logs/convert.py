"""How does another program read this run?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, tell


def convert(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a run (MCAP).")],
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="FILE", help="Ending in .csv, .parquet or .mat; LOG.csv here if left out."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write a run's log as CSV, Parquet or MATLAB file, with units and provenance.

    upright log convert run.mcap -o run.parquet
    """
    from upright.verbs import logs as verbs

    done = verbs.log_convert(log, out=out)
    tell(done.chapter, done.files, done.numbers if as_json else None)
