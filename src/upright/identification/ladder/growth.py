"""Growth of a model rung by rung, each kept only if it predicts better what it has not seen.

A ladder stops early when one run predicts another no better than the model predicts both (`repeats`).

Inside a fit its first rungs choose the friction model. `climb` refits all runs for every rung and asks whether the
held-out error falls by more than chance; inside a fit there is no time for that: every rung is fitted to all runs, and
of all of them the one is taken that predicts blocks of the runs best, a third of them left out in turn.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.identification.inference.scoring import score_run
from upright.identification.ladder.cross_validation import leave_one_out
from upright.identification.ladder.decision import RungComparison, by_chance, compare_rungs, reason, stalled
from upright.identification.ladder.repeats import Repeats, at_ceiling, repeats
from upright.identification.ladder.rungs import Rung, check_rungs, default_rungs, friction_rungs, rig_at, runs_at
from upright.identification.model.fit import RunScore
from upright.identification.model.grey_box import GreyBox, neutral
from upright.identification.model.runs import FITTED_SHARE, LEAST_RUN, Run
from upright.identification.problem.normal_equations import finite
from upright.identification.problem.residuals import Problem, formulate, noise_level
from upright.identification.problem.tracks import FOLDS
from upright.identification.search.descent import (
    CREEP,
    Descent,
    SearchLog,
    descend,
    descend_progressively,
    first_horizon,
)
from upright.identification.search.strategy import (
    POOR,
    better,
    closed_form_starts,
    explains_little,
    search,
    settle_weights,
)
from upright.progress import Progress, part, silent
from upright.workers import HERE, Workers, one_thread

Array = NDArray[np.float64]
Percents = Mapping[str, Mapping[str, float]]

TYPICAL = ("friction", "gain")
"""What a rung lets differ from run to run is not read off a run that is being predicted: it would be no prediction."""


@dataclass(frozen=True, kw_only=True)
class RungResult:
    """What one rung came to: whether it was accepted, and the reason in a sentence.

    `fitted` and `predicted` are fit percents by run and signal, `cost` the sum of squares of the fit, `parameters` and
    `per_run` how many numbers were sought for the rig and for single runs, `values` those of the rig by name.
    `comparison` is with the best rung below, None for the first.
    """

    rung: Rung
    accepted: bool
    reason: str
    fitted: Percents
    predicted: Percents
    cost: float
    parameters: int
    per_run: int
    values: Mapping[str, float]
    seconds: float
    comparison: RungComparison | None = None

    @property
    def fit_percent(self) -> float:
        """Mean over runs and signals."""
        return _mean(self.fitted)

    @property
    def predicted_percent(self) -> float:
        """Mean over runs and signals."""
        return _mean(self.predicted)


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """A model grown as far as it predicts better.

    `steps` are in the order tried, `rig` and `runs` those of the chosen model: what was refused is known to do nothing
    and named in `left_out`. `scores` are its predictions, `held_out` says how they were judged and `stopped` why the
    ladder ended; `repeats` are runs that repeat one another.
    """

    steps: tuple[RungResult, ...]
    rig: GreyBox
    runs: tuple[Run, ...]
    held_out: str
    repeats: tuple[Repeats, ...]
    stopped: str
    scores: Mapping[str, RunScore]
    left_out: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    interrupted: bool = False
    seconds: float = 0.0

    @property
    def accepted(self) -> tuple[RungResult, ...]:
        """The rungs that earned their place."""
        return tuple(s for s in self.steps if s.accepted)


@one_thread()
def climb(
    rig: GreyBox, runs: Sequence[Run], rungs: Sequence[Rung] | None = None, *, progress: Progress = silent,
    workers: Workers = HERE,
) -> Ladder:  # fmt: skip
    """Grow a model rung by rung, while what was held out is predicted better by more than chance.

    Every rung is fitted to all runs from where the best rung below ended, then each run is predicted from a fit of the
    others; of a single run the last third is predicted from the first two. `decision.compare_rungs` says what better
    means: the mean paired decrease of the logarithm of the error exceeds one standard error of it. A rung that is
    refused is taken off again before the next one is tried, and tried once more when another was kept after it: dry
    friction may say nothing while a lag is missing.

    Parameters
    ----------
    rig : GreyBox
        With everything that the richest model estimates.
    runs : sequence of Run
        Those with role ``"fit"`` decide.
    rungs : sequence of Rung, optional
        Poorest first; `default_rungs` when omitted.
    progress : callable, optional
        As for `identify`.
    workers : Workers, optional
        Who predicts the runs from fits of the others.

    Raises
    ------
    BadInput
        When nothing can be held out, or a rung names what was not to be estimated.
    """
    fitted = [run for run in runs if run.role == "fit"]
    rungs = list(rungs) if rungs else default_rungs(rig, fitted)
    check_rungs(rig, rungs)
    if not fitted or (len(fitted) == 1 and fitted[0].first_part() is fitted[0]):
        raise BadInput(
            f"a ladder has to hold something out: two runs with role 'fit', or one of {LEAST_RUN} samples or more"
        )
    return _Climb(rig, fitted, rungs, progress, workers).walk()


class _Climb:
    """One climb; what it found so far survives an interruption.

    Of the model kept so far: its rungs, numbers by key, predictions of the runs, cost, and the problem that weighed it.
    """

    def __init__(
        self, rig: GreyBox, runs: list[Run], rungs: list[Rung], progress: Progress, workers: Workers
    ) -> None:  # fmt: skip
        self.rig, self.runs, self.rungs, self.progress, self.workers = rig, runs, rungs, progress, workers
        self.log = SearchLog()
        self.steps: list[RungResult] = []
        self.kept: list[Rung] = []
        self.values: dict[str, float] = {}
        self.scores: dict[str, RunScore] = {}
        self.cost = math.inf
        self.weighed: Problem | None = None
        self.repeats = repeats(runs)

    def walk(self) -> Ladder:
        began = time.perf_counter()
        stopped, interrupted = "Every rung was tried.", False
        waiting = list(self.rungs)
        try:
            while waiting:
                if self.try_rung(waiting.pop(0), len(waiting)):
                    # what was refused gets another chance, last, since something else was missing then
                    refused = [step.rung for step in self.steps if not step.accepted]
                    waiting += [r for r in dict.fromkeys(refused) if r not in (*waiting, *self.kept)]
                if at_ceiling(self.repeats, self.scores):
                    stopped = "The model predicts the runs as well as they predict one another: nothing is left."
                    if waiting:
                        stopped = f"{stopped[:-1]} ({', '.join(r.name for r in waiting)} not tried)."
                    break
        except KeyboardInterrupt:
            stopped, interrupted = "It was interrupted; the rungs so far stand.", True
        chosen = rig_at(self.rig, self.rungs, self.kept)
        held_out = "each run predicted from a fit of the others"
        if len(self.runs) == 1:
            held_out = "the last third predicted from a fit of the first two thirds"
        return Ladder(
            steps=tuple(self.steps), rig=chosen, runs=tuple(runs_at(self.runs, self.kept)), held_out=held_out,
            repeats=self.repeats, stopped=stopped, scores=self.scores,
            left_out=tuple(n for n in self.rig.estimated if n not in chosen.estimated),
            warnings=tuple(self.log.warnings), interrupted=interrupted, seconds=time.perf_counter() - began,
        )  # fmt: skip

    def try_rung(self, rung: Rung, waiting: int) -> bool:
        """Whether a rung is kept."""
        began, before = time.perf_counter(), len(self.steps)
        start, stop = before / (before + 1 + waiting), (before + 1) / (before + 1 + waiting)
        middle = start + 0.4 * (stop - start)
        self.log.progress = part(self.progress, start, middle, rung.name)
        retained = [*self.kept, rung]
        rig, runs = rig_at(self.rig, self.rungs, retained), runs_at(self.runs, retained)
        shown = [runs[0].first_part()] if len(runs) == 1 else runs
        problem = formulate(rig, shown)
        if self.weighed is not None:
            problem.weigh_like(self.weighed)
        end = self.fit(problem, shown, rung)
        if end.interrupted:
            raise KeyboardInterrupt
        if self.values and end.normal.cost > self.cost * (1 + CREEP) and not rung.drops:
            self.log.warnings.append(stalled(rung.name, end.normal.cost, self.cost))
        chance = by_chance(len(problem.unknowns) - len(self.values), noise_level(problem, end.x))
        lucky = bool(self.values) and self.cost - end.normal.cost <= chance and not rung.drops
        cost = end.normal.cost
        end = settle_weights(problem, end)
        if end.interrupted:
            raise KeyboardInterrupt
        whole = formulate(rig, shown, thin=False)
        fitted = {run.label: score_run(whole, i, end.x) for i, run in enumerate(shown)}
        if len(runs) == 1:
            ahead = replace(
                runs[0], score_from=max(runs[0].score_from, FITTED_SHARE * float(runs[0].t[-1] - runs[0].t[0]))
            )
            predicted = {ahead.label: score_run(formulate(rig, [ahead], thin=False), 0, end.x)}
        else:
            predicted = self.leave_out(problem, end.x, runs, retained, part(self.progress, middle, stop, rung.name))
        comparison = None
        if self.scores:
            poorer, richer = ([scores[run.label] for run in runs] for scores in (self.scores, predicted))
            comparison = compare_rungs(poorer, richer, [np.array(run.quanta) for run in runs])
        better = comparison is None or (comparison.better and not lucky)
        values, shared = problem.values_at(end.x), problem.shared_at(end.x)
        self.steps.append(
            RungResult(
                rung=rung,
                accepted=better,
                reason=reason(comparison, cost, self.cost, lucky=lucky),
                fitted={label: dict(s.fit_percent) for label, s in fitted.items()},
                predicted={label: dict(s.fit_percent) for label, s in predicted.items()},
                cost=end.normal.cost,
                parameters=len(shared),
                per_run=len(values) - len(shared),
                values=shared,
                seconds=time.perf_counter() - began,
                comparison=comparison,
            )
        )
        if better:
            self.kept, self.values, self.scores = retained, values, predicted
            self.cost, self.weighed = end.normal.cost, problem
        return better

    def leave_out(
        self, problem: Problem, x: Array, runs: list[Run], retained: list[Rung], progress: Progress
    ) -> dict[str, RunScore]:
        """Every run as predicted by a fit of the others."""
        known = {n: v for n, v in self.values.items() if n in problem.rig.parameters}
        typical = [n for r in retained for n in r.unknown if n in TYPICAL or n.startswith("scale")]
        left_out = leave_one_out(
            problem.rig, runs, problem.values_at(x), noise=problem.noise, typical=typical,
            otherwise=known | {n: neutral(problem.rig.plant, n) for n in retained[-1].adds}, progress=progress,
            workers=self.workers,
        )  # fmt: skip
        return {one.label: one.score for one in left_out.all()}

    def fit(self, problem: Problem, runs: Sequence[Run], rung: Rung) -> Descent:
        """The best fit that can be found from the end of the rung below, or from nothing."""
        starts = closed_form_starts(problem.rig, runs)
        if not self.values:
            return search(problem, [problem.start, *(problem.place(s) for s in starts)], self.log)
        candidates = [rung.seeds(self.rig)]
        if rung.adds:
            candidates.append({n: self.rig.parameters[n].value for n in rung.adds})
            candidates += [{n: v for n, v in s.items() if n in rung.adds} for s in starts[:1]]
        ends = [
            descend_progressively(problem, problem.place(self.values | c), self.log, horizon=math.inf, tolerance=1e-3)
            for c in candidates
        ]
        best = reduce(better, ends)
        end = descend(problem.normal, best.x, problem.lower, problem.upper, tolerance=1e-6)
        best = replace(end, interrupted=best.interrupted)
        if best.normal.cost > POOR * problem.count() and not best.interrupted and rung.adds and starts:
            best = better(best, search(problem, [problem.place(starts[0])], self.log, patient=False))
        return best


def _mean(percents: Percents) -> float:
    values = [v for signals in percents.values() for v in signals.values()]
    return float(np.mean(values)) if values else math.nan


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A friction model fitted to every run.

    `values` are its numbers by key, those of single runs that ended at a bound left out, `noise` the level of its
    residuals, `held_out` the mean squared residual over blocks of the runs that were left out in turn.
    """

    rig: GreyBox
    cost: float
    noise: float
    values: dict[str, float]
    held_out: float


