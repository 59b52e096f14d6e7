"""Where did the energy of the release go?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upright.physics import Plant

Array = NDArray[np.float64]


def losses(plant: Plant, t: Array, x: Array) -> dict[str, Array]:
    """Energy [J] that each kind of friction has taken since the first sample, shape (N,) each, by a readable name.

    Viscous power is Rayleigh's, joint by joint where a coordinate has its own; dry friction takes F_c |v|, quadratic
    drag c |v|^3. Stiction takes nothing while it holds. Integrated by the trapezoid rule, so the samples must be
    close to each other.
    """
    taken: dict[str, Array] = {}
    values = plant.parameters()
    taken["viscous friction"] = _running(t, plant.power_lost(x))
    for joint in plant.joints:
        i = plant.state_names().index(f"{joint.on}_dot")
        speed = np.abs(x[:, i])
        for kind, name, power in (("Coulomb friction", joint.coulomb, speed), ("drag", joint.quadratic, speed**3)):
            if name and values[name] > 0:
                taken[f"{kind} of {joint.on}"] = _running(t, values[name] * power)
    return {name: energy for name, energy in taken.items() if energy[-1] > 0}


def _running(t: Array, power: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.diff(t) * (power[1:] + power[:-1]) / 2)])
