"""Intervals of the estimates: from standard errors, or from the profile of the cost where these say too little.

For a number that is weakly seen or near a bound the profile is followed: it is held, all others are fitted again, and
the ends are where the cost has risen by Student's quantile squared, rescaled for residuals with a memory (the ratio of
the robust to the white variance).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.covariance import Optimum
from upright.identification.model.fit import Estimate
from upright.identification.model.rig import NOISE, Rig
from upright.identification.model.unknowns import FAR, Unknown
from upright.identification.problem.normal_equations import pseudo_inverse
from upright.identification.problem.residuals import Problem
from upright.identification.search.descent import SearchLog, descend

Array = NDArray[np.float64]

NARROW = 0.1
"""A profile below this share of the interval from the standard error was not followed along its valley."""

AFFORDED = 2.0e7
"""Residuals that the profiles of one fit may cost altogether."""

ALREADY = 0.9
"""A number is unseen when the data narrow what was known beforehand to no less than this share of it."""


def shared_estimates(
    best: Optimum, hidden: Collection[str], log: SearchLog, *, profiles: bool = True
) -> dict[str, Estimate]:
    """Estimates of the numbers that all runs share, by name; those `hidden` from the data have no interval.

    Without `profiles` every interval comes from a standard error, which takes no time.
    """
    found: dict[str, Estimate] = {}
    budget = AFFORDED if profiles else 0.0
    for i in best.shared:
        u, plain = best.problem.unknowns[i], estimate(best, i)
        if u.name in hidden:
            infinite = (-math.inf, math.inf)
            found[u.name] = replace(plain, stderr=math.inf, interval=infinite, status="unseen")
            continue
        status = "firm" if u.asked else "known"
        interval = plain.interval
        wide = interval[1] - interval[0] > abs(plain.value)
        near = best.pinned[i] or interval[0] <= u.lower < plain.value or interval[1] >= u.upper > plain.value
        if u.asked and (wide or near) and not u.name.startswith(NOISE):  # of a level its size is enough
            if profile_work(best) < budget:
                budget -= profile_work(best)
                interval = profile(best, i, plain, best.quantile, log)
                wide = interval[1] - interval[0] > abs(plain.value)
            status = "at bound" if best.pinned[i] else "weak" if wide else "firm"
        found[u.name] = replace(plain, interval=_within(u, interval), status=status)
    return found


def run_estimates(best: Optimum) -> tuple[dict[str, dict[str, Estimate]], dict[str, dict[str, Estimate]]]:
    """Estimates of what differs from run to run, by run and name, and by group of runs and name."""
    tracks = best.problem.tracks
    runs: dict[str, dict[str, Estimate]] = {t.run.label: {} for t in tracks}
    groups: dict[str, dict[str, Estimate]] = {}
    for i, u in enumerate(best.problem.unknowns):
        if u.shared:
            continue
        e = estimate(best, i)
        size = abs(e.value) if u.log else u.scale
        status = "weak" if e.interval[1] - e.interval[0] > size else "firm"
        narrowed = not u.log or u.prior is None or float(best.sigma[i]) <= ALREADY * u.prior[1]
        if best.pinned[i]:
            status = "at bound"
        elif not (best.matrix[i, i] > 0 and narrowed):
            status = "unseen"
        home = groups.setdefault(u.group, {}) if u.group else runs[tracks[u.runs[0]].run.label]
        home[u.name] = replace(e, status=status)
    return runs, groups


def estimate(best: Optimum, place: int, quantile: float | None = None) -> Estimate:
    """Value of one number with its standard error and the interval of `quantile` of them, that of `best` if omitted."""
    u, value, sigma = best.problem.unknowns[place], float(best.values[place]), float(best.sigma[place])
    half = (best.quantile if quantile is None else quantile) * sigma
    if u.log:
        interval = value * math.exp(-min(half, 700.0)), value * math.exp(min(half, 700.0))
        sigma *= value
    else:
        interval = (value - half, value + half)
    return Estimate(value=value, stderr=sigma, interval=interval, unit=_unit(best.problem.rig, u.name))


def _within(u: Unknown, interval: tuple[float, float]) -> tuple[float, float]:
    return max(interval[0], u.lower), min(interval[1], u.upper)


def _unit(rig: Rig, name: str) -> str:
    if name in rig.parameters:
        return rig.parameters[name].unit
    kind, _, which = name.partition(".")
    units = {c.name: c.unit for c in rig.plant.coordinates}
    if kind in ("initial", "offset"):
        return units.get(which) or f"{units.get(which.removesuffix('_dot'), '1')}/s"
    if kind == "input_offset" and "actuator.offset" in rig.parameters:
        return rig.parameters["actuator.offset"].unit
    return "s" if kind in ("input_start", "input_end") else "1"


def profile_work(best: Optimum) -> float:
    """Residuals that one profile costs, give or take: some 40 simulations, 16 lanes of numbers sought at a time."""
    return 40.0 * best.problem.count() * (best.x.size + 1) / 16


def profile(best: Optimum, place: int, plain: Estimate, quantile: float, log: SearchLog) -> tuple[float, float]:
    """Interval of one number's value by profile likelihood, with the ends of the `plain` one where it has none.

    A misfit with a long memory asks for a rise that no cost may reach; near the optimum the data tell all the same.
    A number sought by its logarithm has no end that is `FAR` times or one part in `FAR` of its value.

    Raises
    ------
    KeyboardInterrupt
        When somebody interrupts: half a profile is no interval.
    """
    low, high = _ends(best, place, quantile, log)
    if best.problem.unknowns[place].log:
        low, high = (math.exp(low) if low > -700 else 0.0), math.exp(min(high, 700.0))
        return (low, high) if plain.value / FAR < low and high < plain.value * FAR else plain.interval
    if high - low < NARROW * (plain.interval[1] - plain.interval[0]):
        return plain.interval  # a valley too narrow to follow with one number held
    return (low if math.isfinite(low) else plain.interval[0]), (high if math.isfinite(high) else plain.interval[1])


def _ends(best: Optimum, place: int, quantile: float, log: SearchLog) -> tuple[float, float]:
    """Coordinates at which the refitted cost has risen enough, infinite where it never does."""
    problem, x = best.problem, best.x
    model = problem.normal(x)
    u = problem.unknowns[place]
    ratio = np.diag(best.covariance)[best.white > 0] / best.white[best.white > 0]
    here = float(best.covariance[place, place] / best.white[place]) if best.white[place] > 0 else 0.0
    rise = quantile**2 * best.variance * max(1.0, here or float(np.median(ratio)) if ratio.size else 1.0)
    curvature = _curvature(model.matrix, place, best)
    g = float(model.gradient[place]) if best.pinned[place] else 0.0
    ends: list[float] = []
    for sign in (-1.0, 1.0):
        # where the quadratic model has risen enough: 2 g s + c s^2 = rise
        slope = g * sign
        step = (-slope + math.sqrt(slope**2 + curvature * rise)) / curvature if curvature > 0 else u.scale
        most = 2.0 if u.log else 100 * max(abs(float(x[place])), u.scale)

        def tell(cost: float, share: float = (sign + 1) / 2) -> None:
            log.tell(f"interval of {u.name}", share, cost, problem)

        ends.append(_end(problem, x, place, model.cost, rise, sign * min(max(step, 1e-9 * u.scale), most), tell))
    return ends[0], ends[1]


def _curvature(A: Array, place: int, best: Optimum) -> float:
    """Curvature of the cost along one number, the others following."""
    others = np.array([i for i in range(A.shape[0]) if i != place and not best.pinned[i]], dtype=np.int64)
    row = A[place, others]
    return float(A[place, place] - row @ pseudo_inverse(A[np.ix_(others, others)]) @ row)


def _end(
    problem: Problem, x: Array, place: int, best: float, rise: float, step: float, tell: Callable[[float], None]
) -> float:
    """Coordinate at which the refitted cost has risen by `rise`, by secants of its square root, bracketed."""
    lower, upper = problem.lower.copy(), problem.upper.copy()
    bound = float(lower[place] if step < 0 else upper[place])
    reached, inner, outer = step, 0.0, math.inf
    height, z = 0.0, x
    for _ in range(5):
        at = float(np.clip(x[place] + reached, problem.lower[place], problem.upper[place]))
        lower[place] = upper[place] = at
        start = np.where(np.arange(x.size) == place, at, z)
        found = descend(problem.normal, start, lower, upper, tolerance=1e-3, limit=6, report=tell)
        if found.interrupted:
            raise KeyboardInterrupt
        z = found.x
        height = math.sqrt(max(found.normal.cost - best, 0.0) / rise)
        if abs(height - 1) < 0.05 or (at == bound and height < 1):
            return at
        if height < 1:
            inner = abs(reached)
        else:
            outer = abs(reached)
        guess = abs(reached) * min(3.0, 1 / max(height, 1e-3))
        if not inner < guess < outer:
            guess = (inner + outer) / 2
        reached = math.copysign(guess, step)
    return float(x[place]) + reached if height > 0.3 else math.copysign(math.inf, step)