def choose_friction(rig: GreyBox, runs: Sequence[Run], log: SearchLog) -> tuple[GreyBox, list[Array]]:
    """Rig of the friction that predicts best, and coordinates to start the final fit from.

    Richer rungs start from where the poorer one ended, or they can end with a larger cost (seen: 1083 against 314).
    What the poorest misses the next one mostly explains, so the dear search by simplex waits for the chosen one (seen:
    1,200 simulations that led nowhere, and Coulomb friction then explained 17 times as much).
    """
    rungs = friction_rungs(rig)
    # levels of friction and of noise are sought together, dearly; whether friction predicts better a study may ask
    filtered = any(run.filtered for run in runs)
    if filtered or len(rungs) == 1:
        problem = formulate(rig, runs)
        starts = [problem.start, *(problem.place(s) for s in closed_form_starts(rig, runs))]
        if filtered:
            starts = [min(starts, key=lambda x: problem.cost(x, first_horizon(problem)))]
        return rig, starts
    tried: list[Candidate] = []
    for k, rung in enumerate(rungs):
        here = rig_at(rig, rungs, rungs[: k + 1])
        part = formulate(here, runs)
        starts = [part.place(s) for s in closed_form_starts(here, runs)]
        if tried:
            starts = [part.place(tried[-1].values | rung.seeds(rig)), *starts[:1]]
        else:
            starts = [part.start, *starts]
        end = search(part, starts, log, patient=not tried, stairs=False)
        if tried and end.normal.cost > tried[-1].cost and not end.interrupted:
            # another start looked better over the first seconds and led astray; the poorer fit's end cannot
            end = better(end, descend_progressively(part, starts[0], log, horizon=math.inf))
        if end.interrupted:
            raise KeyboardInterrupt
        cost = end.normal.cost
        if tried and cost > tried[-1].cost * (1 + 1e-6):
            log.warnings.append(stalled(rung.name, cost, tried[-1].cost))
        level, v = noise_level(part, end.x), part.value(end.x)
        values = {part.key(i): float(v[i]) for i, u in enumerate(part.unknowns) if u.shared or u.lower < v[i] < u.upper}
        held_out = _held_out(part, end)
        log.note(f"{rung.name}: held-out cost", held_out, part)
        tried.append(Candidate(rig=here, cost=cost, noise=level, values=values, held_out=held_out))
    k = min(range(len(tried)), key=lambda i: tried[i].held_out)
    _note_rival(tried[k:], [n for rung in rungs[k + 1 :] for n in rung.adds], log)
    return tried[k].rig, [formulate(tried[k].rig, runs).place(tried[k].values)]


