"""Which outputs move nearly alike? What they do together and how they differ are scored alike.

Friction that is a little off carries two disks on one shaft astray together: their angles err by hundreds of counts,
their twist by few. Scored one by one, the common error drowns what the twist says of the shaft; with the principal
components of the motion each in units of its own spread, both speak. Residuals are then weighed by a matrix, as in
generalized least squares (Aitken 1935) with errors taken proportional to the motion itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upright.identification.problem.track import Track

Array = NDArray[np.float64]

ALIKE = 0.98
"""Correlation of two outputs from which on their difference, a tenth of the motion, would be drowned."""


def moving_alike(track: Track) -> Array | None:
    """Weights (outputs, outputs) of a run whose outputs move nearly alike; None when each can stand for itself.

    A component's spread includes the rounding of the encoders, so that a difference nobody could see weighs nothing.
    """
    free = np.flatnonzero(track.weights)
    if free.size < 2:
        return None
    w = track.weights[free]
    z = (track.y[:, free] - track.y[:, free].mean(axis=0)) * w
    S = z.T @ z / len(z)
    d = np.sqrt(np.diag(S))
    if not d.all():  # an output that does not move stands for itself
        return None
    if np.abs(S / np.outer(d, d) - np.eye(free.size)).max() < ALIKE:
        return None
    power, V = np.linalg.eigh(S)
    quantum = np.array(track.run.quantum or (0.0,) * track.weights.size)[free] * w
    rounding = np.einsum("ij,i,ij->j", V, quantum**2, V)
    floor = 1e-12 * power[-1]
    W = np.diag(track.weights)
    W[np.ix_(free, free)] = (V / np.sqrt(np.maximum(power, floor) + rounding)).T * w
    return W
