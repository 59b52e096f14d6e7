"""Numbers that every drive has besides the plant's own parameters: unit, meaning, default and bound, said once.

``force = F_c(gain lag(delay(clip(u, limit) + offset))) on(t) - slope v - B``: the drive is alive, ``on``, from `start`
to `end`; F_c loses `fade` for each unit of speed beyond `knee`; and the braking ``B``, `damping` while the drive is
alive and commanded and `standby` until it trips, times the speed, needs `relaxation` to build up and to fade.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple


class DriveNumber(NamedTuple):
    """One number of a drive; `default` is the value at which it does nothing."""

    unit: Literal["force per command", "command", "time", "speed", "force per speed"]
    meaning: str
    default: float
    never_negative: bool = False


ACTUATOR = {
    "actuator.gain": DriveNumber("force per command", "force per unit of command", 1.0),
    "actuator.offset": DriveNumber("command", "added to the command", 0.0),
    "actuator.limit": DriveNumber("command", "largest command that passes", math.inf, True),
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
}
"""By name, in the order of the kernel."""
