"""A release of the pendulum, its drive out of the way, and the drift of the disk or cart that carries it.

No torque but friction acts about the axis of a level, free disk, so the momentum about it, ``M_11 psi' + M_12
theta'``, can only be rubbed away. Released at rest it is zero: psi is a function of theta, swings
about a fixed centre, and creeps home only as friction takes hold. A push at the release gives momentum, an axis out
of level gives gravity a lever; a soft spring to ground, which the paper suggests, gives psi a home.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from upright.control.trial import twin_log
from upright.errors import BadInput
from upright.physics import CartPendulum, Furuta
from upright.records import Array, Record
from upright.rig import Rig
from upright.rig.makes import MOTOR_AND_BELT, SERVO, make_of

_BELT_OFF = {"b_1": 0.3, "b_1c": 0.1875}  # share of the friction that the disk's own bearings have


@dataclass(frozen=True, kw_only=True)
class Release:
    """How the pendulum was let go: angle held at [rad], and the speed a hand gave its carrier by mistake [SI]."""

    angle: float = math.pi / 2
    push: float = 0.0


def freed(rig: Rig) -> Rig:
    """A pendulum rig with its drive out of the way: a disk's belt is taken off, a cart pulls its silent motor along."""
    plant = rig.plant
    if isinstance(plant, Furuta):
        friction = {name: share * getattr(plant, name) for name, share in _BELT_OFF.items()}
        plant = plant.replace(J_d=plant.J_d - MOTOR_AND_BELT, **friction)
    elif not isinstance(plant, CartPendulum):
        raise BadInput(f"a free swing needs a pendulum on a cart or a disk, and {rig.name} has none.")
    return replace(rig, plant=plant, name=rig.name.split(",")[0])


def carrier(rig: Rig) -> str:
    """Coordinate of what carries the pendulum: ``"psi"`` or ``"x"``."""
    return rig.plant.coordinates[0].name


def motion(rig: Rig, release: Release | None = None, *, seconds: float, every: int = 8) -> tuple[Array, Array]:
    """What really happens after a release: time (N,) [s] and states (N, 4) [SI]."""
    from upright.simulation import simulate

    release = release or Release()
    x0 = rig.plant.state("hanging", **{f"{carrier(rig)}_dot": release.push, "theta": release.angle})
    rows = round(seconds / SERVO / every) + 1
    x = simulate(rig.plant, {}, x0, None, SERVO, samples=rows, every=every)[:, :, 0]
    return np.linspace(0.0, (rows - 1) * every * SERVO, rows), x


def release_log(
    rig: Rig, release: Release | None = None, *, seconds: float = 12.0, every: int = 8, shot: int = 0
) -> Record:
    """Log of both encoders after a release.

    Parameters
    ----------
    rig : Rig
        As `freed`.
    release : Release, optional
        From horizontal, its carrier at rest, when omitted; no hand holds an angle better than a degree.
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
    return twin_log(
        rig, t, np.round(x[:, 0::2] * np.array(rig.per_unit)), unit="counts"
    )  # zeroed where both joints rest


TILT = math.radians(0.25)
"""Lean of the axis in the study [rad]: 1 mm in 23 cm, less than a bubble level shows at a glance."""
SMOOTH = 2.0
"""Width [s] of the window that averages the swings out, two and more of them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DriftPath:
    """Path of one disk, or cart, after a release.

    Attributes
    ----------
    name : str
        What was done to the rig.
    remedy : bool
        Whether the spring was on.
    t, psi, centre : (N,) arrays
        Time [s], angle [rad] or place [m], and the line about which it swings.
    slope : float
        Drift [rad/s or m/s]: slope of the straight line closest to the path.
    end : float
        Where it is in the last seconds, from where it was at the release.
    """

    name: str
    remedy: bool
    t: Array
    psi: Array
    centre: Array
    slope: float
    end: float


def drift_path(name: str, rig: Rig, release: Release | None, *, seconds: float, remedy: bool = False) -> DriftPath:
    """Path of the carrier of one rig after a release."""
    t, x = motion(rig, release, seconds=seconds)
    psi = x[:, 0]
    last = float(np.mean(psi[t > t[-1] - SMOOTH]) - psi[0])
    return DriftPath(name=name, remedy=remedy, t=t, psi=psi, centre=centre(t, psi), slope=slope(t, psi), end=last)


def centre(t: Array, psi: Array) -> Array:
    """Line about which the disk swings [rad]: average under a Hann window; its first and last second lean inward."""
    width = max(3, round(SMOOTH / float(t[1] - t[0])))
    window = np.hanning(width)
    return np.convolve(psi, window, "same") / np.convolve(np.ones_like(psi), window, "same")


def slope(t: Array, psi: Array) -> float:
    """Drift [rad/s]: slope of the straight line closest to the path."""
    return float(np.polyfit(t - t.mean(), psi, 1)[0])


def momentum(plant: Furuta, x: Array) -> Array:
    """Angular momentum about the axis of the disk [kg m^2/s], shape (N,), of states (N, 4); eq. (3), first row of M."""
    psi_dot, theta, theta_dot = x[:, 1], x[:, 2], x[:, 3]
    transverse = plant.J_p + plant.m_p * plant.l_cg**2
    s, c = np.sin(theta), np.cos(theta)
    M_11 = plant.J_d + plant.m_p * plant.r**2 + transverse * s**2 + plant.J_a * c**2
    return M_11 * psi_dot - plant.m_p * plant.r * plant.l_cg * c * theta_dot


def anchored(rig: Rig) -> Rig:
    """The rig with its soft spring to ground."""
    return rig.changed(**{f"k_{carrier(rig)}": make_of(rig.plant).anchor})


def drift_paths(rig: Rig, *, seconds: float = 24.0) -> tuple[DriftPath, ...]:
    """The same release on the rig as it stands, after a push, out of level, and with the spring in each case.

    A rail out of level by so little does not move a cart that sticks.
    """
    push, on_disk = make_of(rig.plant).push, carrier(rig) == "psi"
    pushed = Release(push=push)
    unit = "rad/s" if on_disk else "m/s"
    cases = [
        (f"free {'disk' if on_disk else 'cart'}, level", rig, None),
        (f"pushed at release, {push:g} {unit}", rig, pushed),
    ]
    held = [("spring, level", rig, None), ("spring, pushed at release", rig, pushed)]
    if on_disk:
        leaning, lean = rig.changed(tilt_y=math.sin(TILT)), f"out of level by {math.degrees(TILT):g}°"
        cases.append((lean, leaning, None))
        held.append((f"spring, {lean}", leaning, None))
    return (
        *(drift_path(name, on, how, seconds=seconds) for name, on, how in cases),
        *(drift_path(name, anchored(on), how, seconds=seconds, remedy=True) for name, on, how in held),
    )
