"""In which order are the methods tried? The guess, closed-form starts, a growing horizon, then the simplex.

Starts matter more than optimizers (DESIGN 9): from a start within a few percent least squares needs about a hundred
simulations; from a bad one it fails outright.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.model import Rig, Run
from upright.identification.model.unknowns import SHARED
from upright.identification.problem.normal import pseudo_inverse
from upright.identification.problem.pose import settle_steps
from upright.identification.problem.problem import Problem, loudness
from upright.identification.search.descent import Descent, Report, descend, first_horizon, grow
from upright.identification.search.friction_start import friction_from_energy
from upright.identification.search.inverse_start import regress, samples_of
from upright.identification.search.simplex import simplex

Array = NDArray[np.float64]

POOR = 0.04
"""A mean squared residual above this (a fit of less than 80 %) is worth another attempt."""


PATIENCE = 5e8
"""Simulated samples, lanes counted, after which no further attempt begins."""


@dataclass
class Log:
    """What happened on the way: stages with their cost and simulations, and the best so far should one interrupt.

    `best` holds the problem last worked on and where in it the search stood.

    `rivals` are values of another model that the data do not refuse, `unresolved` lengths below the rounding.
    `doubts` says which conventions look wrong; asked only when a fit is poor, since no search mends a reversed sign.
    """

    report: Report | None = None
    history: list[tuple[str, float, int]] = field(default_factory=list[tuple[str, float, int]])
    best: tuple[Problem, Array] | None = None
    warnings: list[str] = field(default_factory=list[str])
    rivals: dict[str, float] = field(default_factory=dict[str, float])
    unresolved: tuple[str, ...] = ()
    doubts: Callable[[], Sequence[str]] = tuple

    def keep(self, problem: Problem) -> Callable[[Array], None]:
        """What to call with coordinates better than those before."""

        def best(x: Array) -> None:
            self.best = problem, x

        return best


def closed_form_starts(rig: Rig, runs: Sequence[Run]) -> list[dict[str, float]]:
    """Values of the shared numbers from accelerations, then from the energy lost between turning points.

    Empty when a moving coordinate was not measured.
    """
    samples = samples_of(rig, runs)
    if not samples or not rig.estimated:
        return []
    agreement = regress(rig, samples)
    if not math.isfinite(agreement.unexplained):
        return []
    found = [agreement.values]
    friction = friction_from_energy(rig, samples, agreement.values)
    if friction:
        found.insert(0, agreement.values | friction)
    return found


def placed(problem: Problem, values: Mapping[str, float], x: Array | None = None) -> Array:
    """Coordinates with shared numbers from `values`, the rest from `x` or the start."""
    x = problem.start if x is None else x.copy()
    for i, u in enumerate(problem.unknowns):
        if u.runs == SHARED and u.name in values:
            v = values[u.name]
            if not u.log or v > 0:
                x[i] = u.inside(v)
    return np.clip(x, problem.lower, problem.upper)


def carried(part: Problem, x: Array, whole: Problem) -> Array:
    """Coordinates of one problem put into another on the same runs; what the first does not seek keeps its start."""
    known = {(u.runs, u.name): float(z) for u, z in zip(part.unknowns, x, strict=True)}
    start = [known.get((u.runs, u.name), float(z)) for u, z in zip(whole.unknowns, whole.start, strict=True)]
    return np.clip(np.array(start), whole.lower, whole.upper)


def count(problem: Problem, horizon: float = math.inf) -> int:
    """Number of residuals within `horizon` seconds."""
    return sum(
        problem.samples(i, horizon) * t.restarts.size * max(1, int(np.count_nonzero(t.weights)))
        for i, t in enumerate(problem.tracks)
    )


def explain(problem: Problem, candidates: Sequence[Array], log: Log, *, patient: bool = True) -> Descent:
    """Best of several starts, walked over a growing horizon; more attempts when what comes out is poor."""
    h = min(problem.duration, first_horizon(problem))
    ranked = _ranked(problem, candidates, h)
    log.best = problem, ranked[0]
    found = grow(problem, ranked[0], report=log.report, history=log.history)
    log.best = problem, found.x
    if found.interrupted or not patient:
        return found
    n = count(problem)
    others = list(ranked[1:])
    attempts, x_size = 0, problem.start.size + 1
    while found.normal.cost > POOR * n and attempts < 3 and not found.interrupted:
        if problem.evaluations * n * x_size > PATIENCE or log.doubts():
            break
        attempts += 1
        if others:
            x, name = others.pop(0), "another start"
        else:
            name = "simplex"
            x, _ = simplex(problem, ranked[0], horizon=h, limit=400, report=log.report)
            attempts = 3
        log.history.append((name, problem.cost(x, h), problem.evaluations))
        other = grow(problem, x, report=log.report, history=log.history)
        found = better(found, other)
        log.best = problem, found.x
    return found


def better(a: Descent, b: Descent) -> Descent:
    """The one with the lower cost, interrupted when either was."""
    best = min(a, b, key=lambda d: d.normal.cost)
    return replace(best, interrupted=a.interrupted or b.interrupted)


def weigh_priors(problem: Problem, found: Descent) -> Descent:
    """Weigh prior knowledge by the residuals found, memory included, and settle again; unless it hardly pulls."""
    if found.interrupted or not any(u.prior is not None for u in problem.unknowns):
        return found
    for _ in range(3):
        if found.interrupted:
            break
        r, J = problem.prior_rows(found.x)
        pull = pseudo_inverse(found.normal.matrix) @ (J.T @ r)
        variance = found.normal.cost / count(problem)
        error = np.sqrt(np.maximum(np.diag(pseudo_inverse(found.normal.matrix)) * variance, 0.0))
        if np.all(np.abs(pull) <= 0.02 * error) and not any(u.prior and u.runs == SHARED for u in problem.unknowns):
            break
        noise = max(loudness(problem, found.x), 1e-9)
        if abs(math.log(noise / problem.noise)) < 0.2:
            break
        problem.noise = noise
        found = descend(problem.normal, found.x, problem.lower, problem.upper, tolerance=1e-6, limit=20)
    return found


def _ranked(problem: Problem, candidates: Sequence[Array], h: float) -> list[Array]:
    """Candidates walked a little over the first horizon, best first."""
    if len(candidates) == 1:
        return list(candidates)
    costs: list[tuple[float, int, Array]] = []
    for k, x in enumerate(candidates):
        if not math.isfinite(problem.cost(x, h)):
            costs.append((math.inf, k, x))
            continue
        settle_steps(problem, x, h)
        walked = descend(lambda z: problem.normal(z, h), x, problem.lower, problem.upper, tolerance=1e-2, limit=12)
        costs.append((walked.normal.cost, k, walked.x))
        if walked.interrupted:
            raise KeyboardInterrupt
    costs.sort(key=lambda c: c[:2])
    return [x for _, _, x in costs]
