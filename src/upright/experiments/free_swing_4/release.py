"""A release of the pendulum, as experiment 4 simulates and logs it: the rig's drive is out of the way."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.control.rig import ServoRig
from upright.errors import BadInput
from upright.experiments.makes import MOTOR_AND_BELT, SERVO
from upright.physics import CartPendulum, Furuta
from upright.records import Record
from upright.records.record import of_twin

Array = NDArray[np.float64]

_BELT_OFF = {"b_1": 0.3, "b_1c": 0.1875}  # share of the friction that the disk's own bearings have


@dataclass(frozen=True, kw_only=True)
class Release:
    """How the pendulum was let go: angle held at [rad], and the speed a hand gave its carrier by mistake [SI]."""

    angle: float = math.pi / 2
    push: float = 0.0


def freed(rig: ServoRig) -> ServoRig:
    """A pendulum rig with its drive out of the way: a disk's belt is taken off, a cart pulls its silent motor along."""
    plant = rig.plant
    if isinstance(plant, Furuta):
        friction = {name: share * getattr(plant, name) for name, share in _BELT_OFF.items()}
        plant = plant.replace(J_d=plant.J_d - MOTOR_AND_BELT, **friction)
    elif not isinstance(plant, CartPendulum):
        raise BadInput(f"a free swing needs a pendulum on a cart or a disk, and {rig.name} has none.")
    return replace(rig, plant=plant, name=rig.name.split(",")[0])


def carrier(rig: ServoRig) -> str:
    """Coordinate of what carries the pendulum: ``"psi"`` or ``"x"``."""
    return rig.plant.coordinates[0].name


def motion(rig: ServoRig, release: Release | None = None, *, seconds: float, every: int = 8) -> tuple[Array, Array]:
    """What really happens after a release: time (N,) [s] and states (N, 4) [SI]."""
    from upright.simulation import simulate

    release = release or Release()
    x0 = rig.plant.state("hanging", **{f"{carrier(rig)}_dot": release.push, "theta": release.angle})
    rows = round(seconds / SERVO / every) + 1
    x = simulate(rig.plant, {}, x0, None, SERVO, samples=rows, every=every)[:, :, 0]
    return np.linspace(0.0, (rows - 1) * every * SERVO, rows), x


def acquire(
    rig: ServoRig, release: Release | None = None, *, seconds: float = 12.0, every: int = 8, shot: int = 0
) -> Record:
    """Log of both encoders after a release.

    Parameters
    ----------
    rig : ServoRig
        As `freed`.
    release : Release, optional
        From horizontal, its carrier at rest, when omitted; no hand holds an angle better than a degree.
    seconds : float
    every : int
        Servo periods per logged sample.
    shot : int
        Which repetition; each has its own small variation.

    Returns
    -------
    Record
        Columns ``psi`` (or ``x``) and ``theta`` in counts.
    """
    rng = np.random.default_rng([rig.seed, 40, shot])
    release = release or Release()
    meant = Release(angle=release.angle + rng.normal(0, 0.01), push=release.push)
    t, x = motion(rig, meant, seconds=seconds, every=every)
    counts = np.round(x[:, 0::2] * np.array(rig.counts))  # zeroed where both joints rest
    names = tuple(c.name for c in rig.plant.coordinates)
    return Record(
        t=t,
        signals={n: counts[:, i] for i, n in enumerate(names)},
        units=dict.fromkeys(names, "counts"),
        outputs=names,
        provenance=of_twin(rig.name, rig.seed),
    )
