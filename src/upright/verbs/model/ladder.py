"""How rich a model may be before it stops predicting better: `ladder`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from upright.errors import BadInput
from upright.files import check_output, keeps_its_inputs
from upright.progress import Progress, silent
from upright.renamed import CLUSTER, renamed
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.model.identify import LogOptions, folder_beside, requested_study
from upright.verbs.options import known_options
from upright.verbs.pages import pdf_has_folder, write_page

if TYPE_CHECKING:
    from upright.files import PathLike
    from upright.identification.ladder.growth import Ladder
    from upright.verbs.forms import PlantLike, StudyLike
    from upright.verbs.values import Workforce


@command(
    "Model",
    metavars={"study": "STUDY.toml", "out": "OUT"},
    helps={
        "study": "Rig, runs and everything one might ask.",
        "out": "Folder for results; STUDY-ladder if left out.",
    },
    hidden=("plant", "known", "ask", "columns", "units", "window"),
    prepare=lambda typed: {**typed, "out": typed["out"] or folder_beside(typed["study"], "ladder")},
    more="""
    Rungs of your own, in the study:

        [[ladder]]
        name = "Coulomb friction"
        adds = ["b_1c", "b_2c"]      # held at zero below this rung
        [[ladder]]
        name = "torque that falls with speed"
        adds = ["actuator.knee", "actuator.fade"]
        [[ladder]]
        name = "friction of each run"
        unknown = ["friction"]

    Writes OUT/ladder.json, OUT/ladder.html and OUT/study.toml, the study of the
    chosen model. Ctrl-C keeps the rungs so far.
    Exit code: 0 a ladder was written, 2 the study or a log is wrong, 130
    stopped by Ctrl-C.
    """,
)
@renamed(CLUSTER)
@keeps_its_inputs
def ladder(
    study: StudyLike, plant: PlantLike | None = None, *, out: PathLike | None = None,
    data: PathLike | None = None, report: bool = True, pdf: bool = False, workers: Workforce = 1,
    progress: Progress = silent, **of_log: Unpack[LogOptions],
) -> Answer[Ladder]:  # fmt: skip
    """Add terms to a model only while it predicts unseen runs better.

    Give guesses of everything the rig might have. Rung after rung is fitted: viscous friction, Coulomb friction, drag,
    stiction, presliding, then the drive's terms, then friction that differs from run to run. Each run is predicted from
    a fit of the others (of a single run, the last third), and a rung is kept only if that prediction improves by more
    than it scatters. Where runs repeat one another, how well one predicts the other is the ceiling: a model that
    reaches it has nothing left to explain.

    Parameters
    ----------
    study : path, Study, Record, DataFrame or FitAnswer
        Rig, runs, guesses of everything the rig might have, and rungs of one's own where wanted; or a log.
    plant : class of a plant or its name, Rig, FitAnswer, Study, path of either, or Plant, optional
        For a log: what it is of, as `identify` takes it.
    out : path, optional
        Folder for ladder.json, ladder.html and study.toml, the study of the chosen model.
    data : path, optional
        Folder the runs' files are in; the study's own when omitted.
    report : bool
        Write ladder.html as well.
    pdf : bool
        Write the page as PDF too.
    workers : int, str or executor
        Who predicts each run from a fit of the others: processes of this machine, the address of a Dask scheduler, or
        an executor of `concurrent.futures`.
    progress : callable, optional
        Called with the current step and the share completed.
    **of_log
        For a log: known, ask, columns, units, window; see `identify`.

    Returns
    -------
    Answer
        Of a `Ladder`; Ctrl-C keeps the rungs so far, and `interrupted` says so.

    Raises
    ------
    BadInput
        When the study or a log is wrong, or nothing is to be estimated.
    KeyboardInterrupt
        When Ctrl-C came before the first rung stood.
    """
    from upright.files import replace_file, write_json
    from upright.identification.ladder.growth import climb
    from upright.report.ladder import chapter, ladder_steps
    from upright.report.symbols import typed
    from upright.study.results import can_be_trimmed, chosen_study, ladder_content
    from upright.workers import Workers

    shared = Workers.of(workers)
    pdf_has_folder(out, pdf)
    options = known_options(LogOptions, of_log, "ladder")
    folder = Path() if out is None else Path(out)
    requested = requested_study(
        study, plant, verb="ladder", folder=folder, data=None if data is None else Path(data), **options
    )
    study = requested.path
    at = folder_beside(study, "ladder") if out is None else Path(out)
    if out is not None:
        for name in ("ladder.json", "study.toml", "ladder.html"):
            check_output(at / name)
    if not requested.model.estimated:
        raise BadInput(
            f'{study}: nothing to estimate; give a parameter a guess, such as b_2c = {{ guess = "1e-4 N m" }}'
        )
    climbed = climb(requested.model, requested.runs, requested.ladder or None, progress=progress, workers=shared)
    if not climbed.steps:
        raise KeyboardInterrupt
    trimmed = study.is_file() and can_be_trimmed(requested, climbed)
    files: list[Path] = []
    numbers = ladder_content(climbed, requested)
    if out is not None:
        files.append(write_json(at / "ladder.json", numbers))
        if trimmed:
            files.append(replace_file(at / "study.toml", chosen_study(requested, climbed).encode()))
    where = typed(Path(data) if data is not None else study.parent)
    page = chapter(
        climbed, title=f"Ladder: {requested.title or requested.path.stem.replace('_', ' ')}",
        provenance=requested.provenance,
        steps=ladder_steps(climbed, study=typed(study), folder=typed(at), data=where, trimmed=trimmed),
    )  # fmt: skip
    if out is not None and (report or pdf):
        files += write_page(page, at / "ladder.html", pdf)
    return Answer(climbed, replace(page, numbers=numbers), files)
