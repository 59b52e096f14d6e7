"""Gains of a Kalman filter from sample to sample, as machine code: Riccati's recursion for many filters side by side.

Outputs are taken one after the other, their noises being independent: scalars are divided by, and no matrix. Joseph's
form keeps a covariance positive.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upright.simulation.lowering.routine import Routine

Array = NDArray[np.float64]

SETTLED = 1e-6
"""Relative change of the covariance per sample below which the gain counts as settled."""

TEXT = Path(__file__).with_suffix(".kernel").read_text(encoding="utf-8")
"""The recursion in the language of kernels."""


def kalman_gains(
    Phi: Array, Q: Array, sensors: Array, columns: Sequence[int], initial: Array, steps: int
) -> tuple[Array, Array]:
    """Gains (samples, outputs, states, lanes), at most `steps`, until they have settled, and the covariance then.

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
        TEXT, "recursion", Phi, Q, sensors, np.array(columns, dtype=np.int64), P, L,
        SETTLED**2, count, room[0], room[1], np.zeros(n),
    )()  # fmt: skip
    return L[: int(count[0])], P
