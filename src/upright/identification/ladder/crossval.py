"""Does a model predict the run it has not seen? Every run left out in turn, the others fitted again.

A refit starts where the fit of all runs ended, over the whole of the runs, so that leaving out six runs costs little
more than one fit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.identification.inference.scoring import predict
from upright.identification.model.model import Fit, Rig, Run, RunScore
from upright.identification.model.unknowns import SHARED
from upright.identification.problem.pose import pose, settle_steps
from upright.identification.problem.problem import Problem
from upright.identification.search.descent import Report, grow
from upright.identification.search.strategy import placed

Array = NDArray[np.float64]
Values = Mapping[tuple[str, str], float]
"""Numbers by home and name; the home is a run's label, ``"group: label"``, or empty for what all runs share."""

SETTLED = 1e-5
"""Relative gain of the cost at which a refit has settled: its parameters are then off by less than 1 % of an error."""


@dataclass(frozen=True, kw_only=True)
class CrossValidation:
    """Every run as fitted among all, and as predicted by a fit of the others.

    Attributes
    ----------
    fitted, predicted : mapping of str to RunScore
        By run label; `predicted` lacks the runs that an interrupted search did not come to.
    values : mapping of str to mapping of str to float
        Parameters of the fit without a run, by the run's label.
    blind : mapping of str to tuple of str
        Parameters that the others could not see, by the label of the run left out: they keep what that run said, so
        that its prediction is none of theirs.
    interrupted : bool
    """

    fitted: Mapping[str, RunScore]
    predicted: Mapping[str, RunScore]
    values: Mapping[str, Mapping[str, float]]
    blind: Mapping[str, tuple[str, ...]]
    interrupted: bool = False


@dataclass(frozen=True, kw_only=True)
class Left:
    """What the fit without one run came to: parameters by name, and those that no other run sees."""

    label: str
    values: Mapping[str, float]
    blind: tuple[str, ...]


def home(problem: Problem, index: int) -> tuple[str, str]:
    """Home and name of one number sought, which other sets of runs know it by."""
    u = problem.unknowns[index]
    if u.runs == SHARED:
        return "", u.name
    return (f"group: {u.group}" if u.group else problem.tracks[u.runs[0]].run.label), u.name


def values_at(problem: Problem, x: Array) -> dict[tuple[str, str], float]:
    """Every number of a problem by home and name."""
    v = problem.value(x)
    return {home(problem, i): float(v[i]) for i in range(len(problem.unknowns))}


def values_of(fit: Fit) -> dict[tuple[str, str], float]:
    """Every number that a fit estimated, by home and name."""
    found = {("", n): e.value for n, e in fit.estimates.items()}
    found |= {(label, n): e.value for label, own in fit.per_run.items() for n, e in own.items()}
    return found | {(f"group: {label}", n): e.value for label, own in fit.groups.items() for n, e in own.items()}


def placed_at(problem: Problem, known: Values) -> Array:
    """Coordinates at which numbers have the values that are known; the others keep their start."""
    x = problem.start
    for i, u in enumerate(problem.unknowns):
        value = known.get(home(problem, i))
        if value is not None and (not u.log or value > 0):
            x[i] = u.inside(value)
    return np.clip(x, problem.lower, problem.upper)


def leave_one_out(
    rig: Rig,
    runs: Sequence[Run],
    start: Values,
    *,
    noise: float | None = None,
    typical: Sequence[str] = (),
    otherwise: Mapping[str, float] | None = None,
    report: Report | None = None,
    found: Callable[[RunScore, Left], None],
) -> None:
    """Predict every run from a fit of the others.

    Parameters
    ----------
    rig : Rig
        With its unknown parameters.
    runs : sequence of Run
        At least two.
    start : mapping
        Where the fit of all runs ended.
    noise : float, optional
        Residual that one sigma of prior knowledge is worth, as in `Problem`.
    typical : sequence of str
        Names out of `Run.unknown` that a predicted run does not estimate from itself: they stay at what is typical.
    otherwise : mapping, optional
        Values of parameters that the other runs cannot see at all; without it they keep those of `start`, which knows
        the run that is left out.
    report : callable, optional
        As for `identify`.
    found : callable
        Called with a run's score and with what was left, as soon as they are known.

    Raises
    ------
    KeyboardInterrupt
        What was found before stays with the caller.
    """
    for k, run in enumerate(runs):
        others = [r for r in runs if r is not run]
        part = pose(rig, others)
        if noise is not None:
            part.noise = noise

        def tell(stage: str, fraction: float, cost: float, evaluations: int, k: int = k, run: Run = run) -> None:
            if report is not None:
                report(f"without {run.label}", (k + fraction) / len(runs), cost, evaluations)

        tell("", 0.0, math.nan, 0)
        x = placed_at(part, start)
        blind = _blind(part, x)
        if otherwise:
            x = placed(part, {n: v for n, v in otherwise.items() if n in blind}, x)
        end = grow(part, x, report=tell, horizon=math.inf, tolerance=SETTLED)
        if end.interrupted:
            raise KeyboardInterrupt
        values = values_at(part, end.x)
        shared = {n: v for (where, n), v in values.items() if not where}
        groups: dict[str, dict[str, float]] = {}
        for (where, n), v in values.items():
            if where.startswith("group: "):
                groups.setdefault(where.removeprefix("group: "), {})[n] = v
        held = replace(run, role="predict", unknown=tuple(n for n in run.unknown if n not in typical))
        score = predict(shared, rig, [held], groups=groups)[run.label]
        found(score, Left(label=run.label, values=shared, blind=tuple(n for n in rig.estimated if n in blind)))


def _blind(part: Problem, x: Array) -> set[str]:
    """Names of the parameters that no residual feels."""
    felt = np.diag(settle_steps(part, x, math.inf).matrix)
    return {u.name for u, f in zip(part.unknowns, felt, strict=True) if u.runs == SHARED and not f > 0}


def cross_validate(
    fit: Fit,
    runs: Sequence[Run],
    *,
    progress: Report | None = None,
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

    Returns
    -------
    CrossValidation
        As far as it came, when it was interrupted.

    Raises
    ------
    BadInput
        When there are not two runs to fit.
    """
    seen = [run for run in runs if run.role == "fit"]
    if len(seen) < 2:
        raise BadInput(
            f"to hold out each run in turn takes two runs with role 'fit' or more, {len(seen)} came; add a run, or "
            "cut this one into two windows."
        )
    out = {n for n, e in fit.estimates.items() if e.status == "left out"}
    parameters = {
        n: replace(p, value=fit.estimates[n].value, estimate=False) if n in out else p
        for n, p in fit.rig.parameters.items()
    }
    predicted: dict[str, RunScore] = {}
    values: dict[str, Mapping[str, float]] = {}

    blind: dict[str, tuple[str, ...]] = {}

    def keep(score: RunScore, left: Left) -> None:
        predicted[left.label], values[left.label], blind[left.label] = score, left.values, left.blind

    interrupted = False
    try:
        rig = replace(fit.rig, parameters=parameters)
        leave_one_out(rig, seen, values_of(fit), report=progress, found=keep)
    except KeyboardInterrupt:
        interrupted = True
    fitted = {run.label: fit.runs[run.label] for run in seen}
    return CrossValidation(fitted=fitted, predicted=predicted, values=values, blind=blind, interrupted=interrupted)
