"""Runs made ready for the solver: data on a uniform grid, weights, windows and the states at which they start.

A run that a filter predicts gets a plan: where the plant stands, what the sensors see, how far ahead it looks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.identification.model.grey_box import GreyBox
from upright.identification.model.runs import LEAST_RUN, Run
from upright.identification.problem.restarts import smoothed_variance
from upright.signals.smoothing import (
    State,
    acceleration_width,
    dominant_period,
    end_errors,
    savitzky_golay,
    scatter,
    smoothing_width,
)
from upright.simulation import Held

Array = NDArray[np.float64]

STEPS_PER_PERIOD = 120
"""Steps a free run is simulated with per period: RK4 is then off by less than 1e-6 per period."""


BLOCKS, FOLDS = 9, 3
"""Blocks of a run, of which every third judges a model fitted to the others, in turn."""

ALIKE = 0.98
"""Correlation of two outputs from which on their difference, a tenth of the motion, would be drowned."""

WARM = 4.0
"""Longest horizons that a filter follows the record before anything is predicted from its state.

What it would learn from an older past matters for the slow modes only, which the horizons hardly feel.
"""

GROWTH = 1.5
"""Power of the horizon with which the position of a free mass strays under a white random force.

Residuals are divided by it, so that no horizon outvotes another: unweighted, the longest has nearly all of the cost,
and a pole that is too slow makes it smaller, because it amplifies the error of the state less.
"""

DRIFT = 0.003
"""Share of a command by which its drift is uncertain when a filter begins.

