"""Did the course help, as far as its survey can tell?"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, tell, write_page
from upright.errors import BadInput


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
    from upright.questionnaire.chapter import chapter
    from upright.questionnaire.sheet import Ratings, read
    from upright.report.page import Step
    from upright.report.symbols import typed

    ends = re.fullmatch(r"\s*(\d{1,2})\s*(?:-|to)\s*(\d{1,2})\s*", scale)
    if ends is None or int(ends[1]) >= int(ends[2]):
        raise BadInput(f"--scale needs its two ends, such as 1-4, got '{scale}'.")
    limits = (int(ends[1]), int(ends[2]))
    sheet = read(file, scale=limits)
    if isinstance(sheet, Ratings):
        if n is not None:
            raise BadInput(f"--n is for printed summaries; '{file.name}' holds single answers, which are counted.")
    elif n is None:
        raise BadInput(f"'{file.name}' holds printed numbers; say with --n how many answers they are said to rest on.")
    again = f"upright survey {typed(file)}{'' if n is None else f' --n {n}'} --json"
    told = chapter(
        sheet, title=f"Survey: {file.stem.replace('_', ' ')}", source=file.name, answers=n, scale=limits,
        steps=(Step("Hand the numbers on.", again),),
    )  # fmt: skip
    written = write_page(told, out / "report.html", pdf)
    tell(told, written, {**told.numbers, "report": str(written[0])} if as_json else None)
