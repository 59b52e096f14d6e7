"""Identification of a rig from its runs: the numbers that explain them, how sure these are, and what stays unseen."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, reduce

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, nearest
from upright.identification.checks.conventions import wrong_conventions
from upright.identification.checks.outliers import ProvisionalFit, refit_without_outliers
from upright.identification.checks.refit import as_tested, with_refit
from upright.identification.checks.structure import with_proposal
from upright.identification.inference.assumptions import assumption_sentences, assumptions, with_assumptions
from upright.identification.inference.black_box import black_box
from upright.identification.inference.ceiling import judged
from upright.identification.inference.covariance import Identifiability, Optimum, assess, identifiability
from upright.identification.inference.intervals import (
    run_estimates,
    shared_estimates,
    widened,
    with_model_uncertainty,
    with_valleys,
)
from upright.identification.inference.loop import standing
from upright.identification.inference.neglected import is_driven, lateness, neglected, together_late, with_force
from upright.identification.inference.poles import poles, shared_values
from upright.identification.inference.scoring import fit_percent, predict, score_run
from upright.identification.inference.so_far import Lookout, SoFar
from upright.identification.inference.ties import ties, with_ties
from upright.identification.inference.unseen.bands import calibrated
from upright.identification.inference.verdict import judge, trusted
from upright.identification.inference.verdict.evidence import Evidence
from upright.identification.inference.verdict.predicts import GOOD
from upright.identification.ladder.growth import choose_friction
from upright.identification.model.bands import Bands
from upright.identification.model.fit import Assumption, Estimate, Fit, Pole, RunScore
from upright.identification.model.grey_box import GreyBox, neutral
from upright.identification.model.runs import Run
from upright.identification.problem.normal_equations import correlation
from upright.identification.problem.residuals import Problem, formulate, idle, unreached, unresolved
from upright.identification.problem.simulated import with_noise
from upright.identification.problem.trips import Moments, unasked_trips, with_trip_guesses
from upright.identification.search.descent import (
    Descent,
    SearchLog,
    descend,
    descend_progressively,
    first_horizon,
    unseen,
)
from upright.identification.search.strategy import (
    ATTEMPTS,
    FEW,
    POOR,
    better,
    closed_form_starts,
    explains_little,
    other_moments,
    other_valleys,
    reached_limits,
    search,
    settle_weights,
    simplex,
)
from upright.progress import Progress, silent
from upright.workers import one_thread

__all__ = ["METHODS", "fit_percent", "identify", "predict"]

Array = NDArray[np.float64]

METHODS = ("auto", "least-squares", "simplex")
"""`auto`: closed-form starts, friction ladder, growing least squares, simplex where it stalls. `least-squares`: from
the guess over a growing horizon. `simplex`: the paper's, then polished by least squares."""


FIXED = ("unseen", "known")
"""Statuses of numbers that no other model widens."""

LOWER = 2
"""How often a search is taken up again where the profile of an interval met a lower cost."""


@one_thread()
def identify(
    rig: GreyBox, runs: Sequence[Run], *, method: str = "auto", progress: Progress = silent, watch: bool = True,
    near: Fit | None = None, show: Callable[[SoFar], None] | None = None,
) -> Fit:  # fmt: skip
    """Estimate a rig's parameters from its runs.

    Parameters
    ----------
    rig : GreyBox
        Plant, what is known and what is to be estimated.
    runs : sequence of Run
        Those with role ``"fit"`` are explained together; those with role ``"predict"`` are only scored, with the
        parameters fixed.
    method : {"auto", "least-squares", "simplex"}
        See `METHODS`.
    progress : callable, optional
        Called with the stage, its cost and number of simulations, and the share completed.
    watch : bool
        Whether stretches that something else than the input moved are named, and left out in a second fit.
    near : Fit, optional
        Of nearly the same runs: the search begins there, and asks for friction that this fit left out once more.
    show : callable, optional
        Called some two times a second with what the search has come to.

    Returns
    -------
    Fit
        Also when the search did not settle or was interrupted (the best so far, `interrupted` set): its `verdict`
        says so in a sentence.

    Raises
    ------
    BadInput
        When no run may be fitted, nothing is to be estimated, or a name does not exist.
    """
    rig = with_noise(rig, runs)
    moments = Moments(rig)
    fitted = [with_trip_guesses(rig, run, moments) for run in runs if run.role == "fit"]
    conventions = cache(lambda: wrong_conventions(rig, fitted))
    look = unseen if show is None else Lookout(show)

    def located(retained: Sequence[Run], near: Fit | None) -> ProvisionalFit:
        looking, log = watch and retained is runs, SearchLog(progress=progress, conventions=conventions, look=look)
        return _provisional(rig, retained, method, moments, log, watch=looking, near=near)

    first = located(runs, near)
    if not watch or first.fit.interrupted or first.fit.failed:
        return first.whole()
    try:
        fit = refit_without_outliers(first, rig, runs, located)
        explained = least_explained(fit.runs) >= GOOD  # conventions are dear to try, and a good fit has the right ones
        return fit if explained or conventions() else with_proposal(fit, fitted)
    except KeyboardInterrupt:
        return first.interrupted()


