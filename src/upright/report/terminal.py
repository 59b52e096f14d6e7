"""Pages on a terminal: tables, points, verdict, files and what next; prose and pictures stay on the page.

Sentences wrap at words where somebody watches, and are lines of their own where they are piped; commands, which are
copied, are never wrapped.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from upright.report.page import Block, Book, Chapter, Code, Facts, Points, Step, Table

_COLUMN = 14  # characters a column of words is squeezed to before the last one is left out
_GAP = 2


def print_chapter(screen: Any, chapter: Chapter, files: Sequence[Path] = (), title: str = "") -> None:
    """Print what a chapter found on a rich console, its verdict last; `files` are those written.

    Evidence that a written page folds away is only named.
    """
    page = next((file for file in files if file.suffix == ".html"), None)
    if chapter.first_line:
        screen.print(chapter.first_line, style="bold", soft_wrap=not screen.is_terminal, markup=False)
    if title:
        screen.print(title, soft_wrap=not screen.is_terminal, markup=False)
    folded = [part.title for part in chapter.parts if page and part.folded and not part.aside]
    detail = chapter.detail
    for part in chapter.parts:
        if page and part.folded:
            continue
        shown = [b for b in part.content if isinstance(b, Table | Points | Facts | Code)]
        if shown and not part.aside:
            screen.print(f"\n{part.title}", style="bold", soft_wrap=not screen.is_terminal, markup=False)
            for i, block in enumerate(shown):
                if i and isinstance(block, Table):
                    screen.print()
                _print(screen, block)
                for point in block.sentences if isinstance(block, Points) else ():
                    detail = detail.replace(point, "") if point.endswith(".") else detail  # it stands above
    _say(screen, "\nVerdict", " ".join(f"{chapter.verdict} {detail}".split()))
    for warning in chapter.warnings:
        _say(screen, "Warning", warning)
    _say(screen, "\nWritten", ", ".join(map(str, files)))
    if folded:
        _say(screen, f"Evidence in {page}", ", ".join(folded))
    print_steps(screen, chapter.steps)


def print_book(screen: Any, book: Book, files: Sequence[Path] = ()) -> None:
    """Print verdict and numbers of every chapter, which files hold the rest, and what next."""
    if book.first_line:
        screen.print(book.first_line, style="bold", soft_wrap=not screen.is_terminal, markup=False)
    for chapter in book.chapters:
        screen.print(
            f"Experiment {chapter.key}, {chapter.title} ({chapter.about})",
            soft_wrap=not screen.is_terminal,
            markup=False,
        )
        lines = [*filter(None, [chapter.first_line]), f"{chapter.verdict} {chapter.detail}".strip()]
        for f in chapter.findings:
            interval = f", 95 % interval {f.interval}" if f.interval else ""
            lines.append(f"{f.what}: {f.value}{interval}" + (f"; truth {f.truth}" if f.truth else ""))
        _indented(screen, lines)
    for key, title in book.missing:
        screen.print(f"Experiment {key}, {title}: not run", soft_wrap=not screen.is_terminal, markup=False)
    for note in book.notes:
        screen.print(f"\n{note}", soft_wrap=not screen.is_terminal, markup=False)
    _say(screen, "\nReport", ", ".join(map(str, files)))
    print_steps(screen, book.steps)


def print_steps(screen: Any, steps: Iterable[Step]) -> None:
    """Print what to do next, commands on lines of their own."""
    for i, step in enumerate(steps):
        if i == 0:
            screen.print("What next:", style="bold")
        screen.print(f"- {step.sentence}", soft_wrap=not screen.is_terminal, markup=False)
        _indented(screen, step.command.splitlines())


def _say(screen: Any, what: str, text: str) -> None:
    from rich.markup import escape

    if text:
        screen.print(f"[bold]{what}[/bold]: {escape(text)}", soft_wrap=not screen.is_terminal)


def _indented(screen: Any, lines: Iterable[str]) -> None:
    for line in lines:
        screen.print(f"    {line}", soft_wrap=True, markup=False)


def _print(screen: Any, block: Block) -> None:
    match block:
        case Table():
            screen.print(block.caption, soft_wrap=not screen.is_terminal, markup=False, style="italic")
            screen.print(_grid(block, screen.width))
        case Points():
            for sentence in block.sentences:
                screen.print(f"- {sentence}", soft_wrap=not screen.is_terminal, markup=False)
        case Facts():
            for name, fact in block.pairs:
                screen.print(f"- {name}: {fact}", soft_wrap=not screen.is_terminal, markup=False)
        case Code():
            _indented(screen, block.lines.splitlines())
        case _:
            pass


def _grid(content: Table, width: int) -> Any:
    """A table for the terminal; where it is too narrow, the last column is left out if that holds words."""
    from rich.table import Table as Grid
    from rich.text import Text

    columns = list(zip(content.headings, *content.rows, strict=True))
    narrowest = sum(
        _GAP + min(max(map(len, column)), _COLUMN if i not in content.numbers else width)
        for i, column in enumerate(columns)
    )
    last = len(columns) - 1
    shown = columns[:-1] if narrowest > width and last not in content.numbers else columns
    least = [max(map(len, column if i in content.numbers else _words(column))) for i, column in enumerate(shown)]
    if sum(least) + _GAP * len(least) > width:
        return _records(content)
    grid = Grid(box=None, pad_edge=False, header_style="bold")
    for i, (heading, *_) in enumerate(shown):
        number = i in content.numbers
        justify = "right" if number else "left"
        grid.add_column(Text(heading), justify=justify, no_wrap=number, overflow="fold", min_width=least[i])
    for row in content.rows:
        grid.add_row(*(Text(cell) for cell in row[: len(shown)]))
    return grid


def _words(column: Sequence[str]) -> list[str]:
    return [word for cell in column for word in cell.split()] or [""]


def _records(content: Table) -> Any:
    """A table row by row, where its columns would break words: each cell on a line of its own, behind its heading."""
    from rich.console import Group
    from rich.padding import Padding
    from rich.text import Text

    lines: list[Any] = []
    for first, *others in content.rows:
        lines.append(Text(first, style="bold"))
        named = zip(content.headings[1:], others, strict=True)
        lines += [
            Padding(Text(f"{heading}: {cell}" if heading else cell), (0, 0, 0, 4), expand=False)
            for heading, cell in named
            if cell
        ]
    return Group(*lines)
