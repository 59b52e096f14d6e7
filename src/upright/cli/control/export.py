"""How does the law get onto the computer that closes the loop?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, tell
from upright.verbs.pages import folder


def export(
    source: Annotated[Path, typer.Argument(metavar="GAINS", help="design.json, or its folder.")],
    to: Annotated[str, typer.Option(metavar="FORM", help="The law as c, arduino, python, matlab or simulink.")],
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for all files.", callback=folder)
    ] = Path("upright-export"),
    single: Annotated[bool, typer.Option("--float", help="Single precision instead of double.")] = False,
    as_json: AsJson = False,
) -> None:
    """Write a designed law as a program for the computer that closes the loop.

    Sampling, differences or observer, limit and rounding are in it, and a replay by
    which it tests itself there: bit for bit in double precision.

    upright export out/design.json --to c
    upright export out --to arduino --float
    """
    from upright.verbs import export as verbs

    done = verbs.export(source, to=to, out=out, single=single)
    tell(done.chapter, done.files, done.numbers if as_json else None)
