"""Runs as the solver moves them: freely, under the law that closed their loop, or predicted by a Kalman filter.

Many sets of numbers are simulated side by side. A plant that would fall without its loop is predicted from the past
alone: a constant-gain extended Kalman filter (Safonov and Athans 1978) follows the record. The compiled kernel predicts
one sample, friction, stops and delays included, and the innovation corrects the state by the gain of the linear model
about the equilibrium where the plant stands. From its state the kernel predicts several horizons ahead. No sample after
the restart is looked at, and the gain follows from the parameters, so that every number sought, the levels of the
process noise too, is felt through filter and prediction alike.

To go through a record in parallel it is cut into stretches. Every filter begins `warm` samples before its stretch with
a measured position, an unknown speed and the covariance that says so, and its gain settles while it warms up.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.structures import ClosedLoop, finer
from upright.errors import BadInput
from upright.identification.model.grey_box import NOISE, GreyBox, Parameter, base_values
from upright.identification.model.runs import Run
from upright.identification.problem.following import filter_record
from upright.identification.problem.riccati import kalman_gains
from upright.identification.problem.tracks import DRIFT, FilterPlan, Track, nearest_equilibrium
from upright.laws import Law
from upright.physics import Plant
from upright.physics.equations import small_motions
from upright.simulation import Held, Simulator, choose

Array = NDArray[np.float64]


def simulator(rig: GreyBox, track: Track, values: Mapping[str, float | Array], free: Collection[str]) -> Simulator:
    """Solver of one run; terms whose parameters are in `free` stay although they are zero now."""
    derived = rig.plant.derived_for({**values, **dict.fromkeys(free, 1.0)})
    free = [n for n in free if n in derived.parameters or n.startswith("actuator.")]
    loop = track.run.loop
    every = 1 if loop is None else loop.every
    held = {n: finely(h, every) for n, h in track.held.items()}
    law = None if loop is None else law_of_loop(loop, track.run, rig.plant)
    stepped = {n: v for n, v in values.items() if not n.startswith(NOISE)}
    flavour = choose(derived, stepped, free=free, held=tuple(held), loop=law)
    return Simulator(derived=derived, flavour=flavour, dt=track.dt / every, substeps=rig.substeps, loop=law, held=held)


def motions(
    solver: Simulator, track: Track, values: Mapping[str, float | Array], x0: Array, *, samples: int,
    memory: Array | None = None,
) -> Array:  # fmt: skip
    """Simulated states (samples, states, W times lanes); a view of `memory` when it is given, see `Simulator.run`."""
    states, windows, lanes = x0.shape
    if windows > 1:
        values = {n: np.tile(v, windows) if isinstance(v, np.ndarray) else v for n, v in values.items()}
    loop, start, every, u = track.run.loop, None, 1, track.u
    if loop is not None:
        every, u = loop.every, np.repeat(track.u, loop.every, axis=0)
        if windows > 1:
            solver = remembering(solver, track.run, track.restarts, lanes)
    if windows > 1:
        start = np.repeat(track.restarts * every, lanes)
    table = solver.table(values, windows * lanes)
    first = x0.reshape(states, windows * lanes)
    return solver.run(table, first, u, samples=samples, start=start, every=every, memory=memory)


def outputs(
    solver: Simulator, track: Track, values: Mapping[str, float | Array], x0: Array, offsets: Array,
    scales: Array | None = None, *, samples: int, memory: Array | None = None,
) -> Array:  # fmt: skip
    """Simulated outputs (samples, W, outputs, lanes) as the sensors show them.

    Parameters
    ----------
    values : mapping
        Every parameter, a number or one per lane, (lanes,).
    x0 : (states, W, lanes) array
        First states of the windows.
    offsets, scales : (outputs, lanes) arrays
        Sensor offsets and gains, the latter 1 when omitted.
    memory : array, optional
        Where the states of the motion are written, see `Simulator.run`.
    """
    if track.ahead:
        y = predicted(solver, track, values, offsets, scales, samples=samples)
        return y * track.ahead.weight[:samples, None, None, None]
    _, windows, lanes = x0.shape
    out = motions(solver, track, values, x0, samples=samples, memory=memory)
    if windows == 1:
        y = np.empty((samples, 1, len(track.columns), lanes))
        for k, column in enumerate(track.columns):
            if scales is None:
                np.add(out[:, column], offsets[k], out=y[:, 0, k])
            else:
                np.multiply(out[:, column], scales[k], out=y[:, 0, k])
                y[:, 0, k] += offsets[k]
        return y
    y = np.moveaxis(out[:, list(track.columns), :].reshape(samples, len(track.columns), windows, lanes), 1, 2)
    return y + offsets if scales is None else y * scales + offsets


def law_of_loop(loop: ClosedLoop, run: Run, plant: type[Plant]) -> Law:
    """The law on all coordinates of a plant, in their order, feeding its first input.

    Raises
    ------
    BadInput
        When the law reads a coordinate that the plant does not have.
    """
    names = [c.name for c in plant.coordinates]
    for name in loop.law.measured:
        if name not in names:
            raise BadInput(f"the law of run '{run.label}' reads '{name}'; {plant.__name__} has {', '.join(names)}.")
    law = loop.law.over(names, len(plant.inputs))
    if not loop.quantized:
        return replace(law, command_resolution=0.0)
    steps = dict(zip(run.measured, run.resolution, strict=False))
    return replace(law, resolution=[steps.get(name, 0.0) for name in names])


def remembering(solver: Simulator, run: Run, restarts: NDArray[np.int64], lanes: int) -> Simulator:
    """A solver whose law starts each window with the memory that the recorded motion had given it by then."""
    if run.loop is None or not isinstance(solver.loop, Law) or not len(run.loop.law.A):
        return solver
    _, z = run.loop.follow(run.y, run.measured)
    return replace(solver, loop=replace(solver.loop, initial=np.repeat(z[restarts].T, lanes, axis=1), begin=None))


def finely(held: Held, every: int) -> Held:
    """A prescribed motion at the law's rate."""
    if every == 1 or held.q is None:
        return held
    return Held(q=finer(np.asarray(held.q, dtype=np.float64), every))


