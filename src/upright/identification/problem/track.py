"""How is one run made ready for the solver? Its data on a uniform grid, its windows, and where they start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.identification.model.model import Rig, Run
from upright.identification.problem.predictor_setup import Ahead, look_ahead
from upright.identification.problem.restarts import worth
from upright.signals.smoothing import (
    State,
    acceleration_width,
    dominant_period,
    end_errors,
    savitzky_golay,
    smoothing_width,
    spread,
)
from upright.simulation import Held

Array = NDArray[np.float64]

STEPS_PER_PERIOD = 120
"""Steps a free run is simulated with per period: RK4 is then off by less than 1e-6 per period."""


@dataclass(frozen=True, kw_only=True)
class Track:
    """A run made ready: `y` (N, outputs) and `u` (N, inputs) on a grid of `dt`, windows of `length` samples.

    `columns` are the measured coordinates' places in the state, `weights` (outputs,) one over their spread (0 for a
    held one), `restarts` (W,) the first samples of the windows and `x0` (W, states) the measured states there, whose
    `variance` (W, states) counts in variances of a weighted residual: 0 where they are known, or sought with the rest.
    A run predicted by a filter has `ahead`: what then counts as its samples are its horizons.
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
    ahead: Ahead | None = None

    @property
    def windowed(self) -> bool:
        """Whether the run is restarted from measured states."""
        return self.run.horizon is not None

    @property
    def doubtful(self) -> NDArray[np.int64]:
        """Places of the states that restarts know from a measurement only."""
        if not self.variance.any():
            return np.zeros(0, dtype=np.int64)
        return np.sort(np.concatenate([self.columns, np.add(self.columns, 1)])).astype(np.int64)

    @property
    def doubt(self) -> Array:
        """Variances (W, doubtful) of those states."""
        return self.variance[:, self.doubtful]

    @property
    def duration(self) -> float:
        """Seconds that one simulation spans."""
        return (self.ahead.samples[-1] if self.ahead else self.length - 1) * self.dt

    @property
    def spacing(self) -> float:
        """Seconds from one residual to the next."""
        return float(self.restarts[1] - self.restarts[0]) * self.dt if self.ahead else self.dt

    def within(self, horizon: float) -> int:
        """Samples that are simulated within `horizon` seconds, at least two; of horizons at least one."""
        if self.ahead:
            return max(1, sum(h * self.dt <= horizon * (1 + 1e-9) for h in self.ahead.samples))
        if horizon >= self.duration or self.windowed:
            return self.length
        return max(2, min(self.length, int(horizon / self.dt) + 1))

    def targets(self, samples: int) -> Array:
        """Measured outputs (samples, W, outputs) that windows cut to `samples` are compared with."""
        if self.ahead:
            rows = self.restarts[None, :] + np.array(self.ahead.samples[:samples])[:, None]
            return self.y[rows] * self.ahead.weight[:samples, None, None]
        rows = self.restarts[None, :] + np.arange(samples)[:, None]
        return self.y[rows]


def prepare(rig: Rig, run: Run, *, thin: bool) -> Track:
    """Make a run ready; `thin` takes every k-th sample of a run without input, as many as its period needs."""
    names = rig.plant.state_names()
    period_s, n = run.period, run.t.size
    columns = tuple(names.index(c) for c in run.measured)
    quantum = run.quantum or (0.0,) * len(run.measured)
    free = [k for k, c in enumerate(run.measured) if c not in run.held]
    periods = [dominant_period(run.y[:, k], period_s) for k in free if np.ptp(run.y[:, k]) > 3 * quantum[k]]
    period = min(periods, default=n * period_s)

    stride = 1
    if thin and run.loop is None and run.horizon is None and not np.any(run.u != run.u[:1]):
        stride = max(1, min(int(period / STEPS_PER_PERIOD / period_s), n // 200))
    dt = period_s * stride
    length = (n - 1) // stride + 1
    restarts = np.zeros(1, dtype=np.int64)
    filtered = run.restart == "kalman" and run.horizon is not None
    if len(run.horizons) > 1 and not filtered:
        raise BadInput(f"run '{run.label}' has several horizons, which needs restart 'kalman'; or give it one.")
    if run.horizon is not None and not filtered:
        length = min(length, max(2, int(round(max(run.horizons) / dt)) + 1))
        # the last sample of a window is the first of the next, so that no sample is scored at its own restart only
        restarts = np.arange(0, n - length + 1, length - 1, dtype=np.int64)

    x, sizes, errors = np.zeros((n, len(names))), np.ones(len(names)), np.zeros(len(names))
    variance = np.zeros((restarts.size, len(names)))
    taken = np.zeros(len(columns))
    for k, (c, column) in enumerate(zip(run.measured, columns, strict=True)):
        width = smoothing_width(run.y[:, k], period_s, period, quantum[k])
        motion = savitzky_golay(run.y[:, k], period_s, width, derivatives=1)
        x[:, column], x[:, column + 1] = motion.q, motion.v
        sizes[column], sizes[column + 1] = spread(motion.q), spread(motion.v)
        taken[k] = np.std(run.y[:, k] - motion.q)
        errors[column : column + 2] = end_errors(run.y[:, k], motion.q, period_s, width)
        if c in run.held:
            sizes[column : column + 2] = 1.0
        elif run.horizon is not None and not filtered:
            variance[:, column : column + 2] = worth(n, width, period_s, restarts) * spread(run.y[:, k]) ** 2
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
    if filtered:
        ahead, restarts = look_ahead(rig, run, dt, start, taken)
        length, variance = len(ahead.samples), np.zeros((restarts.size, len(names)))
    weights = np.array([0.0 if c in run.held else 1.0 / spread(run.y[:, k]) for k, c in enumerate(run.measured)])
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
        first=int(np.ceil(run.score_from / dt)),
        variance=variance,
        ahead=ahead,
    )
