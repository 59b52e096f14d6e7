"""Model uncertainty: what the numbers would be if a term that ended at zero, or was left out, were there after all.

A term that the held-out data do not ask for may still exist, and another has then taken its part: viscous friction
is larger where Coulomb friction was left out. An interval that leaves this out is too short (the estimate after a
choice of model is a mixture over models, Buckland, Burnham and Augustin 1997).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from upright.identification.inference.covariance import Optimum, assess, student
from upright.identification.inference.intervals import AFFORDED, estimate, profile, profile_work
from upright.identification.model.fit import Estimate
from upright.identification.model.rig import Rig
from upright.identification.problem.formulation import formulate
from upright.identification.problem.normal_equations import pseudo_inverse
from upright.identification.search.descent import SearchLog, descend

Intervals = dict[str, tuple[float, float]]


def with_model_uncertainty(
    estimates: Mapping[str, Estimate], best: Optimum, asked: Rig, left_out: Sequence[str], log: SearchLog
) -> dict[str, Estimate]:
    """Estimates whose intervals hold what a term at its bound, or one left out, would make of them."""
    out = dict(estimates)
    others = [beyond_bounds(best, estimates)]
    if left_out:
        others.append(with_left_out(best, asked, left_out, log))
    for intervals in others:
        for name, interval in intervals.items():
            if name in out and out[name].status not in ("unseen", "known"):
                out[name] = widened(out[name], interval)
    return out


def beyond_bounds(best: Optimum, estimates: Mapping[str, Estimate]) -> Intervals:
    """Intervals widened by what would follow if numbers held at a bound moved to the far end of their intervals.

    The others move by ``-A_ff^-1 A_fp`` per unit of a pinned number, A the Gauss-Newton matrix.
    """
    unknowns, value, A = best.problem.unknowns, best.values, best.matrix
    found = {unknowns[i].name: estimates[unknowns[i].name].interval for i in best.shared
             if unknowns[i].name in estimates}  # fmt: skip
    pinned = [i for i in best.shared if best.pinned[i] and unknowns[i].name in found]
    free = np.flatnonzero(~best.pinned)
    if not pinned or not free.size:
        return {}
    inverse = pseudo_inverse(A[np.ix_(free, free)])
    for p in pinned:
        u = unknowns[p]
        low, high = estimates[u.name].interval
        far = high if value[p] <= u.lower * (1 + 1e-12) or value[p] == u.lower else low
        if not math.isfinite(far):
            continue
        move = -(inverse @ A[free, p]) * (u.coordinate(far) - best.x[p] if not u.log or far > 0 else 0.0)
        for i, d in zip(free, move, strict=True):
            other = unknowns[i]
            if not other.shared or other.name not in found:
                continue
            there = float(value[i] * math.exp(np.clip(d, -700, 700)) if other.log else value[i] + d)
            there = min(max(there, other.lower), other.upper)
            a, b = found[other.name]
            found[other.name] = (min(a, there), max(b, there))
    return found


def with_left_out(best: Optimum, asked: Rig, left_out: Sequence[str], log: SearchLog) -> Intervals:
    """Intervals of all shared numbers in the model that also has what was left out, by name; empty when it will not do.

    Starts from where the chosen model ended, with a tenth of the guess of each term left out.
    """
    chosen = best.problem
    parameters = {**chosen.rig.parameters, **{n: asked.parameters[n] for n in left_out}}
    richer = formulate(replace(chosen.rig, parameters=parameters), [t.run for t in chosen.tracks])
    richer.noise = chosen.noise
    start = richer.place(chosen.values_at(best.x) | {n: 0.1 * asked.parameters[n].value for n in left_out})
    richer.settle_steps(start)
    found = descend(richer.normal, start, richer.lower, richer.upper, tolerance=1e-5, limit=25)
    if found.interrupted:
        raise KeyboardInterrupt
    if not math.isfinite(found.normal.cost):
        return {}
    there = assess(richer, found.x)
    quantile = student(best.samples - best.x.size - len(left_out))
    estimates: dict[str, Estimate] = {}
    for i in there.shared:
        u, e = richer.unknowns[i], estimate(there, i, quantile)
        low, high = e.interval
        if u.name in left_out and there.pinned[i] and profile_work(there) < AFFORDED:
            low, high = profile(there, i, e, quantile, log)
        estimates[u.name] = replace(e, interval=(max(low, u.lower), min(high, u.upper)))
    intervals = {n: e.interval for n, e in estimates.items()}
    return intervals | beyond_bounds(there, estimates)


def widened(e: Estimate, interval: tuple[float, float]) -> Estimate:
    """An estimate whose interval holds another one too; weak when it is then wider than the value."""
    low, high = min(e.interval[0], interval[0]), max(e.interval[1], interval[1])
    wide = e.status == "firm" and high - low > abs(e.value)
    return replace(e, interval=(low, high), status="weak" if wide else e.status)
