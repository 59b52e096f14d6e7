"""Experiments at a rig as chapters: those of the same fits on logs of one's own, told as one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from upright.experiments.frequency_1b.chapter import log_chapter
from upright.experiments.hands_on.hanging import Hanging
from upright.identification.model.fit import Fit
from upright.report.fit.chapter import chapter
from upright.report.fit.tables import plain_estimate
from upright.report.page import Chapter
from upright.report.symbols import typed
from upright.study.load import Study


def hanging_chapter(done: Hanging, folder: Path) -> Chapter:
    """The motion's fit, and the response frequency by frequency before it."""
    told = fit_chapter(done.study, done.fit, folder)
    if done.response is None:
        left = "Dry friction left too few frequencies for a response; the numbers rest on the motion alone."
        return replace(told, warnings=(*told.warnings, left))
    asked = log_chapter(done.response)
    question = "What does the rig answer while it hangs, and which numbers of its equations does that fix?"
    return replace(
        told, question=question, parts=(*asked.parts[:2], *told.parts),
        numbers={**told.numbers, "response": asked.numbers},
    )  # fmt: skip


def fit_chapter(study: Study, fit: Fit, folder: Path) -> Chapter:
    """As `upright identify` tells it."""
    told = chapter(fit, title=study.title, provenance=study.provenance, study=typed(study.path), folder=typed(folder))
    numbers = {n: {**plain_estimate(e), "unit": e.unit, "status": e.status} for n, e in fit.estimates.items()}
    return replace(told, numbers={"trusted": fit.trusted, "verdict": fit.verdict, "parameters": numbers})
