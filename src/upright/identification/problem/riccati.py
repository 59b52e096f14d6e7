"""Gains of a Kalman filter from sample to sample, as machine code: Riccati's recursion for many filters side by side.

Outputs are taken one after the other, their noises being independent: scalars are divided by, and no matrix. Joseph's
form keeps a covariance positive.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upright.simulation.lowering.routine import Routine

Array = NDArray[np.float64]

SETTLED = 1e-6
"""Relative change of the covariance per sample below which the gain counts as settled."""

TEXT = """
@exact
def recursion(Phi, Q, R, columns, P, L, settled, count, ahead, part, gain):
    lanes, states, outputs = P.shape[0], P.shape[1], R.shape[0]
    for step in range(1, L.shape[0]):
        moved = 0
        for lane in range(lanes):
            for i in range(states):
                for j in range(states):
                    total = 0.0
                    for k in range(states):
                        total += Phi[lane, i, k] * P[lane, k, j]
                    part[i, j] = total
            for i in range(states):
                for j in range(states):
                    total = Q[lane, i, j]
                    for k in range(states):
                        total += part[i, k] * Phi[lane, j, k]
                    ahead[i, j] = total
            for o in range(outputs):
                c = columns[o]
                variance = ahead[c, c] + R[o]
                for i in range(states):
                    gain[i] = ahead[i, c] / variance
                for earlier in range(o):
                    seen = L[step, earlier, c, lane]
                    for i in range(states):
                        L[step, earlier, i, lane] -= gain[i] * seen
                for i in range(states):
                    L[step, o, i, lane] = gain[i]
                    for j in range(states):
                        part[i, j] = ahead[i, j] - gain[i] * ahead[c, j]
                for i in range(states):
                    for j in range(states):
                        ahead[i, j] = part[i, j] - part[i, c] * gain[j] + R[o] * gain[i] * gain[j]
            for i in range(states):
                for j in range(states):
                    change = ahead[i, j] - P[lane, i, j]
                    if change * change > settled * max(ahead[i, i], 0.0) * max(ahead[j, j], 0.0):
                        moved = 1
            for i in range(states):
                for j in range(states):
                    P[lane, i, j] = ahead[i, j]
        count[0] = step + 1
        if moved == 0:
            break
"""


def kalman_gains(
    Phi: Array, Q: Array, sensors: Array, columns: Sequence[int], initial: Array, steps: int
) -> tuple[list[Array], Array]:
    """Gains (outputs, states, lanes) at fewer than `steps` samples, until they have settled, and the covariance then.

    Parameters
    ----------
    Phi, Q : (lanes, states, states) arrays
        Transition over one sample and covariance of the process noise.
    sensors : (outputs,) array
        Variances of the outputs.
    columns : sequence of int
        State that each output shows.
    initial : (states,) array
        Variances at the first sample, whose gain is zero.
    """
    lanes, n, _ = Phi.shape
    P = np.zeros((lanes, n, n))
    P[:, range(n), range(n)] = initial
    L = np.zeros((steps, len(columns), n, lanes))
    count, room = np.ones(1, np.int64), np.zeros((2, n, n))
    Phi, Q, sensors = (np.ascontiguousarray(a, dtype=np.float64) for a in (Phi, Q, sensors))
    Routine(
        TEXT, "recursion", Phi, Q, sensors, np.array(columns, dtype=np.int64), P, L, SETTLED**2, count, room[0],
        room[1], np.zeros(n),
    )()  # fmt: skip
    return list(L[: int(count[0])]), P
