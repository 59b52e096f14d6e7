"""Cross-validation: every run predicted by a fit of the others.

A refit starts where the fit of all runs ended, over the whole of the runs, so that leaving out six runs costs little
more than one fit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from upright.errors import BadInput
from upright.identification.inference.covariance import assess
from upright.identification.inference.scoring import predict
from upright.identification.inference.unseen.bands import calibrated, recalibrated
from upright.identification.model.bands import Bands
from upright.identification.model.fit import Fit, RunScore
from upright.identification.model.grey_box import GreyBox
from upright.identification.model.runs import Run
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import SearchLog, descend_progressively
from upright.progress import Progress, part, silent
from upright.workers import HERE, Finished, Workers, spread

SETTLED = 1e-5
"""Relative gain of the cost at which a refit has settled: its parameters are then off by less than 1 % of an error."""


@dataclass(frozen=True, kw_only=True)
class CrossValidation:
    """Every run as fitted among all, and as predicted by a fit of the others, by its label.

    `values` are the parameters of the fit without the run, `blind` those that the others could not see: they keep what
    the run itself specified, so that its prediction is none of theirs. Runs that an interrupted search did not come to
    are missing but for `fitted`. `bands` are those of the fit of all runs, as wide as these predictions ask.
    """

    fitted: Mapping[str, RunScore]
    predicted: Mapping[str, RunScore]
    values: Mapping[str, Mapping[str, float]]
    blind: Mapping[str, tuple[str, ...]]
    bands: Bands | None = None
    interrupted: bool = False


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """A run as predicted by a fit of the others: its score, their parameters by name, and what they cannot see."""

    label: str
    score: RunScore
    values: Mapping[str, float]
    blind: tuple[str, ...]


def leave_one_out(
    rig: GreyBox,
    runs: Sequence[Run],
    start: Mapping[str, float],
    *,
    noise: float | None = None,
    typical: Sequence[str] = (),
    otherwise: Mapping[str, float] | None = None,
    promise: bool = False,
    progress: Progress = silent,
    workers: Workers = HERE,
) -> Finished[HeldOut]:
    """Predict every run from a fit of the others, as far as Ctrl-C lets it come.

    Parameters
    ----------
    rig : GreyBox
        With its unknown parameters.
    runs : sequence of Run
        At least two.
    start : mapping
        Where the fit of all runs ended: numbers by their key, see `Problem.key`.
    noise : float, optional
        Residual that one sigma of prior knowledge is worth, as in `Problem`.
    typical : sequence of str
        Names out of `Run.unknown` that a predicted run does not estimate from itself: they stay at what is typical.
    otherwise : mapping, optional
        Values of parameters that the other runs cannot see at all; without it they keep those of `start`, which knows
        the run that is left out.
    promise : bool
        Whether each prediction carries the bands that the fit of the others promises, which takes a little longer.
    progress : callable, optional
        As for `identify`.
    workers : Workers, optional
        Who computes the refits, which are independent.
    """
    refit = partial(_predicted, rig, tuple(runs), dict(start), noise, tuple(typical), dict(otherwise or {}), promise)
    return spread(refit, range(len(runs)), workers=workers, progress=progress, what="run")


def _predicted(
    rig: GreyBox, runs: Sequence[Run], start: Mapping[str, float], noise: float | None, typical: Sequence[str],
    otherwise: Mapping[str, float], promise: bool, k: int, progress: Progress,
) -> HeldOut:  # fmt: skip
    """Run number `k` from a fit of the others."""
    run = runs[k]
    problem = formulate(rig, [r for r in runs if r is not run])
    if noise is not None:
        problem.noise = noise
    progress(f"without {run.label}", 0.0)
    x = problem.place(start)
    problem.weigh_components(x)
    felt = np.diag(problem.settle_steps(x).matrix)
    blind = [u.name for u, f in zip(problem.unknowns, felt, strict=True) if u.shared and not f > 0]
    if otherwise:
        x = problem.place({n: v for n, v in otherwise.items() if n in blind}, x)
    log = SearchLog(progress=part(progress, 0.0, 1.0, f"without {run.label}"))
    end = descend_progressively(problem, x, log, horizon=math.inf, tolerance=SETTLED)
    if end.interrupted:
        raise KeyboardInterrupt
    groups: dict[str, dict[str, float]] = {}
    for u, v in zip(problem.unknowns, problem.value(end.x), strict=True):
        if u.group:
            groups.setdefault(u.group, {})[u.name] = float(v)
    values = problem.shared_at(end.x)
    held = replace(run, role="predict", unknown=tuple(n for n in run.unknown if n not in typical))
    best = assess(problem, end.x) if promise else None
    bands = None if best is None or best.lost else calibrated(best)
    score = predict(values, rig, [held], groups=groups, bands=bands)[run.label]
    return HeldOut(label=run.label, score=score, values=values, blind=tuple(n for n in rig.estimated if n in blind))


def cross_validate(
    fit: Fit, runs: Sequence[Run], *, progress: Progress = silent, workers: Workers = HERE
) -> CrossValidation:
    """Predict every fitted run of a fit from a fit of the others.

    Parameters
    ----------
    fit : Fit
        Of all runs; the refits start there, without the terms that it left out.
    runs : sequence of Run
        Those that were fitted, at least two with role ``"fit"``.
    progress : callable, optional
        As for `identify`.
    workers : Workers, optional
        Who computes the refits.

    Returns
    -------
    CrossValidation
        As far as it came, when it was interrupted.

    Raises
    ------
    BadInput
        When there are not two runs to fit.
    """
    fitted = [run for run in runs if run.role == "fit"]
    if len(fitted) < 2:
        raise BadInput(
            f"to hold out each run in turn takes two runs with role 'fit' or more, {len(fitted)} came; add a run, or "
            "cut this one into two windows."
        )
    left_out = {n: e.value for n, e in fit.estimates.items() if e.status == "left out"}
    parameters = {
        n: replace(p, value=left_out[n], estimate=False) if n in left_out else p
        for n, p in fit.model.parameters.items()
    }
    rig = replace(fit.model, parameters=parameters)
    spreading = leave_one_out(rig, fitted, fit.keyed(), promise=True, progress=progress, workers=workers)
    predictions = spreading.so_far()
    return CrossValidation(
        fitted={run.label: fit.runs[run.label] for run in fitted},
        predicted={one.label: one.score for one in predictions},
        values={one.label: one.values for one in predictions},
        blind={one.label: one.blind for one in predictions},
        bands=recalibrated(fit.bands, [one.score for one in predictions])
        if fit.bands and not spreading.interrupted
        else fit.bands,
        interrupted=spreading.interrupted,
    )
