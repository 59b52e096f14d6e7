"""Experiments at a rig as chapters: those of the same fits on logs of one's own, told as one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from upright.experiments.frequency_1b.chapter import log_chapter
from upright.experiments.hands_on.hanging import Hanging
from upright.identification.model.fit import Fit
from upright.report.fit.chapter import chapter
from upright.report.fit.tables import finding, plain_estimate
from upright.report.page import Chapter, Symbol
from upright.report.symbols import typed, unit
from upright.study.load import Study


def hanging_chapter(done: Hanging, folder: Path, truth: Mapping[str, float]) -> Chapter:
    """The motion's fit, and the response frequency by frequency before it."""
    told = fit_chapter(done.study, done.fit, folder, truth)
    if done.response is None:
        left = "Dry friction left too few frequencies for a response; the numbers rest on the motion alone."
        return replace(told, warnings=(*told.warnings, left))
    asked = log_chapter(done.response)
    question = "What does the rig answer while it hangs, and which numbers of its equations does that fix?"
    return replace(
        told, question=question, parts=(*asked.parts[:2], *told.parts),
        numbers={**told.numbers, "response": asked.numbers},
    )  # fmt: skip


def fit_chapter(study: Study, fit: Fit, folder: Path, truth: Mapping[str, float]) -> Chapter:
    """As `upright identify` tells it, its numbers on the cover too, beside the `truth` where a twin tells it."""
    told = chapter(fit, title=study.title, provenance=study.provenance, study=typed(study.path), folder=typed(folder))
    numbers = {n: {**plain_estimate(e), "unit": e.unit, "status": e.status} for n, e in fit.estimates.items()}
    found = tuple(
        finding(Symbol(f"{n} [{unit(e.unit)}]" if unit(e.unit) else n), e, truth.get(n))
        for n, e in fit.estimates.items() if e.status != "known" and n in fit.rig.parameters
    )  # fmt: skip
    return replace(
        told, findings=found, numbers={"trusted": fit.trusted, "verdict": fit.verdict, "parameters": numbers}
    )
