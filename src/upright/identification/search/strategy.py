"""The order in which methods are tried: the guess, closed-form starts, a growing horizon, then the simplex.

Starts matter more than optimizers: from a start within a few percent least squares needs about a hundred simulations;
from a bad one it fails outright. Nelder and Mead's simplex, the paper's way, copes where stiction makes the cost a
staircase, and costs 5 to 40 times more than least squares.

When a push ends decides in which phase the shaft swings on, so the cost has a valley every period, and a descent stays
in the one it began in (seen on an ECP 205: 0.29 s too early, a tenth of the cost). Such moments are looked for afresh
at the end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.grey_box import GreyBox
from upright.identification.model.runs import Run
from upright.identification.problem.normal_equations import pseudo_inverse
from upright.identification.problem.residuals import NOTICED, SAME, Problem, noise_level, unreached
from upright.identification.search.descent import (
    WORTH,
    Descent,
    SearchLog,
    descend,
    descend_progressively,
    first_horizon,
)
from upright.identification.search.starts import friction_from_energy, regress, samples_of

Array = NDArray[np.float64]


def simplex(
    problem: Problem, x: Array, log: SearchLog | None = None, *, horizon: float = math.inf, limit: int = 2000,
    keep: bool = False,
) -> tuple[Array, float]:  # fmt: skip
    """Best coordinates within `horizon` seconds and their cost, after at most `limit` simulations.

    To `keep`, every improvement becomes the best of the `log`, should somebody interrupt.
    The first simplex reaches 10 % of each number, or 10 % of its scale when it is zero.
    """
    from scipy.optimize import minimize

    log = SearchLog() if log is None else log
    size = np.array([1.0 if u.log else max(abs(z), u.scale) for u, z in zip(problem.unknowns, x, strict=True)])
    lower, upper = problem.lower, problem.upper
    best = [x.copy(), problem.cost(x, horizon)]
    count = 0

    def cost(z: Array) -> float:
        nonlocal count
        here = np.clip(x + z * size, lower, upper)
        value = problem.cost(here, horizon)
        count += 1
        if value < best[1]:
            best[0], best[1] = here, value
            if keep:
                log.best = problem, here
            if count % 20 == 0:
                log.tell("simplex", count / limit, value, problem)
        return value if math.isfinite(value) else 1e300

    corners = np.vstack([np.zeros(x.size), 0.1 * np.eye(x.size)])
    # a first step away from a bound rather than into it
    for i in range(x.size):
        if x[i] + 0.1 * size[i] > upper[i]:
            corners[1 + i, i] = -0.1
    options = {"initial_simplex": corners, "maxfev": limit, "adaptive": True, "xatol": 1e-6, "fatol": 1e-9 * best[1]}
    minimize(cost, np.zeros(x.size), method="Nelder-Mead", options=options)
    return np.asarray(best[0]), float(best[1])


POOR = 0.04
"""A mean squared residual above this (a fit of less than 80 %) is worth another attempt."""

PATIENCE = 5e8
"""Simulated samples, lanes counted, after which no further attempt begins."""


def closed_form_starts(rig: GreyBox, runs: Sequence[Run]) -> list[dict[str, float]]:
    """Values of the shared numbers from accelerations, then from the energy lost between turning points.

    Empty when a moving coordinate was not measured.
    """
    samples = samples_of(rig, runs)
    if not samples or not rig.estimated:
        return []
    agreement = regress(rig, samples)
    if not math.isfinite(agreement.unexplained):
        return []
    starts = [agreement.values]
    friction = friction_from_energy(rig, samples, agreement.values)
    if friction:
        starts.insert(0, agreement.values | friction)
    return starts


def search(
    problem: Problem, candidates: Sequence[Array], log: SearchLog, *, patient: bool = True, stairs: bool = True
) -> Descent:  # fmt: skip
    """Best of several starts, walked over a growing horizon; more attempts when what comes out is poor.

    Without `stairs` no simplex is among these.
    """
    h = min(problem.duration, first_horizon(problem))
    ranked = _ranked(problem, candidates, h)
    log.best = problem, ranked[0]
    end = descend_progressively(problem, ranked[0], log)
    log.best = problem, end.x
    if end.interrupted or not patient:
        return end
    n = problem.count()
    others = list(ranked[1:])
    attempts, x_size = 0, problem.start.size + 1
    while end.normal.cost > POOR * n and attempts < 3 and not end.interrupted:
        if problem.evaluations * n * x_size > PATIENCE or log.conventions():
            break
        attempts += 1
        if others:
            x, name = others.pop(0), "another start"
        elif not stairs:
            break
        else:
            name = "simplex"
            x, _ = simplex(problem, ranked[0], log, horizon=h, limit=400)
            attempts = 3
        log.note(name, problem.cost(x, h), problem)
        other = descend_progressively(problem, x, log)
        end = better(end, other)
        log.best = problem, end.x
    return end


def better(a: Descent, b: Descent) -> Descent:
    """The one with the lower cost, interrupted when either was."""
    best = min(a, b, key=lambda d: d.normal.cost)
    return replace(best, interrupted=a.interrupted or b.interrupted)


REWEIGHED = 2
"""How often outputs that move alike are weighed by what was missed of them: what is missed most would count ever less.

