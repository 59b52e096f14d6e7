"""What does this log hold, and can its time and its columns be trusted?"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from upright.cli.terminal import AsJson, Out, tell


def show(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs as their programs wrote them.")],
    out: Out = Path(),
    plot: Annotated[bool, typer.Option(help="Draw the columns to show-LOG.svg.")] = True,
    as_json: AsJson = False,
) -> None:
    """Print and draw what a log holds: columns, sample rate, quanta, gaps, lying columns.

    Readable are ECP exports, tab-separated and comma-separated text with or
    without names, MATLAB version 5, CSV exports of ROS bags and upright's own logs
    of runs (MCAP); the format is recognised from the content.

    upright show swing.csv
    """
    from upright.verbs import log as verbs

    steps: tuple[Any, ...] = ()
    figures: list[Path] = []
    found: list[Any] = []
    for log in logs:
        seen = verbs.show(log, out=verbs.picture_path(log, out, figures) if plot else None)
        figures += seen.files
        found.append(seen.numbers)
        steps = steps or seen.chapter.steps
        if not as_json:
            tell(replace(seen.chapter, steps=steps if log == logs[-1] else ()), seen.files)
    if as_json:
        typer.echo(json.dumps(found, indent=1))
