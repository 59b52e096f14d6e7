"""Simulation of a plant from a given state, under commands or a law, one motion or many side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.laws.linear import Law
from upright.laws.rule import Rule
from upright.physics.equations import Derived
from upright.physics.plant import Plant
from upright.progress import Progress, silent
from upright.simulation.kernel.flavour import choose
from upright.simulation.simulator import Device, Held, Simulator
from upright.workers import Workers, cores, cut, spread

Array = NDArray[np.float64]


def simulate(
    plant: type[Plant] | Plant | Derived,
    params: Mapping[str, ArrayLike],
    x0: ArrayLike,
    u: ArrayLike | None,
    dt: float,
    *,
    samples: int,
    substeps: int = 1,
    start: ArrayLike = 0,
    loop: Law | Rule | None = None,
    held: Mapping[str, Held] | None = None,
    every: int = 1,
    threads: int = 1,
    strict: bool = False,
) -> Array:
    """Motion of a plant in one or many lanes, sample by sample.

    Each call looks at names and shapes anew, which takes longer than a short motion; what is called again and again
    with other numbers holds a `Simulator`.

    Parameters
    ----------
    plant : class of a plant, plant, or Derived
        A plant brings its own parameters; those in `params` replace them.
    params : mapping of str to float or array, shape (lanes,)
        Parameters by name; the actuator's as ``"actuator.gain"``, ``"actuator.offset"``, ``"actuator.limit"``,
        ``"actuator.lag"`` [s], ``"actuator.delay"`` [s], ``"actuator.slope"`` (defaults 1, 0, inf, 0, 0, 0);
        ``"actuator.start"`` and ``"actuator.end"`` [s from the first sample of `u`], between which the drive is alive;
        ``"actuator.damping"`` [force per speed] while the command is not zero, ``"actuator.standby"`` whatever it is;
        ``"actuator.relaxation"`` [s], the time in which that braking builds up and fades;
        ``"actuator.fade"``, force lost per speed beyond ``"actuator.knee"`` in the force's own direction;
        ``"actuator.droop"``, ``"actuator.force_limit"``, ``"actuator.damping_rise"``, ``"actuator.dead_zone"``: see
        `upright.physics.actuator`.
    x0 : array, shape (states,) or (lanes, states)
        Initial states: coordinate, its velocity, next coordinate, ...
    u : array, shape (T,) or (T, inputs), or None
        Input at the samples, held between them and after the last.
    dt : float
        Sample time [s].
    samples : int
        Rows returned, the first of which is `x0`.
    substeps : int
        Runge-Kutta steps per sample.
    start : int or int array, shape (lanes,)
        Sample of `u`, reference and held motion at which a lane begins: windows of one record are lanes.
    loop : Law or Rule, optional
        Sampled controller.
    held : mapping of str to Held, optional
        Coordinates whose motion is prescribed, or locked with ``Held()``.
    every : int
        Only each `every`-th sample is returned; `samples` counts what is returned, so `every` multiplies the work.
    threads : int
        Threads among which blocks of 16 lanes are shared.
    strict : bool
        Every operation is rounded by itself, in one order: the same bits on every processor.

    Returns
    -------
    array, shape (samples, states, lanes), or (samples, states + inputs, lanes) with a loop
        See `Simulator.run`.

    Raises
    ------
    BadInput
        When a name is unknown or missing, shapes do not fit together, or a strict motion needs the C library.
    """
    job = _prepare(plant, params, x0, u, dt, substeps, start, loop, held or {}, record=True, strict=strict)
    if strict and (called := job.simulator.library()):
        raise BadInput(
            f"a strict motion has the same bits everywhere, and the last bits of the C library's {', '.join(called)} "
            "are each system's own; leave strict out."
        )
    return job.simulator.run(job.table, job.x0, job.u, samples=samples, start=job.start, every=every, threads=threads)


@dataclass(frozen=True, kw_only=True, eq=False)
class Ensemble:
    """What many motions reduce to; lanes on the last axis.

    Attributes
    ----------
    largest : array, shape (coordinates, lanes)
        Largest absolute value of each coordinate at the samples.
    error : array, shape (coordinates, lanes)
        Largest distance from the target of a `Law`, else from zero, from the time `settle` on.
    saturated : array, shape (inputs, lanes)
        Share of the samples at which the command met its limit.
    final : array, shape (states, lanes)
        Last state. NaN or infinite, as are the others then, where a lane diverged.
    """

    largest: Array
    error: Array
    saturated: Array
    final: Array


def ensemble(
    plant: type[Plant] | Plant | Derived,
    params: Mapping[str, ArrayLike],
    x0: ArrayLike,
    u: ArrayLike | None,
    dt: float,
    *,
    samples: int,
    settle: float = 0.0,
    substeps: int = 1,
    start: ArrayLike = 0,
    loop: Law | Rule | None = None,
    held: Mapping[str, Held] | None = None,
    threads: int | None = None,
    workers: Workers | None = None,
    progress: Progress = silent,
    device: Device = "cpu",
) -> Ensemble:
    """Extremes and final states of many motions, without keeping the motions.

    Parameters are those of `simulate`; `settle` [s] is when errors begin to count, and `threads` defaults to the
    number of processors this process may use. With `workers` blocks of lanes are shared among those instead, one
    thread each, and `progress` is called; the numbers are the same. On the `device` ``"gpu"`` each lane is a thread of
    its own there, and they are the same to rounding.
    """
    if device == "gpu" and workers is not None:
        raise BadInput("an ensemble is computed by workers or on one GPU; leave workers or device='gpu' out.")
    job = _prepare(plant, params, x0, u, dt, substeps, start, loop, held or {}, record=False)
    lanes = job.x0.shape[1]
    if workers is None:
        own = (slice(0, lanes), job.table, job.x0, job.start)
        rows = _reduced(job, samples, settle, own, silent, threads or cores(), device)
    else:
        parts = [
            (p, job.table[:, p], job.x0[:, p], None if job.start is None else job.start[p])
            for p in cut(lanes, block(lanes))
        ]
        shared = replace(job, table=job.table[:, :0], x0=job.x0[:, :0], start=None)
        work = partial(_reduced, shared, samples, settle)
        rows = np.hstack(spread(work, parts, workers=workers, progress=progress, what="block of lanes").all())
    n, nu = len(job.simulator.derived.coordinates), len(job.simulator.derived.inputs)
    final = rows[2 * n + nu :]
    wrong = ~np.isfinite(final).all(axis=0)
    rows[: 2 * n, wrong] = np.nan
    return Ensemble(largest=rows[:n], error=rows[n : 2 * n], saturated=rows[2 * n : 2 * n + nu] / samples, final=final)


BLOCK, MANY, LARGEST = 256, 4096, 16384


def block(lanes: int) -> int:
    """Lanes of an ensemble that are one piece of work.

    Some tens of milliseconds at first; more when there would be more than 4096 pieces, each of which costs whoever
    hands it out a millisecond; and no more than fit into a few megabytes.
    """
    size = BLOCK
    while lanes > size * MANY and size < LARGEST:
        size *= 2
    return size


def _reduced(
    job: _Job, samples: int, settle: float, part: tuple[slice, Array, Array, NDArray[np.int64] | None],
    _progress: Progress, threads: int = 1, device: Device = "cpu",
) -> Array:  # fmt: skip
    """Rows of an ensemble (rows, lanes) for some of its lanes: which, their table, first states and first samples."""
    which, table, x0, start = part
    s = job.simulator
    stepper = s if s.loop is None else replace(s, loop=s.loop.of_lanes(which))
    return stepper.run(table, x0, job.u, samples=samples, start=start, threads=threads, settle=settle, device=device)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Job:
    simulator: Simulator
    table: Array
    x0: Array
    u: Array | None
    start: NDArray[np.int64] | None


def _prepare(
    plant: Any,
    params: Mapping[str, ArrayLike],
    x0: ArrayLike,
    u: ArrayLike | None,
    dt: float,
    substeps: int,
    start: ArrayLike,
    loop: Law | Rule | None,
    held: Mapping[str, Held],
    *,
    record: bool,
    strict: bool = False,
) -> _Job:
    values: dict[str, Any] = {**plant.parameters(), **params} if isinstance(plant, Plant) else dict(params)
    derived: Derived = plant if isinstance(plant, Derived) else plant.derived_for(values)
    flavour = choose(derived, values, held=held, loop=loop, record=record, strict=strict)
    friction = {
        name for j in derived.joints for name in (j.coulomb, j.quadratic, j.stiction, j.stribeck_speed, j.presliding)
    }
    missing = [name for name in derived.parameters if name not in values and name not in friction]
    if missing:
        raise BadInput(f"{derived.name} needs a value for {', '.join(missing)}; only friction may be left out.")
    first = np.asarray(x0, dtype=np.float64)
    first = first[None, :] if first.ndim == 1 else first
    nx = 2 * len(derived.coordinates)
    if first.ndim != 2 or first.shape[1] != nx:
        raise BadInput(f"x0 needs shape ({nx},) or (lanes, {nx}), got {np.shape(x0)}.")
    begin = np.asarray(start)
    if begin.dtype.kind not in "iu":
        raise BadInput(f"start counts samples and needs whole numbers, got {begin.dtype}.")
    sizes: dict[str, int] = {"x0": len(first), "start": begin.size}
    for name, value in values.items():
        if isinstance(value, float):
            continue
        if np.ndim(value) > 1:
            raise BadInput(f"{name} needs one value or one for each lane, got shape {np.shape(value)}.")
        sizes[name] = np.size(value)
    if loop is not None:
        sizes |= loop.widths()
    lanes = max(sizes.values())
    for name, size in sizes.items():
        if size not in (1, lanes):
            raise BadInput(f"{name} has {size} lanes where others have {lanes}; give one value or {lanes}.")
    simulator = Simulator(derived=derived, flavour=flavour, dt=dt, substeps=substeps, loop=loop, held=held)
    command = None
    if u is not None:
        command = np.asarray(u, dtype=np.float64)
        command = command[:, None] if command.ndim == 1 and len(derived.inputs) == 1 else command
    return _Job(
        simulator=simulator,
        table=simulator.table(values, lanes),
        x0=np.repeat(first.T, lanes, axis=1) if len(first) == 1 else first.T,
        u=command,
        start=None if not begin.any() else np.broadcast_to(begin.astype(np.int64).ravel(), (lanes,)),
    )
