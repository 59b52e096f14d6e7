"""The order in which methods are tried: the guess, closed-form starts, a growing horizon, then the simplex.

Starts matter more than optimizers: from a start within a few percent least squares needs about a hundred simulations;
from a bad one it fails outright.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.rig import Rig
from upright.identification.model.runs import Run
from upright.identification.problem.normal_equations import pseudo_inverse
from upright.identification.problem.residuals import Problem, noise_level
from upright.identification.search.descent import (
    Descent,
    SearchLog,
    descend,
    descend_progressively,
    first_horizon,
)
from upright.identification.search.friction_start import friction_from_energy
from upright.identification.search.inverse_start import regress, samples_of
from upright.identification.search.simplex import simplex

Array = NDArray[np.float64]

POOR = 0.04
"""A mean squared residual above this (a fit of less than 80 %) is worth another attempt."""

PATIENCE = 5e8
"""Simulated samples, lanes counted, after which no further attempt begins."""


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


def search(problem: Problem, candidates: Sequence[Array], log: SearchLog, *, patient: bool = True) -> Descent:
    """Best of several starts, walked over a growing horizon; more attempts when what comes out is poor."""
    h = min(problem.duration, first_horizon(problem))
    ranked = _ranked(problem, candidates, h)
    log.best = problem, ranked[0]
    found = descend_progressively(problem, ranked[0], log)
    log.best = problem, found.x
    if found.interrupted or not patient:
        return found
    n = problem.count()
    others = list(ranked[1:])
    attempts, x_size = 0, problem.start.size + 1
    while found.normal.cost > POOR * n and attempts < 3 and not found.interrupted:
        if problem.evaluations * n * x_size > PATIENCE or log.conventions():
            break
        attempts += 1
        if others:
            x, name = others.pop(0), "another start"
        else:
            name = "simplex"
            x, _ = simplex(problem, ranked[0], log, horizon=h, limit=400)
            attempts = 3
        log.note(name, problem.cost(x, h), problem)
        other = descend_progressively(problem, x, log)
        found = better(found, other)
        log.best = problem, found.x
    return found


def better(a: Descent, b: Descent) -> Descent:
    """The one with the lower cost, interrupted when either was."""
    best = min(a, b, key=lambda d: d.normal.cost)
    return replace(best, interrupted=a.interrupted or b.interrupted)


def rescale_priors(problem: Problem, found: Descent) -> Descent:
    """Weigh prior knowledge by the residuals found, memory included, and settle again; unless it hardly pulls."""
    if found.interrupted or not any(u.prior is not None for u in problem.unknowns):
        return found
    for _ in range(3):
        if found.interrupted:
            break
        r, J = problem.prior_rows(found.x)
        pull = pseudo_inverse(found.normal.matrix) @ (J.T @ r)
        variance = found.normal.cost / problem.count()
        error = np.sqrt(np.maximum(np.diag(pseudo_inverse(found.normal.matrix)) * variance, 0.0))
        if np.all(np.abs(pull) <= 0.02 * error) and not any(u.prior and u.shared for u in problem.unknowns):
            break
        noise = max(noise_level(problem, found.x), 1e-9)
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
        problem.settle_steps(x, h)
        walked = descend(lambda z: problem.normal(z, h), x, problem.lower, problem.upper, tolerance=1e-2, limit=12)
        costs.append((walked.normal.cost, k, walked.x))
        if walked.interrupted:
            raise KeyboardInterrupt
    costs.sort(key=lambda c: c[:2])
    return [x for _, _, x in costs]
