"""Which force did the drive give at the measured speeds? What the kernel computes, without a simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from upright.physics.plant import Plant
from upright.signals.smoothing import first_order

if TYPE_CHECKING:
    from upright.identification.search.inverse_start import Sample

Array = NDArray[np.float64]


def effort(values: Mapping[str, float], sample: Sample, plant: type[Plant]) -> Array:
    """Force of every input (inputs, N), actuator and its delays included."""
    out = np.empty_like(sample.u)
    n = sample.u.shape[1]
    a = {name.removeprefix("actuator."): v for name, v in values.items() if name.startswith("actuator.")}
    late, lag = a["delay"] / sample.dt, a["lag"]
    t = np.arange(n) * sample.dt
    # a switch inside a sample counts by its share
    alive = np.clip((a["end"] - t) / sample.dt, 0.0, 1.0)
    on = np.maximum(alive - np.clip((a["start"] - t) / sample.dt, 0.0, 1.0), 0.0)
    for k, drive in enumerate(plant.inputs):
        v = sample.v[[c.name for c in plant.coordinates].index(drive.on)]
        command = np.clip(sample.u[k], -a["limit"], a["limit"]) + a["offset"]
        commanded = sample.u[k] != 0.0
        if late > 0:
            command = np.interp(np.arange(n) - late, np.arange(n), command)
        if lag > 0:
            command = first_order(command, math.exp(-sample.dt / lag))
        force = a["gain"] * command
        beyond = np.maximum(np.sign(force) * v - a["knee"], 0.0)
        braked = v - np.sign(force) * beyond * on * commanded
        force = np.sign(force) * np.maximum(np.abs(force) - a["fade"] * beyond, 0.0)
        braking = (a["damping"] * on * commanded + a["standby"] * alive) * braked
        if a["relaxation"] > 0:
            braking = first_order(braking, math.exp(-sample.dt / a["relaxation"]))
        out[k] = force * on - a["slope"] * v - braking
    return out
