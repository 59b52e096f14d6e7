"""Motion of a linear model, sample by sample: exact for commands that stay until the next sample."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from upright.systems.state_space import StateSpace

Array = NDArray[np.float64]


def march(
    model: StateSpace, commands: Array, start: Array, gains: Array | None = None, limit: float = np.inf
) -> tuple[Array, Array]:
    """States (T, n) of a sampled model and what it was commanded (T, m): ``u[k] - gains x[k]`` within `limit`.

    Stops short, with the samples that it has, where a state is no longer finite.
    """
    states, applied = np.zeros((len(commands), len(start))), np.clip(commands, -limit, limit)
    x = start
    for k in range(len(commands)):
        states[k] = x
        if not np.isfinite(x).all():
            return states[: k + 1], applied[: k + 1]
        if gains is not None:
            applied[k] = np.clip(commands[k] - gains @ x[: gains.shape[1]], -limit, limit)
        x = model.A @ x + model.B @ applied[k]
    return states, applied
