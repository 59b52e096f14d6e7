"""Motion of a linear model, sample by sample: exact for commands that stay until the next sample."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def march(
    A: Array, B: Array, commands: Array, start: Array, gains: Array | None = None, limit: float = np.inf
) -> tuple[Array, Array]:
    """States (T, n) of ``x+ = A x + B u`` and what it was commanded (T, m): ``u[k] - gains x[k]`` within `limit`.

    Stops short, with the samples that it has, where a state is no longer finite.
    """
    states, applied = np.zeros((len(commands), len(start))), np.clip(commands, -limit, limit)
    x = start
    with np.errstate(over="ignore", invalid="ignore"):  # what runs away is handed back as far as it goes
        for k in range(len(commands)):
            states[k] = x
            if not np.isfinite(x).all():
                return states[: k + 1], applied[: k + 1]
            if gains is not None:
                applied[k] = np.clip(commands[k] - gains @ x[: gains.shape[1]], -limit, limit)
            x = A @ x + B @ applied[k]
    return states, applied