A cable or a bearing pulls a little differently from second to second; what lasts is `input_offset`.
"""


@dataclass(frozen=True, kw_only=True)
class FilterPlan:
    """How a run is predicted by a filter, so many `samples` ahead, fewest first.

    The filter follows `warm` samples before its state is used. The plant stands at the `equilibrium` (states,) nearest
    to the record, at its mean where that leaves a choice. Variances are those of a measurement, `sensor` (outputs,),
    and of the states and drifts of the commands that a filter begins with, `initial` (states,) and `drift` (inputs,). A
    residual at each horizon counts by `weight` (H,).
    """

    samples: tuple[int, ...]
    warm: int
    equilibrium: Array
    sensor: Array
    initial: Array
    drift: Array
    weight: Array


@dataclass(frozen=True, kw_only=True)
class Track:
    """A run made ready: `y` (N, outputs) and `u` (N, inputs) on a grid of `dt`, windows of `length` samples.

    `columns` are the measured coordinates' places in the state, `weights` (outputs,) one over their spread (0 for a
    held one), `first` the first sample that counts of a free run. `restarts` (W,) are the first samples of the windows
    and `x0` (W, states) the measured states there, whose `variance` (W, states) counts in variances of a weighted
    residual: 0 where they are known, or sought with the rest. A run predicted by a filter has `ahead`: what then counts
    as its samples are its horizons. `missed` (outputs,) is how much the last fit missed of each component that outputs
    which move alike are weighed by, beside the others; all alike when omitted. `kept` (samples,) are the samples of a
    free run that count; all when omitted.
    """

    run: Run
    dt: float
    y: Array
    u: Array
    columns: tuple[int, ...]
    weights: Array
    restarts: NDArray[np.int64]
    length: int
    x0: Array
    period: float
    start: State
    held: Mapping[str, Held]
    first: int
    variance: Array
    ahead: FilterPlan | None = None
    missed: Array | None = None
    retained: NDArray[np.bool_] | None = None

    @property
    def windowed(self) -> bool:
        """Whether the run is restarted from measured states."""
        return self.run.horizon is not None

    @property
    def plain(self) -> bool:
        """Whether the run is free, all its samples count, and each of its outputs stands for itself."""
        whole = not self.windowed and not self.ahead and not self.first and self.retained is None
        return whole and self.principal is None and bool(self.weights.all())

    @property
    def uncertain(self) -> NDArray[np.int64]:
        """Places of the states that restarts know from a measurement only."""
        if not self.variance.any():
            return np.zeros(0, dtype=np.int64)
        return np.sort(np.concatenate([self.columns, np.add(self.columns, 1)])).astype(np.int64)

    @cached_property
    def principal(self) -> Array | None:
        """Weights (outputs, outputs) of errors whose outputs move nearly alike; None when each can stand for itself.

        Friction that is a little off carries two disks on one shaft astray together: their angles err by hundreds of
        counts, their twist by few. Scored one by one, the common error drowns what the twist says of the shaft. With
        the principal components of the motion each in units of its own spread both speak, as in generalized least
        squares (Aitken 1935) with errors taken proportional to the motion itself; what a first fit `missed` of each
        then takes the place of that assumption. A component's spread includes the rounding of the encoders, so that a
        difference nobody could see weighs nothing.
        """
        free = np.flatnonzero(self.weights)
        if free.size < 2:
            return None
        w = self.weights[free]
        z = (self.y[:, free] - self.y[:, free].mean(axis=0)) * w
        S = z.T @ z / len(z)
        d = np.sqrt(np.diag(S))
        if not d.all():  # an output that does not move stands for itself
            return None
        if np.abs(S / np.outer(d, d) - np.eye(free.size)).max() < ALIKE:
            return None
        power, V = np.linalg.eigh(S)
        resolution = np.array(self.run.quanta)[free] * w
        rounding = np.einsum("ij,i,ij->j", V, resolution**2, V)
        floor = 1e-12 * power[-1]
        W = np.diag(self.weights)
        W[np.ix_(free, free)] = (V / np.sqrt(np.maximum(power, floor) + rounding)).T * w
        return W if self.missed is None else W / self.missed[:, None]

    @cached_property
    def weighting(self) -> Array:
        """What errors (outputs,) are multiplied by from the left: (outputs, outputs)."""
        return np.diag(self.weights) if self.principal is None else self.principal

    @property
    def duration(self) -> float:
        """Seconds that one simulation spans."""
        return (self.ahead.samples[-1] if self.ahead else self.length - 1) * self.dt

    @property
    def spacing(self) -> float:
        """Seconds from one residual to the next."""
        return float(self.restarts[1] - self.restarts[0]) * self.dt if self.ahead else self.dt

    def predicting(self, seconds: float) -> Track:
        """The run with every sample predicted so many seconds ahead, and no other horizon."""
        assert self.ahead is not None
        plan = replace(self.ahead, samples=(max(1, round(seconds / self.dt)),), weight=np.ones(1))
        return replace(self, run=replace(self.run, horizon=seconds), ahead=plan, length=1)

    def within(self, horizon: float) -> int:
        """Samples that are simulated within `horizon` seconds, at least two; of horizons at least one."""
        if self.ahead:
            return max(1, sum(h * self.dt <= horizon * (1 + 1e-9) for h in self.ahead.samples))
        if horizon >= self.duration or self.windowed:
            return self.length
        return max(2, min(self.length, int(horizon / self.dt) + 1))

    def hidden(self, fold: int) -> tuple[NDArray[np.bool_], Track]:
        """Which samples, or windows, judge a model that was fitted to the others, and the run without them.

        Every `FOLDS`-th of `BLOCKS` blocks from number `fold` on, so that every regime of the run, driven or not, fast
        or slow, is on both sides. A short run judges nothing.
        """
        count = self.restarts.size if self.windowed else self.length
        judges = (np.arange(count) * BLOCKS // count) % FOLDS == fold
        if self.run.t.size < LEAST_RUN or not judges.any():
            return np.zeros(count, dtype=bool), self
        if not self.windowed:
            return judges, replace(self, retained=~judges)
        stay = ~judges
        return judges, replace(self, restarts=self.restarts[stay], x0=self.x0[stay], variance=self.variance[stay])

    def errors(self, y: Array) -> Array:
        """Weighted errors (samples, W, outputs) of simulated outputs, of a free run from the first that counts on."""
        skip = min(self.first, len(y) - 1)
        with np.errstate(over="ignore", invalid="ignore"):  # a motion that diverged shows by its NaN
            e = (y[skip:] - self.targets(len(y))[skip:]) @ self.weighting.T
        return e if self.retained is None else e * self.retained[skip : len(y), None, None]

    def flat(self, each: Array) -> Array:
        """Of samples (samples, W, ...) of every window, those of the run (N, ...), windows laid end to end.

        The first of a window is the last of the one before, and left out.
        """
        return np.moveaxis(each[1:], 1, 0).reshape(-1, *each.shape[2:]) if self.windowed else each[:, 0]

    def targets(self, samples: int) -> Array:
        """Measured outputs (samples, W, outputs) that windows cut to `samples` are compared with."""
        if self.ahead:
            rows = self.restarts[None, :] + np.array(self.ahead.samples[:samples])[:, None]
            return self.y[rows] * self.ahead.weight[:samples, None, None]
        rows = self.restarts[None, :] + np.arange(samples)[:, None]
        return self.y[rows]


def prepare(rig: GreyBox, run: Run, *, thin: bool) -> Track:
    """Make a run ready; `thin` takes every k-th sample of a run without input, as many as its period needs."""
    names = rig.plant.state_names()
    period_s, n = run.period, run.t.size
    columns = tuple(names.index(c) for c in run.measured)
    periods = [dominant_period(run.y[:, k], period_s) for k in run.free if np.ptp(run.y[:, k]) > 3 * run.quanta[k]]
    period = min(periods, default=n * period_s)

    stride = 1
    if thin and run.loop is None and run.horizon is None and not np.any(run.u != run.u[:1]):
        stride = max(1, min(int(period / STEPS_PER_PERIOD / period_s), n // 200))
    dt = period_s * stride
    length = (n - 1) // stride + 1
    restarts = np.zeros(1, dtype=np.int64)
    if len(run.horizons) > 1 and not run.filtered:
        raise BadInput(f"run '{run.label}' has several horizons, which needs restart 'kalman'; or give it one.")
    windowed = run.horizon is not None and not run.filtered
    if windowed:
        length = min(length, max(2, int(round(max(run.horizons) / dt)) + 1))
        # the last sample of a window is the first of the next, so that no sample is scored at its own restart only
        restarts = np.arange(0, n - length + 1, length - 1, dtype=np.int64)

    x, sizes, errors = np.zeros((n, len(names))), np.ones(len(names)), np.zeros(len(names))
    variance = np.zeros((restarts.size, len(names)))
    offsets = np.zeros(len(columns))
    for k, (c, column) in enumerate(zip(run.measured, columns, strict=True)):
        width = smoothing_width(run.y[:, k], period_s, period, run.quanta[k])
        motion = savitzky_golay(run.y[:, k], period_s, width, derivatives=1)
        x[:, column], x[:, column + 1] = motion.q, motion.v
        sizes[column], sizes[column + 1] = scatter(motion.q), scatter(motion.v)
        offsets[k] = np.std(run.y[:, k] - motion.q)
        errors[column : column + 2] = end_errors(run.y[:, k], motion.q, period_s, width)
        if c in run.held:
            sizes[column : column + 2] = 1.0
        elif windowed:
            variance[:, column : column + 2] = (
                smoothed_variance(n, width, period_s, restarts) * scatter(run.y[:, k]) ** 2
            )
    for name, value in run.initial.items():
        x[0, names.index(name)] = value
        variance[0, names.index(name)] = 0.0
    held: dict[str, Held] = {}
    for c, value in run.held.items():
        array = np.asarray(value, dtype=np.float64)
        i = names.index(c)
        if array.ndim == 0:
            x[:, i], x[:, i + 1] = float(array), 0.0
            held[c] = Held()
        else:
            # a hand moves at its own pace: the width follows from what counts and noise allow, not from the period
            # a low quartile of its steps, since resampling leaves parts of a count as well
            steps = np.abs(np.diff(array))
            count = float(np.percentile(steps[steps > 0], 25)) if np.any(steps) else 0.0
            width = acceleration_width(array, period_s, count)
            motion = savitzky_golay(array, period_s, width, order=3, derivatives=1)
            x[:, i], x[:, i + 1] = motion.q, motion.v
            held[c] = Held(q=motion.q[::stride])
    start, ahead = State(x=x[0].copy(), spread=sizes, error=errors), None
    if run.filtered:
        ahead, restarts = filter_plan(rig, run, dt, start, offsets)
        length, variance = len(ahead.samples), np.zeros((restarts.size, len(names)))
    weights = np.array([0.0 if c in run.held else 1.0 / scatter(run.y[:, k]) for k, c in enumerate(run.measured)])
    return Track(
        run=run,
        dt=dt,
        y=np.ascontiguousarray(run.y[::stride]),
        u=np.ascontiguousarray(run.u[::stride]),
        columns=columns,
        weights=weights,
        restarts=restarts,
        length=length,
        x0=x[::stride][restarts],
        period=period,
        start=start,
        held=held,
        first=0 if run.horizon is not None else int(np.ceil(run.score_from / dt)),
        variance=variance,
        ahead=ahead,
    )


def filter_plan(rig: GreyBox, run: Run, dt: float, start: State, noise: Array) -> tuple[FilterPlan, NDArray[np.int64]]:
    """How a run is predicted, and the samples (W,) from which; `noise` (outputs,) is what smoothing took off it.

    Raises
    ------
    BadInput
        When the run is no record of a plant about an equilibrium, or too short.
    """
    names = rig.plant.state_names()
    if run.loop is not None:
        raise BadInput(f"run '{run.label}' simulates its loop, so it is not filtered too; leave out loop or restart.")
    moved = [n for n, v in run.held.items() if np.ndim(v)]
    if moved:
        raise BadInput(f"run '{run.label}' holds {', '.join(moved)} in motion, which no filter here allows for.")
    samples = tuple(sorted({max(1, round(h / dt)) for h in run.horizons}))
    warm = math.ceil(WARM * samples[-1])
    first = max(warm, math.ceil(run.score_from / dt - 1e-9))
    restarts = np.arange(first, run.t.size - samples[-1], samples[0], dtype=np.int64)
    if restarts.size < 2:
        raise BadInput(
            f"run '{run.label}' lasts {run.t.size * dt:.3g} s; a filter that warms up for {warm * dt:.3g} s and looks "
            f"{samples[-1] * dt:.3g} s ahead needs more. Widen the window or shorten the horizon."
        )
    columns = [names.index(c) for c in run.measured]
    resolution = np.array(run.quanta)
    sensor = np.where(resolution > 0, resolution**2 / 12, np.maximum(noise, 1e-6 * start.spread[columns]) ** 2)
    initial = start.spread**2
    initial[columns] = sensor
    for n in run.held:
        initial[names.index(n) : names.index(n) + 2] = 0.0
    plan = FilterPlan(
        samples=samples, warm=warm, equilibrium=nearest_equilibrium(rig, run), sensor=sensor, initial=initial,
        drift=(DRIFT * run.u.std(axis=0)) ** 2, weight=(samples[0] / np.array(samples)) ** GROWTH,
    )  # fmt: skip
    return plan, restarts


def nearest_equilibrium(rig: GreyBox, run: Run) -> Array:
    """States (states,) of the equilibrium nearest to the record; turns are counted from it."""
    names = rig.plant.state_names()
    units = {c.name: c.unit for c in rig.plant.coordinates}
    mean = {c: float(run.y[:, k].mean()) for k, c in enumerate(run.measured)}
    mean |= {c: float(np.mean(v)) for c, v in run.held.items()}

    def near(place: Mapping[str, float]) -> tuple[float, Array]:
        x, far = np.zeros(len(names)), 0.0
        for c, unit in units.items():
            value = mean.get(c, place.get(c, 0.0))
            x[names.index(c)] = value
            if c in place and c in mean:
                turns = round((value - place[c]) / (2 * math.pi)) if unit == "rad" else 0
                x[names.index(c)] = place[c] + 2 * math.pi * turns
                far += (value - x[names.index(c)]) ** 2
        return far, x

    return min(map(near, rig.plant.equilibria.values()), key=lambda near_by: near_by[0])[1]
