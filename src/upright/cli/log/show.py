"""What does this log hold, and can its time and its columns be trusted?"""

from __future__ import annotations

import json
import re
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from upright.cli.terminal import AsJson, Out, tell


def show(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs as their programs wrote them.")],
    out: Out = Path(),
    plot: Annotated[bool, typer.Option(help="Draw the columns to show-LOG.svg.")] = True,
    as_json: AsJson = False,
) -> None:
    """Print and draw what a log holds: columns, sample rate, quanta, gaps, lying columns.

    Readable are ECP exports, tab-separated and comma-separated text with or
    without names, MATLAB version 5 and CSV exports of ROS bags; the format is
    recognised from the content.

    upright show swing.csv
    """
    from upright.readers import inspect, read
    from upright.report.drawing import save
    from upright.report.log import chapter, draw_columns
    from upright.report.page import Step
    from upright.report.symbols import typed

    onward = Step(
        "Write a study file, filled in with what was recognised.",
        f"upright init {typed(logs[0])} -o study.toml",
    )
    figures: list[Path] = []
    found: list[dict[str, Any]] = []
    for log in logs:
        record = read(log)
        seen = inspect(record)
        written: Path | None = None
        if plot:
            written = _figure_path(log, out, figures)
            save(draw_columns(record, seen), written)
            figures.append(written)
        if as_json:
            found.append(asdict(seen) | {"figure": str(written) if written else ""})
            continue
        told = chapter(record, seen)
        if log == logs[-1]:
            told = replace(told, steps=(onward,))
        tell(told, [written] if written else [])
    if as_json:
        typer.echo(json.dumps(found, indent=1))


def _figure_path(log: Path, out: Path, taken: list[Path]) -> Path:
    out.mkdir(parents=True, exist_ok=True)
    stem = "show-" + re.sub(r"[^\w.-]+", "_", log.stem)
    path, n = out / f"{stem}.svg", 2
    while path in taken:  # two folders may hold logs of the same name
        path, n = out / f"{stem}-{n}.svg", n + 1
    return path