Of the twist of two disks 79, 79 and 74 percent were explained after one, two and three times.
"""


def settle_weights(problem: Problem, end: Descent) -> Descent:
    """Weigh prior knowledge, and outputs that move alike, by the residuals found, and settle again."""
    for k in range(3):
        if end.interrupted or not math.isfinite(end.normal.cost):  # nothing to weigh by
            break
        changed = k < REWEIGHED and problem.weigh_components(end.x)
        if not (_weigh_priors(problem, end) or changed):
            break
        end = descend(problem.normal, end.x, problem.lower, problem.upper, tolerance=1e-6)
    return end


def _weigh_priors(problem: Problem, end: Descent) -> bool:
    """Weigh prior knowledge by the residuals found, memory included, unless it hardly pulls; whether that matters."""
    if not any(u.prior is not None for u in problem.unknowns):
        return False
    r, J = problem.prior_rows(end.x)
    pull = pseudo_inverse(end.normal.matrix) @ (J.T @ r)
    variance = end.normal.cost / problem.count()
    error = np.sqrt(np.maximum(np.diag(pseudo_inverse(end.normal.matrix)) * variance, 0.0))
    if np.all(np.abs(pull) <= 0.02 * error) and not any(u.prior and u.shared for u in problem.unknowns):
        return False
    noise = max(noise_level(problem, end.x), 1e-9)
    if abs(math.log(noise / problem.noise)) < NOTICED:
        return False
    problem.noise = noise
    return True


def _ranked(problem: Problem, candidates: Sequence[Array], h: float) -> list[Array]:
    """Candidates walked a little over the first horizon, best first."""
    if len(candidates) == 1:
        return list(candidates)
    costs: list[tuple[float, int, Array]] = []
    for k, x in enumerate(candidates):
        if not math.isfinite(problem.cost(x, h)):
            costs.append((math.inf, k, x))
            continue
        problem.settle_steps(x, h)
        walked = descend(lambda z: problem.normal(z, h), x, problem.lower, problem.upper, tolerance=1e-2, limit=12)
        costs.append((walked.normal.cost, k, walked.x))
        if walked.interrupted:
            raise KeyboardInterrupt
    costs.sort(key=lambda c: c[:2])
    return [x for _, _, x in costs]


ATTEMPTS = (8, 26)
"""Descents in a row from around an optimum that find no lower one, at least and at most, before it counts as the
lowest; more than the least only as long as they are cheap, see `CHEAP`. A good fit (below `GOOD`) needs none."""

FEW = (2, 6)
"""The same where the search began at an optimum of nearly the same runs."""

CHEAP = 1.5e8
"""Simulated numbers, perturbed lanes counted, that cost a few seconds."""

GOOD = 4e-4
"""A mean squared residual below this, a fit of 98 %, leaves no other valley to look for."""

LITTLE = 0.1
"""A mean squared residual above this, a fit of less than 68 %, is a model that explains too little to go on with."""


def explains_little(problem: Problem, end: Descent) -> bool:
    """Whether so little is explained that neither other valleys nor careful intervals are worth their time."""
    return not end.normal.cost <= LITTLE * problem.count()


AWAY = (1.0, 3.0)
"""How many standard errors every number is moved by, to either side."""

NEARER, FARTHER = 0.4, 0.6
"""Shares by which every number that all runs share is moved in turn with that: to either side, and normally spread.