def _provisional(
    rig: GreyBox, runs: Sequence[Run], method: str, moments: Moments, log: SearchLog, *, watch: bool, near: Fit | None,
    tested: Mapping[str, RunScore] | None = None,
) -> ProvisionalFit:  # fmt: skip
    """Where the search ends; `moments` and the conventions of the `log` are those of all samples.

    `tested` holds how fitted runs were predicted before, by a fit without them.
    """
    began = time.perf_counter()
    fitted = [with_trip_guesses(rig, run, moments) for run in runs if run.role == "fit"]
    _check(rig, fitted, method)
    log.warnings += unasked_trips(rig, fitted, moments)
    try:
        problem, optimum = find_optimum(rig, fitted, method, log, near)
    except KeyboardInterrupt:
        problem, x = _best_so_far(rig, fitted, log)
        optimum = Descent(x=x, normal=problem.normal(x), converged=False, interrupted=True)

    assessed: list[_Assessed] = []  # of the last optimum, which values and whole fit share

    def conclude(end: Descent, *, values: bool = False) -> Fit:
        if not assessed or not np.array_equal(assessed[-1].best.x, end.x):
            assessed[:] = [_Assessed(best=assess(problem, end.x))]
        fit = _conclude(rig, runs, assessed[-1], end, log, watch=watch, values=values, tested=tested or {})
        return replace(fit, method=method, seconds=time.perf_counter() - began)

    def whole() -> Fit:
        end = optimum
        try:
            fit = conclude(end)
            for _ in range(LOWER):
                if log.lower is None or log.lower[0] is not problem or fit.interrupted:
                    break
                end = descend(problem.normal, log.lower[2], problem.lower, problem.upper, tolerance=1e-6)
                log.note("lower, met by an interval", end.normal.cost, problem)
                log.lower = None
                fit = conclude(other_valleys(problem, end, log))
        except KeyboardInterrupt:  # intervals and predictions may take long too; without them an answer is near
            return conclude(replace(end, interrupted=True))
        return with_refit(fit, runs, refit)

    def refit(all_runs: Sequence[Run], before: Fit) -> Fit:
        fresh = SearchLog(progress=log.progress, conventions=log.conventions, look=log.look)
        tested = {r.label: before.runs[r.label] for r in all_runs if r.role != before.runs[r.label].role}
        return _provisional(rig, all_runs, method, moments, fresh, watch=False, near=before, tested=tested).whole()

    try:
        fit = conclude(optimum, values=True)
    except KeyboardInterrupt:
        optimum = replace(optimum, interrupted=True)
        fit = conclude(optimum, values=True)
    return ProvisionalFit(fit=fit, whole=whole, interrupted=lambda: conclude(replace(optimum, interrupted=True)))


