"""How does the law get onto the computer that closes the loop?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, tell
from upright.verbs.pages import folder


def export(
    source: Annotated[Path, typer.Argument(metavar="GAINS_OR_FIT", help="design.json or fit.json, or its folder.")],
    to: Annotated[
        str,
        typer.Option(
            metavar="FORM",
            help="Such as c or arduino of a law, gymnasium or fmu of a rig; any other word lists them all.",
        ),
    ],
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for all files.", callback=folder)
    ] = Path("upright-export"),
    single: Annotated[bool, typer.Option("--float", help="Single precision instead of double.")] = False,
    limit: Annotated[
        float | None, typer.Option(metavar="U", help="Largest command of a rig, in its unit; the fit's if left out.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write a designed law, or an identified rig, for programs that run elsewhere.

    A law's program has sampling, differences or observer, limit and rounding in it, and
    a replay by which it tests itself: bit for bit in double precision.

    upright export out/design.json --to c
    upright export out --to arduino --float
    upright export out/fit.json --to gymnasium
    """
    from upright.verbs import export as verbs

    done = verbs.export(source, to=to, out=out, single=single, limit=limit)
    tell(done.chapter, done.files, done.numbers if as_json else None)
