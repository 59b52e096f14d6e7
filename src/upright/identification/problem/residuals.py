"""The problem of explaining runs: residuals of simulated runs against measured ones, and their Gauss-Newton model.

All perturbed numbers of a run are simulated side by side in the lanes of one call, which costs little more than one
simulation. Residuals are in units of each signal's spread over its run, so that a fit percent is driven, not a unit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from copy import copy
from dataclasses import dataclass, field, replace
from functools import partial
from threading import get_ident

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.grey_box import GreyBox, Parameter, base_values, neutral
from upright.identification.model.runs import Run
from upright.identification.problem.normal_equations import VECTOR, Normal, finite, products, slopes, squares
from upright.identification.problem.restarts import PERTURBATION, Restart, settle
from upright.identification.problem.simulated import (
    discrete_model,
    filtering,
    motions,
    outputs,
    restart_states,
    simulator,
)
from upright.identification.problem.tracks import Track, prepare
from upright.identification.problem.unknowns import (
    CHANGES,
    FAR,
    Setting,
    Unknown,
    friction_names,
    run_unknowns,
    setting,
    shared_unknowns,
)
from upright.signals.memory import memory
from upright.simulation import Simulator
from upright.workers import share

Array = NDArray[np.float64]
Products = tuple[Array, Array, float]


ROUNDING = 12**-0.5
"""Standard deviation of the rounding to steps of one."""

SAME = 1e-4
"""Relative rise of the cost that tells nothing."""

NOTICED = 0.2
"""A weight that changes by less, of its logarithm, moves no estimate by what matters."""

LEAST_MISSED = 0.01
"""What is missed of a component counts as no less than this share of what is missed of the worst."""

SHARED = 1000
"""Samples of a run, in the mean, from which on threads share the runs: they take a third of a millisecond."""

REUSED = 4_000_000
"""Numbers of a motion up to which its memory is kept for the next one; those of an hour's log are given back."""

STEP = 1e-5
"""A perturbed number moves the weighted outputs by about this much, root mean square."""


