"""Which force did the drive give at the measured speeds? What the kernel computes, without a simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from upright.physics.plant import Plant
from upright.signals.smoothing import first_order

Array = NDArray[np.float64]


def drive_force(plant: type[Plant], values: Mapping[str, float], u: Array, v: Array, dt: float) -> Array:
    """Force of every input (inputs, N), actuator and its delays included.

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
    n = u.shape[1]
    a = {name.removeprefix("actuator."): v for name, v in values.items() if name.startswith("actuator.")}
    late, lag = a["delay"] / dt, a["lag"]
    t = np.arange(n) * dt
    # a switch inside a sample counts by its share
    alive = np.clip((a["end"] - t) / dt, 0.0, 1.0)
    on = np.maximum(alive - np.clip((a["start"] - t) / dt, 0.0, 1.0), 0.0)
    for k, drive in enumerate(plant.inputs):
        speed = v[[c.name for c in plant.coordinates].index(drive.on)]
        command = np.clip(u[k], -a["limit"], a["limit"]) + a["offset"]
        commanded = u[k] != 0.0
        if late > 0:
            command = np.interp(np.arange(n) - late, np.arange(n), command)
        if lag > 0:
            command = first_order(command, math.exp(-dt / lag))
        force = a["gain"] * command
        beyond = np.maximum(np.sign(force) * speed - a["knee"], 0.0)
        braked = speed - np.sign(force) * beyond * on * commanded
        force = np.sign(force) * np.maximum(np.abs(force) - a["fade"] * beyond, 0.0)
        braking = (a["damping"] * on * commanded + a["standby"] * alive) * braked
        if a["relaxation"] > 0:
            braking = first_order(braking, math.exp(-dt / a["relaxation"]))
        out[k] = force * on - a["slope"] * speed - braking
    return out
