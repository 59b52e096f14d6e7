"""What a drive adds to the linear model of its plant, and the command at which it gives all that it can."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from upright.physics import Plant
from upright.physics.actuator import ACTUATOR
from upright.systems import StateSpace

GAIN = "actuator.gain"
MORE = ACTUATOR.keys() - {f"actuator.{n}" for n in ("gain", "limit", "delay", "lag", "offset", "start", "end")}
"""Numbers of a drive besides its gain, limit, delay, lag and offset."""


def driven(plant: Plant, drive: Mapping[str, float], at: str, *, side: float = 0.0) -> StateSpace:
    """Model about an equilibrium from the command to the coordinates, with what the drive takes for speed.

    The drive gives gain u less its slope and its braking, times the speed of what it drives; that braking is at work
    while a loop runs.
    """
    model = plant.linear(at, side=side)
    A, names = model.A, plant.state_names()
    lost = sum(drive.get(f"actuator.{n}", 0.0) for n in ("slope", "damping", "standby"))
    if lost:
        A = A.copy()
        for i, force in enumerate(plant.inputs):
            A[:, names.index(force.on) + 1] -= lost * model.B[:, i]
    return replace(model, A=A, B=model.B * drive[GAIN])


def full_command(drive: Mapping[str, float]) -> float:
    """Command at which the force of a drive at rest meets its limit; infinite for a drive without one."""
    force, gain = drive.get("actuator.force_limit", math.inf), abs(drive[GAIN])
    left = gain - force * drive.get("actuator.droop", 0.0) if math.isfinite(force) else 0.0
    return force / left + drive.get("actuator.dead_zone", 0.0) if left > 0 else math.inf


def saturation(drive: Mapping[str, float]) -> float:
    """Smallest command at which a drive gives all that it can, at rest: that of its command or of its force."""
    return min(drive.get("actuator.limit", math.inf), full_command(drive))
