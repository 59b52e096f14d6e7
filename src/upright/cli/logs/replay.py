"""Did the law do what it says?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, tell

DIFFERENT = 3


def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a run (MCAP).")], as_json: AsJson = False
) -> None:
    """Pass the logged measurements through the logged law; say whether its commands are bit-identical.

    Exit code: 0 every command is the logged one, 3 one differs, 2 the log cannot
    be replayed.

    upright log replay run.mcap
    """
    from upright.verbs import logs as verbs

    again = verbs.log_replay(log)
    tell(again.chapter, again.files, again.numbers if as_json else None)
    if not again.value.identical:
        raise typer.Exit(DIFFERENT)
