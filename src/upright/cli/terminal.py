"""How does a fit look on a terminal? Progress while it runs, then tables, verdict and what to do next."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.progress import Progress, silent
from upright.report.symbols import typed

if TYPE_CHECKING:
    from upright.identification import Fit, RunScore
    from upright.identification.ladder.cross_validation import CrossValidation


def console(*, error: bool = False) -> Any:
    """Terminal to print on; plain text when it is piped."""
    import sys

    from rich.console import Console

    watched = (sys.stderr if error else sys.stdout).isatty()
    return Console(stderr=error, highlight=False, width=None if watched else 160)


@contextmanager
def progress_line(*, quiet: bool = False) -> Generator[Progress]:
    """One line on stderr that follows the search; nothing when `quiet` or when nobody watches."""
    screen = console(error=True)
    if quiet or not screen.is_terminal:
        yield silent
        return
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("Ctrl-C keeps the best so far"),
    )
    with Bar(*columns, console=screen, transient=True, refresh_per_second=8) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda step, share: bar.update(task, description=step, completed=share)


@contextmanager
def step_bar(*, quiet: bool) -> Generator[Callable[[str, float], None]]:
    """Bar on stderr; nothing when `quiet` or when nobody watches."""
    screen = console(error=True)
    if quiet or not screen.is_terminal:
        yield lambda step, share: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (BarColumn(bar_width=24), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=screen, transient=True, refresh_per_second=8) as bar:
        task = bar.add_task("starting (the first time, equations are compiled)", total=1.0)
        yield lambda step, share: bar.update(task, description=step, completed=share)


def print_fit(fit: Fit, files: Sequence[Path], study: str, crossed: CrossValidation | None = None) -> None:
    """Parameters, scores, verdict, warnings, files and next steps; `study` as the command line names it."""
    from rich.table import Table

    from upright.report.advice import next_steps
    from upright.report.tables import parameter_rows, pole_rows, run_rows, swings

    screen = console()
    table = Table(title="Parameters", title_justify="left", box=None, pad_edge=False, header_style="bold")
    headings = ["", "value", "std. error", "interval", "unit", "status", "meaning"]
    headings = headings if screen.width >= 110 else headings[:-1]
    for heading in headings:
        right = heading in ("value", "std. error")
        table.add_column(heading, justify="right" if right else "left", no_wrap=heading != "meaning")
    for row in (*parameter_rows(fit), *run_rows(fit)):
        name = f"{row.name} ({row.run})" if row.run else row.name
        cells = (name, row.value, row.stderr, row.interval, row.unit, row.status, row.meaning)
        table.add_row(*(_plain(cell) for cell in cells[: len(headings)]))
    screen.print(table)
    print_scores(fit.runs)
    for at, swing in swings(fit):
        screen.print(f"\nSwings at {at}: {swing}, 95 % interval in brackets", soft_wrap=True)
    for at, pole, interval, _ in pole_rows(fit, growing=True):
        screen.print(f"\nPole at {at}: {pole} 1/s, 95 % interval {interval}", soft_wrap=True)
    if crossed is not None:
        print_crossed(crossed)
    how = f"{fit.method}, {fit.evaluations} evaluations, {fit.seconds:.2f} s"
    screen.print(f"\n[bold]Verdict[/bold] ({how}): {_plain(fit.verdict)}", soft_wrap=True)
    for warning in fit.warnings:
        screen.print(f"[bold]Warning[/bold]: {_plain(warning)}", soft_wrap=True)
    screen.print("\nWritten: " + ", ".join(str(file) for file in files), soft_wrap=True)
    screen.print("What next:", style="bold")
    for step in next_steps(fit, study=study, folder=typed(files[0].parent), crossed=crossed is not None):
        screen.print(f"- {_plain(step.sentence)}", soft_wrap=True)
        for line in step.command.splitlines():
            screen.print(f"    {_plain(line)}", soft_wrap=True)


def print_scores(runs: Any) -> None:
    """Fit percent per run and signal."""
    from rich.table import Table

    table = Table(
        title="\nHow much of each signal is explained",
        title_justify="left",
        box=None,
        pad_edge=False,
        header_style="bold",
    )
    scores: list[tuple[str, RunScore]] = sorted(runs.items(), key=lambda item: item[1].role != "fit")
    windowed = any(score.naive for _, score in scores)
    for heading in ("run", "", "signal", "fit %", *(["held speed %"] if windowed else []), "compared"):
        table.add_column(heading, justify="right" if heading.endswith("%") else "left")
    for label, score in scores:
        over = "free run" if score.horizon is None else f"restarted every {score.horizon:g} s"
        over = f"{score.horizon:g} s ahead" if score.ahead else over
        over += f", from {score.score_from:g} s on" if score.score_from > 0 else ""
        over += f"; its own {', '.join(score.adapted)}" if score.adapted else ""
        role = "fitted" if score.role == "fit" else "predicted"
        for name, percent in score.fit_percent.items():
            naive = [f"{score.naive[name]:.2f}" if name in score.naive else ""] if windowed else []
            table.add_row(_plain(label), role, name, f"{percent:.2f}", *naive, over)
        for horizon, percents in list(score.ahead.items())[1:]:
            for name, percent in percents.items():
                none = [""] if windowed else []
                table.add_row(_plain(label), role, name, f"{percent:.2f}", *none, f"{horizon:g} s ahead")
    console().print(table)


def print_crossed(crossed: CrossValidation) -> None:
    """Every run fitted among all, and predicted by a fit of the others."""
    from rich.table import Table

    from upright.report.tables import cross_rows

    screen = console()
    title = "\nEvery run fitted among all, and predicted by a fit of the others"
    table = Table(title=title, title_justify="left", box=None, pad_edge=False, header_style="bold")
    for heading in ("run", "signal", "fitted", "predicted"):
        table.add_column(heading, justify="right" if heading.endswith("ed") else "left")
    for r in cross_rows(crossed):
        table.add_row(*(_plain(cell) for cell in (r.run, r.signal, r.fitted, r.predicted)))
    screen.print(table)
    for label, names in crossed.blind.items():
        if names:
            told = (
                f"The other runs cannot see {', '.join(names)}, so the prediction of '{label}' rests on its own values."
            )
            screen.print(_plain(told), soft_wrap=True)
    if crossed.interrupted:
        screen.print("Interrupted: runs without a prediction were not reached.", soft_wrap=True)


def _plain(text: str) -> str:
    """Text whose square brackets are not taken for markup."""
    from rich.markup import escape

    return escape(text)


def on_terminal(content: Any) -> Any:
    """A table of a page (`report.sections.Table`) for the terminal."""
    from rich.table import Table

    table = Table(
        title=f"\n{_plain(content.caption)}", title_justify="left", box=None, pad_edge=False, header_style="bold"
    )
    for i, heading in enumerate(content.headings):
        table.add_column(_plain(heading), justify="right" if i in content.numbers else "left")
    for row in content.rows:
        table.add_row(*(_plain(cell) for cell in row))
    return table
