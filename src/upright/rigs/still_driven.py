"""Is a rig that was stopped still driven? What nothing drives only loses energy, to friction."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from upright.records import Array
from upright.rig import Rig

LOOKED = 0.4
"""For how long a rig is looked at after its command went to zero [s]."""
SPAN = 0.01
"""Speeds are differences over so long to either side [s]."""
RISE, WRONG = 0.05, 0.1
"""Rise of the energy that is no error: share of what lies between the equilibria, and of the kinetic energy, of which
the model may have so much wrong."""


def energy_risen(model: Rig, t: ArrayLike, q: ArrayLike) -> bool:
    """Whether the model's energy rises along a motion.

    Parameters
    ----------
    t : array, shape (N,)
        Times from when the command was zero [s]; the drive's delay and lag are waited for.
    q : array, shape (N, coordinates)
        Coordinates [rad or m].
    """
    time, place = np.asarray(t, dtype=np.float64), np.asarray(q, dtype=np.float64)
    k = max(1, round(SPAN / model.period))
    if len(time) < 4 * k:
        return False
    x = np.empty((len(time) - 2 * k, 2 * place.shape[1]))
    x[:, 0::2] = place[k:-k]
    x[:, 1::2] = (place[2 * k :] - place[: -2 * k]) / (time[2 * k :] - time[: -2 * k])[:, None]
    x = x[time[k:-k] - time[0] > model.delay + 5 * model.lag + SPAN]
    if len(x) < 2 * k:
        return False
    return _risen(model, x, k)


def _risen(model: Rig, x: Array, k: int) -> bool:
    energy, still = np.asarray(model.plant.energy(x), dtype=np.float64), x.copy()
    still[:, 1::2] = 0.0
    kinetic = energy - np.asarray(model.plant.energy(still), dtype=np.float64)
    levels = [float(model.plant.energy(model.plant.state(name))) for name in model.plant.equilibria]
    risen = float(energy[-k:].mean() - np.minimum.accumulate(energy)[:-k].min())
    return risen > RISE * (max(levels) - min(levels)) + WRONG * float(kinetic.max())
