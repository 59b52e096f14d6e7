"""How far are the simulated runs from the measured ones, and how does that change with every number sought?

All perturbed numbers of a run are simulated side by side in the lanes of one call (DESIGN 2).
Residuals are in units of each signal's spread over its run, so that a fit percent is driven, not a unit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.model import Rig
from upright.identification.model.unknowns import SHARED, Unknown
from upright.identification.problem.normal import Normal, Rows, finite, mixed, products, squares
from upright.identification.problem.nuisances import CHANGES, Dressed, dress, known_beforehand
from upright.identification.problem.predictor import restart_states
from upright.identification.problem.restarts import PERTURBATION, Restart, settle
from upright.identification.problem.simulated import motions, outputs, simulator
from upright.identification.problem.track import Track
from upright.signals.memory import memory
from upright.simulation import Simulator

Array = NDArray[np.float64]


@dataclass
class Problem:
    """Rig, runs and the numbers sought; counts its simulations in `evaluations`.

    `steps` (sought,) are the perturbations, `noise` the residual that one sigma of prior knowledge is worth,
    `blends` (outputs, outputs) by run what weighs errors of outputs that err together, in place of the track's weights.
    """

    rig: Rig
    tracks: list[Track]
    unknowns: list[Unknown]
    base: dict[str, float]
    friction: tuple[str, ...]
    steps: Array
    noise: float = 0.1
    evaluations: int = 0
    solvers: dict[int, Simulator] = field(default_factory=dict[int, Simulator])
    memory: Array = field(default_factory=lambda: np.empty(0))
    blends: dict[int, Array] = field(default_factory=dict[int, Array])

    @property
    def lower(self) -> Array:
        """Lower bounds of the coordinates (sought,)."""
        return np.array([u.bounds[0] for u in self.unknowns])

    @property
    def upper(self) -> Array:
        """Upper bounds of the coordinates (sought,)."""
        return np.array([u.bounds[1] for u in self.unknowns])

    @property
    def start(self) -> Array:
        """Coordinates of the start (sought,)."""
        return np.array([u.inside(u.value) for u in self.unknowns])

    @property
    def duration(self) -> float:
        """Seconds of the longest simulation."""
        return max(t.duration for t in self.tracks)

    def sought_in(self, index: int) -> NDArray[np.int64]:
        """Places of the numbers that matter in one run."""
        return np.array([i for i, u in enumerate(self.unknowns) if u.runs == SHARED or index in u.runs], dtype=np.int64)

    def value(self, x: Array) -> Array:
        """Values (sought,) or (sought, lanes) of coordinates."""
        log = np.array([u.log for u in self.unknowns], dtype=bool)
        out = x.copy()
        out[log] = np.exp(np.minimum(x[log], 300.0))
        return out

    def simulate(self, index: int, x: Array, samples: int, shift: Array | None = None) -> Array:
        """Outputs (samples, W, outputs, lanes) of one run for coordinates `x` (sought, lanes).

        `shift` (states, W, lanes or 1) is added to the states at which windows start.
        """
        d = self._dressed(index, x)
        x0 = d.x0 if shift is None else d.x0 + shift
        self.evaluations += 1
        return outputs(self.solver(index), self.tracks[index], d.values, x0, d.offsets, d.scales, samples=samples)

    def filtered(self, index: int, x: Array) -> tuple[Array, Array]:
        """Positions and speeds (W, outputs), as the sensors would show them, that a filter knows at the restarts."""
        track, d = self.tracks[index], self._dressed(index, x[:, None])
        at = restart_states(self.solver(index), track, d.values, d.offsets, d.scales)[..., 0]
        q, v = (at[np.add(track.columns, k)].T for k in (0, 1))
        gain = 1.0 if d.scales is None else d.scales[:, 0]
        return q * gain + d.offsets[:, 0], v * gain

    def _dressed(self, index: int, x: Array) -> Dressed:
        """What one run is simulated with, for coordinates `x` (sought, lanes)."""
        track, v = self.tracks[index], self.value(x)
        values: dict[str, float | Array] = {**self.base, **track.run.known}
        values |= {u.name: v[i] for i, u in enumerate(self.unknowns) if u.runs == SHARED}
        own = {u.name: v[i] for i, u in enumerate(self.unknowns) if index in u.runs}
        return dress(self.rig, track, values, own, self.friction, x.shape[1])

    def blend(self, index: int) -> Array:
        """What errors (..., outputs) of one run are weighed with, ``W e``: (outputs, outputs)."""
        return self.blends.get(index, np.diag(self.tracks[index].weights))

    def solver(self, index: int) -> Simulator:
        """Solver of one run, made once."""
        if index not in self.solvers:
            track = self.tracks[index]
            free = [u.name for u in self.unknowns if u.runs == SHARED]
            own = {u.name for u in self.unknowns if index in u.runs}
            free += [p for n, p in CHANGES.items() if n in own]
            self.solvers[index] = simulator(self.rig, track, {**self.base, **track.run.known}, free)
        return self.solvers[index]

    def samples(self, index: int, horizon: float) -> int:
        """Samples of one run within `horizon` seconds, at least two."""
        return self.tracks[index].within(horizon)

    def rows(self, index: int, x: Array, horizon: float = math.inf, *, central: bool = False) -> Rows | None:
        """Residuals and Jacobian of one run, None when the simulation ran away."""
        track, sought = self.tracks[index], self.sought_in(index)
        n, m = self.samples(index, horizon), sought.size
        lanes = np.repeat(x[:, None], 2 * m + 1 if central else m + 1, axis=1)
        here = np.arange(m)
        lanes[sought, 1 + here] += self.steps[sought]
        if central:
            lanes[sought, 1 + m + here] -= self.steps[sought]
        restart = self.restart(index, x) if track.doubtful.size else None
        y = self.simulate(index, lanes, n, None if restart is None else restart.shift)
        W = self.blend(index)
        target = track.targets(n)
        skip = 0 if track.windowed else min(track.first, n - 1)
        residual = (y[skip:, :, :, 0] - target[skip:]) @ W.T
        if not finite(residual):
            return None
        with np.errstate(over="ignore", invalid="ignore"):  # a lane that ran away makes the cost infinite
            if central:
                slope = W @ ((y[skip:, :, :, 1 : m + 1] - y[skip:, :, :, m + 1 :]) / (2 * self.steps[sought]))
            else:
                slope = W @ ((y[skip:, :, :, 1:] - y[skip:, :, :, :1]) / self.steps[sought])
        k = len(track.columns) * (n if track.ahead else 1)  # all horizons of one restart stand in one row
        r, J = np.moveaxis(residual, 1, 0), np.moveaxis(slope, 1, 0)  # windows one after another
        if restart is not None:
            r, J = restart.rows(r.reshape(track.restarts.size, -1), J.reshape(track.restarts.size, -1, m))
        return Rows(r.reshape(-1, k), J.reshape(-1, k, m), sought)

    def missed(self, index: int, x: Array, horizon: float = math.inf) -> Array:
        """Residuals (W, samples) of every window of one run, each from the restart that suits it; no Jacobian."""
        track = self.tracks[index]
        if track.doubtful.size:
            restart = self.restart(index, x)
            return np.concatenate([restart.residual, restart.price], axis=1)
        n = self.samples(index, horizon)
        skip = 0 if track.windowed else min(track.first, n - 1)
        y = self.simulate(index, x[:, None], n)[skip:, :, :, 0]
        return np.moveaxis((y - track.targets(n)[skip:]) @ self.blend(index).T, 1, 0).reshape(track.restarts.size, -1)

    def restart(self, index: int, x: Array) -> Restart:
        """Where the windows of one run are best restarted, for coordinates `x`."""
        track = self.tracks[index]
        places = track.doubtful
        sizes = PERTURBATION * track.start.spread[places]
        targets = track.targets(track.length)
        lanes = np.repeat(x[:, None], 1 + places.size, axis=1)
        W = self.blend(index)

        def respond(d: Array) -> tuple[Array, Array]:
            shift = np.zeros((track.x0.shape[1], track.restarts.size, 1 + places.size))
            shift[places] = d.T[:, :, None]
            shift[places, :, 1 + np.arange(places.size)] += sizes[:, None]
            y = self.simulate(index, lanes, track.length, shift)
            residual = np.moveaxis((y[..., 0] - targets) @ W.T, 1, 0).reshape(len(d), -1)
            slope = np.moveaxis(W @ ((y[..., 1:] - y[..., :1]) / sizes), 1, 0)
            return residual, slope.reshape(*residual.shape, -1)

        d, residual, slope = settle(respond, track.doubt)
        shift = np.zeros((track.x0.shape[1], track.restarts.size, 1))
        shift[places] = d.T[:, :, None]
        return Restart(shift=shift, residual=residual, slope=slope, change=d, variance=track.doubt)

    def normal(self, x: Array, horizon: float = math.inf, *, central: bool = False) -> Normal:
        """Cost and its Gauss-Newton model at coordinates `x`; the cost is infinite when a simulation ran away."""
        size = x.size
        A, g, cost = np.zeros((size, size)), np.zeros(size), 0.0
        for index in range(len(self.tracks)):
            sought = self.sought_in(index)
            if central or self.tracks[index].windowed:
                rows = self.rows(index, x, horizon, central=central)
                if rows is None:
                    return Normal(math.inf, A, g)
                squares = products(rows.jacobian.reshape(-1, sought.size), rows.residual.reshape(-1))
            else:
                squares = self._squares(index, x, horizon, sought)
            if not math.isfinite(squares[2]):
                return Normal(math.inf, A, g)
            cost += squares[2]
            A[np.ix_(sought, sought)] += squares[0]
            g[sought] += squares[1]
        r, J = self.prior_rows(x)
        cost += float(r @ r)
        normal = Normal(cost, A + J.T @ J, g + J.T @ r)
        return normal if finite(normal.matrix) else Normal(math.inf, A, g)

    def _squares(self, index: int, x: Array, horizon: float, sought: NDArray[np.int64]) -> tuple[Array, Array, float]:
        """``J'J``, ``J'r`` and ``r'r`` of a free run, in the lanes as they come: the same numbers as from `rows`."""
        track, n = self.tracks[index], self.samples(index, horizon)
        lanes = np.repeat(x[:, None], 1 + sought.size, axis=1)
        lanes[sought, 1 + np.arange(sought.size)] += self.steps[sought]
        d = self._dressed(index, lanes)
        self.evaluations += 1
        rows = len(d.x0) + track.u.shape[1]  # a loop records its commands as well
        if self.memory.size < (most := n * rows * (lanes.shape[1] + 15)):
            self.memory = np.empty(most)
        motion = motions(self.solver(index), track, d.values, d.x0, samples=n, memory=self.memory)
        skip = min(track.first, n - 1)
        seen = [motion[skip:, c] for c in track.columns]
        W = self.blends.get(index)
        if W is None:
            G = squares(seen, track.y[skip:n], d.offsets, track.weights, d.scales)
        else:
            G = squares(*mixed(seen, track.y[skip:n], d.offsets, d.scales, W))
        h = self.steps[sought]
        with np.errstate(over="ignore", invalid="ignore"):  # a lane that ran away makes the cost infinite
            return G[1:, 1:] / np.outer(h, h), G[1:, 0] / h, float(G[0, 0])

    def prior_rows(self, x: Array) -> tuple[Array, Array]:
        """Residuals and Jacobian of what was known beforehand, worth `noise` per sigma."""
        return known_beforehand(self.unknowns, x, self.noise)

    def cost(self, x: Array, horizon: float = math.inf) -> float:
        """Sum of squares alone, one lane per run."""
        r, _ = self.prior_rows(x)
        total = float(r @ r)
        for index in range(len(self.tracks)):
            e = self.missed(index, x, horizon)
            with np.errstate(over="ignore"):
                total += float(np.sum(e * e))
        return total if math.isfinite(total) else math.inf


def loudness(problem: Problem, x: Array) -> float:
    """Weighted residual that one independent observation carries: its deviation times the root of its memory.

    What was known beforehand is weighed against the data in this unit.
    """
    squares, samples = 0.0, 0
    for index, track in enumerate(problem.tracks):
        y = problem.simulate(index, x[:, None], track.length)[:, :, :, 0]
        e = np.moveaxis((y - track.targets(track.length)) * track.weights, 1, 0)
        e = e.reshape(len(e), -1) if track.ahead else e.reshape(-1, len(track.columns))
        alike = max(1.0, 2 * memory(e, track.spacing) / track.spacing - 1)
        squares += alike * float(np.sum(e * e))
        samples += e.shape[0] * max(1, int(np.count_nonzero(track.weights)) * (track.length if track.ahead else 1))
    return math.sqrt(squares / max(samples, 1))
