"""What stands in for the rig of the paper's experiment 4? A digital twin of the ECP 205 with the A51 pendulum.

Nothing about the A51 is published, so its rod and weight are plausible brass parts from a shop; the disk carries two
500 g masses at 6.5 cm, which puts the unstable pole of the upright rig near the paper's 7.98 rad/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.control.rig import Rig
from upright.errors import BadInput
from upright.physics import CartPendulum, Furuta
from upright.records import Provenance, Record

COUNTS = 16_000
"""Encoder counts per turn of both joints (ECP 205)."""
SERVO = 0.884e-3
"""Servo period of the ECP controller [s]; it logs every n-th sample."""

_BRASS = 8500.0  # kg/m^3


@dataclass(frozen=True, kw_only=True)
class BrassPendulum:
    """Hollow rod hinged at its end with a disk-shaped weight on it, all brass; lengths [m].

    `weight_at` is the distance from the hinge to the middle of the weight.
    """

    length: float = 0.330
    outer: float = 9.53e-3
    bore: float = 7.94e-3
    weight_diameter: float = 44e-3
    weight_thickness: float = 6e-3
    weight_at: float = 0.200

    def parameters(self) -> dict[str, float]:
        """Mass, centre of gravity, transverse and axial inertia by the names of `Furuta`, from solid geometry."""
        rod = _BRASS * math.pi / 4 * (self.outer**2 - self.bore**2) * self.length
        weight = _BRASS * math.pi / 4 * (self.weight_diameter**2 - self.outer**2) * self.weight_thickness
        m_p = rod + weight
        l_cg = (rod * self.length / 2 + weight * self.weight_at) / m_p
        rod_square, weight_square = self.outer**2 + self.bore**2, self.weight_diameter**2 + self.outer**2
        transverse_rod = rod * (self.length**2 / 12 + rod_square / 16 + (self.length / 2 - l_cg) ** 2)
        transverse_weight = weight * (self.weight_thickness**2 / 12 + weight_square / 16 + (self.weight_at - l_cg) ** 2)
        axial = (rod * rod_square + weight * weight_square) / 8
        return {"m_p": m_p, "l_cg": l_cg, "J_p": transverse_rod + transverse_weight, "J_a": axial}


NOMINAL = Furuta(
    **BrassPendulum().parameters(),
    r=0.150,
    J_d=7.2e-3,  # disk 2.5e-3, arm 0.5e-3, two 500 g masses at 6.5 cm 4.2e-3
    b_1=6e-4,  # drive belt off
    b_1c=1.5e-3,
    b_2=3e-5,
    b_2c=2.5e-4,
)
"""The rig as designed."""


MOTOR_AND_BELT = 5e-4
"""Inertia that the disk loses with its drive belt [kg m^2], by the maker's guide."""
_BELT_OFF = {"b_1": 0.3, "b_1c": 0.1875}  # share of the friction that the disk's own bearings have


@dataclass(frozen=True, kw_only=True)
class Twin:
    """A pendulum rig for free swings: its true parameters, counts per m or rad, and the seed it was drawn with."""

    truth: Furuta | CartPendulum
    seed: int
    name: str = "ECP 205 + A51"
    counts: tuple[float, ...] = (COUNTS / (2 * math.pi),) * 2

    @property
    def base(self) -> str:
        """Coordinate of what carries the pendulum: ``"psi"`` or ``"x"``."""
        return self.truth.coordinates[0].name

    def changed(self, **parameters: float) -> Twin:
        """The same rig after a change, such as ``tilt_y`` when it is out of level or ``k_psi`` when anchored."""
        return replace(self, truth=self.truth.replace(**parameters))


def freed(rig: Rig) -> Twin:
    """A pendulum rig with its drive out of the way: a disk's belt is taken off, a cart pulls its silent motor along."""
    plant = rig.plant
    if isinstance(plant, Furuta):
        own = {name: share * getattr(plant, name) for name, share in _BELT_OFF.items()}
        plant = plant.replace(J_d=plant.J_d - MOTOR_AND_BELT, **own)
    elif not isinstance(plant, CartPendulum):
        raise BadInput(f"a free swing needs a pendulum on a cart or a disk, and {rig.name} has none.")
    return Twin(truth=plant, seed=rig.seed, name=rig.name.split(",")[0], counts=rig.counts)


@dataclass(frozen=True, kw_only=True)
class Release:
    """How the pendulum was let go: angle held at [rad], and the speed a hand gave its base by mistake [SI]."""

    angle: float = math.pi / 2
    push: float = 0.0


def motion(
    rig: Twin, release: Release | None = None, *, seconds: float, every: int = 8
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What really happens after a release: time (N,) [s] and states (N, 4) [SI]."""
    from upright.simulation import simulate

    release = release or Release()
    x0 = rig.truth.state("hanging", **{f"{rig.base}_dot": release.push, "theta": release.angle})
    rows = round(seconds / SERVO / every) + 1
    x = simulate(rig.truth, {}, x0, None, SERVO, samples=rows, every=every)[:, :, 0]
    return np.linspace(0.0, (rows - 1) * every * SERVO, rows), x


def acquire(
    rig: Twin, release: Release | None = None, *, seconds: float = 12.0, every: int = 8, shot: int = 0
) -> Record:
    """Log of both encoders after a release.

    Parameters
    ----------
    rig : Twin
    release : Release, optional
        From horizontal, its base at rest, when omitted; no hand holds an angle better than a degree.
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
    names = tuple(c.name for c in rig.truth.coordinates)
    return Record(
        t=t,
        signals={n: counts[:, i] for i, n in enumerate(names)},
        units=dict.fromkeys(names, "counts"),
        outputs=names,
        provenance=Provenance(
            reader="twin",
            rig=f"digital twin of {rig.name}, seed {rig.seed}",
            notes=("This log was simulated; no rig was touched.",),
        ),
    )
