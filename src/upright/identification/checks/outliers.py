"""Stretches of a run that something else than the input moved: found, named, and left out of a second fit.

A hand, a bump, a drive that feeds an oscillation, a lost count. Each run is restarted every half swing from its
measured state and the fitted model says where it should be half a swing later. What it misses there happened there,
while the misfit of a free run lives on until the swing has died. A stretch that is missed far more than the other runs
are is no fault of the model, since that errs alike in all.

Both answers are reported: what the numbers are without such a stretch, and what they would have been with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.scoring import predict
from upright.identification.model.fit import Fit
from upright.identification.model.grey_box import GreyBox
from upright.identification.model.runs import Run
from upright.identification.problem.residuals import formulate
from upright.signals.smoothing import dominant_period
from upright.signals.spikes import spikes, without
from upright.signals.stretches import stretches
from upright.workers import share

Array = NDArray[np.float64]


def without_spikes(run: Run) -> tuple[Run, list[tuple[float, str]]]:
    """The run with its spikes replaced by what stands beside them, and when they were in which coordinate."""
    y = run.y.copy()
    places: list[tuple[float, str]] = []
    for k, c in enumerate(run.measured):
        at = spikes(run.y[:, k], run.quanta[k])
        y[:, k] = without(run.y[:, k], at)
        places += [(float(t), c) for t in run.t[at]]
    return (replace(run, y=y) if places else run), places


FAR = 4.0
"""A stretch is missed far more than the others when by this factor over their upper quartile, and"""

LEAST = 0.05
"""by this share of how much the signal varies over the runs.

