"""Levenberg-Marquardt descent within bounds, over a horizon that grows as the model earns it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.problem.normal_equations import Normal
from upright.identification.problem.residuals import Problem
from upright.progress import Progress, silent

Array = NDArray[np.float64]

WORTH = 1e-3
"""Share of the cost that another optimum has to save to be worth going there."""

CREEP = 1e-3
"""A walk that gained less than this share in its last ten steps counts as settled when its evaluations run out."""


LONGEST = 2000
"""Accepted steps that are kept."""


@dataclass(frozen=True, kw_only=True)
class Descent:
    """Where a walk ended: coordinates, model there, whether it settled, whether it was interrupted."""

    x: Array
    normal: Normal
    converged: bool
    interrupted: bool = False


def unseen(problem: Problem, x: Array) -> None:
    """Look at nothing; the default."""


@dataclass
class SearchLog:
    """What happened on the way: stages with their cost and simulations, and the best so far should one interrupt.

    `best` holds the problem last worked on and where in it the search stood, `lower` a problem, a lower cost of it met
    since and where, `valleys` the same of where else descents ended, `rivals` values of another model that the data do
    not refuse, `unresolved` lengths below the rounding, `unreached` limits and `idle` numbers, with the term that they
    shape. `conventions` says which signs and zeros look wrong; evaluated only when a fit is poor, since no search mends
    a reversed sign. `path` are the mean squared residual and the shared numbers after each accepted step, which `look`
    is called with.
    """

    progress: Progress = silent
    history: list[tuple[str, float, int]] = field(default_factory=list[tuple[str, float, int]])
    best: tuple[Problem, Array] | None = None
    lower: tuple[Problem, float, Array] | None = None
    valleys: list[tuple[Problem, float, Array]] = field(default_factory=list[tuple[Problem, float, Array]])
    warnings: list[str] = field(default_factory=list[str])
    rivals: dict[str, float] = field(default_factory=dict[str, float])
    unresolved: tuple[str, ...] = ()
    unreached: tuple[str, ...] = ()
    idle: dict[str, str] = field(default_factory=dict[str, str])
    conventions: Callable[[], Sequence[str]] = tuple
    path: list[tuple[float, dict[str, float]]] = field(default_factory=list[tuple[float, dict[str, float]]])
    look: Callable[[Problem, Array], None] = unseen

    def step(self, stage: str, share: float, cost: float, problem: Problem, x: Array, horizon: float) -> None:
        """Report progress, and keep where an accepted step of the descent led, at most `LONGEST` of them."""
        self.tell(stage, share, cost, problem)
        if len(self.path) < LONGEST:
            self.path.append((cost / max(problem.count(horizon), 1), problem.shared_at(x)))
        self.look(problem, x)

    def tell(self, stage: str, share: float, cost: float, problem: Problem) -> None:
        """Report progress, with the cost reached and the simulations made."""
        self.progress(f"{stage}, cost {cost:.6g}, {problem.evaluations} evaluations", share)

    def met(self, problem: Problem, here: Descent, best: float) -> None:
        """Keep where a cost below the `best` one of a problem was met, the lowest of all."""
        known = self.lower[1] if self.lower is not None and self.lower[0] is problem else best
        if here.normal.cost < (1 - WORTH) * known:
            self.lower = problem, here.normal.cost, here.x

    def note(self, stage: str, cost: float, problem: Problem) -> None:
        """Add a stage to the history."""
        self.history.append((stage, cost, problem.evaluations))


def descend(
    evaluate: Callable[[Array], Normal],
    x: Array,
    lower: Array,
    upper: Array,
    *,
    tolerance: float = 1e-8,
    limit: int = 60,
    stride: float = 1.0,
    report: Callable[[float, Array], None] | None = None,
    here: Normal | None = None,
) -> Descent:
    """Minimize a sum of squares by Levenberg-Marquardt steps projected onto bounds.

    Parameters
    ----------
    evaluate : callable
        Coordinates to `Normal`; an infinite cost is stepped back from.
    x, lower, upper : (n,) arrays
        Start and bounds.
    tolerance : float
        Relative decrease of the cost, as the model predicts it, at which the walk has settled.
    limit : int
        Largest number of evaluations.
    stride : float
        Longest first step as a multiple of the undamped one; smaller is more careful.
    here : Normal, optional
        The model at the start, when it is known already.

    Notes
    -----
    Damping after Nielsen (1999); scaled by the largest diagonal met (More 1978), so that no unit matters.
    """
    x = np.clip(x, lower, upper)
    here = evaluate(x) if here is None else here
    damping, growth = 1e-3 / stride, 2.0
    diagonal = np.zeros(x.size)
    converged = False
    passed: list[float] = []
    try:
        for _ in range(limit):
            passed.append(here.cost)
            if not math.isfinite(here.cost):
                break
            A, g = here.matrix, here.gradient
            diagonal = np.maximum(diagonal, np.diag(A))
            D = np.maximum(diagonal, 1e-12 * diagonal.max(initial=1e-300))
            step = _bounded_step(A + np.diag(damping * D), g, lower - x, upper - x)
            promised = -(2 * g @ step + step @ A @ step)
            if promised <= tolerance * here.cost:
                newton = _bounded_step(A + np.diag(1e-9 * D), g, lower - x, upper - x)
                if damping < 1 or -(g @ newton) <= tolerance * here.cost:
                    converged = True
                    break
            there = np.clip(x + step, lower, upper)
            new = evaluate(there)
            gained = here.cost - new.cost
            if math.isfinite(new.cost) and gained > 0:
                ratio = gained / promised
                damping *= max(0.1, 1 - (2 * ratio - 1) ** 3)
                growth = 2.0
                x, here = there, new
                if report is not None:
                    report(here.cost, x)
                if gained <= tolerance * here.cost and damping < 1:
                    converged = True
                    break
            else:
                damping *= growth
                growth *= 2
                if damping > 1e12:
                    converged = True
                    break
    except KeyboardInterrupt:
        return Descent(x=x, normal=here, converged=False, interrupted=True)
    # along a valley that the data hardly see the steps go on for long, and matter no more
    creeping = len(passed) > 10 and passed[-10] - here.cost <= CREEP * here.cost
    return Descent(x=x, normal=here, converged=converged or creeping)


def _bounded_step(A: Array, g: Array, least: Array, most: Array) -> Array:
    """Minimum of ``g's + s'As/2`` over ``least <= s <= most``, numbers that run into a bound fixed there in turn."""
    step = np.zeros(g.size)
    free = ~(((least >= 0) & (g > 0)) | ((most <= 0) & (g < 0)))
    for _ in range(g.size):
        if not free.any():
            break
        step[free] = -_solve(A[np.ix_(free, free)], g[free] + A[np.ix_(free, ~free)] @ step[~free])
        out = free & ((step < least) | (step > most))
        if not out.any():
            break
        step[out] = np.clip(step[out], least[out], most[out])
        free &= ~out
    return step


def _solve(A: Array, b: Array) -> Array:
    """Solution of a symmetric positive system, scaled to unit diagonal first."""
    s = 1 / np.sqrt(np.maximum(np.diag(A), 1e-300))
    try:
        return s * np.linalg.solve(A * s[:, None] * s, s * b)
    except np.linalg.LinAlgError:
        return s * np.linalg.lstsq(A * s[:, None] * s, s * b, rcond=1e-12)[0]


def reach(problem: Problem, x: Array) -> float:
    """Seconds over which every run, simulated with coordinates `x`, stays within its own spread of the data."""
    seconds = math.inf
    for index, track in enumerate(problem.tracks):
        if track.windowed:
            continue
        e = problem.simulate(index, x[:, None], track.length)[:, 0, :, 0] - track.targets(track.length)[:, 0]
        lost = np.flatnonzero(~(np.abs(e * track.weights).max(axis=1) < 1.0))
        if lost.size:
            seconds = min(seconds, lost[0] * track.dt)
    return seconds


def first_horizon(problem: Problem) -> float:
    """Seconds to begin with: one and a half periods of the slowest run; everything when runs are restarted.

    Of several horizons the shortest: the longer ones amplify what a first guess does to the state.
    """
    free = [t for t in problem.tracks if not t.windowed]
    shortest = [t.ahead.samples[0] * t.dt for t in problem.tracks if t.ahead]
    return max((1.5 * t.period for t in free), default=max(shortest, default=math.inf))


def descend_progressively(
    problem: Problem,
    x: Array,
    log: SearchLog | None = None,
    *,
    horizon: float | None = None,
    upto: float = math.inf,
    tolerance: float = 1e-6,
) -> Descent:
    """Descend over a horizon that grows to the whole of the runs, at least doubling, at most to where it still follows.

    Fitting long records at once stalls or costs 5 to 30 times more.

    Parameters
    ----------
    problem, x : Problem, (sought,) array
        What is minimized, and from where.
    log : SearchLog, optional
        Where the stages are noted.
    horizon, upto : float
        Seconds to begin with, `first_horizon` when omitted, and to end with.
    tolerance : float
        As for `descend`, in the last stage.
    """
    log = SearchLog() if log is None else log
    whole = min(problem.duration, upto)
    h = min(whole, first_horizon(problem) if horizon is None else horizon)
    x = np.clip(x, problem.lower, problem.upper)
    here: Normal | None = problem.settle_steps(x, h)
    while True:
        last = h >= whole
        name = "whole runs" if last else f"first {h:.3g} s"
        share = h / whole if math.isfinite(whole) else 1.0
        end = descend(
            lambda z, h=h: problem.normal(z, h), x, problem.lower, problem.upper,
            tolerance=tolerance if last else 1e-3, limit=60 if last else 25, here=here,
            report=lambda cost, z, name=name, share=share, h=h: log.step(name, share, cost, problem, z, h),
        )  # fmt: skip
        x = end.x
        log.note(name, end.normal.cost, problem)
        if last or end.interrupted:
            return end
        try:
            problem.rescale_steps(end.normal, h)
            followed = reach(problem, x)
        except KeyboardInterrupt:
            return replace(end, converged=False, interrupted=True)
        here = None
        h = min(whole, max(2 * h, followed))
        if h > 0.7 * whole:
            h = whole