def _note_rival(tried: Sequence[Candidate], left_out: Sequence[str], log: SearchLog) -> None:
    """Note where a richer model differs, where it explains the runs better.

    That what is left out is predicted worse then means that something else is missing, not that the richer model is
    wrong. The chosen model comes first.
    """
    chosen, rival = tried[0], min(tried, key=lambda c: c.cost)
    if chosen.cost - rival.cost <= by_chance(len(left_out), rival.noise):
        return
    for n in chosen.rig.estimated:
        a, b = chosen.values.get(n, 0.0), rival.values.get(n, 0.0)
        if abs(a - b) > 0.5 * max(abs(a), abs(b)):
            log.rivals[n] = b
    if log.rivals:
        log.warnings.append(
            f"The runs are explained better with {', '.join(left_out)} (cost {rival.cost:.3g} against "
            f"{chosen.cost:.3g}), what is left out of them is predicted better without, so something else is missing "
            f"from the model; until it is found, the intervals of {', '.join(log.rivals)} hold what both models say."
        )


def _held_out(problem: Problem, best: Descent) -> float:
    """Mean squared residual over blocks of the runs, each fitted without them, from the `best` of all.

    Not over whole runs: a cart that climbs in stairs slips one of them where it was left out, and Coulomb friction was
    refused although it explains the runs 17 times better. Of runs too short to leave anything out the mean squared
    residual itself.
    """
    x, itself = best.x, best.normal.cost / max(problem.count(), 1)
    if explains_little(problem, best):  # refits would only lose time
        return itself
    total, samples = 0.0, 0
    for fold in range(FOLDS):
        parts = [track.hidden(fold) for track in problem.tracks]
        if not any(judges.any() for judges, _ in parts):
            return itself
        part = replace(problem, tracks=[track for _, track in parts])
        end = descend(part.normal, x, part.lower, part.upper, tolerance=REFIT, limit=10)
        if end.interrupted:
            raise KeyboardInterrupt
        for index, (track, (judges, _)) in enumerate(zip(problem.tracks, parts, strict=True)):
            e = problem.residuals(index, end.x)
            e = e[judges] if track.windowed else e[0].reshape(-1, len(track.columns))[judges[track.first :]]
            # one run that slips a cycle should not outvote all others
            total += float(np.sum(np.minimum(e * e, 4.0))) if finite(e) else 4.0 * e.size
            samples += e.size
    return total / max(samples, 1)


REFIT = 1e-3
"""Relative gain of the cost at which a fit that leaves something out has settled well enough."""
