"""Which law closed the loop in this log?"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.closed_loop import Recovery
    from upright.records import Record


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
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for law.json and law.svg.")] = Path(),
) -> None:
    """Recover the control law from a closed-loop log: structure, gains, limit, and what it leaves unexplained.

    P, PI, PD and PID are tried on error and measurement, with plain, two-tap
    and low-passed differences; the simplest that predicts rows held out wins.

    upright law run.csv --command u --measured theta --reference target
    """
    from upright.closed_loop import recover
    from upright.closed_loop.recovery import as_json
    from upright.readers import read
    from upright.report.laws import save_law

    if out.exists() and not out.is_dir():
        raise BadInput(f"--out needs a folder, and '{out}' is a file; name another folder.")
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
    files = (out / f"law-{stem}.json", out / f"law-{stem}.svg")
    files[0].write_text(as_json(found) + "\n", encoding="utf-8")
    save_law(record, found, files[1])
    _print(log, record, found, files)


def _print(log: Path, record: Record, found: Recovery, files: tuple[Path, ...]) -> None:
    from rich.markup import escape
    from rich.table import Table

    from upright.cli.terminal import console
    from upright.closed_loop.recovery import loop_recovered, loop_written

    screen = console()
    law = found.law
    screen.print(f"\n[bold]{escape(found.command)} of {escape(log.name)}[/bold]: {escape(found.structure)}")
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("", "value", "at least", "at most", "acts"):
        table.add_column(heading, justify="left" if heading in ("", "acts") else "right", no_wrap=True)
    for name, g in found.gains.items():
        low, high = g.interval
        table.add_row(escape(name), f"{g.value:.7g}", f"{low:.7g}", f"{high:.7g}", escape(g.meaning))
    screen.print(table)
    unit = f" {found.unit}" if found.unit else ""
    rate = f"every {law.period * 1e3:.5g} ms"
    rows = record.t.size / found.rows.size
    rate += f", {found.every} times per row" if found.every > 1 else ", once per row" if rows < 1.5 else ""
    screen.print(f"Evaluated {rate}; {'a sample late' if law.delay else 'answers at the same sample'}.")
    if found.saturated:
        sums = " (its sum stands still meanwhile)" if law.windup == "hold" else ""
        screen.print(
            f"Limited to {law.limit:.6g}{unit} in {100 * found.saturated:.2g} % of the rows{escape(sums)}.",
            soft_wrap=True,
        )
    screen.print(escape(found.sentence), soft_wrap=True)
    tried = Table(box=None, pad_edge=False, header_style="bold", title="Tried", title_justify="left")
    for heading in ("structure", "numbers", f"missed on rows held out{unit}"):
        tried.add_column(heading, justify="left" if heading == "structure" else "right")
    shown: set[str] = set()
    for candidate in found.candidates:
        if candidate.name not in shown and len(shown) < 8:
            shown.add(candidate.name)
            tried.add_row(escape(candidate.name), str(candidate.parameters), f"{candidate.missed:.3g}")
    screen.print(tried)
    screen.print(f"Written: {escape(', '.join(str(f) for f in files))}", soft_wrap=True)
    screen.print("\nWhat next:", style="bold")
    if found.quality == "poor":
        screen.print("- name the columns that the law reads, with --measured and --reference, or try --every N")
        screen.print("    upright show " + escape(log.name), soft_wrap=True)
        return
    screen.print("- simulate the loop with the plant: put one of these into the run of a study")
    for line in (loop_recovered(found), loop_written(found)):
        if line:
            screen.print(f"    {escape(line)}", soft_wrap=True)
