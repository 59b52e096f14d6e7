"""Force that a drive gives at measured speeds: what the kernel computes, without a simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from upright.physics.plant import Plant

Array = NDArray[np.float64]


def drive_force(plant: type[Plant], values: Mapping[str, float], u: Array, v: Array, dt: float) -> Array:
    """Force of every input (inputs, N), actuator and its delays included; `kernel.drive` has the equations.

    A mean over each sample, but for what lags, which is given at its beginning.

    Parameters
    ----------
    plant : class of a plant
    values : mapping
        The actuator's numbers by name, such as ``"actuator.gain"``.
    u, v : array, shape (inputs, N) and (coordinates, N)
        Commands and speeds at the samples.
    dt : float
        Sample time [s].
    """
    out = np.empty_like(u)
    k = np.arange(u.shape[1], dtype=np.float64)
    a = {name.removeprefix("actuator."): v for name, v in values.items() if name.startswith("actuator.")}
    # a switch inside a sample counts by its share
    alive = np.clip(a["end"] / dt - k, 0.0, 1.0)
    on = np.maximum(alive - np.clip(a["start"] / dt - k, 0.0, 1.0), 0.0)
    for i, drive in enumerate(plant.inputs):
        speed = v[[c.name for c in plant.coordinates].index(drive.on)]
        command = np.interp(k - a["delay"] / dt, k, np.clip(u[i], -a["limit"], a["limit"]) + a["offset"])
        commanded = np.interp(k - a["delay"] / dt, k, (u[i] != 0.0).astype(np.float64)) * on
        force = a["gain"] * _lagging(command, a["lag"] / dt, float(command[0]))
        beyond = np.maximum(np.sign(force) * speed - a["knee"], 0.0)
        braked = speed - np.sign(force) * beyond * commanded
        braking = (a["damping"] * commanded + a["standby"] * alive) * braked
        force = np.sign(force) * np.maximum(np.abs(force) - a["fade"] * beyond, 0.0)
        out[i] = force * on - a["slope"] * speed - _lagging(braking, a["relaxation"] / dt, 0.0)
    return out


def _lagging(u: Array, samples: float, first: float) -> Array:
    """Answer of a first-order lag of some samples to inputs (N,) held between them, from `first` on."""
    from scipy.linalg import solve_banded  # scipy.signal's filters would take longer to import than to run

    if not samples > 0:
        return u
    keep = math.exp(-1.0 / samples)
    # y[k] - keep y[k-1] = (1 - keep) u[k-1]
    right = np.concatenate([[first], (1.0 - keep) * u[:-1]])
    return np.asarray(solve_banded((1, 0), [np.ones(u.size), np.full(u.size, -keep)], right), dtype=np.float64)
