"""How does the solver move one run, with many sets of numbers side by side, and with the law that closed its loop?"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.loop import ClosedLoop, finer
from upright.errors import BadInput
from upright.identification.model.rig import NOISE, Rig
from upright.identification.model.runs import Run
from upright.identification.problem.predictor import predicted
from upright.identification.problem.tracks import Track
from upright.laws import Law
from upright.physics import Plant
from upright.simulation import Held, Simulator, choose

Array = NDArray[np.float64]


def simulator(rig: Rig, track: Track, values: Mapping[str, float | Array], free: Collection[str]) -> Simulator:
    """Solver of one run; terms whose parameters are in `free` stay although they are zero now."""
    derived = rig.plant.derived_for({**values, **dict.fromkeys(free, 1.0)})
    free = [n for n in free if n in derived.parameters or n.startswith("actuator.")]
    loop = track.run.loop
    every = 1 if loop is None else loop.every
    held = {n: finely(h, every) for n, h in track.held.items()}
    law = None if loop is None else controller(loop, track.run, rig.plant)
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
    scales: Array | None = None, *, samples: int,
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
    """
    if track.ahead:
        y = predicted(solver, track, values, offsets, scales, samples=samples)
        return y * track.ahead.weight[:samples, None, None, None]
    _, windows, lanes = x0.shape
    out = motions(solver, track, values, x0, samples=samples)
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


def controller(loop: ClosedLoop, run: Run, plant: type[Plant]) -> Law:
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
        return replace(law, command_quantum=0.0)
    steps = dict(zip(run.measured, run.quantum, strict=False))
    return replace(law, quantum=[steps.get(name, 0.0) for name in names])


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
