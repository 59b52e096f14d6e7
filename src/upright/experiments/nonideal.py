"""Twins with what models leave out, so that a fit of one reads as a fit of a real rig does.

Sizes are those of the misfit benchmark, which are those of logs of real rigs: friction larger close to rest (Stribeck,
by 10 to 50 %), torque that ripples with the drive's angle (up to a fifth of its dry friction, some 1 % of a command
that moves it), a frame out of level by up to 0.3 degrees, commands up to 2 ms late, play of the encoders (up to 0.06
degrees or 50 um) and encoders off centre (up to 0.1 degrees of their shaft).
"""

from __future__ import annotations

import math

import numpy as np

from upright.physics import CartPendulum, Furuta, Plant
from upright.physics.nonideal import NonidealCartPendulum, NonidealFuruta
from upright.rig import Rig
from upright.rig.mounting import Mounting

TURN = {"rad": 2 * math.pi, "m": 0.0706}
"""Motion per turn of an encoder's shaft, by unit of the coordinate."""
PLAY = {"rad": 1e-3, "m": 5e-5}
STRIBECK_SPEED = {"rad": 0.25, "m": 0.025}
"""Speed at which the excess of friction close to rest has faded to a third, by unit of the joint's motion."""
EXCESS = (0.1, 0.5)
RIPPLE, RIPPLES = 0.2, (6, 24)
"""Most share of the drive's dry friction, and how often on a turn of its shaft."""
TILT, LATE, OFF_CENTRE = math.radians(0.3), 2e-3, math.radians(0.1)


def nonideal(rig: Rig, seed: int) -> Rig:
    """The rig of a make with flaws of its own, its name and numbers as they were.

    Parameters
    ----------
    seed : int
        Of the flaws.
    """
    rng = np.random.default_rng([seed, 67])
    units = [c.unit for c in rig.plant.coordinates]
    size = len(units)
    mounting = Mounting(
        play=tuple(rng.uniform(0, PLAY[u]) for u in units),
        off_centre=tuple(rng.uniform(0, OFF_CENTRE) * TURN[u] / (2 * math.pi) for u in units),
        phase=tuple(rng.uniform(0, 2 * math.pi, size).tolist()), turn=tuple(TURN[u] for u in units),
    )  # fmt: skip
    late = rig.delay + rng.uniform(0, LATE)
    return rig.replace(plant=_nonideal_plant(rig, rng), delay=float(late), mounting=mounting)


def _nonideal_plant(rig: Rig, rng: np.random.Generator) -> Plant:
    plant = rig.plant
    values = plant.parameters()
    units = {c.name: c.unit for c in plant.coordinates}
    excess = 1 + rng.uniform(*EXCESS)
    for joint in plant.joints:
        if joint.stiction and values[joint.coulomb] > 0:
            speed = STRIBECK_SPEED[units[joint.on]]
            values |= {joint.stiction: values[joint.coulomb] * excess, joint.stribeck_speed: speed}
    force, around = rng.uniform(0, RIPPLE) * values[plant.joints[0].coulomb], rng.integers(*RIPPLES)
    phase, tilt, towards = rng.uniform(0, 2 * math.pi), math.sin(rng.uniform(-TILT, TILT)), rng.uniform(0, 2 * math.pi)
    if isinstance(plant, Furuta):
        lean = {"tilt_x": tilt * math.cos(towards), "tilt_y": tilt * math.sin(towards)}
        return NonidealFuruta(**values | lean, T_r=force, n_r=float(around), phi_r=phase)
    if isinstance(plant, CartPendulum):
        per_metre = 2 * math.pi * around / TURN["m"]
        return NonidealCartPendulum(**values, F_r=force, n_r=per_metre, phi_r=phase, slope=tilt)
    return plant.replace(**values)
