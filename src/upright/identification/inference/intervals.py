"""Intervals of the estimates: from standard errors, from the profile of the cost, and from other models.

For a number that is weakly seen or near a bound a standard error says too little and the profile is followed: the
number is held, all others are fitted again, and the ends are where the cost has risen by Student's quantile squared,
rescaled for residuals with a memory (the ratio of the robust to the white variance).

A term that ended at zero, or that the held-out data do not ask for, may still exist, and another has then taken its
part: viscous friction is larger where Coulomb friction was left out. An interval that leaves this out is too short (the
estimate after a choice of model is a mixture over models, Buckland, Burnham and Augustin 1997).

Curvature and profiles are of one valley of the cost. Stiction and trips fold it into several, and of two whose costs
differ by less than the ends of an interval allow the data prefer neither: numbers that differ are not well determined.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.covariance import Optimum, assess, student
from upright.identification.model.fit import Estimate
from upright.identification.model.grey_box import NOISE, GreyBox
from upright.identification.problem.normal_equations import Normal, pseudo_inverse
from upright.identification.problem.residuals import Problem, formulate
from upright.identification.problem.unknowns import FAR, Unknown
from upright.identification.search.descent import SearchLog, descend

Array = NDArray[np.float64]
Intervals = dict[str, tuple[float, float]]

NARROW = 0.1
"""An end nearer than this share of what the quadratic model says was not followed along its valley: no wall is there,
and the refits beside the estimate stall, as on the staircase that what sticks makes of the cost."""

AFFORDED = 2.0e7
"""Residuals that the profiles of one fit may cost altogether."""

VAGUE = 10.0
"""An interval of a positive number whose ends are this many times apart leaves it undetermined."""

WIDE = 0.5
"""How far an interval may reach from a number that is well determined, relative to it."""

ALREADY = 0.9
"""A number is unseen when the data narrow what was known beforehand to no less than this share of it."""


def shared_estimates(
    best: Optimum, hidden: Collection[str], log: SearchLog, *, profiles: bool = True
) -> dict[str, Estimate]:
    """Estimates of the numbers that all runs share, by name; those `hidden` from the data have no interval.

    Without `profiles` every interval comes from a standard error, which takes no time.
    """
    estimates: dict[str, Estimate] = {}
    budget = AFFORDED if profiles else 0.0
    for i in best.shared:
        u, plain = best.problem.unknowns[i], beside_bound(best, i)
        if u.name in hidden or (u.estimated and not best.pinned[i] and plain.zero_wide):
            estimates[u.name] = replace(plain, status="nuisance") if u.name.startswith(NOISE) else _unseen(plain)
            continue
        firm = "poorly determined" if best.explains_nothing else "well determined"
        status = firm if u.estimated else "known"
        interval = plain.interval
        wide = plain.half > WIDE
        near = best.pinned[i] or interval[0] <= u.lower < plain.value or interval[1] >= u.upper > plain.value
        if u.estimated and (wide or near) and not u.name.startswith(NOISE):  # of a level its size is enough
            if profile_work(best) < budget:
                budget -= profile_work(best)
                interval = profile(best, i, plain, best.quantile, log)
                wide = replace(plain, interval=interval).half > WIDE
            status = "at bound" if best.pinned[i] else "poorly determined" if wide else firm
        status = "nuisance" if u.name.startswith(NOISE) else status
        estimates[u.name] = replace(plain, interval=within_bounds(u, interval), status=status)
    return estimates


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
        status = (
            "poorly determined" if best.explains_nothing or e.interval[1] - e.interval[0] > size else "well determined"
        )
        narrowed = not u.log or u.prior is None or float(best.sigma[i]) <= ALREADY * u.prior[1]
        if best.pinned[i]:
            status = "at bound"
        elif e.zero_wide:
            e, status = _unseen(e), "unseen"
        elif not (best.matrix[i, i] > 0 and narrowed):
            status = "unseen"
        home = groups.setdefault(u.group, {}) if u.group else runs[tracks[u.runs[0]].run.label]
        home[u.name] = replace(e, status=status)
    return runs, groups


def _unseen(plain: Estimate) -> Estimate:
    return replace(plain, stderr=math.inf, interval=(-math.inf, math.inf), status="unseen")


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


def beside_bound(best: Optimum, place: int, quantile: float | None = None) -> Estimate:
    """As `estimate`; of a number that ended at a bound, which has no standard error, as far as the cost allows."""
    plain, u = estimate(best, place, quantile), best.problem.unknowns[place]
    if not best.pinned[place]:
        return plain
    model = best.problem.normal(best.x)
    _, (down, up) = _steps(best, place, best.quantile if quantile is None else quantile, model)
    low, high = float(best.x[place]) - down, float(best.x[place]) + up
    return replace(plain, interval=(math.exp(max(low, -700.0)), math.exp(min(high, 700.0))) if u.log else (low, high))


def within_bounds(u: Unknown, interval: tuple[float, float]) -> tuple[float, float]:
    """An interval without what lies beyond the bounds of its number."""
    return max(interval[0], u.lower), min(interval[1], u.upper)


def _unit(rig: GreyBox, name: str) -> str:
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
    u, x = best.problem.unknowns[place], float(best.x[place])
    model = best.problem.normal(best.x)
    rise, steps = _steps(best, place, quantile, model)
    low, high = (
        x + sign * step if abs(end - x) < NARROW * step and end != wall else end
        for sign, step, end, wall in zip(
            (-1, 1), steps, _ends(best, place, model.cost, rise, steps, log),
            (best.problem.lower[place], best.problem.upper[place]), strict=True,
        )
    )  # fmt: skip
    if u.log:
        low, high = (math.exp(low) if low > -700 else 0.0), math.exp(min(high, 700.0))
        return (low, high) if plain.value / FAR < low and high < plain.value * FAR else plain.interval
    return (low if math.isfinite(low) else plain.interval[0]), (high if math.isfinite(high) else plain.interval[1])


def _ends(
    best: Optimum, place: int, least: float, rise: float, steps: tuple[float, float], log: SearchLog
) -> tuple[float, float]:
    """Coordinates at which the refitted cost has risen enough from the `least`, infinite where it never does."""
    problem, x = best.problem, best.x
    u = problem.unknowns[place]
    ends: list[float] = []
    for sign, step in zip((-1.0, 1.0), steps, strict=True):
        most = 2.0 if u.log else 100 * max(abs(float(x[place])), u.scale)

        def tell(cost: float, _x: Array, share: float = (sign + 1) / 2) -> None:
            log.tell(f"interval of {u.name}", share, cost, problem)

        ends.append(_end(problem, x, place, least, rise, sign * min(max(step, 1e-9 * u.scale), most), tell, log))
    return ends[0], ends[1]


def _steps(best: Optimum, place: int, quantile: float, model: Normal) -> tuple[float, tuple[float, float]]:
    """Rise of the cost at the ends of an interval, and the steps down and up to them in the quadratic model."""
    u, rise = best.problem.unknowns[place], allowed_rise(best, place, quantile)
    curvature = _curvature(model.matrix, place, best)
    g = float(model.gradient[place]) if best.pinned[place] else 0.0
    # where the quadratic model has risen enough: 2 g s + c s^2 = rise
    down, up = ((-s + math.sqrt(s**2 + curvature * rise)) / curvature if curvature > 0 else u.scale for s in (-g, g))
    return rise, (down, up)


def allowed_rise(best: Optimum, place: int, quantile: float | None = None) -> float:
    """By how much the cost may rise towards the ends of an interval of so many standard errors, as in `estimate`."""
    quantile = best.quantile if quantile is None else quantile
    ratio = np.diag(best.covariance)[best.white > 0] / best.white[best.white > 0]
    here = float(best.covariance[place, place] / best.white[place]) if best.white[place] > 0 else 0.0
    return quantile**2 * best.variance * max(1.0, here or float(np.median(ratio)) if ratio.size else 1.0)


def _curvature(A: Array, place: int, best: Optimum) -> float:
    """Curvature of the cost along one number, the others following."""
    others = np.array([i for i in range(A.shape[0]) if i != place and not best.pinned[i]], dtype=np.int64)
    row = A[place, others]
    return float(A[place, place] - row @ pseudo_inverse(A[np.ix_(others, others)]) @ row)


def _end(
    problem: Problem, x: Array, place: int, best: float, rise: float, step: float, tell: Callable[[float, Array], None],
    log: SearchLog,
) -> float:  # fmt: skip
    """Coordinate at which the refitted cost has risen by `rise`, by secants of its square root, bracketed."""
    lower, upper = problem.lower.copy(), problem.upper.copy()
    bound = float(lower[place] if step < 0 else upper[place])
    reached, inner, outer = step, 0.0, math.inf
    height, z = 0.0, x
    for _ in range(5):
        at = float(np.clip(x[place] + reached, problem.lower[place], problem.upper[place]))
        lower[place] = upper[place] = at
        start = np.where(np.arange(x.size) == place, at, z)
        end = descend(problem.normal, start, lower, upper, tolerance=1e-3, limit=6, report=tell)
        if end.interrupted:
            raise KeyboardInterrupt
        z = end.x
        log.met(problem, end, best)
        height = math.sqrt(max(end.normal.cost - best, 0.0) / rise)
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


def with_model_uncertainty(
    estimates: Mapping[str, Estimate], best: Optimum, requested: GreyBox, left_out: Sequence[str], log: SearchLog
) -> dict[str, Estimate]:
    """Estimates whose intervals hold what a term at its bound, or one left out, would make of them."""
    out = dict(estimates)
    others = [beyond_bounds(best, estimates)]
    if left_out:
        others.append(with_left_out(best, requested, left_out, log))
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
    intervals = {unknowns[i].name: estimates[unknowns[i].name].interval for i in best.shared
             if unknowns[i].name in estimates}  # fmt: skip
    pinned = [i for i in best.shared if best.pinned[i] and unknowns[i].name in intervals]
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
            if not other.shared or other.name not in intervals:
                continue
            there = float(value[i] * math.exp(np.clip(d, -300, 300)) if other.log else value[i] + d)
            there = min(max(there, other.lower), other.upper)
            a, b = intervals[other.name]
            intervals[other.name] = (min(a, there), max(b, there))
    return intervals


def with_left_out(best: Optimum, requested: GreyBox, left_out: Sequence[str], log: SearchLog) -> Intervals:
    """Intervals of all shared numbers in the model that also has what was left out, by name; empty when it will not do.

    Starts from where the chosen model ended, with a tenth of the guess of each term left out.
    """
    chosen = best.problem
    parameters = {**chosen.rig.parameters, **{n: requested.parameters[n] for n in left_out}}
    richer = formulate(replace(chosen.rig, parameters=parameters), [t.run for t in chosen.tracks])
    richer.weigh_like(chosen)
    start = richer.place(chosen.values_at(best.x) | {n: 0.1 * requested.parameters[n].value for n in left_out})
    richer.settle_steps(start)
    end = descend(richer.normal, start, richer.lower, richer.upper, tolerance=1e-5, limit=25)
    if end.interrupted:
        raise KeyboardInterrupt
    if not math.isfinite(end.normal.cost):
        return {}
    there = assess(richer, end.x)
    if there.lost:
        return {}
    quantile = student(best.samples - best.x.size - len(left_out))
    estimates: dict[str, Estimate] = {}
    for i in there.shared:
        u, e = richer.unknowns[i], beside_bound(there, i, quantile)
        low, high = e.interval
        if u.name in left_out and there.pinned[i] and profile_work(there) < AFFORDED:
            low, high = profile(there, i, e, quantile, SearchLog(progress=log.progress))
        estimates[u.name] = replace(e, interval=(max(low, u.lower), min(high, u.upper)))
    intervals = {n: e.interval for n, e in estimates.items()}
    return intervals | beyond_bounds(there, estimates)


def widened(e: Estimate, interval: tuple[float, float]) -> Estimate:
    """An estimate whose interval holds another one too; poorly determined when it then reaches too far."""
    whole = replace(e, interval=(min(e.interval[0], interval[0]), max(e.interval[1], interval[1])))
    wide = e.status == "well determined" and whole.half > WIDE
    return replace(whole, status="poorly determined" if wide else e.status)


DIFFERENT = 0.1
"""Two answers differ in a number by more than this share of it."""

COUNTS = {2: "Two", 3: "Three"}


def with_valleys(
    estimates: Mapping[str, Estimate], best: Optimum, log: SearchLog
) -> tuple[dict[str, Estimate], str]:  # fmt: skip
    """Estimates whose intervals hold what other valleys say, poorly determined where these differ; and the sentence.

    It names those that are known to a factor of `VAGUE` at least, and is empty where none differs. Of what is known
    poorly a difference below its standard error is none.
    """
    out, answers = dict(estimates), dict[str, list[float]]()
    valleys = _apart(best, log)
    for i in best.shared:
        name = best.problem.unknowns[i].name
        e = out.get(name)
        if e is None or e.status not in ("well determined", "poorly determined"):
            continue
        values, rise = [e.value], allowed_rise(best, i)
        least = e.stderr if e.status == "poorly determined" else 0.0
        for higher, there in valleys:
            v = float(there[i])
            if higher <= rise and all(abs(v - w) > max(DIFFERENT * max(abs(v), abs(w)), least) for w in values):
                values.append(v)
        if len(values) > 1:
            e = replace(widened(e, (min(values), max(values))), status="poorly determined")
            out[name] = e
            if e.interval[1] < VAGUE * e.interval[0]:
                answers[name] = values
    return out, _sentence(answers, out)


def _apart(best: Optimum, log: SearchLog) -> list[tuple[float, Array]]:
    """Valleys behind a ridge, the lowest first: by how much they are higher than the optimum, and values (n,) there.

    A descent that was given up on its way back to the optimum has none before it.
    """
    problem, cost = best.problem, best.problem.cost(best.x)
    most = cost + max((allowed_rise(best, i) for i in best.shared), default=0.0)
    met = sorted(((c, k) for k, (of, c, _) in enumerate(log.valleys) if of is problem and c <= most))
    places = [(c, log.valleys[k][2]) for c, k in met]
    return [(c - cost, problem.value(x)) for c, x in places if problem.cost((best.x + x) / 2) > c]


def _sentence(answers: Mapping[str, list[float]], estimates: Mapping[str, Estimate]) -> str:
    if not answers:
        return ""
    most = max(map(len, answers.values()))
    named = ", ".join(f"{n} {_either(v)} {estimates[n].unit}".removesuffix(" 1") for n, v in answers.items())
    return f"{COUNTS.get(most, 'Several')} answers explain the log alike: {named}."


def _either(values: list[float]) -> str:
    """``38 or 46``, the chosen one first."""
    shown = [f"{v:.2g}" for v in values[:4]]
    return f"{', '.join(shown[:-1])} or {shown[-1]}"
