"""Which law closed the loop in this log?"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import Out, Pdf, tell, write_page
from upright.errors import BadInput


def law(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log as its program wrote it.")],
    command: Annotated[str, typer.Option(metavar="COLUMN", help="Column that the law put out.")] = "",
    measured: Annotated[
        list[str] | None, typer.Option(metavar="COLUMN", help="Column that it read; once for each.")
    ] = None,
    reference: Annotated[
        list[str] | None, typer.Option(metavar="COLUMN", help="What a measured column followed, in the same order.")
    ] = None,
    feedforward: Annotated[
        list[str] | None, typer.Option(metavar="COLUMN", help="Column that was added to the law's output.")
    ] = None,
    every: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Samples of the servo per row, when it is known.")
    ] = None,
    out: Out = Path(),
    pdf: Pdf = False,
) -> None:
    """Recover the control law from a closed-loop log: structure, gains, limit, and what it leaves unexplained.

    P, PI, PD and PID are tried on error and measurement, with plain, two-tap
    and low-passed differences; the simplest that predicts rows held out wins.

    upright law run.csv --command u --measured theta --reference target
    """
    from upright.closed_loop import recover
    from upright.closed_loop.recovery import as_json
    from upright.readers import read
    from upright.report.drawing import save
    from upright.report.law import chapter, draw_law
    from upright.report.symbols import typed

    record = read(log)
    if not command or not measured:
        raise BadInput(
            f"{log.name} holds the columns {', '.join(record.names)}; say which one the law put out (--command) and"
            " which it read (--measured, and --reference if it followed one)."
        )
    found = recover(
        record, measured=measured, references=reference or (), command=command, feedforward=feedforward or (),
        every=every,
    )  # fmt: skip
    out.mkdir(parents=True, exist_ok=True)
    stem = re.sub(r"[^\w.-]+", "_", log.stem)
    files = [out / f"law-{stem}.{ending}" for ending in ("json", "svg", "html")]
    files[0].write_text(as_json(found) + "\n", encoding="utf-8")
    save(draw_law(record, found), files[1])
    told = chapter(record, found, typed(log.name))
    tell(told, [*files[:2], *write_page(told, files[2], pdf)])