def find_optimum(
    rig: GreyBox, runs: Sequence[Run], method: str, log: SearchLog, near: Fit | None = None
) -> tuple[Problem, Descent]:  # fmt: skip
    """The problem whose model was chosen, and where its cost is least."""
    problem = formulate(rig, runs)
    if near is not None and not any(e.status == "left out" for e in near.estimates.values()):
        end = descend_progressively(problem, problem.place(near.keyed()), log, horizon=math.inf)
    elif method == "auto":
        chosen, candidates = choose_friction(rig, runs, log)
        if chosen is not rig:
            problem = formulate(chosen, runs)
        end = search(problem, candidates, log)
    elif method == "simplex":
        x = problem.start
        for horizon in (min(problem.duration, 2 * first_horizon(problem)), math.inf):
            x, cost = simplex(problem, x, log, horizon=horizon, limit=200 * x.size, keep=True)
            log.note("simplex", cost, problem)
        end = descend_progressively(problem, x, log, horizon=math.inf)
    else:
        end = descend_progressively(problem, problem.start, log)
        log.best = problem, end.x
        if end.normal.cost > POOR * problem.count() and not end.interrupted:
            starts = [problem.place(s) for s in closed_form_starts(rig, runs)]
            other = search(problem, starts, log, patient=False) if starts else end
            end = better(end, other)
    if not math.isfinite(end.normal.cost):  # the motion runs away wherever the search came: nothing to refine
        return problem, end
    end = settle_weights(problem, other_moments(problem, end, log))
    end = reached_limits(problem, end, log)
    log.unresolved = () if end.interrupted else unresolved(problem, end.x)
    log.unreached = () if end.interrupted else unreached(problem, end.x)
    log.idle = {} if end.interrupted else idle(problem, end.x)
    if left := (*log.unresolved, *log.unreached, *log.idle):  # they would bias everything else, or what is predicted
        whole = formulate(problem.rig.without(left), runs)
        whole.weigh_like(problem)
        end = descend_progressively(whole, whole.place(problem.values_at(end.x)), log, horizon=math.inf)
        problem, end = whole, settle_weights(whole, end)
    end = other_valleys(problem, end, log, attempts=ATTEMPTS if near is None else FEW)
    if end.interrupted:  # perhaps over a part of the runs
        end = replace(end, normal=problem.normal(end.x))
    return problem, end


def _best_so_far(rig: GreyBox, runs: Sequence[Run], log: SearchLog) -> tuple[Problem, Array]:
    """Problem and coordinates of the best so far, which may be of a part of the runs."""
    if log.best is None:
        problem = formulate(rig, runs)
        return problem, problem.start
    part, x = log.best
    problem = formulate(part.rig, runs)
    return problem, problem.place(part.values_at(x))


def _check(rig: GreyBox, runs: Sequence[Run], method: str) -> None:
    if method not in METHODS:
        raise BadInput(f"the method must be one of {', '.join(METHODS)}, got '{method}'; {nearest(method, METHODS)}")
    if not runs:
        raise BadInput("an identification needs at least one run with role 'fit', none came; set it for one run.")
    if not rig.estimated:
        raise BadInput("no parameter is to be estimated; give at least one a guess.")
    for run in runs:
        if run.t.size < 10:
            raise BadInput(f"run '{run.label}' has {run.t.size} samples, at least 10 are needed; widen its window.")


def least_explained(scores: Mapping[str, RunScore]) -> float:
    """Least fit percent of a fitted signal."""
    return min((p for s in scores.values() if s.role == "fit" for p in s.fit_percent.values()), default=100.0)


def _skipped(runs: Sequence[Run], *, watch: bool) -> tuple[str, ...]:
    """What an interrupted fit says nothing of, so that nobody takes silence for "looked at, and found nothing"."""
    return (
        *(["the prediction of runs that were held out"] if any(run.role != "fit" for run in runs) else []),
        "profiles of the intervals, which are standard errors here",
        "other models and assumed numbers that the estimates may rest on",
        "a drive that acts late",
        *(["stretches that something else than the input moved"] if watch else []),
        "whether it is good enough for a loop",
        "the band that predictions promise",
    )


@dataclass(frozen=True, kw_only=True)
class _Assessed:
    """What is known of an optimum for its values already: its covariance, and `scores` of its runs by horizon."""

    best: Optimum
    scores: dict[float | None, dict[str, RunScore]] = field(default_factory=dict[float | None, dict[str, RunScore]])


