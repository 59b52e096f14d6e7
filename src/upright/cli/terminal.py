"""What commands share: the console, a bar while they work, and the end of each, where page and answer are written."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upright.errors import BadInput
from upright.progress import Progress, silent

if TYPE_CHECKING:
    from upright.report.page import Chapter


def _folder(path: Path) -> Path:
    if path.exists() and not path.is_dir():
        raise BadInput(f"--out needs a folder, and '{path}' is a file; name another folder.")
    return path


def _wants_pdf(asked: bool) -> bool:
    """Say before the work begins that a PDF cannot be made."""
    if asked:
        from upright.report.pdf import available

        if not available():
            raise BadInput("--pdf needs the pdf extra: pip install 'upright[pdf]', or print the page from a browser.")
    return asked


Out = Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for all files.", callback=_folder)]
Data = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Folder the runs' files are in; the study's own if left out.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the numbers as JSON instead of tables.")]
Pdf = Annotated[bool, typer.Option("--pdf", help="Write the page as PDF too (pdf extra).", callback=_wants_pdf)]
"""Options that several commands have."""


def console(*, error: bool = False) -> Any:
    """Terminal to print on; plain text when it is piped."""
    import sys

    from rich.console import Console

    watched = (sys.stderr if error else sys.stdout).isatty()
    return Console(stderr=error, highlight=False, width=None if watched else 160)


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
        task = bar.add_task("starting (the first time, equations are compiled)", total=1.0)
        yield lambda step, share: bar.update(task, description=step, completed=share)


def write_page(chapter: Chapter, path: Path, pdf: bool) -> list[Path]:
    """Write a chapter as HTML and, where that is asked for, as PDF beside it; gives back the files."""
    from upright.report.html import write_html
    from upright.report.pdf import write_pdf

    return [write_html(path, chapter), *([write_pdf(path.with_suffix(".pdf"), chapter)] if pdf else [])]


def tell(chapter: Chapter, files: Sequence[Path] = (), numbers: Any = None) -> None:
    """Print a chapter, the files that were written, and what next; or, where they are given, its `numbers` as JSON."""
    if numbers is not None:
        print_json(numbers)
        return
    from upright.report.terminal import print_chapter

    print_chapter(console(), chapter, files)


def print_json(content: Any) -> None:
    """Print numbers for another program; nothing where one is not finite."""
    from upright.files import json_text

    typer.echo(json_text(content))
