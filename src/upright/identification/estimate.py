"""Which numbers explain these runs, how sure is that, and what can they not tell?"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.identification.checks.conventions import doubts
from upright.identification.checks.refit import watched
from upright.identification.inference.answer import answer
from upright.identification.inference.scoring import fit_percent, predict
from upright.identification.ladder.friction import choose
from upright.identification.ladder.rungs import without
from upright.identification.model.model import Fit, Rig, Run
from upright.identification.problem.pose import pose, unresolved
from upright.identification.problem.predictor_setup import with_noise
from upright.identification.problem.problem import Problem
from upright.identification.problem.trips import located, untold
from upright.identification.search.descent import Descent, Report, grow
from upright.identification.search.moments import other_moments
from upright.identification.search.simplex import simplex
from upright.identification.search.strategy import (
    Log,
    better,
    carried,
    closed_form_starts,
    count,
    explain,
    placed,
    weigh_priors,
)

__all__ = ["METHODS", "fit_percent", "identify", "predict"]

Array = NDArray[np.float64]

METHODS = ("auto", "least-squares", "simplex")
"""`auto`: closed-form starts, friction ladder, growing least squares, simplex where it stalls. `least-squares`: from
the guess over a growing horizon. `simplex`: the paper's, then polished by least squares."""


def identify(
    rig: Rig, runs: Sequence[Run], *, method: str = "auto", progress: Report | None = None, watch: bool = True
) -> Fit:
    """Estimate a rig's parameters from its runs.

    Parameters
    ----------
    rig : Rig
        Plant, what is known and what is asked.
    runs : sequence of Run
        Those with role ``"fit"`` are explained together; those with role ``"predict"`` are only scored, with the
        parameters fixed.
    method : {"auto", "least-squares", "simplex"}
        See `METHODS`.
    progress : callable, optional
        Called with stage, fraction done, cost and number of simulations.
    watch : bool
        Whether stretches that something else than the input moved are named, and left out in a second fit.

    Returns
    -------
    Fit
        Also when the search did not settle or was interrupted (the best so far, `interrupted` set): its `verdict`
        says so in a sentence.

    Raises
    ------
    BadInput
        When no run may be fitted, nothing is asked, or a name does not exist.
    """
    began = time.perf_counter()
    rig = with_noise(rig, runs)
    seen = [located(rig, run) for run in runs if run.role == "fit"]
    _check(rig, seen, method)
    log = Log(report=progress, doubts=cache(lambda: doubts(rig, seen)))
    log.warnings += untold(rig, seen)
    left_out: tuple[str, ...] = ()
    chosen = rig
    problem = pose(rig, seen)
    found: Descent | None = None
    try:
        if method == "auto":
            chosen, candidates, left_out = choose(rig, seen, log)
            if chosen is not rig:
                problem = pose(chosen, seen)
            found = explain(problem, candidates, log)
        elif method == "simplex":
            x, limit = problem.start, 200 * problem.start.size
            for horizon in (_half(problem), math.inf):
                x, cost = simplex(problem, x, horizon=horizon, limit=limit, report=progress, keep=log.keep(problem))
                log.history.append(("simplex", cost, problem.evaluations))
            found = grow(problem, x, report=progress, history=log.history, horizon=math.inf)
        else:
            found = grow(problem, problem.start, report=progress, history=log.history)
            log.best = problem, found.x
            if found.normal.cost > 0.04 * count(problem) and not found.interrupted:
                starts = [placed(problem, s) for s in closed_form_starts(rig, seen)]
                other = explain(problem, starts, log, patient=False) if starts else found
                found = better(found, other)
        found = other_moments(problem, found, log)
        plain = () if found.interrupted else unresolved(problem, found.x)
        if plain:  # kept at their bound they would bias everything else
            log.unresolved = plain
            left_out += plain
            chosen, wider = without(chosen, plain), (problem, found.x)
            problem = pose(chosen, seen)
            found = grow(problem, carried(*wider, problem), report=progress, history=log.history, horizon=math.inf)
        found = weigh_priors(problem, found)
        if found.interrupted:  # perhaps over a part of the runs
            found = replace(found, normal=problem.normal(found.x))
    except KeyboardInterrupt:
        chosen, problem, x = _resumed(rig, seen, log)
        left_out = tuple(n for n in rig.estimated if n not in chosen.estimated)
        found = Descent(x=x, normal=problem.normal(x), converged=False, interrupted=True)

    def told(found: Descent) -> Fit:
        return answer(
            rig, chosen, runs, problem, found,
            log=log, method=method, left_out=left_out, seconds=lambda: time.perf_counter() - began,
        )  # fmt: skip

    try:
        fit = told(found)
        if not watch or fit.interrupted:
            return fit
        return watched(fit, rig, runs, lambda kept: identify(rig, kept, method=method, progress=progress, watch=False))
    except KeyboardInterrupt:  # intervals and predictions may take long too; without them an answer is near
        return told(replace(found, interrupted=True))


def _resumed(rig: Rig, seen: Sequence[Run], log: Log) -> tuple[Rig, Problem, Array]:
    """Rig, problem and coordinates of the best so far, which may be of a part of the runs."""
    if log.best is None:
        problem = pose(rig, seen)
        return rig, problem, problem.start
    part, x = log.best
    problem = pose(part.rig, seen)
    return part.rig, problem, carried(part, x, problem)


def _half(problem: Problem) -> float:
    from upright.identification.search.descent import first_horizon

    return min(problem.duration, 2 * first_horizon(problem))


def _check(rig: Rig, seen: Sequence[Run], method: str) -> None:
    from upright.errors import nearest

    if method not in METHODS:
        raise BadInput(f"the method must be one of {', '.join(METHODS)}, got '{method}'; {nearest(method, METHODS)}")
    if not seen:
        raise BadInput("an identification needs at least one run with role 'fit', none came; set it for one run.")
    if not rig.estimated:
        raise BadInput("nothing is asked: no parameter is to be estimated; give at least one a guess.")
    for run in seen:
        if run.t.size < 10:
            raise BadInput(f"run '{run.label}' has {run.t.size} samples, at least 10 are needed; widen its window.")
