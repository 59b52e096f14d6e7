"""How rich a model do these runs deserve? A study goes in, a ladder of models and the chosen study come out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import Cluster, Data, Pdf, Processes, progress_bar, tell

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
    workers: Processes = 1,
    cluster: Cluster = "",
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
    from upright.verbs import model as verbs
    from upright.verbs.study import folder_beside

    folder = out if out is not None else folder_beside(study, "ladder")
    with progress_bar(quiet=as_json) as bar:
        climbed = verbs.ladder(
            study, out=folder, data=data, report=report, pdf=pdf, workers=workers, cluster=cluster, progress=bar
        )
    tell(climbed.chapter, climbed.files, climbed.numbers if as_json else None)
    if climbed.value.interrupted:
        raise typer.Exit(INTERRUPTED)
