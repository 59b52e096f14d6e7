"""What does this log hold, and can its time and its columns be trusted?"""

from __future__ import annotations

import re
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.readers.inspection import Column, Inspection


def show(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs as their programs wrote them.")],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for the figures.")] = Path(),
    plot: Annotated[bool, typer.Option(help="Draw the columns to show-LOG.svg.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was found as JSON instead of tables.")] = False,
) -> None:
    """Print and draw what a log holds: columns, sample rate, quanta, gaps, lying columns.

    Readable are ECP exports, tab-separated and comma-separated text with or
    without names, MATLAB version 5 and CSV exports of ROS bags; the format is
    recognised from the content.

    upright show swing.csv
    """
    from upright.json_file import json_text
    from upright.readers import inspect, read

    figures: list[Path] = []
    found: list[dict[str, Any]] = []
    for log in logs:
        record = read(log)
        seen = inspect(record)
        written: Path | None = None
        if plot:
            written = _figure_path(log, out, figures)
            from upright.report.columns import save_columns

            save_columns(record, seen, written)
            figures.append(written)
        if as_json:
            found.append(asdict(seen) | {"figure": str(written) if written else ""})
        else:
            _print(seen, written)
    if as_json:
        typer.echo(json_text(found))
    else:
        _print_next(logs[0])


def _figure_path(log: Path, out: Path, taken: list[Path]) -> Path:
    if out.exists() and not out.is_dir():
        raise BadInput(f"--out needs a folder, and '{out}' is a file; name another folder.")
    out.mkdir(parents=True, exist_ok=True)
    stem = "show-" + re.sub(r"[^\w.-]+", "_", log.stem)
    path, n = out / f"{stem}.svg", 2
    while path in taken:  # two folders may hold logs of the same name
        path, n = out / f"{stem}-{n}.svg", n + 1
    return path


def _print(seen: Inspection, figure: Path | None) -> None:
    from rich.markup import escape
    from rich.table import Table

    from upright.cli.terminal import console

    screen = console()
    screen.print(f"\n[bold]{escape(seen.file)}[/bold] ({seen.reader})", soft_wrap=True)
    for line in time_lines(seen):
        screen.print(escape(line), soft_wrap=True)
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("column", "unit", "lowest", "highest", "quantum", "remarks"):
        number = heading in ("lowest", "highest")
        table.add_column(heading, justify="right" if number else "left", overflow="fold", no_wrap=number)
    for column in seen.columns:
        unit = column.unit or (f"{column.guess}?" if column.guess else "")
        cells = (column.name, unit, f"{column.low:.5g}", f"{column.high:.5g}", str(column.quantum))
        table.add_row(*map(escape, cells), escape("; ".join(remarks(column))))
    screen.print(table)
    for note in seen.notes:
        screen.print(f"Note: {escape(note)}", soft_wrap=True)
    if figure is not None:
        screen.print(f"Drawn: {escape(str(figure))}", soft_wrap=True)


def time_lines(seen: Inspection) -> list[str]:
    """Sentences about the time base."""
    time = seen.time
    lines = [
        f"{time.samples} samples over {time.duration:.6g} s, period {time.period * 1e3:.6g} ms"
        + f" ({1 / time.period:.5g} Hz)"
        + (f", rebuilt from stamps rounded to {time.rounding * 1e3:g} ms" if time.rebuilt else "")
        + (f", jitter {time.jitter * 1e3:.3g} ms (99 %)" if time.jitter > 0.01 * time.period else "")
        + "."
    ]
    if abs(time.late) > 1.5 * time.period:
        lines.append(f"The first sample is at {time.late:.6g} s, not at 0.")
    if time.gaps:
        largest = max(time.gaps, key=lambda gap: gap.length)
        lines.append(
            f"{len(time.gaps)} gap{'s' if len(time.gaps) > 1 else ''}, the largest {largest.length * 1e3:.4g} ms"
            f" at {largest.start:.5g} s ({largest.missing} sample{'s' if largest.missing > 1 else ''} missing)."
        )
    if seen.rests:
        spans = ", ".join(f"{start:.4g} to {stop:.4g} s" for start, stop in seen.rests[:6])
        lines.append(f"Nothing moves: {spans}.")
    return lines


def remarks(column: Column) -> list[str]:
    """Short remarks on one column."""
    if column.constant:
        return ["idle, always 0" if column.idle else f"constant {column.low:g}"]
    told = list(column.lies)
    if column.drive and not told:
        told.append("drives?")
    if column.switches and not column.stepwise:
        told.append(
            ", ".join(f"{'back at' if value == 0 else 'leaves'} 0 at {t:.4g} s" for t, value in column.switches)
        )
    elif column.switches and len(column.switches) <= 6:
        told.append("switches " + ", ".join(f"to {value:.4g} at {t:.4g} s" for t, value in column.switches))
    if column.drive:
        for share, level in ((column.low_share, column.low), (column.high_share, column.high)):
            if share and not column.stepwise:
                told.append(f"at {level:.4g} for {100 * share:.2g} % of the samples (saturated?)")
    if column.turns:
        told.append(f"offset of {column.turns} turns (2 pi each)")
    return told


def _print_next(log: Path) -> None:
    from rich.markup import escape

    from upright.cli.terminal import console, typed

    name = typed(log)
    screen = console()
    screen.print("\nWhat next:", style="bold")
    screen.print("- write a study file, filled in with what was recognised:", soft_wrap=True)
    screen.print(f"    upright init {escape(name)} -o study.toml", soft_wrap=True)
