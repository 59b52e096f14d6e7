"""The fit of a study of logs from a test stand, and its chapter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from upright.identification.estimate import identify
from upright.identification.model.fit import Fit
from upright.progress import Progress
from upright.report.fit.chapter import chapter
from upright.report.fit.tables import finding, plain_estimate
from upright.report.page import Chapter, Symbol
from upright.report.symbols import typed, unit
from upright.study.load import Study, load_study
from upright.study.results import write_fit


def fit_study(path: Path, progress: Progress) -> tuple[Study, Fit]:
    """A study with its fit, as `upright identify` would find it; leaves `fit.json` beside the study."""
    study = load_study(path)
    fit = identify(study.model, study.runs, progress=progress)
    write_fit(fit, study, path.with_name("fit.json"))
    return study, fit


def fit_chapter(study: Study, fit: Fit, folder: Path, truth: Mapping[str, float]) -> Chapter:
    """As `upright identify` tells it, its numbers on the cover too, beside the `truth` where a twin tells it."""
    page = chapter(fit, title=study.title, provenance=study.provenance, study=typed(study.path), folder=typed(folder))
    numbers = {n: {**plain_estimate(e), "unit": e.unit, "status": e.status} for n, e in fit.estimates.items()}
    findings = tuple(
        finding(Symbol(f"{n} [{unit(e.unit)}]" if unit(e.unit) else n), e, truth.get(n))
        for n, e in fit.estimates.items() if e.status != "known" and n in fit.model.parameters
    )  # fmt: skip
    return replace(
        page, findings=findings, numbers={"trusted": fit.trusted, "verdict": fit.verdict, "parameters": numbers}
    )
