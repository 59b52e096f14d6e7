"""How rich a model does the rig deserve? Rung after rung, each kept only if it predicts better what it has not seen.

A ladder stops early when one run predicts another no better than the model predicts both (`repeats.py`).
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.identification.inference.scoring import score
from upright.identification.ladder.crossval import Values, leave_one_out, placed_at, values_at
from upright.identification.ladder.decision import by_chance, compare, percents
from upright.identification.ladder.repeats import at_ceiling, repeats
from upright.identification.ladder.result import Ladder, Step, reason
from upright.identification.ladder.rungs import Rung, at, check, default_rungs, neutral, runs_at
from upright.identification.model.model import LEAST_RUN, SEEN, Rig, Run, RunScore
from upright.identification.problem.pose import pose
from upright.identification.problem.problem import Problem, loudness
from upright.identification.search.descent import CREEP, Descent, Report, descend, grow
from upright.identification.search.strategy import (
    POOR,
    Log,
    better,
    closed_form_starts,
    count,
    explain,
    placed,
    weigh_priors,
)

Array = NDArray[np.float64]

TYPICAL = ("friction", "gain")
"""What a rung lets differ from run to run is not read off a run that is being predicted: it would be no prediction."""


def climb(
    rig: Rig, runs: Sequence[Run], rungs: Sequence[Rung] | None = None, *, progress: Report | None = None
) -> Ladder:
    """Grow a model rung by rung, while what was held out is predicted better by more than chance.

    Every rung is fitted to all runs from where the best rung below ended, then each run is predicted from a fit of the
    others; of a single run the last third is predicted from the first two. `decision.compare` says what better means:
    the mean paired decrease of the logarithm of the error exceeds one standard error of it. A rung that is refused is
    taken off again before the next one is tried, and tried once more when another was kept after it: dry friction may
    say nothing while a lag is missing.

    Parameters
    ----------
    rig : Rig
        With everything that the richest model estimates.
    runs : sequence of Run
        Those with role ``"fit"`` decide.
    rungs : sequence of Rung, optional
        Poorest first; `default_rungs` when omitted.
    progress : callable, optional
        As for `identify`.

    Raises
    ------
    BadInput
        When nothing can be held out, or a rung names what was not asked.
    """
    seen = [run for run in runs if run.role == "fit"]
    rungs = list(rungs) if rungs else default_rungs(rig, seen)
    check(rig, rungs)
    if not seen or (len(seen) == 1 and seen[0].first_part() is seen[0]):
        raise BadInput(
            f"a ladder has to hold something out: two runs with role 'fit', or one of {LEAST_RUN} samples or more"
        )
    return _Climb(rig, seen, rungs, progress).walk()


class _Climb:
    """One climb; what it found so far survives an interruption."""

    def __init__(self, rig: Rig, runs: list[Run], rungs: list[Rung], progress: Report | None) -> None:
        self.rig, self.runs, self.rungs = rig, runs, rungs
        self.progress = progress
        self.log = Log()
        self.steps: list[Step] = []
        self.kept: list[Rung] = []
        self.known: Values = {}
        self.best: dict[str, RunScore] = {}
        self.cost, self.noise = math.inf, math.nan
        self.repeats = repeats(runs)
        self.quanta = [np.array(run.quantum or (0.0,) * len(run.measured)) for run in runs]

    def walk(self) -> Ladder:
        began = time.perf_counter()
        stopped, interrupted = "Every rung was tried.", False
        try:
            waiting = list(self.rungs)
            while waiting:
                rung = waiting.pop(0)
                if self.try_rung(rung, len(waiting)):
                    self.again(waiting)
                if at_ceiling(self.repeats, self.best):
                    stopped = "The model predicts the runs as well as they predict one another: nothing is left."
                    if waiting:
                        stopped = f"{stopped[:-1]} ({', '.join(r.name for r in waiting)} not tried)."
                    break
        except KeyboardInterrupt:
            stopped, interrupted = "It was interrupted; the rungs so far stand.", True
        chosen = at(self.rig, self.rungs, self.kept)
        return Ladder(
            steps=tuple(self.steps), rig=chosen, runs=tuple(runs_at(self.runs, self.kept)), held_out=self.held_out(),
            repeats=self.repeats, stopped=stopped, scores=self.best,
            left_out=tuple(n for n in self.rig.estimated if n not in chosen.estimated),
            warnings=tuple(self.log.warnings), interrupted=interrupted, seconds=time.perf_counter() - began,
        )  # fmt: skip

    def again(self, waiting: list[Rung]) -> None:
        """Give every rung that was refused another chance, last, since something else was missing then."""
        for step in self.steps:
            if not step.kept and step.rung not in (*waiting, *self.kept):
                waiting.append(step.rung)

    def held_out(self) -> str:
        if len(self.runs) > 1:
            return "each run predicted from a fit of the others"
        return "the last third predicted from a fit of the first two thirds"

    def try_rung(self, rung: Rung, waiting: int) -> bool:
        """Whether a rung is kept."""
        done = len(self.steps)
        began = time.perf_counter()
        kept = [*self.kept, rung]
        rig = at(self.rig, self.rungs, kept)
        runs = runs_at(self.runs, kept)
        single = len(runs) == 1
        shown = [run.first_part() for run in runs] if single else runs

        def tell(stage: str, fraction: float, cost: float, evaluations: int) -> None:
            if self.progress is not None:
                within = 0.4 * fraction if not stage.startswith("without") else 0.4 + 0.6 * fraction
                self.progress(f"{rung.name}: {stage}", (done + within) / (done + 1 + waiting), cost, evaluations)

        self.log.report = tell
        problem = pose(rig, shown)
        if self.known:  # costs of two rungs compare only where prior knowledge weighs the same
            problem.noise = self.noise
        found = self.fit(problem, rig, shown, rung)
        if found.interrupted:
            raise KeyboardInterrupt
        if self.steps and found.normal.cost > self.cost * (1 + CREEP) and not rung.drops:
            self.log.warnings.append(
                f"With {rung.name} the runs were fitted worse (cost {found.normal.cost:.6g} against {self.cost:.6g}); "
                "a richer model that contains the poorer one never should, so the search stalled; try better guesses."
            )
        luck = by_chance(len(problem.unknowns) - len(self.known), loudness(problem, found.x))
        lucky = bool(self.known) and self.cost - found.normal.cost <= luck and not rung.drops
        before, cost = self.cost, found.normal.cost
        found = weigh_priors(problem, found)
        if found.interrupted:
            raise KeyboardInterrupt
        values = values_at(problem, found.x)
        whole = pose(rig, shown, thin=False)
        fitted = {run.label: score(whole, i, found.x) for i, run in enumerate(shown)}
        if single:
            ahead = replace(runs[0], score_from=max(runs[0].score_from, SEEN * float(runs[0].t[-1] - runs[0].t[0])))
            predicted = {ahead.label: score(pose(rig, [ahead], thin=False), 0, found.x)}
        else:
            predicted = self.leave_out(rig, runs, rung, values, problem, tell)
        comparison = None
        if self.best:
            pairs = [(self.best[r.label], predicted[r.label]) for r in runs]
            comparison = compare([a for a, _ in pairs], [b for _, b in pairs], self.quanta)
        better = comparison is None or (comparison.better and not lucky)
        why = reason(comparison, cost, before, lucky=lucky)
        shared = {n: v for (home, n), v in values.items() if not home}
        step = Step(
            rung=rung, kept=better, reason=why, fitted=percents(fitted), predicted=percents(predicted),
            cost=found.normal.cost, parameters=len(shared), own=len(values) - len(shared), values=shared,
            seconds=time.perf_counter() - began, comparison=comparison,
        )  # fmt: skip
        self.steps.append(step)
        if better:
            self.kept, self.known, self.best, self.cost = kept, values, predicted, found.normal.cost
            self.noise = problem.noise
        return better

    def leave_out(
        self, rig: Rig, runs: list[Run], rung: Rung, values: Values, problem: Problem, tell: Report
    ) -> dict[str, RunScore]:
        predicted: dict[str, RunScore] = {}
        leave_one_out(
            rig, runs, values, noise=problem.noise, typical=[n for r in (*self.kept, rung) for n in r.unknown
                                                             if n in TYPICAL or n.startswith("scale")],
            otherwise={**{n: v for (home, n), v in self.known.items() if not home},
                       **{n: neutral(rig.plant, n) for n in rung.adds}},
            report=tell, found=lambda s, left: predicted.update({left.label: s}),
        )  # fmt: skip
        return predicted

    def fit(self, problem: Problem, rig: Rig, runs: Sequence[Run], rung: Rung) -> Descent:
        """The best fit that can be found from the end of the rung below, or from nothing."""
        starts = closed_form_starts(rig, runs)
        if not self.known:
            return explain(problem, [problem.start, *(placed(problem, s) for s in starts)], self.log)
        here = placed_at(problem, self.known)
        guess = {n: self.rig.parameters[n].value for n in rung.adds}
        little = {n: _towards(v, neutral(rig.plant, n)) for n, v in guess.items()}
        seen = [{n: v for n, v in s.items() if n in rung.adds} for s in starts[:1]]
        candidates = [placed(problem, terms, here) for terms in (little, guess, *seen)]
        found: Descent | None = None
        for x in candidates if rung.adds else candidates[:1]:
            walked = grow(problem, x, report=self.log.report, horizon=math.inf, tolerance=1e-3)
            found = walked if found is None else better(found, walked)
        assert found is not None
        found = replace(
            descend(problem.normal, found.x, problem.lower, problem.upper, tolerance=1e-6),
            interrupted=found.interrupted,
        )
        if found.normal.cost > POOR * count(problem) and not found.interrupted and rung.adds and starts:
            found = better(found, explain(problem, [placed(problem, starts[0])], self.log, patient=False))
        return found


def _towards(guess: float, nothing: float) -> float:
    """A tenth of the way from where a term does nothing to its guess."""
    return nothing + 0.1 * (guess - nothing) if math.isfinite(nothing) else guess
