"""The fit of a log: its report, and what the page shows of it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from upright.browser.answers import thinned
from upright.browser.identify.bounded import finish
from upright.browser.identify.reading import record_named
from upright.errors import BadInput
from upright.experiments.stand.known import bench_values, model_of
from upright.files import plain_values, replace_file
from upright.identification.estimate import identify
from upright.identification.inference.assumptions import assumption_sentences
from upright.identification.inference.so_far import SoFar
from upright.identification.model.fit import Fit, RunScore
from upright.identification.model.runs import FITTED_SHARE, LEAST_RUN
from upright.physics import Plant
from upright.progress import Progress
from upright.quantities import with_unit
from upright.records import Record
from upright.report.fit.chapter import chapter
from upright.report.fit.tables import parameter_table
from upright.report.html import tone, write_html
from upright.report.symbols import number, percent, unit
from upright.rig.makes import make_named
from upright.rigs.rigfile import RigFile
from upright.running.rig import model_and_truth
from upright.study.draft.from_record import study_of_record
from upright.study.load import Study
from upright.study.results import fit_content, write_fit
from upright.study.windows import windows
from upright.workers import one_core

BUCKETS, FEW = 300, 150
"""Of a curve in the page, and while a fit goes on; a bucket has its least and its greatest sample."""


def identify_log(
    path: Path, name: str, rig: RigFile | None, measured: Mapping[str, str], folder: Path, progress: Progress,
    show: Callable[[dict[str, Any]], None] | None = None,
) -> str:  # fmt: skip
    """Fit a log, and write fit.json, report.html and what the page shows into a folder; the verdict.

    Parameters
    ----------
    rig : RigFile or None
        Of the rig that was logged, with the seed of its twin; None where the columns are to tell what it was.
    measured : mapping of str to str
        Numbers that somebody measured, with their units.
    show : callable, optional
        Called with what the search has come to, as the page draws it.

    Raises
    ------
    BadInput
        When log and rig do not go together, or nothing is to be estimated.
    """
    progress("reading the log", 0.0)
    record = record_named(path, name)
    study = study_of_record(record, known=measured) if rig is None else _study_of_rig(record, rig, measured)
    study = _tested(study)
    if not study.model.estimated:
        raise BadInput(f"every number of {study.title} is known, so that nothing is left to estimate.")
    with one_core():  # the other ones are for loops that must not be late
        fit = identify(study.model, study.runs, progress=progress, show=None if show is None else _shower(study, show))
    finish()
    folder.mkdir(parents=True)
    write_fit(fit, study, folder / "fit.json")
    page = chapter(fit, title=study.title, provenance=study.provenance, study=name, windows=windows(study.runs))
    write_html(folder / "report.html", replace(page, numbers=fit_content(fit, study)))
    facts = {
        "verdict": page.verdict, "sound": page.sound, "interrupted": fit.interrupted, "warnings": page.warnings,
        "plant": study.plant, "windows": windows(study.runs), "rests": assumption_sentences(fit.assumptions),
        "assessments": [
            {"question": a.question, "state": a.state, "tone": tone(a.state), "why": a.why} for a in page.assessments
        ],
        "assumed": [
            {"name": n, "meaning": p.meaning, "value": f"{number(p.value)} {unit(p.unit)}".strip()}
            for n, p in fit.model.parameters.items() if p.assumed
        ],
        "parameters": _parameters(fit), "curves": _curves(fit.model.plant, _shown(fit.runs)),
    }  # fmt: skip
    replace_file(folder / "facts.json", json.dumps(plain_values(facts)).encode())
    return page.verdict


def _study_of_rig(record: Record, file: RigFile, measured: Mapping[str, str]) -> Study:
    """The study of a log of a rig that the bench knows.

    Of a model of the laboratory it is known what a scale and a ruler tell, and how well; of any other what its
    description says.
    """
    model, truth = model_and_truth(file)
    if file.known is not None:
        return study_of_record(record, model, known=measured)
    make = make_named(file.make)
    known, sought = dict[str, str](), dict[str, float | str]()
    driven = any(bool(record[name].any()) for name in record.inputs)
    for name, p in model_of(make, bench_values(truth, make), make.bench).parameters.items():
        if p.uncertainty:
            known[name] = f"{with_unit(p.value, p.unit, 10)} +- {with_unit(p.uncertainty, p.unit, 4)}"
        elif p.estimate and (driven or not name.startswith("actuator.")):
            sought[name] = p.value
    sought = {name: value for name, value in sought.items() if name not in measured}
    return study_of_record(record, model, known={**known, **measured}, ask=sought)


def _tested(study: Study) -> Study:
    """The same with the end of its only run predicted instead of fitted: what was fitted tests nothing."""
    if len(study.runs) != 1 or study.runs[0].t.size < LEAST_RUN or study.runs[0].role != "fit":
        return study
    run = study.runs[0]
    if run.loop is not None or {"input_start", "input_end"} & set(run.unknown):
        return study
    seconds = float(run.t[-1] - run.t[0])
    rest = replace(run, label="the rest", role="predict", score_from=max(run.score_from, FITTED_SHARE * seconds))
    return replace(study, runs=(run.first_part(), rest))


def _parameters(fit: Fit) -> list[dict[str, str]]:
    """Rows of the report's table of parameters."""
    table, rows = parameter_table(fit), list[dict[str, str]]()
    for row in table.rows:
        cells = dict(zip(table.headings, row, strict=True))
        name, _, meaning = cells["name and meaning"].partition(", ")
        rows.append({
            "symbol": str(row[0]), "name": name, "meaning": meaning or name, "value": cells["value"],
            "interval": cells["95 % interval"], "unit": cells["unit"], "status": cells["status"],
            "tone": tone(cells["status"]),
        })  # fmt: skip
    return rows


def _shower(study: Study, show: Callable[[dict[str, Any]], None]) -> Callable[[SoFar], None]:
    def picture(so_far: SoFar) -> None:
        curves = {} if so_far.runs is None else {"curves": _curves(study.model.plant, so_far.runs, FEW)}
        explained = {name: round(percent, 2) for name, percent in so_far.explained.items()}
        show({"evaluations": so_far.evaluations, "explained": explained, **curves})

    return picture


def _curves(plant: type[Plant], runs: Mapping[str, RunScore], buckets: int = BUCKETS) -> list[dict[str, Any]]:
    """Signals as measured and as the model has them, thinned."""
    units = {c.name: (c.unit, c.meaning) for c in plant.coordinates}
    return [
        {
            "run": label, "role": score.role, "signal": name, "unit": units.get(name, ("", name))[0],
            "meaning": units.get(name, ("", name))[1], "fit": percent(score.fit_percent.get(name, math.nan)),
            "from": float(score.t[0]) + score.score_from, "ahead": score.horizon or 0.0,
            "measured": thinned(score.t, score.y[:, k], buckets),
            "predicted": thinned(score.t, score.simulated[:, k], buckets),
        }
        for label, score in runs.items() for k, name in enumerate(score.measured)
    ]  # fmt: skip


def _shown(runs: Mapping[str, RunScore]) -> Mapping[str, RunScore]:
    """The runs that test the model; where none does, those that were fitted."""
    predicted = {label: score for label, score in runs.items() if score.role == "predict"}
    return predicted or runs
