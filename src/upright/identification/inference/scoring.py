"""Scores of runs, the fit percent of each signal, and the verdict that follows: is the model to be trusted?"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.identification.inference.ceiling import ceilings, judged
from upright.identification.inference.covariance import assess
from upright.identification.inference.intervals import run_estimates
from upright.identification.inference.unseen.bands import banded
from upright.identification.model.bands import Bands
from upright.identification.model.fit import Fit, Offer, RunScore
from upright.identification.model.grey_box import GreyBox
from upright.identification.model.runs import LEAST_RUN, Run
from upright.identification.problem.residuals import Problem, formulate
from upright.identification.problem.simulated import with_noise
from upright.identification.problem.tracks import FilterPlan, Track
from upright.identification.problem.trips import with_trip_guesses
from upright.identification.search.descent import SearchLog, descend_progressively
from upright.identification.search.strategy import better, settle_weights
from upright.progress import Progress, silent

Array = NDArray[np.float64]


def fit_percent(y: ArrayLike, simulated: ArrayLike) -> float:
    """``100 (1 - |y - yhat| / |y - mean y|)``: 100 is exact, 0 no better than the mean, never below -1000.

    A signal that does not move scores 100 when it is met exactly and 0 otherwise.
    """
    y, simulated = np.asarray(y, dtype=np.float64), np.asarray(simulated, dtype=np.float64)
    with np.errstate(over="ignore", invalid="ignore"):  # a motion that ran away misses by more than a number holds
        moved, missed = float(np.linalg.norm(y - y.mean())), float(np.linalg.norm(y - simulated))
    if moved == 0:
        return 100.0 if missed == 0 else 0.0
    score = 100 * (1 - missed / moved)
    return max(-1000.0, score) if math.isfinite(score) else -1000.0


def score_run(problem: Problem, index: int, x: Array, seconds: float | None = None) -> RunScore:
    """Score of one run for coordinates `x`; windows restarted from measured states are laid end to end.

    One that a filter predicts is scored so many `seconds` ahead, as far as runs are judged when omitted.
    """
    track = problem.tracks[index]
    run = track.run
    if track.ahead:
        here = judged(problem, x) if seconds is None else None
        return _score_ahead(problem, index, x, track.ahead, here.seconds if here is not None else seconds or track.dt)
    y = problem.simulate(index, x[:, None], track.length)[..., 0]
    if not track.windowed:
        t, measured, simulated = run.t[:: round(track.dt / run.period)], track.y, y[:, 0, :]
    else:
        # every sample once: a window's last sample is the next one's first and belongs to the prediction
        rows = (track.restarts[None, :] + np.arange(track.length)[:, None])[1:]
        measured = np.moveaxis(track.y[rows], 1, 0).reshape(-1, len(run.measured))
        simulated = np.moveaxis(y[1:], 1, 0).reshape(-1, len(run.measured))
        t = run.t[0] + track.dt * rows.T.reshape(-1)
    skip = int(np.searchsorted(t, run.t[0] + run.score_from - 1e-9)) if run.score_from > 0 else 0
    return RunScore(
        role=run.role, fit_percent=_percents(run, measured[skip:], simulated[skip:]),
        horizon=next(iter(run.horizons), None), t=t, y=measured, simulated=simulated, measured=run.measured,
        score_from=run.score_from,
        naive=_percents(run, measured[skip:], held_speed(track)[skip:]) if track.windowed else {},
    )  # fmt: skip


def _score_ahead(problem: Problem, index: int, x: Array, plan: FilterPlan, seconds: float) -> RunScore:
    """Score of a run that a filter predicts: predicted exactly so far ahead, restart by restart.

    Beside it stand the requested horizons, each with what the start state allows.
    """
    requested = problem.tracks[index]
    run, weight = requested.run, plan.weight[:, None, None]
    y = problem.simulate(index, x[:, None], requested.length)[..., 0] / weight
    targets = requested.targets(requested.length) / weight
    percents = {h: _percents(run, targets[i], y[i]) for i, h in enumerate(run.horizons)}
    near = problem.ahead(seconds)
    track = near.tracks[index]
    predicted, measured = near.simulate(index, x[:, None], 1)[0, ..., 0], track.targets(1)[0]
    position, speed = problem.filtered(index, x)
    samples = round(seconds / track.dt)
    percents[seconds] = _percents(run, measured, predicted)
    horizons = sorted(percents)
    allowed = ceilings(problem, index, x, [max(1, round(h / track.dt)) for h in horizons])
    limits = [{run.measured[k]: float(row[k]) for k in run.free} for row in allowed]
    return RunScore(
        role=run.role, fit_percent=percents[seconds], horizon=seconds, t=run.t[track.restarts + samples], y=measured,
        simulated=predicted, measured=run.measured,
        naive=_percents(run, measured, position + speed * (track.dt * samples)),
        ahead={h: percents[h] for h in horizons},
        ceiling=dict(zip(horizons, limits, strict=True)),
    )  # fmt: skip


def _percents(run: Run, y: Array, simulated: Array) -> dict[str, float]:
    """Fit percent of every signal that moved freely."""
    return {run.measured[k]: fit_percent(y[:, k], simulated[:, k]) for k in run.free}


def held_speed(track: Track) -> Array:
    """Outputs (samples, outputs) of windows laid end to end, if every measured speed lasted: a prediction by no model.

    It starts from the same measured states as the model does.
    """
    q, v = (track.x0[:, np.add(track.columns, k)] for k in (0, 1))
    ahead = track.dt * np.arange(1, track.length)
    return (q[:, None] + v[:, None] * ahead[:, None]).reshape(-1, len(track.columns))


def predict(
    fitted: Fit | Mapping[str, float],
    rig: GreyBox,
    runs: Sequence[Run],
    *,
    groups: Mapping[str, Mapping[str, float]] | None = None,
    bands: Bands | None = None,
    progress: Progress = silent,
) -> dict[str, RunScore]:
    """Scores of runs that a fitted model has not seen, by label.

    Parameters
    ----------
    fitted : Fit or mapping of str to float
        The model, or its parameters by name.
    rig : GreyBox
        Where parameters that were not fitted come from.
    runs : sequence of Run
        What differs from run to run (initial state, declared offsets and factors) is estimated from the run itself:
        from what comes before `score_from` when that is set, from all of it otherwise; the scores say what
        (`RunScore.adapted`). The parameters stay as they are, and so does what a group of runs shares when the group
        was fitted.
    groups : mapping, optional
        What groups of runs share, by label and name; those of a `Fit` when omitted.
    bands : Bands, optional
        What the fit promises; that of a `Fit` when omitted. Without it no band is drawn.
    progress : callable, optional
        Called with the stage, its cost and number of simulations, and the share completed.

    Raises
    ------
    KeyboardInterrupt
        When somebody interrupts: half a prediction is none.
    """
    values = {n: e.value for n, e in fitted.estimates.items()} if isinstance(fitted, Fit) else dict(fitted)
    if groups is None and isinstance(fitted, Fit):
        groups = {label: {n: e.value for n, e in group.items()} for label, group in fitted.groups.items()}
    if bands is None and isinstance(fitted, Fit):
        bands = fitted.bands
    known = with_noise(rig, runs).with_values(values)
    return {run.label: _predict(known, run, groups or {}, bands, progress) for run in runs}


def _promised(run: Run, bands: Bands | None) -> float | None:
    """How far ahead a filtered run is judged: as far as the fitted ones were, if it looks as far."""
    parts = () if bands is None or not run.filtered else (s for spreads in bands.spreads.values() for s in spreads)
    return max((s.horizon for s in parts if 0 < s.horizon <= run.horizons[-1]), default=None)


def _either_side(problem: Problem) -> list[Array]:
    """Starts with a gain of the run's own that is somewhat smaller, and larger, than is typical.

    A shaft that swings gives the cost of a free run a valley for every swing that a gain a few percent off adds.
    """
    starts: list[Array] = []
    for i, u in enumerate(problem.unknowns):
        if u.prior is None or u.name != "gain" or problem.tracks[0].windowed:
            continue
        for side in (-1.0, 1.0):
            x = problem.start
            x[i] += side * min(u.prior[1], 0.1)
            starts.append(np.clip(x, problem.lower, problem.upper))
    return starts


SHORT, MENDED = 90.0, 2 / 3
"""Fit percent below which a prediction falls short, and the share of what it missed that a mended one may miss."""

FACTORS = ("friction", "gain")


def _predict(
    rig: GreyBox, run: Run, groups: Mapping[str, Mapping[str, float]], bands: Bands | None, progress: Progress
) -> RunScore:
    """Score of one run, with its band, and the factor of its own that would mend it where it falls short."""
    run = with_trip_guesses(rig, run)
    seconds = _promised(run, bands)
    plain, problem, x = _foresee(rig, run, groups, progress, seconds)
    if bands is not None:
        plain = banded(plain, bands, rig, run, groups, problem, x)
    missed = 100 - min(plain.fit_percent.values(), default=100.0)
    if missed <= 100 - SHORT:
        return plain
    offers: list[tuple[float, Offer]] = []
    for name in FACTORS:
        if name in (*run.unknown, *run.shared) or (name == "gain" and not run.u.any()):
            continue
        wider = replace(run, unknown=(*run.unknown, name))
        with_it, problem, x = _foresee(rig, wider, groups, progress, seconds)
        left = 100 - min(with_it.fit_percent.values())
        if left <= MENDED * missed:
            best = assess(problem, x)
            if best.lost:
                continue
            factor = run_estimates(best)[0][run.label][name]
            offers.append((left, Offer(name=name, factor=factor, fit_percent=with_it.fit_percent)))
    return replace(plain, offer=min(offers, key=lambda o: o[0])[1]) if offers else plain


def _foresee(
    rig: GreyBox, run: Run, groups: Mapping[str, Mapping[str, float]], progress: Progress, seconds: float | None
) -> tuple[RunScore, Problem, Array]:
    """Score of one run, and the problem and the coordinates of what was estimated from the run itself.

    One that a filter predicts is scored so many `seconds` ahead, if that is given.
    """
    before = replace(run, score_from=0.0)
    upto = run.score_from if run.score_from > 0 else math.inf
    if run.score_from > 2 * run.period and (run.horizon is not None or run.t.size >= LEAST_RUN):
        before, upto = before.first_part(run.score_from / (run.period * run.t.size)), math.inf
    problem = formulate(rig, [before], stated=groups)
    x, log = problem.start, SearchLog(progress=progress)
    if x.size:
        # how a swing begins is felt at once, and later a speed that is a little off has thrown it out of phase; what a
        # drive spins up from rest is felt late
        early = min(track.period for track in problem.tracks) / 4
        end = descend_progressively(problem, x, log, upto=upto)
        for other in (x, *_either_side(problem)):
            if not end.interrupted:
                end = better(end, descend_progressively(problem, other, log, horizon=early, upto=upto))
        if end.interrupted:
            raise KeyboardInterrupt
        if math.isinf(upto):  # else what is scored must not weigh
            end = settle_weights(problem, end)
        x = end.x
    whole = formulate(rig, [run], thin=False, stated=groups)
    sought = [u.name for u in problem.unknowns if u.lower < u.upper]
    adapted = dict.fromkeys("initial" if name.startswith("initial.") else name for name in sought)
    return replace(score_run(whole, 0, x, seconds), adapted=tuple(adapted)), problem, x
