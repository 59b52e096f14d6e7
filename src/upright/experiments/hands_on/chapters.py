"""Experiments at a rig as chapters: those of the same fits on logs of one's own, told as one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from upright.experiments.frequency_1b.chapter import log_chapter
from upright.experiments.hands_on.hanging import Hanging
from upright.experiments.hands_on.loaded import Weighed
from upright.experiments.weighing_1a.chapter import loading_chapter
from upright.identification.model.fit import Fit
from upright.report.fit.chapter import chapter
from upright.report.fit.tables import finding, plain_estimate
from upright.report.page import Chapter, Step, Symbol
from upright.report.symbols import typed, unit
from upright.rig.makes import OSCILLATORS
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


def loaded_chapter(done: Weighed, folder: Path) -> Chapter:
    """The swings and their line, beside the truth of a twin."""
    found, body, (column,) = done.loadings, OSCILLATORS[done.kind], done.stand.names
    true = done.stand.truth
    truth = {"k": true["k_1"], body.bare: true[body.inertia], "c": true["c_1"]} if true else {}
    logs = " ".join(typed(folder / file) for file in done.files.values())
    added = " ".join(f"--added {typed(a)}" for a in done.stand.file.added)
    added += f' --tolerance "{100 * done.stand.file.tolerance:g} %"' if done.stand.file.tolerance else ""
    told = loading_chapter(
        found, kind=done.kind, title="Stiffness and inertia from added loads", logs=done.logs,
        signals=dict.fromkeys(done.logs, column), left_out=done.left_out, truth=truth or None,
        steps=(
            Step("Weigh it again from one log of each loading, as you would from logs of your own.",
                 f"upright loadings {logs} {added} --signal {column} --command u_applied"),
            Step(f"Write {body.inertia} into the study of what is built on this body, what is mounted on it added."),
        ),
    )  # fmt: skip
    named = (("k", found.k, "stiffness"), (body.bare, found.bare, "inertia"), ("c", found.damping, "damping"))
    units = {"stiffness": "k_1", "inertia": body.inertia, "damping": "c_1"}
    findings = tuple(
        finding(Symbol(f"{n} [{unit(body.plant.quantity(units[what]).unit)}]"), e, truth.get(n))
        for n, e, what in named
    )  # fmt: skip
    weighed = {body.inertia: {**plain_estimate(found.bare), "unit": body.unit}}
    return replace(told, key="1a", findings=findings, numbers={**told.numbers, "parameters": weighed})


def fit_chapter(study: Study, fit: Fit, folder: Path, truth: Mapping[str, float]) -> Chapter:
    """As `upright identify` tells it, its numbers on the cover too, beside the `truth` where a twin tells it."""
    told = chapter(fit, title=study.title, provenance=study.provenance, study=typed(study.path), folder=typed(folder))
    numbers = {n: {**plain_estimate(e), "unit": e.unit, "status": e.status} for n, e in fit.estimates.items()}
    found = tuple(
        finding(Symbol(f"{n} [{unit(e.unit)}]" if unit(e.unit) else n), e, truth.get(n))
        for n, e in fit.estimates.items() if e.status != "known" and n in fit.model.parameters
    )  # fmt: skip
    return replace(
        told, findings=found, numbers={"trusted": fit.trusted, "verdict": fit.verdict, "parameters": numbers}
    )
