"""What is told at the end? Estimates with their uncertainty, scores, and what the data cannot see, as one `Fit`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference import assumptions
from upright.identification.inference.covariance import Spread, assess
from upright.identification.inference.identifiability import Sight, hidden, look, sentences
from upright.identification.inference.model_doubt import doubted
from upright.identification.inference.per_run import estimate, own_estimates, quantile
from upright.identification.inference.poles import poles
from upright.identification.inference.profile import AFFORDED, profile, settled, work
from upright.identification.inference.scoring import predict, score
from upright.identification.inference.verdict import GOOD, judge
from upright.identification.model.model import NOISE, Estimate, Fit, Rig, Run, RunScore
from upright.identification.model.unknowns import SHARED
from upright.identification.problem.pose import pose
from upright.identification.problem.problem import Problem
from upright.identification.search.descent import Descent
from upright.identification.search.strategy import Log

Array = NDArray[np.float64]


NARROW = 0.1
"""A profile below this share of the interval from the standard error was not followed along its valley."""


def answer(
    asked: Rig,
    chosen: Rig,
    runs: Sequence[Run],
    problem: Problem,
    found: Descent,
    *,
    log: Log,
    method: str,
    left_out: Sequence[str],
    seconds: Callable[[], float],
) -> Fit:
    """Everything known about an optimum; of an interrupted search only what takes no time, so no predictions."""
    x = found.x
    warnings = list(log.warnings)
    spread = assess(problem, x)
    sight = look(problem, x, spread)
    blind = hidden(sight)
    estimates = _estimates(problem, x, spread, blind, log, interrupted=found.interrupted)
    per_run, groups = own_estimates(problem, x, spread)
    for name, value in log.rivals.items():
        estimates[name] = _widened(estimates[name], value)
    for name in left_out:
        estimates[name] = Estimate(
            value=0.0, stderr=0.0, interval=(0.0, 0.0), unit=asked.parameters[name].unit, status="left out"
        )
        warnings.append(
            f"{name} was left out: shorter than the encoder's rounding, it is plain Coulomb friction."
            if name in log.unresolved
            else f"{name} was left out: with it the held-out part of the runs is not predicted better."
        )
    estimates = {n: estimates[n] for n in [*asked.parameters] if n in estimates}
    if not found.interrupted:
        estimates = doubted(estimates, asked, chosen, problem, x, spread, left_out, log)
    told = [run for run in runs if run.role == "fit" or not found.interrupted]
    known = {label: {n: e.value for n, e in group.items()} for label, group in groups.items()}
    scores = _scores(chosen, told, problem, x, {n: e.value for n, e in estimates.items()}, known, log)
    if len(told) < len(runs):
        warnings.append("What was held out is not predicted, because the search was interrupted.")
    units = {n: p.unit for n, p in asked.parameters.items()}
    unseen = sentences(sight, units)
    worst = min((p for s in scores.values() if s.role == "fit" for p in s.fit_percent.values()), default=100.0)
    conventions = tuple(log.doubts()) if worst < GOOD else ()
    verdict, trusted = judge(
        runs=scores,
        estimates=estimates,
        unseen=unseen,
        conventions=conventions,
        converged=found.converged,
        interrupted=found.interrupted,
        memory=spread.memory,
        period=min(t.period for t in problem.tracks),
    )
    values = _whole(problem, x)
    there = [(i, u.name) for i, u in enumerate(problem.unknowns) if u.runs == SHARED and u.name in values]
    C = spread.covariance[np.ix_([i for i, _ in there], [i for i, _ in there])]
    size = np.array([values[n] if problem.unknowns[i].log else 1.0 for i, n in there])
    places = [i for i, u in enumerate(problem.unknowns) if u.runs == SHARED]
    taken = () if found.interrupted else assumptions.assumptions(chosen, problem, x, spread.pinned, estimates)
    verdict = " ".join([verdict, *assumptions.sentences(taken)])
    return Fit(
        rig=asked,
        estimates=estimates,
        per_run=per_run,
        groups=groups,
        runs=scores,
        verdict=verdict,
        trusted=trusted,
        method=method,
        evaluations=problem.evaluations,
        seconds=seconds(),
        cost=found.normal.cost,
        names=sight.names,
        correlation=_correlation(spread.covariance, places, problem, sight),
        singular_values=sight.singular_values,
        directions=sight.directions,
        unseen=unseen,
        warnings=(*warnings, *conventions),
        history=tuple(log.history),
        interrupted=found.interrupted,
        poles={}
        if blind  # a pole may depend on what the data cannot see
        else poles(chosen, values, [n for _, n in there], C * np.outer(size, size), quantile(spread.samples, x.size)),
        assumptions=taken,
    )


def _whole(problem: Problem, x: Array) -> dict[str, float]:
    """Every parameter of plant and actuator at coordinates `x`."""
    v = problem.value(x)
    return {**problem.base, **{u.name: float(v[i]) for i, u in enumerate(problem.unknowns) if u.runs == SHARED}}


def _estimates(
    problem: Problem, x: Array, spread: Spread, blind: set[str], log: Log, *, interrupted: bool
) -> dict[str, Estimate]:
    value = problem.value(x)
    q = quantile(spread.samples, x.size)
    shared: dict[str, Estimate] = {}
    budget = AFFORDED
    for i, u in enumerate(problem.unknowns):
        if u.runs != SHARED:
            continue
        plain = estimate(problem, u, float(value[i]), math.sqrt(max(spread.covariance[i, i], 0.0)), q)
        if u.name in blind:
            shared[u.name] = Estimate(
                value=plain.value, stderr=math.inf, interval=(-math.inf, math.inf), unit=plain.unit, status="unseen"
            )
            continue
        status = "firm" if u.asked else "known"
        interval = plain.interval
        wide = interval[1] - interval[0] > abs(plain.value)
        near = spread.pinned[i] or interval[0] <= u.lower < plain.value or interval[1] >= u.upper > plain.value
        if u.asked and (wide or near) and not u.name.startswith(NOISE):  # of a level its size is enough
            cost = work(problem, x.size)
            if cost < budget and not interrupted:
                budget -= cost
                interval = profile(problem, x, i, spread, q, report=log.report)
                whole = plain.interval[1] - plain.interval[0]
                if not u.log and interval[1] - interval[0] < NARROW * whole:
                    interval = plain.interval  # a valley too narrow to follow with one number held
                interval = settled(interval, plain, log=u.log)
                wide = interval[1] - interval[0] > abs(plain.value)
            status = "at bound" if spread.pinned[i] else "weak" if wide else "firm"
        interval = max(interval[0], u.lower), min(interval[1], u.upper)
        shared[u.name] = Estimate(
            value=plain.value, stderr=plain.stderr, interval=interval, unit=plain.unit, status=status
        )
    return shared


def _widened(e: Estimate, value: float) -> Estimate:
    """An estimate whose interval holds `value` too."""
    low, high = min(e.interval[0], value), max(e.interval[1], value)
    return replace(e, interval=(low, high), status="weak" if e.status == "firm" else e.status)


def _scores(
    rig: Rig, runs: Sequence[Run], problem: Problem, x: Array, values: dict[str, float],
    groups: Mapping[str, Mapping[str, float]], log: Log,
) -> dict[str, RunScore]:  # fmt: skip
    fitted = [run for run in runs if run.role == "fit"]
    thinned = any(t.y.shape[0] < t.run.t.size for t in problem.tracks)
    whole = pose(rig, fitted, thin=False) if thinned else problem
    found = {run.label: score(whole, i, x) for i, run in enumerate(fitted)}
    ahead = [run for run in runs if run.role != "fit"]
    found |= predict(values, rig, ahead, groups=groups, progress=log.report)
    return {run.label: found[run.label] for run in runs}


def _correlation(covariance: Array, places: list[int], problem: Problem, sight: Sight) -> Array:
    """Correlation (names, names) of the shared numbers in the order of `sight.names`."""
    chosen = [i for i in places if problem.unknowns[i].name in sight.names]
    C = covariance[np.ix_(chosen, chosen)]
    d = np.sqrt(np.maximum(np.diag(C), 0.0))
    s = np.where(d > 0, 1 / np.where(d > 0, d, 1.0), 0.0)
    R = C * s[:, None] * s
    np.fill_diagonal(R, 1.0)
    return R
