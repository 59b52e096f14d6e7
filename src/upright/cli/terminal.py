"""What commands share: the console, a bar while they work, and the end of each, where the answer is told."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upright.progress import Progress, silent
from upright.verbs.pages import can_be_pdf, folder

if TYPE_CHECKING:
    from upright.report.page import Chapter


Out = Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for all files.", callback=folder)]
Data = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Folder the runs' files are in; the study's own if left out.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the numbers as JSON instead of tables.")]
Pdf = Annotated[bool, typer.Option("--pdf", help="Write the page as PDF too (pdf extra).", callback=can_be_pdf)]
Processes = Annotated[
    int, typer.Option("--workers", metavar="N", help="Processes of this machine that share the work.")
]
Cluster = Annotated[
    str, typer.Option("--cluster", metavar="ADDRESS", help="Dask scheduler, tcp://host:8786 (cluster extra).")
]
"""Options that several commands have."""


def console(*, error: bool = False) -> Any:
    """Terminal to print on; plain text when it is piped."""
    import sys

    from rich.console import Console

    class Screen(Console):
        def on_broken_pipe(self) -> None:  # rich would end the process as one that failed
            raise BrokenPipeError

    watched = (sys.stderr if error else sys.stdout).isatty()
    return Screen(stderr=error, highlight=False, width=None if watched else 160)


@contextmanager
def progress_bar(*, quiet: bool = False) -> Generator[Progress]:
    """Bar on stderr; nothing when `quiet` or when nobody watches."""
    screen = console(error=True)
    if quiet or not screen.is_terminal:
        yield silent
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (BarColumn(bar_width=24), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=screen, transient=True, refresh_per_second=8) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda step, share: bar.update(task, description=step, completed=share)


@contextmanager
def step_lines(*, quiet: bool = False) -> Generator[Progress]:
    """Each new step as a line on stderr, for work that asks and shows things in between."""
    screen, said = console(error=True), ""

    def progress(step: str, _share: float) -> None:
        nonlocal said
        head = ": ".join(step.split(": ")[:2])  # counts of evaluations are no steps
        if not quiet and head != said:
            said = head
            screen.print(step, style="dim", markup=False)

    yield progress


def tell(chapter: Chapter, files: Sequence[Path] = (), numbers: Any = None) -> None:
    """Print a chapter, the files that were written, and what next; or, where they are given, its `numbers` as JSON."""
    if numbers is not None:
        print_json(numbers)
        return
    from upright.report.terminal import print_chapter

    print_chapter(console(), chapter, files)


def print_json(content: Any) -> None:
    """Print numbers for another program; nothing where one is not finite."""
    import json
    import sys

    from upright.files import json_text

    text = json_text(content)
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:  # a question mark would be another value
        text = json.dumps(json.loads(text), indent=2)
    typer.echo(text)
