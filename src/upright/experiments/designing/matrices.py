"""A linear model of plain matrices, to design for: what it is called, and how its states come from its outputs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from upright.basis import DESCRIBED, Basis
from upright.errors import BadInput, nearest
from upright.gains import Estimator, Sampled, filtered, hold, placed_observer, read_off, sampled_model
from upright.gains.requests import Roots
from upright.gains.sampled import to_z
from upright.physics import Linear
from upright.records import Array

SWIFTER = 3.0
"""How many times as fast as the loop its observer is; Franklin, Powell and Workman advise two to six."""
MOST_STATES = 30
"""States from which 60 digits take longer than anyone waits."""


@dataclass(frozen=True, kw_only=True)
class Matrices:
    """``x' = A x + B u, y = C x + D u``, or the same from sample to sample; numbers in the units that they wear.

    Attributes
    ----------
    A, B, C, D : arrays, shape (n, n), (n, m), (p, n) and (p, m)
    states, inputs, outputs : tuple of str
    period : float
        Of a sampled model [s]; 0 for a continuous one.
    units : mapping of str to str
        By name; what has none is a pure number.
    name : str
    basis : Basis
        That they were given, not identified.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    period: float = 0.0
    units: Mapping[str, str] = field(default_factory=dict[str, str])
    name: str = "plain matrices"
    basis: Basis = DESCRIBED

    def __post_init__(self) -> None:
        if not 1 <= len(self.states) <= MOST_STATES or not self.inputs or not self.outputs:
            raise BadInput(
                f"a model to design for has 1 to {MOST_STATES} states, an input and an output, got {len(self.states)} "
                f"states, {len(self.inputs)} inputs and {len(self.outputs)} outputs."
            )

    @property
    def unit(self) -> str:
        """Of the command; empty for a pure number."""
        return self.units.get(self.inputs[0], "")

    @property
    def state_units(self) -> list[str]:
        """Unit of every state."""
        return [self.units.get(name, "1") for name in self.states]

    @property
    def output_units(self) -> list[str]:
        """Unit of every output."""
        return [self.units.get(name, "1") for name in self.outputs]

    def linear(self) -> Linear | Sampled:
        """The model itself, `Sampled` where the matrices are those of samples."""
        return self.at_samples(self.period, 0.0, 0.0) if self.period else self._continuous()

    def _continuous(self) -> Linear:
        return Linear(
            A=self.A, B=self.B, C=self.C, mass=np.zeros((0, 0)), point={}, states=self.states, inputs=self.inputs,
            outputs=self.outputs,
        )  # fmt: skip

    def at_samples(self, period: float, delay: float, lag: float) -> Sampled:
        """The model as the loop meets it: command held, `delay` samples late, behind a drive of this lag [s].

        Raises
        ------
        BadInput
            When a sampled model is asked for what lies between its samples.
        """
        if not self.period:
            return hold(self._continuous(), period, delay, lag, D=self.D)
        if lag or delay != math.floor(delay) or not 0 <= delay <= 1000:
            raise BadInput(
                f"a model known at its samples alone takes no lag, and a delay of 0 to 1000 whole samples, got "
                f"{1e3 * lag:g} ms and {delay:g}; put them into the matrices, or give a continuous model."
            )
        return sampled_model(self.A, self.B, self.C, self.D, self.period, int(delay), states=self.states,
                             inputs=self.inputs)  # fmt: skip

    def estimator(self, speed: str, sampled: Sampled, memory: float, loop: Roots) -> Estimator:
        """States from outputs in one of the `ways`, for a loop with these poles [1/s]."""
        if speed == "observer":
            z = to_z(SWIFTER * np.maximum(loop.real, -100 / sampled.period) + 1j * SWIFTER * loop.imag, sampled.period)
            z.imag[np.abs(z.imag) < 1e-12] = 0.0  # of a real z below 0, by rounding
            return placed_observer(sampled, z)
        return read_off(sampled) if speed == "measured" else filtered(sampled, memory if speed == "filtered" else 0.0)

    @property
    def ways(self) -> tuple[str, ...]:
        """Ways to the states that this model allows, the plainest first."""
        n, p = len(self.states), len(self.outputs)
        through = self.D.any()
        told = np.linalg.matrix_rank(self.C) == n and not through
        position, velocity = (np.kron(np.eye(p), pair) for pair in ([1.0, 0.0], [0.0, 1.0]))
        differences = (
            not self.period and not through and n == 2 * p and not self.B[::2].any()
            and np.array_equal(self.A[::2], velocity) and np.array_equal(self.C, position)
        )  # fmt: skip
        return (*(("measured",) if told else ()), *(("filtered", "plain") if differences else ()), "observer")

    def way(self, speed: str) -> str:
        """The way asked for, or the plainest where none was.

        Raises
        ------
        BadInput
            When the model does not allow it.
        """
        if speed and speed not in self.ways:
            known = {
                "measured": "not every state can be read off the outputs without D",
                "kalman": "matrices do not say how good readings are",
            }
            why = known.get(speed, "its outputs are not positions, each followed by its velocity")
            if speed not in (*known, "plain", "filtered"):
                why = nearest(speed, self.ways).rstrip(".")
            raise BadInput(f"--speed {speed} is not for this model, {why}; it takes {' or '.join(self.ways)}.")
        return speed or self.ways[0]
