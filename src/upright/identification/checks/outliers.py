"""Did something else than the input move the rig? A hand, a bump, a drive that feeds an oscillation, a lost count.

Each run is restarted every half swing from its measured state and the fitted model says where it should be half a
swing later. What it misses there happened there, while the misfit of a free run lives on until the swing has died.
A stretch that is missed far more than the other runs are is no fault of the model, since that errs alike in all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.checks.spikes import without_spikes
from upright.identification.model.fit import Fit
from upright.identification.model.rig import Rig
from upright.identification.model.runs import Run
from upright.identification.problem.residuals import formulate
from upright.signals.smoothing import dominant_period
from upright.signals.stretches import stretches

Array = NDArray[np.float64]

FAR = 4.0
"""A stretch is missed far more than the others when by this factor over their upper quartile, and"""

LEAST = 0.05
"""by this share of how much the signal varies over the runs.

Measured with it: no alarm on 138 clean swings of random pendulums, half of them with drag that the model lacked; 40 of
70 pushes of 0.8 to 2 rad/s in swings from 0.5 to 2.6 rad found. With 0.04 it is 2 alarms and 43 pushes.
"""

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

    `constant` (W,) says where the commands do not change, `quantum` (outputs,) the sensors' resolution.
    """

    run: Run
    start: Array
    stop: Array
    missed: Array
    moved: Array
    constant: NDArray[np.bool_]
    quantum: Array


def outliers(fit: Fit, rig: Rig, runs: Sequence[Run]) -> tuple[Outlier, ...]:
    """Stretches of the runs that the fitted model does not explain although it explains the others.

    Parameters
    ----------
    fit : Fit
        The model; `rig` is what it was asked about.
    runs : sequence of Run
        Those that were fitted and any others of the same rig. A run under a loop is only searched for spikes, since
        what its law remembers is not in the log.
    """
    found: list[Outlier] = []
    seen: list[Stretches] = []
    known = rig.with_values({n: e.value for n, e in fit.estimates.items()})
    for run in runs:
        clean, spikes = without_spikes(run)
        if spikes:
            found.append(_spiky(run, spikes))
        stretches = None if run.loop is not None else half_swings(known, clean, _own(fit, run))
        if stretches is not None:
            seen.append(stretches)
    spread = _spread([s.run for s in seen])
    for s in seen:
        found += _strange(s, [o for o in seen if o is not s] or [s], spread)
    return tuple(sorted(found, key=lambda o: ([r.label for r in runs].index(o.run), o.start)))


def half_swings(known: Rig, run: Run, own: Mapping[str, float]) -> Stretches | None:
    """A run restarted every half swing; `own` are its own numbers by name. None when it is too short for that."""
    free = [k for k, c in enumerate(run.measured) if c not in run.held]
    duration = float(run.t[-1] - run.t[0])
    # of the speed, since a step that is held for long looks like one slow swing
    seconds = min(dominant_period(np.gradient(run.y[:, k], run.period), run.period) / 2 for k in free)
    seconds = min(seconds, duration / 8)
    samples = round(seconds / run.period)
    if samples < 4:
        return None
    stretches = _restarted(known, run, own, seconds, free)
    # what is left at the end is less than a half swing: another that ends there, begun inside the last one
    tail = _restarted(known, cut(run, run.t.size - 1 - 2 * samples, run.t.size), own, seconds, free)
    if tail.stop[-1] > stretches.stop[-1] + run.period / 2:
        joined = {n: np.concatenate([getattr(stretches, n), getattr(tail, n)[-1:]]) for n in PER_STRETCH}
        stretches = replace(stretches, **joined)
    return stretches


def _restarted(known: Rig, run: Run, own: Mapping[str, float], seconds: float, free: Sequence[int]) -> Stretches:
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
        constant=np.all(u == u[:1], axis=(0, 2)), quantum=np.array([run.quanta[k] for k in free]),
    )  # fmt: skip


PER_STRETCH = ("start", "stop", "missed", "moved", "constant")
"""What `Stretches` has one of for every half swing."""


def _own(fit: Fit, run: Run) -> dict[str, float]:
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


def _usual(others: Sequence[Stretches], c: str, spread: float) -> float:
    """Upper quartile of what others miss while they move."""
    missed = [
        s.missed[s.moved[:, k] > STILL * spread, k]
        for s in others
        for k, name in enumerate(s.run.measured)
        if name == c
    ]
    values = np.concatenate([np.zeros(0), *missed])
    return float(np.quantile(values, 0.75)) if values.size else 0.0


def _strange(s: Stretches, others: Sequence[Stretches], spread: Mapping[str, float]) -> list[Outlier]:
    """Stretches of one run that are missed far more than those of the others."""
    far = np.zeros(s.start.size, dtype=bool)
    times = np.zeros(s.start.size)
    for k, c in enumerate(s.run.measured):
        usual = max(_usual(others, c, spread[c]), 1e-3 * spread[c])
        far |= s.missed[:, k] > max(FAR * usual, LEAST * spread[c], 5 * s.quantum[k])
        times = np.maximum(times, s.missed[:, k] / usual)
    found: list[Outlier] = []
    for first, last in stretches(far, gap=2):
        here = slice(first, last + 1)
        size = np.where(np.isfinite(times[here]), times[here], 0.0).max()
        told = f"missed {size:.0f} times as much as the other stretches"
        lasting, grown = _lasts(s, first, last)
        if lasting:
            reason, told = SELF_EXCITED, f"{grown}; {told}"
        elif np.count_nonzero(far[here]) >= GROWS:
            reason = UNEXPLAINED
        elif not np.any(far[here] & s.constant[here]):
            continue  # the command changed, so that the model of the drive may be what errs
        elif first < 2 or last >= s.start.size - 2:
            reason = TOUCHED.format("start" if first < 2 else "end")
        else:
            reason = BUMPED
        found.append(Outlier(run=s.run.label, start=float(s.start[first]), stop=float(s.stop[last]), reason=reason,
                             evidence=told))  # fmt: skip
    return found


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


def _spiky(run: Run, spikes: Sequence[tuple[float, str]]) -> Outlier:
    """Single samples that jump away and back."""
    when = [t for t, _ in spikes]
    some = ", ".join(f"{t:.4g} s" for t in when[:5]) + (" and others" if len(when) > 5 else "")
    return Outlier(
        run=run.label, start=min(when), stop=max(when), reason=SPIKES,
        evidence=f"{', '.join(sorted({c for _, c in spikes}))} at {some}",
    )  # fmt: skip


def cut(run: Run, first: int, last: int) -> Run:
    """Samples `first` to `last` of a run, called so; states known at its first sample are not those of a later one."""
    if (first, last) == (0, run.t.size):
        return run
    held = {c: v[first:last] if isinstance(v, np.ndarray) else v for c, v in run.held.items()}
    span = f"{run.t[first]:.3g} to {run.t[last - 1]:.3g} s"
    return replace(
        run, label=f"{run.label}, {span}", t=run.t[first:last], u=run.u[first:last], y=run.y[first:last], held=held,
        initial=run.initial if first == 0 else {}, source=f"{run.source}; cut to {span}",
    )  # fmt: skip