def _conclude(
    requested: GreyBox, runs: Sequence[Run], assessed: _Assessed, end: Descent, log: SearchLog, *, watch: bool,
    values: bool, tested: Mapping[str, RunScore],
) -> Fit:  # fmt: skip
    """Everything known about an optimum; of an interrupted search, or for `values` alone, only what takes no time.

    That is without predictions.

    Where the motion runs away nothing is known of how sure the numbers are, and nothing is predicted.
    """
    best, problem = assessed.best, assessed.best.problem
    identifiable = identifiability(best)
    warnings = list(log.warnings)
    brief = values or end.interrupted or bool(best.lost)
    little = explains_little(problem, end)
    if little and not brief:
        guessed = [f"{name}, which is assumed" for name in problem.rig.assumed_scales]
        warnings.append(
            "The search stopped after its first pass, because the model explains less than two thirds of how the "
            "signals vary; intervals come from standard errors. Look first at "
            f"{', '.join([*guessed, 'units, signs and the plant'])}."
        )
    estimates = shared_estimates(best, identifiable.hidden, log, profiles=not (brief or little))
    per_run, groups = run_estimates(best)
    for name, value in log.rivals.items():
        e = widened(estimates[name], (value, value))
        estimates[name] = replace(e, status="poorly determined" if e.status == "well determined" else e.status)
    left_out = [n for n in requested.estimated if n not in problem.rig.estimated]
    for name in left_out:
        unit = requested.parameters[name].unit
        value = neutral(requested.plant, name)
        estimates[name] = Estimate(value=value, stderr=0.0, interval=(value, value), unit=unit, status="left out")
        warnings.append(
            f"{name} was left out: no fitted run reaches it, so a run that goes further may be limited where this "
            "model says it is not."
            if name in log.unreached
            else f"{name} was left out: how {log.idle[name]} acts makes no difference in these runs."
            if name in log.idle
            else f"{name} was left out: shorter than the encoder's rounding, it is plain Coulomb friction."
            if name in log.unresolved
            else f"{name} was left out: with it the held-out part of the runs is not predicted better."
        )
    estimates = {n: estimates[n] for n in requested.parameters if n in estimates}
    if not brief:
        estimates = with_model_uncertainty(estimates, best, requested, left_out, log)
    forces = () if brief or little else neglected(best)
    for force in forces:
        estimates |= {
            n: widened(estimates[n], i) for n, i in force.intervals.items() if estimates[n].status not in FIXED
        }
        warnings.append(force.sentence())
    estimates, alike = (estimates, "") if brief or little else with_valleys(estimates, best, log)
    late_by = None if brief or little else together_late(best)
    if late_by is not None:
        name, total = late_by
        estimates[name] = widened(estimates[name], total.interval)
        warnings.append(
            f"{name} stands for delay and lag of the drive together, {1e3 * total.value:.4g} ms in a model that has "
            "both; its interval holds their sum."
        )
    scored = [run for run in runs if run.role == "fit" or not brief]
    bands = None if brief else calibrated(best)
    bands = None if bands is None else reduce(with_force, forces, bands)
    ahead = None if best.lost else judged(problem, best.x)
    scores = _scores(assessed, scored, estimates, groups, bands, log, None if ahead is None else ahead.seconds)
    scores = as_tested(scores, tested)
    skipped = _skipped(runs, watch=watch) if end.interrupted else ()
    if skipped:
        warnings.append(f"Not evaluated: interrupted. This concerns {', '.join(skipped)}.")
    elif len(scored) < len(runs):
        warnings.append("What was held out is not predicted, because the fit failed.")
    unseen = () if best.lost else identifiable.sentences({n: p.unit for n, p in requested.parameters.items()})
    conventions = tuple(log.conventions()) if least_explained(scores) < GOOD else ()
    assumed = assumptions(best, estimates, evaluate=not brief)
    tied = () if brief else ties(best, estimates)
    estimates = with_assumptions(with_ties(estimates, tied), assumed)
    late = None if brief or little or conventions else lateness(best)
    warnings += [late.sentence] if late else []
    # a pole may depend on what the data cannot see
    roots = {} if values or identifiable.hidden else _poles(best, assumed)
    free = {at: there for at, there in roots.items() if at in problem.rig.plant.equilibria}
    answers = judge(
        Evidence(
            rig=problem.rig,
            runs=scores,
            estimates=estimates,
            unseen=unseen,
            conventions=conventions,
            assumptions=assumed,
            converged=end.converged,
            interrupted=end.interrupted,
            memory=best.memory,
            bent=late.bent if late else (),
            missing=tuple(force.sentence() for force in forces if force.essential),
            period=min(t.period for t in problem.tracks),
            standing=None if brief or identifiable.hidden else standing(best, assumed, free or None),
            judged=ahead,
            lost=best.lost,
            nothing=best.explains_nothing,
            ties=tied,
            driven=is_driven(best),
            alike=alike,
            refitted=[label for label in tested if scores[label].role != "fit"],
        )
    )
    return Fit(
        model=requested,
        estimates=estimates,
        per_run=per_run,
        groups=groups,
        runs=scores,
        verdict=" ".join([*(a.text() for a in answers), *assumption_sentences(assumed)]),
        trusted=trusted(answers),
        answers=answers,
        method="",
        evaluations=problem.evaluations,
        seconds=0.0,
        cost=end.normal.cost,
        names=identifiable.names,
        correlation=_correlation(best, identifiable),
        singular_values=identifiable.singular_values,
        directions=identifiable.directions,
        unseen=unseen,
        warnings=(*warnings, *conventions),
        history=tuple(log.history),
        path=tuple(log.path),
        interrupted=end.interrupted,
        not_evaluated=skipped,
        poles=roots,
        assumptions=assumed,
        bands=bands,
        failed=bool(best.lost),
    )