@dataclass
class Problem:
    """Rig, runs and the numbers sought; counts its simulations in `evaluations`.

    `steps` (sought,) are the perturbations, `noise` the residual that one sigma of prior knowledge is worth.
    """

    rig: GreyBox
    tracks: list[Track]
    unknowns: list[Unknown]
    steps: Array
    noise: float = 0.1
    evaluations: int = 0
    _solvers: dict[int, Simulator] = field(init=False, default_factory=dict[int, Simulator])
    _memory: dict[int, Array] = field(init=False, default_factory=dict[int, Array])  # one for each thread

    def __post_init__(self) -> None:
        self.base, self._friction = base_values(self.rig), friction_names(self.rig)

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
        return np.array([u.coordinate(u.value) for u in self.unknowns])

    @property
    def duration(self) -> float:
        """Seconds of the longest simulation."""
        return max(t.duration for t in self.tracks)

    def sought_in(self, index: int) -> NDArray[np.int64]:
        """Places of the numbers that matter in one run."""
        return np.array([i for i, u in enumerate(self.unknowns) if u.shared or index in u.runs], dtype=np.int64)

    def beside(self, sought: Parameter, *stated: Parameter) -> Problem:
        """The problem with one number more, its last, and what else its rig then has."""
        (number,) = shared_unknowns(replace(self.rig, parameters={sought.name: sought}))
        more = {p.name: p for p in (sought, *stated)}
        rig = replace(self.rig, parameters={**self.rig.parameters, **more})
        wider = replace(self, rig=rig, unknowns=[*self.unknowns, number], steps=np.append(self.steps, 1e-6))
        wider._memory.update(self._memory)
        return wider

    def with_factors(self, index: int, names: Sequence[str]) -> Problem:
        """The problem with factors of one run more, ``friction`` or ``gain``, its last."""
        track = self.tracks[index]
        run = replace(track.run, unknown=tuple(names), shared={})
        more = run_unknowns(self.rig, index, run, track.start)
        wider = replace(self, unknowns=[*self.unknowns, *more], steps=np.append(self.steps, np.full(len(more), 1e-6)))
        wider._solvers.update(self._solvers)
        return wider

    def value(self, x: Array) -> Array:
        """Values (sought,) or (sought, lanes) of coordinates."""
        log = np.array([u.log for u in self.unknowns], dtype=bool)
        out = x.copy()
        out[log] = np.exp(np.minimum(x[log], 300.0))
        return out

    def key(self, index: int) -> str:
        """Name of one number sought; of one that not all runs share, with its group or its run before it.

        Problems that explain other runs, or other models, know it by the same key.
        """
        u = self.unknowns[index]
        if u.shared:
            return u.name
        home = f"group {u.group}" if u.group else self.tracks[u.runs[0]].run.label
        return f"{home}: {u.name}"

    def values_at(self, x: Array) -> dict[str, float]:
        """Every number sought at coordinates `x`, by its key."""
        return {self.key(i): float(v) for i, v in enumerate(self.value(x))}

    def shared_at(self, x: Array) -> dict[str, float]:
        """The numbers that all runs share at coordinates `x`, by name."""
        return {u.name: float(v) for u, v in zip(self.unknowns, self.value(x), strict=True) if u.shared}

    def place(self, values: Mapping[str, float], x: Array | None = None) -> Array:
        """Coordinates of the `values` that are given by key; the others as in `x`, or at their start."""
        x = self.start if x is None else x.copy()
        for i, u in enumerate(self.unknowns):
            value = values.get(self.key(i))
            if value is not None and (not u.log or value > 0):
                x[i] = u.coordinate(value)
        return np.clip(x, self.lower, self.upper)

    def count(self, horizon: float = math.inf) -> int:
        """Number of residuals within `horizon` seconds."""
        return sum(
            (t.within(horizon) if t.retained is None else int(np.count_nonzero(t.retained[: t.within(horizon)])))
            * t.restarts.size * max(1, int(np.count_nonzero(t.weights)))
            for t in self.tracks
        )  # fmt: skip

    def simulate(self, index: int, x: Array, samples: int, shift: Array | None = None) -> Array:
        """Outputs (samples, W, outputs, lanes) of one run for coordinates `x` (sought, lanes).

        `shift` (states, W, lanes or 1) is added to the states at which windows start.
        """
        d = self._setting(index, x)
        x0 = d.x0 if shift is None else d.x0 + shift
        self.evaluations += 1
        track, lanes = self.tracks[index], x0.shape[1] * x.shape[1]
        size = samples * (len(x0) + track.u.shape[1]) * -(-lanes // VECTOR) * VECTOR
        memory = None if track.ahead or size > REUSED else self._room(size)
        return outputs(
            self.solver(index), track, d.values, x0, d.offsets, d.scales, samples=samples, memory=memory
        )  # fmt: skip

    def _room(self, size: int) -> Array:
        """Memory of this thread for so many numbers, used again: fresh memory takes as long as a motion does."""
        thread = get_ident()
        if thread not in self._memory or self._memory[thread].size < size:
            self._memory[thread] = np.empty(size)
        return self._memory[thread]

    def filtered(self, index: int, x: Array) -> tuple[Array, Array]:
        """Positions and speeds (W, outputs), as the sensors would show them, that a filter knows at the restarts."""
        track, d = self.tracks[index], self._setting(index, x[:, None])
        at = restart_states(self.solver(index), track, d.values, d.offsets, d.scales)[..., 0]
        q, v = (at[np.add(track.columns, k)].T for k in (0, 1))
        gain = 1.0 if d.scales is None else d.scales[:, 0]
        return q * gain + d.offsets[:, 0], v * gain

    def known_state(self, index: int, x: Array) -> tuple[Array, Array]:
        """Transition over one sample, and the covariance that a filter leaves at the restarts, (S, S) each.

        Of the states and of the drifts of the inputs.
        """
        track, d, solver = self.tracks[index], self._setting(index, x[:, None]), self.solver(index)
        assert track.ahead is not None
        Phi, _ = discrete_model(solver, track, d.values, 1)
        _, P = filtering(solver, track, d.values, track.ahead.warm + 1, 1)
        return Phi[0], P[0]

    def ahead(self, seconds: float) -> Problem:
        """The problem with its filtered runs predicted so many seconds ahead alone, from the same restarts."""
        tracks = [t.predicting(seconds) if t.ahead else t for t in self.tracks]
        further = replace(self, tracks=tracks)
        further._solvers.update(self._solvers)
        return further

    def _setting(self, index: int, x: Array) -> Setting:
        """What one run is simulated with, for coordinates `x` (sought, lanes)."""
        track, v = self.tracks[index], self.value(x)
        values: dict[str, float | Array] = {**self.base, **track.run.known}
        values |= {u.name: v[i] for i, u in enumerate(self.unknowns) if u.shared}
        own = {u.name: v[i] for i, u in enumerate(self.unknowns) if index in u.runs}
        return setting(self.rig, track, values, own, self._friction, x.shape[1])

    def solver(self, index: int) -> Simulator:
        """Solver of one run, made once."""
        if index not in self._solvers:
            track = self.tracks[index]
            free = [u.name for u in self.unknowns if u.shared]
            own = {u.name for u in self.unknowns if index in u.runs}
            free += [p for n, p in CHANGES.items() if n in own]
            self._solvers[index] = simulator(self.rig, track, {**self.base, **track.run.known}, free)
        return self._solvers[index]

    def lanes(self, x: Array, sought: NDArray[np.int64], *, central: bool = False) -> Array:
        """Coordinates (sought, lanes) with every number moved by its step, to both sides when `central`."""
        move = np.zeros((x.size, sought.size))
        move[sought, np.arange(sought.size)] = self.steps[sought]
        return x[:, None] + np.hstack([np.zeros((x.size, 1)), move, *([-move] if central else [])])

    def rows(
        self, index: int, x: Array, horizon: float = math.inf, *, central: bool = False,
        sought: NDArray[np.int64] | None = None,
    ) -> tuple[Array, Array] | None:  # fmt: skip
        """Residuals (T, outputs) of one run, windows one after another, and their Jacobian (T, outputs, sought in it).

        Of all that is sought in the run, or only of the places `sought`.
        None when the simulation ran away, or does as soon as a number is moved to either side.
        """
        track, sought = self.tracks[index], self.sought_in(index) if sought is None else sought
        n, m = track.within(horizon), sought.size
        restart = self.restart(index, x) if track.uncertain.size else None
        y = self.simulate(index, self.lanes(x, sought, central=central), n, restart.shift if restart else None)
        residual = track.errors(y[..., 0])
        if not finite(residual):
            return None
        y = y[min(track.first, n - 1) :]
        with np.errstate(over="ignore", invalid="ignore"):  # a lane that ran away makes the cost infinite
            slope = track.weighting @ slopes(y, self.steps[sought], central=central)
            if central and not finite(slope * slope):
                return None
        k = len(track.columns) * (n if track.ahead else 1)  # all horizons of one restart stand in one row
        r, J = np.moveaxis(residual, 1, 0), np.moveaxis(slope, 1, 0)  # windows one after another
        if restart is not None:
            r, J = restart.rows(r.reshape(track.restarts.size, -1), J.reshape(track.restarts.size, -1, m))
            if not (finite(r) and finite(J)):
                return None
        return r.reshape(-1, k), J.reshape(-1, k, m)

    def residuals(self, index: int, x: Array, horizon: float = math.inf) -> Array:
        """Residuals (W, samples) of every window of one run, each from the restart that suits it; no Jacobian."""
        track = self.tracks[index]
        if track.uncertain.size:
            restart = self.restart(index, x)
            return np.concatenate([restart.residual, restart.price], axis=1)
        y = self.simulate(index, x[:, None], track.within(horizon))[..., 0]
        return np.moveaxis(track.errors(y), 1, 0).reshape(track.restarts.size, -1)

    def weigh_components(self, x: Array) -> bool:
        """Weigh the components of outputs that move alike by what is missed of each at coordinates `x`.

        Over all runs with the same components; the cost at `x` stays about what it was. Whether a weight changed by
        enough to matter.
        """
        squares: dict[tuple[str, ...], list[Array]] = {}
        for index, track in enumerate(self.tracks):
            if track.principal is not None:
                e = self.residuals(index, x)
                width = len(track.columns)
                e = e[:, : track.length * width].reshape(-1, width) * _relative(
                    track.missed
                )  # without prices of restarts
                squares.setdefault(_components(track), []).append(np.mean(e * e, axis=0))
        changed = False
        for index, track in enumerate(self.tracks):
            if track.principal is None:
                continue
            missed = np.sqrt(np.mean(squares[_components(track)], axis=0))
            free = track.weights > 0
            if not (np.isfinite(missed).all() and missed[free].all()):
                continue
            missed = np.where(free, np.maximum(missed, LEAST_MISSED * missed.max()), 1.0)
            missed[free] /= np.sqrt(np.mean(missed[free] ** 2))
            changed = changed or bool(np.abs(np.log(missed / _relative(track.missed))).max() > NOTICED)
            self.tracks[index] = replace(track, missed=missed)
        return changed

    def weigh_like(self, other: Problem) -> None:
        """Weigh prior knowledge and components as another problem does, so that their costs compare."""
        self.noise = other.noise
        missed = {_components(track): track.missed for track in other.tracks}
        self.tracks = [replace(t, missed=missed.get(_components(t), t.missed)) for t in self.tracks]

    def restart(self, index: int, x: Array) -> Restart:
        """Where the windows of one run are best restarted, for coordinates `x`."""
        track = self.tracks[index]
        places = track.uncertain
        variance = track.variance[:, places]
        sizes = PERTURBATION * track.start.spread[places]
        lanes = np.repeat(x[:, None], 1 + places.size, axis=1)

        def respond(d: Array) -> tuple[Array, Array]:
            shift = np.zeros((track.x0.shape[1], track.restarts.size, 1 + places.size))
            shift[places] = d.T[:, :, None]
            shift[places, :, 1 + np.arange(places.size)] += sizes[:, None]
            y = self.simulate(index, lanes, track.length, shift)
            residual = np.moveaxis(track.errors(y[..., 0]), 1, 0).reshape(len(d), -1)
            with np.errstate(over="ignore", invalid="ignore"):  # a window that ran away stays where it was measured
                slope = np.moveaxis(track.weighting @ ((y[..., 1:] - y[..., :1]) / sizes), 1, 0)
            return residual, slope.reshape(*residual.shape, -1)

        d, residual, slope = settle(respond, variance)
        shift = np.zeros((track.x0.shape[1], track.restarts.size, 1))
        shift[places] = d.T[:, :, None]
        return Restart(shift=shift, residual=residual, slope=slope, change=d, variance=variance)

    def normal(self, x: Array, horizon: float = math.inf) -> Normal:
        """Cost and its Gauss-Newton model at coordinates `x`; the cost is infinite when a simulation ran away."""
        size, places = x.size, range(len(self.tracks))
        A, g, cost = np.zeros((size, size)), np.zeros(size), 0.0
        for index in places:  # made here: threads would each make one
            self.solver(index)
        squares = partial(self._counted_squares, x, horizon)
        with closing(share(squares, places) if self._long(horizon) else (squares(index) for index in places)) as each:
            for index, (products, evaluations) in enumerate(each):
                self.evaluations += evaluations
                if products is None or not math.isfinite(products[2]):
                    return Normal.lost(size)
                sought = self.sought_in(index)
                cost += products[2]
                with np.errstate(over="ignore", invalid="ignore"):  # a number far from where it is felt
                    A[np.ix_(sought, sought)] += products[0]
                    g[sought] += products[1]
        r, J = self.prior_rows(x)
        cost += float(r @ r)
        normal = Normal(cost, A + J.T @ J, g + J.T @ r)
        return normal if finite(normal.matrix) else Normal.lost(size)

    def _long(self, horizon: float) -> bool:
        """Whether the runs are long enough for threads to share them."""
        samples = sum(t.y.shape[0] if t.windowed else t.within(horizon) for t in self.tracks)
        return len(self.tracks) > 1 and samples > SHARED * len(self.tracks)

    def _counted_squares(self, x: Array, horizon: float, index: int) -> tuple[Products | None, int]:
        """``J'J``, ``J'r`` and ``r'r`` of one run, None where it runs away; and the simulations that it took.

        Who counts them adds them up in the order of the runs, so that they do not depend on who computed what.
        """
        own, sought = copy(self), self.sought_in(index)
        own.evaluations = 0
        if not self.tracks[index].windowed:
            return own._squares(index, x, horizon, sought), own.evaluations
        rows = own.rows(index, x, horizon)
        return rows and products(rows[1].reshape(-1, sought.size), rows[0].reshape(-1)), own.evaluations

    def _squares(self, index: int, x: Array, horizon: float, sought: NDArray[np.int64]) -> Products:
        """``J'J``, ``J'r`` and ``r'r`` of a free run, in the lanes as they come: the same numbers as from `rows`."""
        track, n = self.tracks[index], self.tracks[index].within(horizon)
        d = self._setting(index, self.lanes(x, sought))
        self.evaluations += 1
        rows = len(d.x0) + track.u.shape[1]  # a loop records its commands as well
        memory = self._room(n * rows * (sought.size + 16))
        motion = motions(self.solver(index), track, d.values, d.x0, samples=n, memory=memory)
        if sought.size:  # with the lanes that fill up a vector
            width = -(-motion.shape[2] // VECTOR) * VECTOR
            motion = memory[: n * motion.shape[1] * width].reshape(n, -1, width)
        kept = np.arange(min(track.first, n - 1), n)
        kept = kept if track.retained is None else np.flatnonzero(track.retained[:n])
        G = squares(motion, track.columns, track.y, d.offsets, track.weighting, d.scales, kept)
        h = self.steps[sought]
        with np.errstate(over="ignore", invalid="ignore"):  # a lane that ran away makes the cost infinite
            return G[1:, 1:] / np.outer(h, h), G[1:, 0] / h, float(G[0, 0])

    def settle_steps(self, x: Array, horizon: float = math.inf) -> Normal:
        """Choose perturbations that move the outputs by about `STEP`, so that no guess of a size is needed.

        The model at `x` comes back, found with perturbations not far from those.
        """
        for _ in range(4):
            here = self.normal(x, horizon)
            if self.rescale_steps(here, horizon):
                return here
        return self.normal(x, horizon)

    def rescale_steps(self, normal: Normal, horizon: float = math.inf) -> bool:
        """Choose perturbations by the effects found at an earlier evaluation within `horizon` seconds.

        Whether those that it was found with were not far from these.
        """
        samples = sum(t.within(horizon) * t.restarts.size for t in self.tracks)
        return self.resize_steps(np.arange(self.steps.size), np.maximum(np.diag(normal.matrix), 0.0) / samples)

    def resize_steps(self, places: NDArray[np.int64], effect: Array) -> bool:
        """Choose perturbations of some numbers by the mean square that each adds to a sample's outputs per unit.

        Whether those that it was found with were not far from these.
        """
        before, effect = self.steps[places], np.sqrt(effect)
        wanted = np.where(effect > 0, STEP / np.maximum(effect, 1e-300), 100 * before)
        wanted = np.clip(wanted, before * 1e-4, before * 1e4)
        scale = np.array([self.unknowns[i].scale for i in places])
        self.steps = self.steps.copy()
        self.steps[places] = steps = np.clip(wanted, 1e-9 * scale, 1e-3 * scale)
        return bool(np.all((steps < 30 * before) & (steps > before / 30)))

    def prior_rows(self, x: Array) -> tuple[Array, Array]:
        """Residuals and Jacobian of what was known beforehand of coordinates `x`, worth `noise` per sigma.

        What is known of a first coordinate is a reading, so where the sensor's offset is sought too, their sum is held
        against it. Held against the coordinate alone it would fight the offset (seen: 34 sigma on a cart whose spring
        was slack 6 mm from zero, which bent everything else).
        """
        known = [(i, u, u.prior) for i, u in enumerate(self.unknowns) if u.prior is not None]
        place = {(u.name, run): i for i, u in enumerate(self.unknowns) for run in u.runs}
        r, J = np.zeros(len(known)), np.zeros((len(known), x.size))
        for row, (i, u, (mean, sigma)) in enumerate(known):
            kind, _, which = u.name.partition(".")
            parts = {i} if kind != "initial" else {i, place.get((f"offset.{which}", u.runs[0]), i)}
            J[row, list(parts)] = self.noise / sigma
            r[row] = self.noise * (float(np.sum(x[list(parts)])) - mean) / sigma
        return r, J

    def cost(self, x: Array, horizon: float = math.inf) -> float:
        """Sum of squares alone, one lane per run."""
        r, _ = self.prior_rows(x)
        total = float(r @ r)
        for index in range(len(self.tracks)):
            e = self.residuals(index, x, horizon)
            with np.errstate(over="ignore"):
                total += float(np.sum(e * e))
        return total if math.isfinite(total) else math.inf


def formulate(
    rig: GreyBox, runs: Sequence[Run], *, thin: bool = True, stated: Mapping[str, Mapping[str, float]] | None = None
) -> Problem:
    """Set up the problem of explaining `runs`.

    `thin` drops samples of free runs that their period does not need; `stated` holds what is known of a group of runs,
    by its label and name.
    """
    tracks = [prepare(rig, run, thin=thin) for run in runs]
    unknowns = resolved(rig, runs, shared_unknowns(rig))
    for u in (u for i, track in enumerate(tracks) for u in run_unknowns(rig, i, track.run, track.start)):
        place = next((i for i, o in enumerate(unknowns) if u.group and (o.name, o.group) == (u.name, u.group)), None)
        if place is not None:
            unknowns[place] = replace(unknowns[place], runs=(*unknowns[place].runs, *u.runs))
        elif (value := (stated or {}).get(u.group, {}).get(u.name)) is not None:
            unknowns.append(replace(u, value=value, lower=value, upper=value))
        else:
            unknowns.append(u)
    return Problem(rig=rig, tracks=tracks, unknowns=unknowns, steps=np.array([1e-6 * u.scale for u in unknowns]))


def resolved(rig: GreyBox, runs: Sequence[Run], unknowns: Sequence[Unknown]) -> list[Unknown]:
    """The numbers sought, presliding lengths no shorter than `ROUNDING` of the finest encoder step that sees them.

    The effect of shorter ones on the outputs comes from where the steps of the integration happen to fall: differences
    of simulations then are noise, and a matrix of such differences promises intervals far too narrow.
    """
    least = _shortest(rig, runs)
    return [
        replace(u, lower=least[u.name], value=max(u.value, least[u.name]))
        if u.estimated and u.name in least and u.lower < least[u.name] <= u.upper
        else u
        for u in unknowns
    ]


def unresolved(problem: Problem, x: Array) -> tuple[str, ...]:
    """Presliding lengths at coordinates `x` that the encoder does not tell from plain Coulomb friction."""
    least = _shortest(problem.rig, [track.run for track in problem.tracks])
    return tuple(
        u.name
        for u, value in zip(problem.unknowns, problem.value(x), strict=True)
        if u.estimated and u.name in least and u.lower == least[u.name] and value <= u.lower * (1 + 1e-6)
    )


def unreached(problem: Problem, x: Array) -> tuple[str, ...]:
    """Limits at coordinates `x` that no run reaches: knees and largest forces without which the cost is the same."""
    plant = problem.rig.plant
    limits = [i for i, u in enumerate(problem.unknowns) if u.estimated and u.shared and u.log]
    limits = [i for i in limits if math.isinf(neutral(plant, problem.unknowns[i].name))]
    most = problem.cost(x) * (1 + SAME) if limits else 0.0

    def beyond(i: int) -> bool:
        there = x.copy()
        there[i] = min(x[i] + math.log(FAR), problem.upper[i])
        return problem.cost(there) <= most

    return tuple(problem.unknowns[i].name for i in limits if beyond(i))


def idle(problem: Problem, x: Array) -> dict[str, str]:
    """Numbers at coordinates `x` without which the cost is the same, each with the term that they shape.

    In how much time a braking of nearly 0 builds up shows in no run, and an interval of it would be rounding's.
    """
    estimated = {u.name: i for i, u in enumerate(problem.unknowns) if u.estimated and u.shared and not u.log}
    shaping = {name: term for name, term in _shaping(problem.rig) if name in estimated}
    most = problem.cost(x) * (1 + SAME) if shaping else 0.0

    def without(name: str) -> bool:
        there, i = x.copy(), estimated[name]
        there[i] = problem.lower[i]
        return problem.unknowns[i].lower == neutral(problem.rig.plant, name) and problem.cost(there) <= most

    return {name: term for name, term in shaping.items() if without(name)}


def _shaping(rig: GreyBox) -> Iterator[tuple[str, str]]:
    """Numbers that say how a term acts, and the term."""
    yield "actuator.relaxation", "actuator.damping"
    for joint in rig.plant.derived().joints:
        if joint.stribeck_speed and joint.stiction:
            yield joint.stribeck_speed, joint.stiction


def _shortest(rig: GreyBox, runs: Sequence[Run]) -> dict[str, float]:
    """Least presliding length worth telling, by its name."""
    derived = rig.plant.derived()
    pairs = [pair for run in runs for pair in zip(run.measured, run.resolution, strict=False)]
    steps = [min((resolution for name, resolution in pairs if name == c), default=0.0) for c in derived.coordinates]
    return {j.presliding: ROUNDING * float(np.abs(j.direction) @ steps) for j in derived.joints if j.presliding}


def _components(track: Track) -> tuple[str, ...]:
    """What tells which runs have the same components: the outputs that moved freely."""
    return tuple(c for c, w in zip(track.run.measured, track.weights, strict=True) if w)


def _relative(missed: Array | None) -> Array | float:
    return 1.0 if missed is None else missed


def noise_level(problem: Problem, x: Array) -> float:
    """Weighted residual that one independent observation carries: its deviation times the root of its memory.

    What was known beforehand is weighed against the data in this unit.
    """
    squares, samples = 0.0, 0
    for index, track in enumerate(problem.tracks):
        y = problem.simulate(index, x[:, None], track.length)[:, :, :, 0]
        e = (y - track.targets(track.length)) @ track.weighting.T
        e = np.moveaxis(e if track.retained is None else e[track.retained], 1, 0)
        e = e.reshape(len(e), -1) if track.ahead else e.reshape(-1, len(track.columns))
        alike = max(1.0, 2 * memory(e, track.spacing) / track.spacing - 1)
        squares += alike * float(np.sum(e * e))
        samples += e.shape[0] * max(1, int(np.count_nonzero(track.weights)) * (track.length if track.ahead else 1))
    return math.sqrt(squares / max(samples, 1))
