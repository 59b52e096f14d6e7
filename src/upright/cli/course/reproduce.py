"""Do the paper's tables come again, and do its misprints show?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, tell


def reproduce(
    out: Out = Path(),
    seed: Annotated[int, typer.Option(min=0, help="Seed of the rigs on which formulas are tried.")] = 0,
    pdf: Pdf = False,
    as_json: AsJson = False,
) -> None:
    """Regenerate Tables 1 and 2 of the paper from a handful of numbers, and show each of its misprints.

    The printed poles lie on a locus of least cost: plant and weights are recovered
    from them, and all poles follow again, to less than the print's rounding.

    upright reproduce -o out
    """
    from upright.verbs import course as verbs

    told = verbs.reproduce(seed=seed, out=out, pdf=pdf)
    tell(told.chapter, told.files, told.numbers if as_json else None)
