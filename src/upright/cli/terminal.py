"""What commands share: the console, a bar while they work, and how each prints its answer."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from typing import Any

import typer

from upright.progress import Progress, silent
from upright.verbs.answer import Answer


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
    screen, last = console(error=True), ""

    def progress(step: str, _share: float) -> None:
        nonlocal last
        head = ": ".join(step.split(": ")[:2])  # counts of evaluations are no steps
        if not quiet and head != last:
            last = head
            screen.print(step, style="dim", markup=False)

    yield progress


def tell(answer: Any, *, as_json: bool = False) -> None:
    """Print what a verb answered, chapter or book, piece by piece where there are many; or its numbers as JSON."""
    if isinstance(answer, Iterator):
        many: list[Any] = []
        for piece in answer:
            many.append(piece.numbers) if as_json else tell(piece)
        if as_json:
            print_json(many)
    elif not isinstance(answer, Answer):
        typer.echo(answer)
    elif as_json:
        print_json(answer.numbers)
    elif hasattr(answer, "book"):
        from upright.report.terminal import print_book

        print_book(console(), answer.book, answer.files)
        for sentence in answer.hints:
            typer.echo(sentence)
    else:
        from upright.report.terminal import print_chapter

        print_chapter(console(), answer.chapter, answer.files)


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