Measured with it: no alarm on 138 clean swings of random pendulums, half of them with drag that the model lacked; 40 of
70 pushes of 0.8 to 2 rad/s in swings from 0.5 to 2.6 rad found. With 0.04 it is 2 alarms and 43 pushes.
"""

MOST = 99
"""How many times more a stretch is missed is reported up to here; beyond, what the others miss is next to nothing."""

STILL = 0.03
"""A stretch that varies by less than this share says nothing about how well motion is predicted."""

GROWS = 4
"""So many half swings in a row are no single push."""


@dataclass(frozen=True, kw_only=True)
class Outlier:
    """A stretch of a run, `start` to `stop` seconds of its own time, that the model does not explain, and why."""

    run: str
    start: float
    stop: float
    reason: str
    evidence: str

    @property
    def sentence(self) -> str:
        """What to tell."""
        return f"{self.run}, {self.start:.3g} to {self.stop:.3g} s: {self.reason} ({self.evidence})."


@dataclass(frozen=True, kw_only=True)
class Stretches:
    """Half swings of one run: when they begin and end (W,), by how much each signal is missed and moves (W, outputs).

    `constant` (W,) says where the commands do not change, `resolution` (outputs,) the sensors' resolution.
    """

    run: Run
    start: Array
    stop: Array
    missed: Array
    moved: Array
    constant: NDArray[np.bool_]
    resolution: Array


def outliers(fit: Fit, rig: GreyBox, runs: Sequence[Run]) -> tuple[Outlier, ...]:
    """Stretches of the runs that the fitted model does not explain although it explains the others.

    Parameters
    ----------
    fit : Fit
        The model; `rig` is the requested one.
    runs : sequence of Run
        Those that were fitted and any others of the same rig. A run under a loop is only searched for spikes, since
        what its law remembers is not in the log; so is a predicted one with numbers of its own, since those are not in
        the fit.
    """
    known = rig.with_values({n: e.value for n, e in fit.estimates.items()})

    def searched(run: Run) -> tuple[list[tuple[float, str]], Stretches | None]:
        clean, jumped = without_spikes(run)
        own = _estimated_for(fit, run)
        missing = {*run.unknown, *run.shared} - {"initial", *own}
        blind = run.loop is not None or (run.role != "fit" and missing)
        return jumped, None if blind else half_swings(known, clean, own)

    each = list(share(searched, runs))
    out = [_spiky(run, jumped) for run, (jumped, _) in zip(runs, each, strict=True) if jumped]
    stretches = [halves for _, halves in each if halves is not None]
    spread = _spread([s.run for s in stretches])
    for s in stretches:
        out += _strange(s, _judges(s, stretches), spread)
    return tuple(sorted(out, key=lambda o: ([r.label for r in runs].index(o.run), o.start)))


def half_swings(known: GreyBox, run: Run, own: Mapping[str, float]) -> Stretches | None:
    """A run restarted every half swing; `own` are its own numbers by name. None when it is too short for that."""
    free = run.free
    duration = float(run.t[-1] - run.t[0])
    # of the speed, since a step that is held for long looks like one slow swing
    seconds = min(dominant_period(np.gradient(run.y[:, k], run.period), run.period) / 2 for k in free)
    seconds = min(seconds, duration / 8)
    samples = round(seconds / run.period)
    if samples < 4:
        return None
    halves = _restarted(known, run, own, seconds, free)
    # what is left at the end is less than a half swing: another that ends there, begun inside the last one
    tail = _restarted(known, part_of_run(run, run.t.size - 1 - 2 * samples, run.t.size), own, seconds, free)
    if tail.stop[-1] > halves.stop[-1] + run.period / 2:
        joined = {n: np.concatenate([getattr(halves, n), getattr(tail, n)[-1:]]) for n in PER_STRETCH}
        halves = replace(halves, **joined)
    return halves


def _restarted(known: GreyBox, run: Run, own: Mapping[str, float], seconds: float, free: Sequence[int]) -> Stretches:
    """A run restarted every so many seconds, its coordinates `free`."""
    problem = formulate(known, [replace(run, horizon=seconds, restart="smooth", score_from=0.0)], thin=False)
    x = np.array([u.coordinate(own.get(u.name, u.value)) for u in problem.unknowns])
    track = problem.tracks[0]
    # started where it suits the stretch, as far as the measurement leaves that open: near upright a slip of a
    # thousandth is no bump
    shift = problem.restart(0, x).shift if track.uncertain.size else None
    y = problem.simulate(0, x[:, None], track.length, shift)[:, :, free, 0]
    measured = track.targets(track.length)[:, :, free]
    with np.errstate(over="ignore", invalid="ignore"):
        missed = np.sqrt(np.mean((y - measured) ** 2, axis=0))
    start = run.t[track.restarts]
    u = track.u[track.restarts[None, :] + np.arange(track.length - 1)[:, None]]
    return Stretches(
        run=replace(run, y=run.y[:, free], measured=tuple(run.measured[k] for k in free)),
        start=start, stop=start + (track.length - 1) * track.dt,
        missed=np.where(np.isfinite(missed), missed, math.inf), moved=np.ptp(measured, axis=0),
        constant=np.all(u == u[:1], axis=(0, 2)), resolution=np.array([run.quanta[k] for k in free]),
    )  # fmt: skip


PER_STRETCH = ("start", "stop", "missed", "moved", "constant")
"""What `Stretches` has one of for every half swing."""


def _estimated_for(fit: Fit, run: Run) -> dict[str, float]:
    """What the fit found for this run alone, and for the groups it belongs to."""
    own = {n: e.value for n, e in fit.per_run.get(run.label, {}).items()}
    return own | {n: fit.groups[g][n].value for n, g in run.shared.items() if n in fit.groups.get(g, {})}


def _spread(runs: Sequence[Run]) -> dict[str, float]:
    """How much each coordinate varies, the median over the runs that measure it."""
    every: dict[str, list[float]] = {}
    for run in runs:
        for k, c in enumerate(run.measured):
            every.setdefault(c, []).append(float(np.std(run.y[:, k])))
    return {c: float(np.median(v)) for c, v in every.items()}


def _judges(s: Stretches, stretches: Sequence[Stretches]) -> list[Stretches]:
    """Runs that a run is held against: the others, and itself where it is alone.

    A fitted run is held against fitted ones: one that the model was never asked to explain may be missed for reasons of
    its own, or hardly for being small, and the only run that was fitted is what the model knows.
    """
    others = [o for o in stretches if o is not s and (s.run.role != "fit" or o.run.role == "fit")]
    return others or [s]


def _usual(s: Stretches, judges: Sequence[Stretches], c: str, spread: float) -> float:
    """Upper quartile of what a run's judges miss of a coordinate while it moves; its own where they tell nothing."""
    for group in (judges, [s]):
        missed = [
            o.missed[o.moved[:, k] > STILL * spread, k]
            for o in group
            for k, name in enumerate(o.run.measured)
            if name == c
        ]
        values = np.concatenate([np.zeros(0), *missed])
        if values.size:
            return float(np.quantile(values, 0.75))
    return 0.0


