"""States of a plain linear model from its outputs: read off, by differences, or by an observer."""

from __future__ import annotations

import numpy as np

from upright.errors import BadInput, nearest
from upright.gains import Estimator, filtered, placed_observer, read_off
from upright.gains.requests import Roots
from upright.systems import StateSpace, to_z

SWIFTER = 3.0
"""How many times as fast as the loop its observer is; Franklin, Powell and Workman advise two to six."""


def estimator(speed: str, sampled: StateSpace, memory: float, loop: Roots) -> Estimator:
    """States from outputs in one of the ways of `estimators`, for a loop with these poles [1/s]."""
    if speed == "observer":
        z = to_z(SWIFTER * np.maximum(loop.real, -100 / sampled.period) + 1j * SWIFTER * loop.imag, sampled.period)
        z.imag[np.abs(z.imag) < 1e-12] = 0.0  # of a real z below 0, by rounding
        return placed_observer(sampled, z)
    return read_off(sampled) if speed == "measured" else filtered(sampled, memory if speed == "filtered" else 0.0)


def estimators(model: StateSpace) -> tuple[str, ...]:
    """Ways to the states that a model allows, the plainest first."""
    n, p = len(model.states), len(model.outputs)
    through = model.D.any()
    read = np.linalg.matrix_rank(model.C) == n and not through
    position, velocity = (np.kron(np.eye(p), pair) for pair in ([1.0, 0.0], [0.0, 1.0]))
    differences = (
        model.dt is None and not through and n == 2 * p and not model.B[::2].any()
        and np.array_equal(model.A[::2], velocity) and np.array_equal(model.C, position)
    )  # fmt: skip
    return (*(("measured",) if read else ()), *(("filtered", "plain") if differences else ()), "observer")


def chosen(model: StateSpace, speed: str) -> str:
    """The requested velocity estimator, or the plainest where none was.

    Raises
    ------
    BadInput
        When the model does not allow it.
    """
    ways = estimators(model)
    if speed and speed not in ways:
        known = {
            "measured": "not every state can be read off the outputs without D",
            "kalman": "matrices do not say how good readings are",
        }
        why = known.get(speed, "its outputs are not positions, each followed by its velocity")
        if speed not in (*known, "plain", "filtered"):
            why = nearest(speed, ways).rstrip(".")
        raise BadInput(f"--speed {speed} is not for this model, {why}; it takes {' or '.join(ways)}.")
    return speed or ways[0]
