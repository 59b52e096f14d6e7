"""The law that closed the loop of a run: its rate, and its commands and memory at every row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.laws import Law

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedLoop:
    """The law that closed the loop during a run; its output is added to the run's command.

    Attributes
    ----------
    law : Law
        Reads coordinates by name [SI], puts out commands in the actuator's unit; its references are at its samples.
    every : int
        Samples of the law per row of the run.
    quantized : bool
        Whether the simulated law reads encoders in counts and rounds its command. A fit by differences of simulations
        stumbles over the steps; a prediction does not.
    note : str
        What the report says about it.
    """

    law: Law
    every: int = 1
    quantized: bool = False
    note: str = ""

    def follow(self, motion: Array, names: Sequence[str]) -> tuple[Array, Array]:
        """Commands (N,) and memory (N, n) at the rows of a measured motion (N, len(names)); what is missing is zero.

        A law faster than the rows sees a cubic spline through them.
        """
        y = np.zeros(((len(motion) - 1) * self.every + 1, self.law.readings))
        for j, name in enumerate(self.law.measured):
            if name in names:
                y[:, j] = finer(np.ascontiguousarray(motion[:, list(names).index(name)]), self.every)
        u, z = self.law.follow(y)
        return u[:: self.every, 0], z[:: self.every]


def finer(values: Array, every: int) -> Array:
    """Samples of a signal (N,) at `every` times its rate, a cubic spline through them."""
    if every == 1:
        return values
    from scipy.interpolate import CubicSpline

    rows = np.arange(values.size)
    return np.asarray(CubicSpline(rows, values)(np.arange((values.size - 1) * every + 1) / every))