def _strange(s: Stretches, judges: Sequence[Stretches], spread: Mapping[str, float]) -> list[Outlier]:
    """Stretches of one run that are missed far more than those of the others."""
    far = np.zeros(s.start.size, dtype=bool)
    times = np.zeros(s.start.size)
    for k, c in enumerate(s.run.measured):
        usual = max(_usual(s, judges, c, spread[c]), 1e-3 * spread[c])
        far |= s.missed[:, k] > max(FAR * usual, LEAST * spread[c], 5 * s.resolution[k])
        times = np.maximum(times, s.missed[:, k] / usual)
    out: list[Outlier] = []
    for first, last in stretches(far, gap=2):
        here = slice(first, last + 1)
        size = float(times[here].max())
        evidence = f"missed {size:.2g} times as much as the other stretches"
        if not math.isfinite(size):
            evidence = "the simulation runs away there"
        elif size < FAR:  # far by the resolution or the signal's size alone
            evidence = "missed, and the other stretches are not"
        elif size > MOST:
            evidence = f"missed more than {MOST} times as much as the other stretches"
        lasting, grown = _lasts(s, first, last)
        if lasting:
            reason, evidence = SELF_EXCITED, f"{grown}; {evidence}"
        elif np.count_nonzero(far[here]) >= GROWS:
            reason = UNEXPLAINED
        elif not np.any(far[here] & s.constant[here]):
            continue  # the command changed, so that the model of the drive may be what errs
        elif first < 2 or last >= s.start.size - 2:
            reason = TOUCHED.format("start" if first < 2 else "end")
        else:
            reason = BUMPED
        out.append(Outlier(run=s.run.label, start=float(s.start[first]), stop=float(s.stop[last]), reason=reason,
                             evidence=evidence))  # fmt: skip
    return out