def _scores(
    assessed: _Assessed, runs: Sequence[Run], estimates: dict[str, Estimate], groups: dict[str, dict[str, Estimate]],
    bands: Bands | None, log: SearchLog, ahead: float | None,
) -> dict[str, RunScore]:  # fmt: skip
    problem, rig = assessed.best.problem, assessed.best.problem.rig
    fitted = [run for run in runs if run.role == "fit"]
    if ahead not in assessed.scores:
        assessed.scores[ahead] = _fitted_scores(assessed.best, fitted, ahead)
    scores = dict(assessed.scores[ahead])
    values = {n: e.value for n, e in estimates.items()}
    known = {label: {n: e.value for n, e in group.items()} for label, group in groups.items()}
    others = [r for r in runs if r.role != "fit"]
    pace = min(t.period for t in problem.tracks)
    for label, predicted in predict(values, rig, others, groups=known, bands=bands, progress=log.progress).items():
        held_out = next(run for run in others if run.label == label)
        scores[label] = replace(predicted, black_box=black_box(fitted, held_out, pace))
    return {run.label: scores[run.label] for run in runs}


def _fitted_scores(best: Optimum, fitted: Sequence[Run], ahead: float | None) -> dict[str, RunScore]:
    problem = best.problem
    thinned = any(t.y.shape[0] < t.run.t.size for t in problem.tracks)
    whole = formulate(problem.rig, fitted, thin=False) if thinned else problem
    return {
        run.label: replace(
            score_run(whole, i, best.x, ahead), guess=score_run(whole, i, whole.start, ahead).simulated
        )
        for i, run in enumerate(fitted)
    }  # fmt: skip


def _correlation(best: Optimum, identifiable: Identifiability) -> Array:
    """Correlation (names, names) of the shared numbers in the order of `identifiable.names`."""
    places = [i for i in best.shared if best.problem.unknowns[i].name in identifiable.names]
    if best.lost:
        return np.eye(len(places))
    return correlation(best.covariance[np.ix_(places, places)])


def _poles(best: Optimum, assumed: Sequence[Assumption]) -> dict[str, tuple[Pole, ...]]:
    values, names, C = shared_values(best)
    held = {frozenset(track.run.held) for track in best.problem.tracks}
    return poles(best.problem.rig, values, names, C, best.quantile, held, assumed)
