"""Did the course help, as far as its survey can tell?"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

import typer

from upright.errors import BadInput


def survey(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="CSV as a spreadsheet writes it.")],
    n: Annotated[
        int | None, typer.Option("--n", min=2, metavar="N", help="Answers behind printed means or shares.")
    ] = None,
    scale: Annotated[str, typer.Option(metavar="LOW-HIGH", help="Scale of the ratings.")] = "1-4",
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for the report.")] = Path("survey"),
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON instead of tables.")] = False,
) -> None:
    r"""Evaluate ratings before and after a course and agreement with statements; check printed summaries.

    One row per person ('feedback pre', 'feedback post', ...), one row per answer (id, item, time, rating), or what
    was printed: means (concept, pre, post) and percentages, with --n answers.

    \b
    upright survey ratings.csv -o out
    upright survey means.csv --n 53
    """
    from upright.json_file import json_text
    from upright.survey import Ratings, read
    from upright.survey.page import told, write_survey

    if out.exists() and not out.is_dir():
        raise BadInput(f"--out needs a folder, and '{out}' is a file; name another folder.")
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
    content = told(sheet, answers=n, scale=limits)
    title = f"Survey: {file.stem.replace('_', ' ')}"
    data = content.pop("data")
    page = write_survey(content, out, title=title, source=file.name)
    if as_json:
        whole = {"sentences": content["sentences"], "notes": content["notes"], "report": str(page), "found": data}
        typer.echo(json_text(whole))
        return
    _print(content, page, file, n)


def _print(content: dict[str, Any], page: Path, file: Path, n: int | None) -> None:
    from rich.markup import escape
    from rich.table import Table

    from upright.cli.terminal import console, typed

    screen = console()
    for told in content["tables"]:
        table = Table(title=told["caption"], title_justify="left", box=None, pad_edge=False, header_style="bold")
        for i, heading in enumerate(told["head"]):
            table.add_column(heading, justify="left" if i == 0 else "right")
        for row in told["rows"]:
            table.add_row(*(escape(cell) for cell in row))
        screen.print(table)
        screen.print()
    for sentence in (*content["sentences"], *(f"Note: {note}" for note in content["notes"])):
        screen.print(f"- {sentence}", soft_wrap=True, markup=False)
    screen.print(f"\nReport: {page}\nWhat next:", soft_wrap=True, markup=False)
    screen.print("- hand the numbers on", soft_wrap=True)
    screen.print(
        f"    upright survey {typed(file)}{'' if n is None else f' --n {n}'} --json", soft_wrap=True, markup=False
    )
