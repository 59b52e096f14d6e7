"""What is wrong with this log?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.doctor import Diagnosis

WRONG = 3


def doctor(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log as its program wrote it.")],
    rig: Annotated[
        str,
        typer.Option(metavar="RIG", help="Plant (furuta, torsional-2, ...), study (TOML) or fit.json of the rig."),
    ] = "",
    html: Annotated[
        Path | None,
        typer.Option("-o", "--html", metavar="FILE", help="Write a page with a picture of every finding."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was found as JSON.")] = False,
    reader: Annotated[str, typer.Option(metavar="NAME", help="Reader of the log, when it is not recognised.")] = "",
) -> None:
    r"""Say in plain sentences what looks wrong with a log, on which evidence, and what to do.

    Looks for dead, frozen, wrapping and spiking sensors, lost counts, gaps,
    jitter, doubled rows, resets of the clock, efforts that are none or at
    their limit, motion before the command, creeping bodies; knowing the rig, also
    for signs, scales and silent trips.

        upright doctor run.csv
        upright doctor run.csv --rig furuta
        upright doctor run.csv --rig study.toml -o run-doctor.html

    A plant's name tells signs; a study with known inertias, or the fit.json of
    `upright identify`, tells scales too.
    Exit code: 0 nothing looks wrong, 3 something does, 2 the log or the rig
    cannot be read.
    """
    from upright.doctor import examine, read_known
    from upright.doctor.clock import read_mended
    from upright.json_file import json_text

    if html is not None and html.is_dir():
        raise BadInput(f"--html needs a file, and {html} is a folder; name one in it, such as {html / 'doctor.html'}")
    if not log.is_file():
        wrong = "is a folder; name one file of it" if log.is_dir() else "does not exist; check the path"
        raise BadInput(f"the log {log} {wrong}")
    known = read_known(rig, str(log)) if rig else None
    record, mended = read_mended(log, reader=reader)
    diagnosis = examine(record, known, before=mended)
    if html is not None:
        from upright.doctor.page import write_diagnosis

        write_diagnosis(diagnosis, html)
    if as_json:
        typer.echo(json_text(as_plain(diagnosis, html)))
    else:
        _print(diagnosis, log, rig, html)
    if diagnosis.wrong:
        raise typer.Exit(WRONG)


def as_plain(diagnosis: Diagnosis, html: Path | None) -> dict[str, Any]:
    """A diagnosis as plain dicts, lists, text and numbers; pictures stay in the page."""
    return {
        "file": diagnosis.file,
        "rig": diagnosis.rig,
        "samples": diagnosis.samples,
        "duration": diagnosis.duration,
        "wrong": bool(diagnosis.wrong),
        "findings": [
            {
                "kind": f.kind,
                "columns": list(f.columns),
                "severity": f.severity,
                "sentence": f.sentence,
                "evidence": dict(f.evidence),
                "advice": f.advice,
                "key": f.key,
            }
            for f in diagnosis.findings
        ],
        "checked": list(diagnosis.checked),
        "unchecked": dict(diagnosis.unchecked),
        "page": str(html) if html is not None else "",
    }


def _print(diagnosis: Diagnosis, log: Path, rig: str, html: Path | None) -> None:
    from rich.console import Group
    from rich.markup import escape
    from rich.panel import Panel
    from rich.text import Text

    from upright.cli.terminal import console
    from upright.doctor import KINDS

    screen = console()
    told = f"rig: {diagnosis.rig}" if diagnosis.rig else "no rig told"
    screen.print(
        f"[bold]{escape(diagnosis.file)}[/bold]: {diagnosis.samples} samples over {diagnosis.duration:.4g} s,"
        f" {escape(told)}",
        soft_wrap=True,
    )
    colours = {"fault": "red", "warning": "yellow", "note": "dim"}
    for f in diagnosis.findings:
        lines = [Text(f.sentence)]
        if f.evidence:
            shown = (f"{name.rpartition(' [')[0]} {value:.4g}{_unit(name)}" for name, value in f.evidence.items())
            lines.append(Text("Evidence: " + ", ".join(shown), style="dim"))
        if f.advice:
            lines.append(Text("What to do: " + f.advice))
        lines += [Text("    " + line, style="cyan") for line in f.key.splitlines()]
        title = f"{f.severity}: {f.kind}"
        screen.print(Panel(Group(*lines), title=title, title_align="left", border_style=colours[f.severity]))
    if not diagnosis.wrong:
        screen.print("[bold green]Nothing wrong found.[/]")
    screen.print("[bold]Looked for[/]: " + escape("; ".join(KINDS[k] for k in diagnosis.checked)) + ".")
    for why in dict.fromkeys(diagnosis.unchecked.values()):
        what = "; ".join(KINDS[k] for k, v in diagnosis.unchecked.items() if v == why)
        screen.print(f"[bold]Not looked for[/]: {escape(what)}: {escape(why)}.")
    _print_next(diagnosis, log, rig, html)


def _unit(name: str) -> str:
    unit = name.rpartition("[")[2].rstrip("]")
    return "" if unit == "1" else f" {unit}"


def _print_next(diagnosis: Diagnosis, log: Path, rig: str, html: Path | None) -> None:
    from rich.markup import escape

    from upright.cli.terminal import console, typed

    screen = console()
    if html is not None:
        screen.print(f"\nWritten: {escape(str(html))}", soft_wrap=True)
    screen.print("What next:", style="bold")
    name = typed(log)
    again = f" --rig {typed(rig)}" if rig else ""
    if diagnosis.findings and html is None:
        screen.print("- see the pictures:", soft_wrap=True)
        screen.print(f"    upright doctor {escape(name)}{escape(again)} -o {escape(typed(f'{log.stem}-doctor.html'))}",
                     soft_wrap=True)  # fmt: skip
    if not rig:
        screen.print("- name the rig, so that signs and scales can be told:", soft_wrap=True)
        screen.print(f"    upright doctor {escape(name)} --rig furuta", soft_wrap=True)
    screen.print("- write a study, with the keys named above:", soft_wrap=True)
    screen.print(f"    upright init {escape(name)} -o study.toml", soft_wrap=True)
