"""How rich a model do these runs deserve? A study goes in, a ladder of models and the chosen study come out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from upright.errors import BadInput

INTERRUPTED = 130


def ladder(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Rig, runs and everything one might ask.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="OUT", help="Folder for results; STUDY-ladder if left out.")
    ] = None,
    data: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder the runs' files are in; the study's own if left out.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print ladder.json instead of tables.")] = False,
    report: Annotated[bool, typer.Option(help="Write ladder.html as well.")] = True,
) -> None:
    r"""Grow a model only while it predicts better what it has not seen.

    Give guesses of everything the rig might have. Rung after rung is fitted:
    viscous friction, Coulomb friction, drag, stiction, presliding, then the
    drive's terms, then friction that differs from run to run. Each run is
    predicted from a fit of the others (of a single run, the last third), and
    a rung is kept only if that prediction improves by more than it scatters.
    Where runs repeat one another, how well one predicts the other is the
    ceiling: a model that reaches it has nothing left to explain.

    Rungs of your own, in the study:

        \[\[ladder]]
        name = "Coulomb friction"
        adds = \["b_1c", "b_2c"]      # held at zero below this rung
        \[\[ladder]]
        name = "torque that falls with speed"
        adds = \["actuator.knee", "actuator.fade"]
        \[\[ladder]]
        name = "friction of each run"
        unknown = \["friction"]

    Writes OUT/ladder.json, OUT/ladder.html and OUT/study.toml, the study of the
    chosen model. Ctrl-C keeps the rungs so far.
    Exit code: 0 a ladder was written, 2 the study or a log is wrong, 130
    stopped by Ctrl-C.
    """
    from upright.cli.terminal import progress_line, typed
    from upright.identification.ladder.growth import climb
    from upright.json_file import json_text
    from upright.study.ladder_file import can_be_trimmed, chosen_study, write_ladder
    from upright.study.load import load_study

    if not study.exists():
        raise BadInput(
            f"the study {study} does not exist; `upright init LOG -o {typed(study.name)}` writes one from a log"
        )
    folder = out if out is not None else study.with_name(f"{study.stem}-ladder")
    if folder.exists() and not folder.is_dir():
        raise BadInput(f"results need a folder, but {folder} is a file; name another with -o")
    asked = load_study(study, data=data)
    if not asked.rig.estimated:
        raise BadInput(f'{study}: nothing is asked; give a parameter a guess, such as b_2c = {{ guess = "1e-4 N m" }}')
    with progress_line(quiet=as_json) as progress:
        climbed = climb(asked.rig, asked.runs, asked.ladder or None, progress=progress)
    if not climbed.steps:
        raise KeyboardInterrupt
    written = [folder / "ladder.json"]
    content = write_ladder(climbed, asked, written[0])
    trimmed = can_be_trimmed(asked, climbed)
    if trimmed:
        written.append(folder / "study.toml")
        written[-1].write_text(chosen_study(asked, climbed), encoding="utf-8")
    from upright.report.ladder import next_rungs, write_ladder_report

    where = typed(data if data is not None else study.parent)
    steps = next_rungs(climbed, study=typed(study), folder=typed(folder), data=where, trimmed=trimmed)
    if report:
        provenance: dict[str, object] = {
            "study": asked.path.name,
            "sha256 of the study": asked.sha256,
            "data": asked.source or "not stated",
            "runs": {run.label: run.source for run in asked.runs},
        }
        title = f"Ladder: {asked.title or asked.path.stem.replace('_', ' ')}"
        written.append(write_ladder_report(climbed, folder, title=title, provenance=provenance, steps=steps))
    if as_json:
        typer.echo(json_text(content))
    else:
        _print(climbed, written, steps)
    if climbed.interrupted:
        raise typer.Exit(INTERRUPTED)


def _print(climbed: Any, files: list[Path], steps: Any) -> None:
    """The ladder, its reasons, the ceiling, and what to do next."""
    from rich.markup import escape
    from rich.table import Table

    from upright.cli.terminal import console
    from upright.report.ladder import ceiling_rows, ladder_rows, verdict

    screen = console()
    table = Table(title="Ladder", title_justify="left", box=None, pad_edge=False, header_style="bold")
    for heading in ("rung", "terms", "fitted", "predicted", "cost", "parameters", "s", ""):
        right = heading in ("fitted", "predicted", "cost", "parameters", "s")
        table.add_column(heading, justify="right" if right else "left", no_wrap=right)
    rows = ladder_rows(climbed)
    for r in rows:
        cells = (r.name, r.terms, r.fit, r.predicted, r.cost, r.parameters, r.seconds, "kept" if r.kept else "refused")
        table.add_row(*(escape(cell) for cell in cells))
    screen.print(table)
    screen.print(f"Predicted: {climbed.held_out}.")
    for r in rows:
        screen.print(f"- {escape(r.name)}. {escape(r.reason)}", soft_wrap=True)
    ceilings = ceiling_rows(climbed)
    if ceilings:
        table = Table(title="\nHow well the rig repeats itself", title_justify="left", box=None, pad_edge=False,
                      header_style="bold")  # fmt: skip
        for heading in ("runs", "signal", "one by another", "range", "model"):
            table.add_column(heading, justify="left" if heading in ("runs", "signal") else "right")
        for c in ceilings:
            table.add_row(*(escape(cell) for cell in (c.runs, c.signal, c.median, c.range, c.reached)))
        screen.print(table)
    screen.print(f"\n[bold]Verdict[/bold] ({climbed.seconds:.1f} s): {escape(verdict(climbed))}", soft_wrap=True)
    for warning in climbed.warnings:
        screen.print(f"[bold]Warning[/bold]: {escape(warning)}", soft_wrap=True)
    screen.print("\nWritten: " + ", ".join(str(file) for file in files), soft_wrap=True)
    screen.print("What next:", style="bold")
    for step in steps:
        screen.print(f"- {escape(step.sentence)}", soft_wrap=True)
        for line in step.command.splitlines():
            screen.print(f"    {escape(line)}", soft_wrap=True)
