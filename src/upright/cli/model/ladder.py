"""How rich a model do these runs deserve? A study goes in, a ladder of models and the chosen study come out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.model.identify import provenance, read_study
from upright.cli.terminal import Data, Pdf, progress_bar, tell, write_page
from upright.errors import BadInput

INTERRUPTED = 130


def ladder(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Rig, runs and everything one might ask.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="OUT", help="Folder for results; STUDY-ladder if left out.")
    ] = None,
    data: Data = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print ladder.json instead of tables.")] = False,
    report: Annotated[bool, typer.Option(help="Write ladder.html as well.")] = True,
    pdf: Pdf = False,
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
    from upright.files import json_text
    from upright.identification.ladder.growth import climb
    from upright.report.symbols import typed
    from upright.study.results import can_be_trimmed, chosen_study, write_ladder

    folder = out if out is not None else study.with_name(f"{study.stem}-ladder")
    asked = read_study(study, folder, data)
    if not asked.rig.estimated:
        raise BadInput(f'{study}: nothing is asked; give a parameter a guess, such as b_2c = {{ guess = "1e-4 N m" }}')
    with progress_bar(quiet=as_json) as bar:
        climbed = climb(asked.rig, asked.runs, asked.ladder or None, progress=bar)
    if not climbed.steps:
        raise KeyboardInterrupt
    written = [folder / "ladder.json"]
    content = write_ladder(climbed, asked, written[0])
    trimmed = can_be_trimmed(asked, climbed)
    if trimmed:
        written.append(folder / "study.toml")
        written[-1].write_text(chosen_study(asked, climbed), encoding="utf-8")
    from upright.report.ladder import chapter, next_steps

    where = typed(data if data is not None else study.parent)
    told = chapter(
        climbed, title=f"Ladder: {asked.title or asked.path.stem.replace('_', ' ')}", provenance=provenance(asked),
        steps=next_steps(climbed, study=typed(study), folder=typed(folder), data=where, trimmed=trimmed),
    )  # fmt: skip
    if report or pdf:
        written += write_page(told, folder / "ladder.html", pdf)
    if as_json:
        typer.echo(json_text(content))
    else:
        tell(told, written)
    if climbed.interrupted:
        raise typer.Exit(INTERRUPTED)