STRETCH = 2
"""Warming-ups that a stretch lasts; warming up then costs half as much again."""

EASE = 0.05
"""Share of a coordinate's own forces with which the search for the random force begins."""


def predicted(
    solver: Simulator, track: Track, values: Mapping[str, float | Array], offsets: Array, scales: Array | None,
    *, samples: int,
) -> Array:  # fmt: skip
    """Outputs (samples, W, outputs, lanes) as the sensors show them, at the first `samples` horizons of each restart.

    Parameters
    ----------
    values : mapping
        Every parameter, a number or one per lane, (lanes,); ``noise.COORDINATE`` among them.
    offsets, scales : (outputs, lanes) arrays
        Sensor offsets and gains, the latter 1 when omitted.
    """
    x = restart_states(solver, track, values, offsets, scales)
    states = len(_plan(track).equilibrium)
    _, windows, lanes = x.shape
    ahead = _plan(track).samples[:samples]
    every = math.gcd(*ahead)
    table, drift = _table(solver, values, windows, lanes)
    table[drift] += x[states:].reshape(-1, windows * lanes)
    motion = solver.run(
        table, x[:states].reshape(states, -1), track.u,
        samples=ahead[-1] // every + 1, every=every, start=np.repeat(track.restarts, lanes),
    )  # fmt: skip
    y = motion[[a // every for a in ahead]][:, list(track.columns)].reshape(len(ahead), -1, windows, lanes)
    y = np.moveaxis(y, 1, 2)
    return y + offsets if scales is None else y * scales + offsets


def restart_states(
    solver: Simulator, track: Track, values: Mapping[str, float | Array], offsets: Array, scales: Array | None
) -> Array:
    """Filtered states, then drifts of the inputs, (states + inputs, W, lanes) at the restarts.

    Each knows samples up to its own and none after.
    """
    lanes, plan = offsets.shape[1], _plan(track)
    stretch = STRETCH * plan.warm
    first, last = int(track.restarts[0]) - plan.warm, int(track.restarts[-1])
    begin = np.arange(first, last - plan.warm + 1, stretch, dtype=np.int64)
    count, steps = begin.size, min(plan.warm + stretch, last - first + 1)
    gain = gains(solver, track, values, steps, lanes)
    table, drift = _table(solver, values, count, lanes)
    still = table[drift]
    states, columns = len(plan.equilibrium), list(track.columns)
    scale = np.ones_like(offsets) if scales is None else scales
    x = np.zeros((states + len(still), count, lanes))
    x[:states] = plan.equilibrium[:, None, None]
    x[columns] = (track.y.T[:, begin, None] - offsets[:, None]) / scale[:, None]
    place = np.full(last + 1, -1)
    place[track.restarts] = np.arange(track.restarts.size)
    out = np.full((len(x), track.restarts.size, lanes), np.nan)
    stepping = solver.stepping(table, x[:states].reshape(states, -1), track.u)
    filter_record(
        stepping, x.reshape(len(x), -1), begin, still, drift, track.y, offsets, scale, gain, columns, place, out,
        warm=plan.warm, steps=steps,
    )  # fmt: skip
    return out


def gains(solver: Simulator, track: Track, values: Mapping[str, float | Array], steps: int, lanes: int) -> Array:
    """Kalman gains (samples, outputs, states, lanes) from the first of a stretch, which is zero, until they settle."""
    return filtering(solver, track, values, steps, lanes)[0]


def filtering(
    solver: Simulator, track: Track, values: Mapping[str, float | Array], steps: int, lanes: int
) -> tuple[Array, Array]:
    """As `gains`, and the covariance (lanes, S, S) of states and drifts of the inputs that they leave at the last."""
    Phi, Q = discrete_model(solver, track, values, lanes)
    plan = _plan(track)
    initial = np.concatenate([plan.initial, plan.drift])
    return kalman_gains(Phi, Q, np.asarray(plan.sensor), list(track.columns), initial, steps)


def discrete_model(
    solver: Simulator, track: Track, values: Mapping[str, float | Array], lanes: int
) -> tuple[Array, Array]:
    """Transition matrix over one sample and covariance of the process noise, (lanes, S, S) for states and drifts.

    Van Loan's (1978) integral of ``x' = A x + B w``, `w` white with the roots of its densities in ``noise.COORDINATE``
    and ``noise.INPUT``; the latter make the drift of a command.
    """
    from scipy.linalg import expm

    d = solver.derived
    point = {c: float(_plan(track).equilibrium[2 * i]) for i, c in enumerate(d.coordinates)}
    M, D, K, G = small_motions(d, {**values, **point}, (lanes,))
    n = len(d.coordinates)
    for i in np.flatnonzero(G.any(axis=(0, 2))):
        D[:, i, i] += values["actuator.slope"]  # back-EMF
    free = [i for i in range(n) if i not in solver.flavour.held]
    inputs = range(len(d.inputs))
    S, w = 2 * n + len(inputs), n + len(inputs)
    A, B = np.zeros((lanes, S, S)), np.zeros((lanes, S, w))
    inner = np.ix_(range(lanes), free, free)
    inverse = np.full((lanes, n, n), np.nan)
    sound = np.abs(np.linalg.det(M[inner])) > 0
    inverse[np.ix_(np.flatnonzero(sound).tolist(), free, free)] = np.linalg.inv(M[inner][sound])
    speeds = [2 * i + 1 for i in free]
    A[:, [2 * i for i in free], speeds] = 1.0
    turned = inverse[inner]
    A[np.ix_(range(lanes), speeds, [2 * i for i in free])] = -turned @ K[inner]
    A[np.ix_(range(lanes), speeds, speeds)] = -turned @ D[inner]
    command = turned @ G[:, free] * np.reshape(values["actuator.gain"], (-1, 1, 1))
    A[np.ix_(range(lanes), speeds, [2 * n + j for j in inputs])] = command
    B[np.ix_(range(lanes), speeds, free)] = turned * _levels(values, [d.coordinates[i] for i in free])
    B[:, [2 * n + j for j in inputs], [n + j for j in inputs]] = _levels(values, d.inputs)[..., 0, :]
    whole = np.zeros((lanes, 2 * S, 2 * S))
    whole[:, :S, :S] = -A
    whole[:, :S, S:] = B @ B.transpose(0, 2, 1)
    whole[:, S:, S:] = A.transpose(0, 2, 1)
    bad = ~np.isfinite(whole).all(axis=(1, 2))
    whole[bad] = 0.0
    E: Array = np.asarray(expm(whole * track.dt), dtype=np.float64)
    Phi: Array = np.ascontiguousarray(E[:, S:, S:].transpose(0, 2, 1))
    Phi[bad] = np.nan
    return Phi, Phi @ E[:, :S, S:]


def _levels(values: Mapping[str, float | Array], names: Sequence[str]) -> Array:
    """Levels of noise (lanes or 1, 1, names)."""
    levels = np.broadcast_arrays(*(np.asarray(values.get(f"{NOISE}{n}", 0.0), dtype=np.float64) for n in names))
    return np.array([np.atleast_1d(v) for v in levels]).T[:, None, :]


def _table(
    solver: Simulator, values: Mapping[str, float | Array], times: int, lanes: int
) -> tuple[Array, NDArray[np.int64]]:
    """Rows of parameters for the lanes of every window or stretch, and which rows hold the inputs' offsets."""
    tiled = {n: np.tile(v, times) if isinstance(v, np.ndarray) else v for n, v in values.items()}
    rows = [r for r, name in enumerate(solver.names) if name == "actuator.offset"]
    return solver.table(tiled, times * lanes), np.array(rows, dtype=np.int64)


def _plan(track: Track) -> FilterPlan:
    assert track.ahead is not None
    return track.ahead


def with_noise(rig: GreyBox, runs: Sequence[Run]) -> GreyBox:
    """The rig with the levels of process noise that filters of these runs need, to estimate unless it has them."""
    filtered = [run for run in runs if run.filtered]
    moving = {c for run in filtered for c in run.measured if c not in run.held}
    driven = {i.name for run in filtered for k, i in enumerate(rig.plant.inputs) if np.ptp(run.u[:, k]) > 0}
    if all(f"{NOISE}{c}" in rig.parameters for c in moving | driven):
        return rig
    run = filtered[0]
    values: dict[str, float] = {**base_values(rig), **run.known}
    level = dict(zip(rig.plant.state_names(), nearest_equilibrium(rig, run), strict=True))
    M, _, _, _ = small_motions(rig.plant.derived(), {**values, **level})
    parameters = dict(rig.parameters)
    for i, c in enumerate(rig.plant.coordinates):
        if c.name not in moving or f"{NOISE}{c.name}" in parameters:
            continue
        y = next(r.y[:, r.measured.index(c.name)] for r in filtered if c.name in r.measured)
        force = float(M[i, i]) * float(np.std(y)) / run.horizons[0] ** 2
        parameters[f"{NOISE}{c.name}"] = Parameter(
            name=f"{NOISE}{c.name}", value=EASE * force * math.sqrt(run.horizons[0]) or 1e-9,
            unit=f"{'N m' if c.unit == 'rad' else 'N'} s^(1/2)", estimate=True, lower=0.0,
            meaning=f"random force on {c.name}, root of its density",
        )  # fmt: skip
    for k, i in enumerate(rig.plant.inputs):
        if i.name in driven and f"{NOISE}{i.name}" not in parameters:
            size = max(float(np.std(r.u[:, k])) for r in filtered)
            unit = rig.parameters["actuator.offset"].unit if "actuator.offset" in rig.parameters else "1"
            parameters[f"{NOISE}{i.name}"] = Parameter(
                name=f"{NOISE}{i.name}", value=0.1 * DRIFT * size, unit=f"{unit} s^(-1/2)", estimate=True, lower=0.0,
                meaning=f"drift of the command of {i.name}, root of its variance per time",
            )  # fmt: skip
    return replace(rig, parameters=parameters)
