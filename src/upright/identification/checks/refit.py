"""Runs that were predicted, fitted too: where the others leave a number undetermined that they would determine.

What was held out has tested the model by then, and a test is not worth a number. Only a whole fit tells whether it was
worth it, so the fit before it is kept until then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from upright.identification.checks.outliers import ASTRAY, explains_worse
from upright.identification.inference.verdict import trusted
from upright.identification.inference.verdict.evidence import PREDICTS, USABLE
from upright.identification.model.fit import Fit, RunScore
from upright.identification.model.runs import Run


def with_refit(fit: Fit, runs: Sequence[Run], again: Callable[[Sequence[Run], Fit], Fit]) -> Fit:
    """The fit, or that of `again`, which fits runs that it predicted as well, where that alone makes it trusted."""
    tested = {run.label for run in runs if run.refit and run.role == "predict"}
    answers = {a.question: a.answer for a in fit.answers}
    shown = answers.get(PREDICTS) in ("yes", "in part") and answers.get(USABLE) == "no"
    if not tested or not shown or not any(e.status == "poorly determined" for e in fit.estimates.values()):
        return fit
    new = again([replace(run, role="fit") if run.label in tested else run for run in runs], fit)
    if new.interrupted or not trusted(new.answers) or explains_worse(new, fit):
        return fit
    return replace(new, seconds=fit.seconds + new.seconds, evaluations=fit.evaluations + new.evaluations)


def as_tested(scores: Mapping[str, RunScore], tested: Mapping[str, RunScore]) -> dict[str, RunScore]:
    """Scores of fitted runs, in their place those of predictions that were `tested` before.

    None where a run is explained worse than it was predicted: the numbers are then others than those of the test.
    """
    return {
        label: tested[label] if label in tested and not _worse(score, tested[label]) else score
        for label, score in scores.items()
    }


def _worse(now: RunScore, before: RunScore) -> bool:
    return any(percent < before.fit_percent[signal] - ASTRAY for signal, percent in now.fit_percent.items())
