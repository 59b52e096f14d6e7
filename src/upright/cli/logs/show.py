"""What happened in this run?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, Out, tell


def show(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a run (MCAP), whole, torn or still growing.")],
    out: Out = Path(),
    plot: Annotated[bool, typer.Option("--plot", help="Draw the columns to show-LOG.svg.")] = False,
    as_json: AsJson = False,
) -> None:
    """Print what a run's log holds: rig, law, duration, rate, modes and faults, events, what is missing.

    upright log show run.mcap --plot
    """
    from upright.verbs import logs as verbs

    seen = verbs.log_show(log, out=out if plot else None)
    tell(seen.chapter, seen.files, seen.numbers if as_json else None)
