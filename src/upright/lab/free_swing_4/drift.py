"""Why does the disk wander during a free swing, and what stops it?

No torque but friction acts about the axis of a level, free disk, so the momentum about it, ``M_11 psi' + M_12
theta'``, can only be rubbed away. Released at rest it is zero: psi is a function of theta, swings
about a fixed centre, and creeps home only as friction takes hold. A push at the release gives momentum, an axis out
of level gives gravity a lever; a soft spring to ground, which the paper suggests, gives psi a home.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.lab.rigs.twin import Release, Twin, motion
from upright.physics import Furuta

Array = NDArray[np.float64]

TILT = math.radians(0.25)
"""Lean of the axis in the study [rad]: 1 mm in 23 cm, less than a bubble level shows at a glance."""
PUSH = {"psi": 0.15, "x": 0.05}
"""Speed that a careless hand gives disk [rad/s] or cart [m/s]."""
SPRING = {"psi": 0.04, "x": 20.0}
"""Soft anchoring spring [N m/rad or N/m]; the disk alone would swing on it at a third of the pendulum's frequency."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Wander:
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


def wander(name: str, rig: Twin, release: Release | None = None, *, seconds: float, remedy: bool = False) -> Wander:
    """Path of the disk of one rig after a release."""
    t, x = motion(rig, release, seconds=seconds)
    psi = x[:, 0]
    last = float(np.mean(psi[t > t[-1] - SMOOTH]) - psi[0])
    return Wander(name=name, remedy=remedy, t=t, psi=psi, centre=centre(t, psi), slope=slope(t, psi), end=last)


SMOOTH = 2.0
"""Width [s] of the window that averages the swings out, two and more of them."""


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
    own = plant.J_d + plant.m_p * plant.r**2 + transverse * s**2 + plant.J_a * c**2
    return own * psi_dot - plant.m_p * plant.r * plant.l_cg * c * theta_dot


def anchored(rig: Twin) -> Twin:
    """The rig with its soft spring to ground."""
    return rig.changed(**{f"k_{rig.base}": SPRING[rig.base]})


def study(rig: Twin, *, seconds: float = 24.0) -> tuple[Wander, ...]:
    """The same release on the rig as it stands, after a push, out of level, and with the spring in each case.

    A rail out of level by so little does not move a cart that sticks.
    """
    push = PUSH[rig.base]
    body, pushed = "disk" if rig.base == "psi" else "cart", Release(push=push)
    cases = [(f"free {body}, level", rig, None),
             (f"pushed at release, {push:g} {'rad/s' if rig.base == 'psi' else 'm/s'}", rig, pushed)]  # fmt: skip
    held = [("spring, level", rig, None), ("spring, pushed at release", rig, pushed)]
    if rig.base == "psi":
        leaning, lean = rig.changed(tilt_y=math.sin(TILT)), f"out of level by {math.degrees(TILT):g}°"
        cases.append((lean, leaning, None))
        held.append((f"spring, {lean}", leaning, None))
    return (
        *(wander(name, on, how, seconds=seconds) for name, on, how in cases),
        *(wander(name, anchored(on), how, seconds=seconds, remedy=True) for name, on, how in held),
    )
