"""How well does the best point that a search has reached explain its runs, while it goes on?"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.scoring import fit_percent, score_run
from upright.identification.model.fit import RunScore
from upright.identification.problem.residuals import Problem

Array = NDArray[np.float64]

OFTEN = 0.4
"""Time between two looks at least [s]."""
COST = 0.02
"""Share of a search's time that looking at it takes at most."""


@dataclass(frozen=True, kw_only=True)
class SoFar:
    """What a search has come to.

    Attributes
    ----------
    evaluations : int
        Simulations so far, of every model that was tried.
    explained : mapping of str to float
        Fit percent of each fitted signal at the point that was just accepted, its mean over the runs.
    runs : mapping of str to RunScore, optional
        Each run by label at the best point so far; None where it is what it was.
    """

    evaluations: int
    explained: Mapping[str, float]
    runs: Mapping[str, RunScore] | None


@dataclass(eq=False)
class Lookout:
    """Called with every accepted step of a search; looks at a step now and then, and shows what it sees.

    A look simulates each run once, so that the next one waits until it is `COST` of the time since.
    """

    show: Callable[[SoFar], None]
    clock: Callable[[], float] = time.perf_counter
    _due: float = 0.0
    _best: float = -np.inf
    _problem: Problem | None = None
    _counted: int = 0
    _before: int = field(default=0)

    def __call__(self, problem: Problem, x: Array) -> None:
        """Look at coordinates `x` where it is time to."""
        if problem is not self._problem:
            self._before, self._problem = self._before + self._counted, problem
        self._counted = problem.evaluations
        began = self.clock()
        if began < self._due:
            return
        runs = {track.run.label: _score(problem, index, x) for index, track in enumerate(problem.tracks)}
        problem.evaluations = self._counted  # what is only looked at is no work of the search
        names = dict.fromkeys(name for score in runs.values() for name in score.fit_percent)
        explained = {
            name: float(np.mean([s.fit_percent[name] for s in runs.values() if name in s.fit_percent]))
            for name in names
        }
        better = min(explained.values(), default=0.0) > self._best
        self._best = max(self._best, min(explained.values(), default=0.0))
        self.show(SoFar(evaluations=self._before + self._counted, explained=explained, runs=runs if better else None))
        self._due = self.clock() + max(OFTEN, (self.clock() - began) / COST)


def _score(problem: Problem, index: int, x: Array) -> RunScore:
    """Score of one run, at the furthest horizon where a filter predicts it."""
    track = problem.tracks[index]
    if not track.ahead:
        return replace(score_run(problem, index, x), naive={})
    weight, run = track.ahead.weight[-1], track.run
    y = problem.simulate(index, x[:, None], track.length)[-1, ..., 0] / weight
    measured = track.targets(track.length)[-1] / weight
    return RunScore(
        role=run.role, horizon=track.ahead.samples[-1] * track.dt,
        t=run.t[0] + track.dt * (track.restarts + track.ahead.samples[-1]), y=measured, simulated=y,
        measured=run.measured,
        fit_percent={run.measured[k]: fit_percent(measured[:, k], y[:, k]) for k in run.free},
    )  # fmt: skip
