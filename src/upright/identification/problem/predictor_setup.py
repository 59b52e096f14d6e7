"""What does a filter have to know before it follows a record: where the plant stands, what the sensors see, how far."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.identification.model.model import NOISE, Parameter, Rig, Run
from upright.signals.smoothing import State

Array = NDArray[np.float64]

WARM = 4.0
"""Longest horizons that a filter follows the record before anything is predicted from its state.

What it would learn from an older past matters for the slow modes only, which the horizons hardly feel.
"""

GROWTH = 1.5
"""Power of the horizon with which the position of a free mass strays under a white random force.

Residuals are divided by it, so that no horizon outvotes another: unweighted, the longest has nearly all of the cost,
and a pole that is too slow makes it smaller, because it amplifies the error of the state less.
"""

EASE = 0.05
"""Share of a coordinate's own forces with which the search for the random force begins."""

DRIFT = 0.003
"""Share of a command by which its drift is uncertain when a filter begins.

A cable or a bearing pulls a little differently from second to second; what lasts is `input_offset`.
"""


@dataclass(frozen=True, kw_only=True)
class Ahead:
    """How a run is predicted by a filter.

    Attributes
    ----------
    samples : tuple of int
        Samples ahead, fewest first.
    warm : int
        Samples that the filter follows before its state is used.
    level : (states,) array
        Where the plant stands: the equilibrium nearest to the record, at its mean where that leaves a choice.
    sensor : (outputs,) array
        Variance of a measurement.
    doubt : (states,) array
        Variance of the states that a filter begins with.
    drift : (inputs,) array
        Variance of the drift of each command that a filter begins with.
    weight : (H,) array
        What a residual at each horizon counts.
    """

    samples: tuple[int, ...]
    warm: int
    level: Array
    sensor: Array
    doubt: Array
    drift: Array
    weight: Array


def look_ahead(rig: Rig, run: Run, dt: float, start: State, noise: Array) -> tuple[Ahead, NDArray[np.int64]]:
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
    quantum = np.array(run.quantum or (0.0,) * len(run.measured))
    sensor = np.where(quantum > 0, quantum**2 / 12, np.maximum(noise, 1e-6 * start.spread[_places(names, run)]) ** 2)
    doubt = start.spread**2
    for k, i in enumerate(_places(names, run)):
        doubt[i] = sensor[k]
    for n in run.held:
        doubt[names.index(n) : names.index(n) + 2] = 0.0
    ahead = Ahead(
        samples=samples, warm=warm, level=_level(rig, run), sensor=sensor, doubt=doubt,
        drift=(DRIFT * run.u.std(axis=0)) ** 2, weight=(samples[0] / np.array(samples)) ** GROWTH,
    )  # fmt: skip
    return ahead, restarts


def _places(names: Sequence[str], run: Run) -> list[int]:
    return [names.index(c) for c in run.measured]


def _level(rig: Rig, run: Run) -> Array:
    """States (states,) of the equilibrium nearest to the record; turns are counted from it."""
    names = rig.plant.state_names()
    units = {c.name: c.unit for c in rig.plant.coordinates}
    mean = {c: float(run.y[:, k].mean()) for k, c in enumerate(run.measured)}
    mean |= {c: float(np.mean(v)) for c, v in run.held.items()}
    best: tuple[float, Array] | None = None
    for place in rig.plant.equilibria.values():
        x, far = np.zeros(len(names)), 0.0
        for c, unit in units.items():
            x[names.index(c)] = value = mean.get(c, place.get(c, 0.0))
            if c in place and c in mean:
                turn = 2 * math.pi if unit == "rad" else math.inf
                near = place[c] + (turn * round((value - place[c]) / turn) if math.isfinite(turn) else 0.0)
                far += (value - near) ** 2
                x[names.index(c)] = near
        if best is None or far < best[0]:
            best = far, x
    assert best is not None
    return best[1]


def with_noise(rig: Rig, runs: Sequence[Run]) -> Rig:
    """The rig with the levels of process noise that filters of these runs need, to estimate unless it has them."""
    from upright.identification.model.unknowns import base_values
    from upright.physics.equations import small_motions

    filtered = [run for run in runs if run.restart == "kalman" and run.horizon is not None]
    moving = {c for run in filtered for c in run.measured if c not in run.held}
    driven = {i.name for run in filtered for k, i in enumerate(rig.plant.inputs) if np.ptp(run.u[:, k]) > 0}
    if all(f"{NOISE}{c}" in rig.parameters for c in moving | driven):
        return rig
    run = filtered[0]
    values: dict[str, float] = {**base_values(rig), **run.known}
    level = dict(zip(rig.plant.state_names(), _level(rig, run), strict=True))
    M, _, _, _ = small_motions(rig.plant.derived(), {**values, **level})
    found = dict(rig.parameters)
    for i, c in enumerate(rig.plant.coordinates):
        if c.name not in moving or f"{NOISE}{c.name}" in found:
            continue
        y = next(r.y[:, r.measured.index(c.name)] for r in filtered if c.name in r.measured)
        force = float(M[i, i]) * float(np.std(y)) / run.horizons[0] ** 2
        found[f"{NOISE}{c.name}"] = Parameter(
            name=f"{NOISE}{c.name}", value=EASE * force * math.sqrt(run.horizons[0]) or 1e-9,
            unit=f"{'N m' if c.unit == 'rad' else 'N'} s^(1/2)", estimate=True, lower=0.0,
            meaning=f"random force on {c.name}, root of its density",
        )  # fmt: skip
    for k, i in enumerate(rig.plant.inputs):
        if i.name in driven and f"{NOISE}{i.name}" not in found:
            size = max(float(np.std(r.u[:, k])) for r in filtered)
            unit = rig.parameters["actuator.offset"].unit if "actuator.offset" in rig.parameters else "1"
            found[f"{NOISE}{i.name}"] = Parameter(
                name=f"{NOISE}{i.name}", value=0.1 * DRIFT * size, unit=f"{unit} s^(-1/2)", estimate=True, lower=0.0,
                meaning=f"drift of the command of {i.name}, root of its variance per time",
            )  # fmt: skip
    return replace(rig, parameters=found)
