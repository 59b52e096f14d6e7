"""Does this machine keep time?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, Out, tell


def check(
    seconds: Annotated[float, typer.Option(help="How long to measure.")] = 60.0,
    rate: Annotated[float, typer.Option(metavar="HZ", help="Ticks per second.")] = 1000.0,
    fifo: Annotated[bool, typer.Option(help="Ask for real-time priority.")] = True,
    out: Out = Path("rig-check"),
    as_json: AsJson = False,
) -> None:
    """Measure how late this machine wakes a loop with law and supervision, and say whether it holds a rate.

    A histogram goes to jitter.svg.
    Measure with everything running that will run beside the loop.

    upright rig check --seconds 60
    """
    from upright.verbs import rig as verbs

    done = verbs.rig_check(seconds=seconds, rate=rate, fifo=fifo, out=out)
    tell(done.chapter, done.files, done.numbers if as_json else None)
    if not done.chapter.sound:
        raise typer.Exit(3)
