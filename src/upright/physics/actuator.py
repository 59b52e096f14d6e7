"""Numbers that every drive has besides the plant's own parameters, and the force it gives at measured speeds.

``force = clip(F_c(lag(delay(gain w / (1 + droop |w|)))) on(t) - slope v, force_limit) - B`` with
``w = sign(c) max(|c| - dead_zone, 0)`` and ``c = clip(u, limit) + offset``: the drive is alive, ``on``, from `start` to
`end`; F_c loses `fade` for each unit of speed beyond `knee`; and the braking ``B``, `damping` and `damping_rise` for
each unit of command while the drive is alive and commanded and `standby` until it trips, times the speed, needs
`relaxation` to build up and to fade.

An H-bridge is this with what it is already called: its dead zone; PWM steps, the `converter` of a rig; back-EMF, the
`slope` (k_t k_e/R of a motor on voltage); a supply that sags under its own current, `droop`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upright.physics.plant import Plant


class DriveNumber(NamedTuple):
    """One number of a drive; `default` is the value at which it does nothing."""

    unit: Literal[
        "force per command", "command", "time", "speed", "force per speed", "force", "per command",
        "force per speed per command",
    ]  # fmt: skip
    meaning: str
    default: float
    never_negative: bool = False


ACTUATOR = {
    "actuator.gain": DriveNumber("force per command", "force per unit of command", 1.0),
    "actuator.offset": DriveNumber("command", "added to the command", 0.0),
    "actuator.limit": DriveNumber("command", "command limit", math.inf, True),
    "actuator.lag": DriveNumber("time", "first-order lag", 0.0, True),
    "actuator.delay": DriveNumber("time", "dead time", 0.0, True),
    "actuator.slope": DriveNumber("force per speed", "force lost per speed (back-EMF)", 0.0),
    "actuator.start": DriveNumber("time", "when the drive comes alive, from the run's first sample", -math.inf),
    "actuator.end": DriveNumber(
        "time", "when the drive trips, from the run's first sample; no force after it", math.inf
    ),
    "actuator.damping": DriveNumber(
        "force per speed", "damping while the drive is alive and its command is not zero", 0.0, True
    ),
    "actuator.standby": DriveNumber(
        "force per speed", "damping until the drive trips, whatever its command", 0.0, True
    ),
    "actuator.knee": DriveNumber(
        "speed", "speed in the force's direction beyond which fade acts and braking grows no more", math.inf, True
    ),
    "actuator.fade": DriveNumber(
        "force per speed", "force lost per speed beyond the knee, down to no force", 0.0, True
    ),
    "actuator.relaxation": DriveNumber("time", "time in which damping and standby build up and fade", 0.0, True),
    "actuator.droop": DriveNumber("per command", "gain lost with the command u: gain/(1 + droop |u|)", 0.0, True),
    "actuator.force_limit": DriveNumber(
        "force", "largest force that reaches the body, what the slope takes included", math.inf, True
    ),
    "actuator.damping_rise": DriveNumber(
        "force per speed per command", "damping added for each unit of command; negative takes away", 0.0
    ),
    "actuator.dead_zone": DriveNumber("command", "command that is lost to either side", 0.0, True),
}
"""By name, in the order of the kernel."""


Array = NDArray[np.float64]


def drive_force(plant: type[Plant], values: Mapping[str, float], u: Array, v: Array, dt: float) -> Array:
    """Force of every input (inputs, N), actuator and its delays included; `kernel.drive` has the equations.

    A mean over each sample, but for what lags, which is given at its beginning.

    Parameters
    ----------
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
        size = np.interp(k - a["delay"] / dt, k, np.abs(np.clip(u[i], -a["limit"], a["limit"]))) * on
        command = np.sign(command) * np.maximum(np.abs(command) - a.get("dead_zone", 0.0), 0.0)
        drooping = command / (1.0 + a["droop"] * np.abs(command))
        force = a["gain"] * _lagging(drooping, a["lag"] / dt, float(drooping[0]))
        beyond = np.maximum(np.sign(force) * speed - a["knee"], 0.0)
        braked = speed - np.sign(force) * beyond * commanded
        braking = (a["damping"] * commanded + a["damping_rise"] * size + a["standby"] * alive) * braked
        force = np.sign(force) * np.maximum(np.abs(force) - a["fade"] * beyond, 0.0)
        force = np.clip(force * on - a["slope"] * speed, -a["force_limit"], a["force_limit"])
        out[i] = force - _lagging(braking, a["relaxation"] / dt, 0.0)
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
