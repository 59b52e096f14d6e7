"""What would the numbers be if a term that ended at zero, or was left out, were there after all?

A term that the held-out data do not ask for may still exist, and another has then taken its part: viscous friction
is larger where Coulomb friction was left out. An interval that leaves this out is too short (the estimate after a
choice of model is a mixture over models, Buckland, Burnham and Augustin 1997).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.covariance import Spread, assess
from upright.identification.inference.per_run import estimate, quantile
from upright.identification.inference.profile import AFFORDED, profile, settled, work
from upright.identification.model.model import Estimate, Rig
from upright.identification.model.unknowns import SHARED
from upright.identification.problem.normal import pseudo_inverse
from upright.identification.problem.pose import pose, settle_steps
from upright.identification.problem.problem import Problem
from upright.identification.search.descent import Descent, descend
from upright.identification.search.strategy import Log, carried, placed

Array = NDArray[np.float64]


def doubted(
    estimates: Mapping[str, Estimate], asked: Rig, chosen: Rig, problem: Problem, x: Array, spread: Spread,
    left_out: Sequence[str], log: Log,
) -> dict[str, Estimate]:  # fmt: skip
    """Estimates whose intervals hold what a term at its bound, or one left out, would make of them."""
    out = dict(estimates)
    doubts = [beyond_bounds(problem, x, spread, estimates)]
    if left_out:
        q = quantile(spread.samples, x.size + len(left_out))
        doubts.append(with_left_out(asked, chosen, problem, x, left_out, q, log))
    for found in doubts:
        for name, interval in found.items():
            if name in out and out[name].status not in ("unseen", "known"):
                out[name] = widened(out[name], interval)
    return out


def beyond_bounds(
    problem: Problem, x: Array, spread: Spread, estimates: Mapping[str, Estimate]
) -> dict[str, tuple[float, float]]:
    """Intervals widened by what would follow if numbers held at a bound moved to the far end of their intervals.

    The others move by ``-A_ff^-1 A_fp`` per unit of a pinned number, A the Gauss-Newton matrix.
    """
    shared = [i for i, u in enumerate(problem.unknowns) if u.runs == SHARED]
    pinned = [i for i in shared if spread.pinned[i] and problem.unknowns[i].name in estimates]
    free = np.flatnonzero(~spread.pinned)
    found = {problem.unknowns[i].name: estimates[problem.unknowns[i].name].interval for i in shared
             if problem.unknowns[i].name in estimates}  # fmt: skip
    if not pinned or not free.size:
        return {}
    inverse = pseudo_inverse(spread.matrix[np.ix_(free, free)])
    value = problem.value(x)
    for p in pinned:
        u = problem.unknowns[p]
        low, high = estimates[u.name].interval
        far = high if value[p] <= u.lower * (1 + 1e-12) or value[p] == u.lower else low
        if not math.isfinite(far):
            continue
        move = -(inverse @ spread.matrix[free, p]) * (u.inside(far) - x[p] if not u.log or far > 0 else 0.0)
        for i, d in zip(free, move, strict=True):
            other = problem.unknowns[i]
            if other.runs != SHARED or other.name not in found:
                continue
            there = float(value[i] * math.exp(np.clip(d, -700, 700)) if other.log else value[i] + d)
            there = min(max(there, other.lower), other.upper)
            a, b = found[other.name]
            found[other.name] = (min(a, there), max(b, there))
    return found


def with_left_out(
    asked: Rig, chosen: Rig, problem: Problem, x: Array, left_out: Sequence[str], q: float, log: Log,
) -> dict[str, tuple[float, float]]:  # fmt: skip
    """Intervals of all shared numbers in the model that also has what was left out, by name; empty when it will not do.

    Starts from where the chosen model ended, with a tenth of the guess of each term left out.
    """
    freer = replace(chosen, parameters={**chosen.parameters, **{n: asked.parameters[n] for n in left_out}})
    richer = pose(freer, [t.run for t in problem.tracks])
    richer.noise, richer.blends = problem.noise, problem.blends
    seeds = {n: 0.1 * asked.parameters[n].value for n in left_out}
    z = placed(richer, seeds, carried(problem, x, richer))
    settle_steps(richer, z, math.inf)
    found = descend(richer.normal, z, richer.lower, richer.upper, tolerance=1e-5, limit=25)
    if found.interrupted:
        raise KeyboardInterrupt
    if not math.isfinite(found.normal.cost):
        return {}
    return _intervals(richer, found, left_out, q, log)


def _intervals(
    problem: Problem, found: Descent, left_out: Sequence[str], q: float, log: Log
) -> dict[str, tuple[float, float]]:
    spread = assess(problem, found.x)
    value = problem.value(found.x)
    out: dict[str, Estimate] = {}
    for i, u in enumerate(problem.unknowns):
        if u.runs != SHARED:
            continue
        v, sigma = float(value[i]), math.sqrt(max(float(spread.covariance[i, i]), 0.0))
        interval = estimate(problem, u, v, sigma, q).interval
        if u.name in left_out and spread.pinned[i] and work(problem, found.x.size) < AFFORDED:
            plain = Estimate(value=v, stderr=sigma, interval=interval, unit="", status="")
            interval = settled(profile(problem, found.x, i, spread, q, report=log.report), plain, log=u.log)
        interval = max(interval[0], u.lower), min(interval[1], u.upper)
        out[u.name] = Estimate(value=v, stderr=sigma, interval=interval, unit="", status="")
    wider = beyond_bounds(problem, found.x, spread, out)
    return {n: wider.get(n, e.interval) for n, e in out.items()}


def widened(e: Estimate, interval: tuple[float, float]) -> Estimate:
    """An estimate whose interval holds another one too; weak when it is then wider than the value."""
    low, high = min(e.interval[0], interval[0]), max(e.interval[1], interval[1])
    wide = e.status == "firm" and high - low > abs(e.value)
    return replace(e, interval=(low, high), status="weak" if wide else e.status)
