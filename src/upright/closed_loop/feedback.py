"""How does a law close the loop of a run? Its references at its own rate, and the memory it has at every row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.law import SampledLaw
from upright.closed_loop.preparation import finer

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Feedback:
    """The law that closed the loop during a run; its output is added to the run's command.

    Attributes
    ----------
    law : SampledLaw
        Reads coordinates by name [SI], puts out commands in the actuator's unit.
    references : ((N - 1) every + 1, len(law.references)) array, or one row
        At the samples of the law; one row stands for constants.
    every : int
        Samples of the law per row of the run.
    quantized : bool
        Whether the simulated law reads encoders in counts and rounds its command. A fit by differences of simulations
        stumbles over the steps; a prediction does not.
    told : str
        What the report says about it.
    """

    law: SampledLaw
    references: Array = field(default_factory=lambda: np.zeros((1, 0)))
    every: int = 1
    quantized: bool = False
    told: str = ""

    def read(self, samples: int) -> Array:
        """References (samples, len(law.references)), the last row held."""
        rows = np.minimum(np.arange(samples), len(self.references) - 1)
        return self.references[rows]

    def follow(self, motion: Array, names: Sequence[str]) -> tuple[Array, Array]:
        """Commands (N,) and memory (N, n) at the rows of a measured motion (N, len(names)); what is missing is zero.

        A law faster than the rows sees a cubic spline through them.
        """
        y = np.zeros(((len(motion) - 1) * self.every + 1, len(self.law.measured)))
        for j, name in enumerate(self.law.measured):
            if name in names:
                y[:, j] = finer(np.ascontiguousarray(motion[:, list(names).index(name)]), self.every)
        u, z = self.law.follow(y, self.read(len(y)))
        return u[:: self.every], z[:-1][:: self.every]

    def first(self, rows: int) -> Feedback:
        """The law during the first rows of its run."""
        return replace(self, references=self.references[: (rows - 1) * self.every + 1])

    def thinned(self, every: int) -> Feedback:
        """The law of a run of which every `every`-th row is kept."""
        return replace(self, every=self.every * every)
