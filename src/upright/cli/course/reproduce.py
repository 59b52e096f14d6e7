"""Do the paper's tables come again, and do its misprints show?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.errors import BadInput


def reproduce(
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for reproduce.html.")] = Path(),
    seed: Annotated[int, typer.Option(min=0, help="Seed of the rigs on which formulas are tried.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON instead of tables.")] = False,
) -> None:
    """Regenerate Tables 1 and 2 of the paper from a handful of numbers, and show each of its misprints.

    The printed poles lie on a locus of least cost: plant and weights are recovered
    from them, and all poles follow again, to less than the print's rounding.

    upright reproduce -o out
    """
    from rich.markup import escape

    from upright.cli.terminal import console, on_terminal, typed
    from upright.json_file import json_text
    from upright.lab.makes import NOMINAL
    from upright.paper import page
    from upright.paper.reproduce import reproduce as again

    if out.exists() and not out.is_dir():
        raise BadInput(f"--out needs a folder, and '{out}' is a file; name another folder.")
    done = again(NOMINAL, seed)
    written = page.write(done, out / "reproduce.html")
    if as_json:
        typer.echo(json_text(page.as_json(done)))
        return
    screen = console()
    for sentences, table in zip(
        page.facts(done), (*(page.set_table(t) for t in done.tables), page.errata_table(done)), strict=True
    ):
        screen.print(on_terminal(table))
        for sentence in sentences:
            screen.print(sentence, soft_wrap=True, markup=False)
    screen.print(f"\n[bold]Verdict[/bold]: {escape(done.verdict)}", soft_wrap=True)
    screen.print(f"\nWritten: {typed(written)}\nWhat next:", soft_wrap=True, markup=False)
    for step in page.next_steps():
        screen.print(f"- {step.sentence}\n    {step.command}", soft_wrap=True, markup=False)