The former find two disks whose fit is otherwise lost (`tests/study/draft/test_chain.py`), the latter a lower optimum of
carts that stick.
"""


def other_valleys(
    problem: Problem, end: Descent, log: SearchLog, *, attempts: tuple[int, int] = ATTEMPTS, seed: int = 0
) -> Descent:
    """The lowest optimum met by descents from around the one found, every number moved by `AWAY` standard errors.

    Stiction, trips and cycles slipped fold the cost into valleys a few standard errors apart; of descents from one
    standard error away six in ten ended lower, where there was a lower one. Filters see smooth costs, dearly.
    """
    if any(track.ahead for track in problem.tracks) or explains_little(problem, end):
        return end
    if end.interrupted or end.normal.cost <= GOOD * problem.count():
        return end
    rng, scatter = np.random.default_rng(seed), np.random.default_rng([seed, 1])
    sigma, failed = _errors(problem, end), 0
    shares = [1.0 if u.log else max(abs(v), u.scale) for u, v in zip(problem.unknowns, end.x, strict=True)]
    far = np.array([s if u.shared else 0.0 for u, s in zip(problem.unknowns, shares, strict=True)])
    begun, lanes = problem.evaluations, problem.count() / len(problem.tracks) * (end.x.size + 1)
    while failed < attempts[0] or (failed < attempts[1] and (problem.evaluations - begun) * lanes < CHEAP):
        if failed % 4 == 3:
            away = FARTHER * far * scatter.normal(size=end.x.size)
        else:
            size = (*(n * sigma for n in AWAY), NEARER * far)[failed % 4]
            away = size * rng.choice([-1.0, 1.0], end.x.size)
        x = np.clip(end.x + away, problem.lower, problem.upper)
        other = _from(problem, x, end)
        failed += 1
        log.tell("another valley", failed / attempts[1], min(other.normal.cost, end.normal.cost), problem)
        if other.interrupted:
            return replace(end, interrupted=True)
        log.valleys.append((problem, other.normal.cost, other.x))
        if other.normal.cost < (1 - WORTH) * end.normal.cost:
            log.valleys[-1] = problem, end.normal.cost, end.x
            other = descend(problem.normal, other.x, problem.lower, problem.upper, tolerance=1e-6, here=other.normal)
            log.note("another valley", other.normal.cost, problem)
            end, log.best, failed = other, (problem, other.x), 0
            sigma = _errors(problem, end)
    return end


LEG = 8
"""Evaluations after which a descent is looked at."""

HOPELESS, ARRIVED = 3.0, 0.05
"""A descent is given up above this multiple of the lowest cost known, and when all that it is short of it is explained
by how far it still is from there, within this share."""


def _from(problem: Problem, x: Array, known: Descent) -> Descent:
    """Where a descent ends; given up early where it only returns to an optimum that is `known`, or ends far above."""
    end = descend(problem.normal, x, problem.lower, problem.upper, tolerance=1e-6, limit=LEG)
    for _ in range(60 // LEG):
        cost, away = end.normal.cost, end.x - known.x
        back = away @ known.normal.matrix @ away <= ARRIVED * known.normal.cost and cost >= known.normal.cost
        if end.converged or end.interrupted or back or not cost < HOPELESS * known.normal.cost:
            break
        end = descend(problem.normal, end.x, problem.lower, problem.upper, tolerance=1e-6, limit=LEG, here=end.normal)
    return end


def _errors(problem: Problem, end: Descent) -> Array:
    """Standard errors (n,) of the coordinates, for residuals with the memory that they have."""
    variance = np.diag(pseudo_inverse(end.normal.matrix)) * noise_level(problem, end.x) ** 2
    return np.sqrt(np.maximum(variance, 0.0))


BITES = (0.95, 0.8, 0.6)
"""Shares of the least value that still does nothing, from which a limit that no run reached is sought once more."""


LUCK = 10.8
"""Squared residuals, of independent ones, by which a number that does nothing lowers the cost once in 1000 times."""


def reached_limits(problem: Problem, end: Descent, log: SearchLog) -> Descent:
    """The optimum after every limit that does nothing was tried where it begins to.

    Beyond what a run reaches the cost is flat, so that no descent comes back from there.
    """
    for name in () if end.interrupted else unreached(problem, end.x):
        place = next(i for i, u in enumerate(problem.unknowns) if u.name == name)
        lanes = np.repeat(end.x[:, None], 40, axis=1)
        lanes[place] = np.maximum(lanes[place] + math.log(0.85) * np.arange(40), problem.lower[place])
        costs = np.sum([_costs(problem, k, lanes) for k in range(len(problem.tracks))], axis=0)
        idle = np.flatnonzero(costs <= costs[0] * (1 + SAME))
        for share in BITES:
            x = end.x.copy()
            x[place] = max(lanes[place, idle[-1]] + math.log(share), problem.lower[place])
            problem.settle_steps(x)
            other = _from(problem, x, end)
            if other.interrupted:
                return replace(end, interrupted=True)
            if other.normal.cost < end.normal.cost - LUCK * noise_level(problem, other.x) ** 2:
                log.note(f"{name} reached", other.normal.cost, problem)
                end, log.best = other, (problem, other.x)
                break
    return end


MOMENTS = ("input_start", "input_end")

REACH, STEP = 0.6, 0.02
"""Seconds looked at on either side, two periods of a shaft at 3.5 Hz, and from one place to the next."""


def other_moments(problem: Problem, end: Descent, log: SearchLog) -> Descent:
    """The optimum after every sought moment was tried on a grid, the other numbers following from the best place."""
    for _ in range(3):
        x = None if end.interrupted else _moved(problem, end.x, end.normal.cost)
        if x is None:
            return end
        problem.settle_steps(x)
        other = descend(problem.normal, x, problem.lower, problem.upper, tolerance=1e-6, limit=60)
        log.note("another moment", other.normal.cost, problem)
        end = better(end, other)
        log.best = problem, end.x
    return end


def _moved(problem: Problem, x: Array, cost: float) -> Array | None:
    """Coordinates with the best moment of every run, each taken by itself; None when they are best already."""
    out = x.copy()
    shifts = np.arange(-round(REACH / STEP), round(REACH / STEP) + 1) * STEP
    for i, u in enumerate(problem.unknowns):
        if u.name not in MOMENTS or any(problem.tracks[k].windowed for k in u.runs):
            continue
        lanes = np.repeat(x[:, None], shifts.size, axis=1)
        lanes[i] = np.clip(x[i] + shifts, problem.lower[i], problem.upper[i])
        total = np.sum([_costs(problem, k, lanes) for k in u.runs], axis=0)
        best = int(np.nanargmin(total))
        if float(total[shifts.size // 2]) - float(total[best]) > WORTH * cost:
            out[i] = lanes[i, best]
    return None if np.array_equal(out, x) else out


def _costs(problem: Problem, index: int, lanes: Array) -> Array:
    """Sums of squares (lanes,) of one run; infinite where the simulation ran away."""
    track = problem.tracks[index]
    y = problem.simulate(index, lanes, track.length)[track.first :]
    target = track.targets(track.length)[track.first :]
    with np.errstate(over="ignore", invalid="ignore"):
        e = track.weighting @ (y - target[..., None])
        total = np.sum(e * e, axis=(0, 1, 2))
    return np.where(np.isfinite(total), total, np.inf)
