"""Did the course help, as far as its survey can tell?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, tell


def survey(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="CSV as a spreadsheet writes it.")],
    n: Annotated[
        int | None, typer.Option("--n", min=2, metavar="N", help="Answers behind printed means or shares.")
    ] = None,
    scale: Annotated[str, typer.Option(metavar="LOW-HIGH", help="Scale of the ratings.")] = "1-4",
    out: Out = Path("survey"),
    pdf: Pdf = False,
    as_json: AsJson = False,
) -> None:
    r"""Evaluate ratings before and after a course and agreement with statements; check printed summaries.

    One row per person ('feedback pre', 'feedback post', ...), one row per answer (id, item, time, rating), or what
    was printed: means (concept, pre, post) and percentages, with --n answers.

    \b
    upright survey ratings.csv -o out
    upright survey means.csv --n 53
    """
    from upright.verbs import course as verbs

    told = verbs.survey(file, n=n, scale=scale, out=out, pdf=pdf)
    tell(told.chapter, told.files, told.numbers if as_json else None)