def _lasts(s: Stretches, first: int, last: int) -> tuple[bool, str]:
    """Whether a swing goes on undiminished between two half swings although the commands are constant; and how."""
    inside = [w for w in range(first, last) if s.constant[w] and s.constant[w + 1]]
    if len(inside) < GROWS:
        return False, ""
    # two half swings one after another hold both turning points, wherever the first began
    swing = np.maximum(s.moved[:-1], s.moved[1:])[inside].max(axis=1)
    quarter = max(len(inside) // 4, 1)
    before, after = float(np.mean(swing[:quarter])), float(np.mean(swing[-quarter:]))
    return after > 0.9 * before, f"swings of {before:.3g} became swings of {after:.3g}"


SPIKES = "single samples jump away and back, as lost counts do"
SELF_EXCITED = "self-excited, it swings on under a constant command where the model says that it must die down"
TOUCHED = "touched at the {}, something else than the input moved it"
BUMPED = "bumped, something else than the input moved it"
UNEXPLAINED = "not explained by the model that explains the rest"


def _spiky(run: Run, jumped: Sequence[tuple[float, str]]) -> Outlier:
    """Single samples that jump away and back."""
    when = [t for t, _ in jumped]
    some = ", ".join(f"{t:.4g} s" for t in when[:5]) + (" and others" if len(when) > 5 else "")
    return Outlier(
        run=run.label, start=min(when), stop=max(when), reason=SPIKES,
        evidence=f"{', '.join(sorted({c for _, c in jumped}))} at {some}",
    )  # fmt: skip


def part_of_run(run: Run, first: int, last: int) -> Run:
    """Samples `first` to `last` of a run, called so; states known at its first sample are not those of a later one."""
    if (first, last) == (0, run.t.size):
        return run
    span = f"{run.t[first]:.3g} to {run.t[last - 1]:.3g} s"
    return replace(
        run.samples(slice(first, last)), label=f"{run.label}, {span}", initial=run.initial if first == 0 else {},
        source=f"{run.source}; cut to {span}",
    )  # fmt: skip


WORTH = 1 / 3
"""What is left of a run is fitted when it is this share of it, and"""

LEAST_SAMPLES = 50
"""so many samples, and"""

MOVES = 0.1
"""when one of its signals still spans this share of what it spans in the whole run."""


ASTRAY = 3.0
"""Percent by which a run may be explained worse once outliers of others are out: more than they could have bent it."""

STAYS = "Without that stretch the other runs were explained worse, so the fit keeps it."


@dataclass(frozen=True, kw_only=True)
class ProvisionalFit:
    """Where a search ended: values and scores of its `fit`, enough to see outliers by; `whole` adds all the rest.

    Intervals, predictions and the verdict take as long as the search, and only one of several candidates needs them.
    `interrupted` is the fit that an interrupted search gives.
    """

    fit: Fit
    whole: Callable[[], Fit]
    interrupted: Callable[[], Fit]


def refit_without_outliers(
    first: ProvisionalFit, rig: GreyBox, runs: Sequence[Run], again: Callable[[Sequence[Run], Fit], ProvisionalFit]
) -> Fit:
    """The fit, or `again` without what the first one found strange; at most twice, as outliers hide each other.

    `again` begins at the fit before. Reasons are those that the last model gives: the first one was bent by what it had
    to explain.
    """
    strange = outliers(first.fit, rig, runs)
    last, retained = first, list(runs)
    for _ in range(2):
        left = without_outliers(runs, strange)
        if not any(r.role == "fit" for r in left) or _same(left, retained):
            break
        retained, new = left, again(left, last.fit)
        if explains_worse(new.fit, first.fit):
            fit = first.whole()
            sentences = tuple(f"Outlier: {o.sentence}" for o in strange)
            return replace(fit, warnings=(*fit.warnings, *sentences, STAYS))
        last = new
        if last.fit.interrupted:
            break
        strange = outliers(last.fit, rig, runs) or strange
    fit = last.whole()
    if not strange:
        return fit
    sentences = [f"Outlier: {o.sentence}" for o in strange]
    if last is first:
        return replace(fit, warnings=(*fit.warnings, *sentences))
    absent = [r for r in runs if r.label not in fit.runs and (r.role == "fit" or not fit.interrupted)]
    missing = [replace(r, role="predict") for r in absent]
    scores = {**fit.runs, **predict(fit, rig, missing)}
    known = [r.label for r in runs]
    order = sorted(scores, key=lambda label: next((i for i, k in enumerate(known) if label.startswith(k)), len(known)))
    names = ", ".join(dict.fromkeys(o.run for o in strange))
    return replace(
        fit,
        runs={label: scores[label] for label in order},
        warnings=(*fit.warnings, *sentences, _compared(first.fit, fit)),
        verdict=f"{fit.verdict} Left out of the fit as outliers, or in part: {names}; see the warnings.",
        seconds=first.fit.seconds + fit.seconds,
        evaluations=first.fit.evaluations + fit.evaluations,
    )


def explains_worse(new: Fit, old: Fit) -> bool:
    """Whether runs that both were fitted to are explained worse by the new fit: its search then went astray."""
    both = [label for label, s in new.runs.items() if s.role == "fit" and label in old.runs]
    return any(
        percent < old.runs[label].fit_percent[signal] - ASTRAY
        for label in both
        for signal, percent in new.runs[label].fit_percent.items()
    )


def _same(a: Sequence[Run], b: Sequence[Run]) -> bool:
    return len(a) == len(b) and all(r.label == s.label and r.y is s.y for r, s in zip(a, b, strict=True))


def _compared(before: Fit, after: Fit) -> str:
    """What the outliers would have done to the numbers."""
    moved = [
        f"{n} {before.estimates[n].value:.4g} instead of {e.value:.4g} {e.unit}"
        for n, e in after.estimates.items()
        if n in before.estimates and not e.interval[0] <= before.estimates[n].value <= e.interval[1]
    ]
    if not moved:
        return "With the outliers in, every number stays within its interval."
    return f"With the outliers in it would have been {', '.join(moved)}."


def without_outliers(runs: Sequence[Run], strange: Sequence[Outlier]) -> list[Run]:
    """The runs with spikes taken out, and fitted ones cut into what stands before and after each stretch.

    What is left of a run is dropped when it is shorter than a third of it or than 50 samples, or hardly moves. A run
    that excites itself is dropped whole: it does so before one can see it.
    """
    retained: list[Run] = []
    for run in runs:
        spans = sorted((o.start, o.stop) for o in strange if o.run == run.label and o.reason != SPIKES)
        spiky = any(o.run == run.label and o.reason == SPIKES for o in strange)
        clean = without_spikes(run)[0] if spiky else run
        if run.role != "fit" or not spans:
            retained.append(clean)
            continue
        if any(o.run == run.label and o.reason == SELF_EXCITED for o in strange):
            continue
        edges = [float(run.t[0]) - 1, *(e for span in spans for e in span), float(run.t[-1]) + 1]
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            part = np.flatnonzero((run.t > a) & (run.t < b))
            moves = part.size > 0 and np.any(np.ptp(clean.y[part], axis=0) > MOVES * np.ptp(clean.y, axis=0))
            if moves and part.size >= max(LEAST_SAMPLES, run.t.size * WORTH):
                retained.append(part_of_run(clean, int(part[0]), int(part[-1]) + 1))
    return retained
