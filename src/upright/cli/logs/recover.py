"""What is left of this torn log?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, tell


def recover(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a run (MCAP), torn or damaged.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Where to write; LOG-recovered.mcap if left out.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write the rows of a torn log, up to its first error, to a whole file; say how many were kept and lost.

    Every row that is kept was checked. The log itself stays as it is.

    upright log recover run.mcap -o whole.mcap
    """
    from upright.verbs import logs as verbs

    found = verbs.log_recover(log, out=out)
    tell(found.chapter, found.files, found.numbers if as_json else None)
