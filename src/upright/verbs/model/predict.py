"""How well a model that was fitted before explains other runs: `predict`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput
from upright.files import keeps_its_inputs
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.pages import folder, pdf_has_folder, write_page
from upright.verbs.values import open_log

if TYPE_CHECKING:
    from upright.files import PathLike
    from upright.identification.inference.scoring import RunScore
    from upright.study.load import Study
    from upright.study.stored_fit import StoredFit
    from upright.verbs.forms import FitLike, StudyLike


@command(
    "Model",
    metavars={"model": "OUT/fit.json", "study": "STUDY.toml", "out": "OUT"},
    helps={
        "model": "Model that `upright identify` wrote.",
        "study": "Runs to score, a study whose guesses are not used, or a log.",
    },
    wrong=lambda scored: not scored.chapter.sound,
    more="""
    The study is written as for `upright identify`; [parameters] and [actuator]
    may be left out, since every number comes from the fit.

    upright predict swing-fit/fit.json other_day.toml

    upright predict swing-fit/fit.json other_day.csv

    Exit code: 0 predicted as well as the fit promises, 3 worse, or only runs that
    the fit has seen, 2 the model, the study or a log is wrong.
    """,
)
@keeps_its_inputs
def predict(
    model: FitLike, study: StudyLike, *, data: PathLike | None = None,
    out: PathLike | None = None, pdf: bool = False,
) -> Answer[dict[str, RunScore]]:  # fmt: skip
    """Predict other runs with a fitted model, and score the prediction.

    Every run is scored, whatever its role. Only what a run lists under ``unknown`` (its initial state by default) is
    estimated for that run. Each prediction has a band that should hold 90 % of the samples. A run that goes beyond the
    fitted commands, speeds or angles is named, with by how much.

    Parameters
    ----------
    model : fit or path
        What `identify` answered, or the fit.json that it wrote, or its folder.
    study : path, Study, Record or pandas.DataFrame
        Runs to score: a study, whose guesses are not used, or a log, whose columns are recognised.
    data : path, optional
        Folder the runs' files are in; the study's own when omitted.
    out : path, optional
        Folder for prediction.json and prediction.html.
    pdf : bool
        Write the page as PDF too.

    Returns
    -------
    Answer
        Of the scores by run. Its chapter is `sound` when they are predicted as well as the fit promises.

    Raises
    ------
    BadInput
        When model or study cannot be read, or speak of different plants.
    """
    from upright.files import write_json
    from upright.identification.inference.scoring import predict as score
    from upright.identification.inference.unseen.promise import promise
    from upright.report.fit.pictures import score_pictures
    from upright.report.fit.tables import score_table
    from upright.report.page import Chapter, Part, Step
    from upright.verbs.handover import called, fitted_of

    pdf_has_folder(out, pdf)
    for source, what in ((model, "the model"), (study, "the study")):
        if isinstance(source, str | os.PathLike) and not Path(source).exists():
            raise BadInput(f"{what} {source} does not exist; the call is upright predict OUT/fit.json STUDY.toml")
    fitted, of = fitted_of(model, "predict"), Path(called(model)).name
    requested, on = runs_to_predict(fitted, study, data)
    missing = [n for n in fitted.values if n not in requested.model.parameters]
    if missing:
        raise BadInput(
            f"{on}: the plant '{requested.plant}' has no parameter {missing[0]}, and {of} is a '{fitted.plant}';"
            " both must be the same plant"
        )
    rig = replace(requested.model, substeps=fitted.substeps)
    runs = [replace(run, role="predict") for run in requested.runs]
    scores = score(fitted.values, rig, runs, groups=fitted.groups, bands=fitted.bands)
    promised = promise(scores, fitted.bands, fitted.scores)
    fitted_runs = {run.label: label for run in runs if (label := fitted.fitted_run(run.source))}
    verdict = f"{_fitted_note(fitted_runs, len(runs))}{promised.sentence}"
    names = ("beyond", "role", "fit_percent", "horizon", "adapted", "offer", "inside")
    numbers: dict[str, Any] = {
        "model": of,
        "study": on,
        "verdict": verdict,
        "as_promised": promised.holds,
        "seen_in_the_fit": fitted_runs,
        "runs": {label: {name: getattr(s, name) for name in names} for label, s in scores.items()},
    }
    offers = [s.offer.sentence(label, s.fit_percent) for label, s in scores.items() if s.offer is not None]
    source, only_fitted = called(model), len(fitted_runs) == len(runs)
    onward = (
        Step("Predict a run that was not fitted.", f"upright predict {source} OTHER.csv") if only_fitted
        else Step("Find gains for this model.", f"upright design {source}") if promised.holds
        else Step("Look for faults of this log's sensors and drive.", f"upright doctor LOG --rig {source}")
    )  # fmt: skip
    page = Chapter(
        title=f"{of} on {on}", verdict=verdict, sound=promised.holds and not only_fitted, numbers=numbers,
        steps=(onward,),
        parts=(
            Part(
                "How much of each signal is explained",
                (score_table(scores), *score_pictures(scores, rig.plant, "prediction")),
            ),
        ),
        warnings=(
            *(() if fitted.trusted else (f"The model's own verdict was: {fitted.verdict}",)),
            *fitted.hardware.unlike(requested.hardware), *(s for run in scores.values() for s in run.beyond), *offers,
        ),
    )  # fmt: skip
    if out is None:
        return Answer(scores, page)
    at = folder(out)
    return Answer(
        scores, page, [write_json(at / "prediction.json", numbers), *write_page(page, at / "prediction.html", pdf)]
    )


def _fitted_note(fitted_runs: Mapping[str, str], runs: int) -> str:
    """What has to stand before the verdict where runs were fitted: how they are explained is no prediction."""
    if not fitted_runs:
        return ""
    which = ", ".join(f"'{run}' (as '{label}')" if run != label else f"'{run}'" for run, label in fitted_runs.items())
    what = "This is no prediction: the fit has seen" if len(fitted_runs) == runs else "The fit has seen"
    return f"{what} {which}. "


def runs_to_predict(fitted: StoredFit, source: Any, data: PathLike | None) -> tuple[Study, str]:
    """Study of the runs to score, and what it is called."""
    from upright.study.draft.from_record import study_of_record
    from upright.study.load import Study, load_study

    if isinstance(source, Study):
        return source, source.path.name
    if isinstance(source, str | os.PathLike) and Path(source).suffix.lower() in (".toml", ""):
        study = load_study(Path(source), data=None if data is None else Path(data), fixed=fitted.values)
        return study, Path(source).name
    kind = fitted.kind
    record, path = open_log(source)
    known = {n: v for n, v in fitted.values.items() if n in kind.names()}
    whole = (float(record.t[0]), float(record.t[-1]))
    study = study_of_record(record, kind, known=known, ask=[], window=whole)
    drive = {n: replace(p, value=fitted.values.get(n, p.value)) for n, p in study.model.parameters.items()}
    return replace(study, model=replace(study.model, parameters=drive)), path.name
