"""What was the law, how sure are its gains, and does it tell the whole log?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.law import SampledLaw
from upright.closed_loop.structures import Channel

Array = NDArray[np.float64]
Quality = Literal["exact", "rounding", "partial", "poor"]

EXACT = 1e-9
"""Largest residual of an exact law, by the range of the command: what double precision and printed digits leave."""

POOR = 90.0
"""Fit percent below which a law is no law of the log."""


@dataclass(frozen=True, kw_only=True)
class Gain:
    """One number of the law with its 95 % interval, in the log's units."""

    value: float
    stderr: float
    interval: tuple[float, float]
    meaning: str


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One structure that was tried: its name, how many numbers it has, and the rms that rows left out missed."""

    name: str
    parameters: int
    missed: float


@dataclass(frozen=True, kw_only=True)
class Recovery:
    """A law recovered from a log.

    Attributes
    ----------
    law : SampledLaw
        In the log's units; its references are columns of the log.
    command : str
        The column explained.
    feedforward : mapping of str to float
        Columns added to the law's output, and the factor on each.
    channels : tuple of Channel
        The law as a program writes it.
    gains : mapping of str to Gain
    structure : str
        In words.
    rows : (K,) int array
        Rows of the log at which the law was evaluated.
    recorded, reproduced : (K,) arrays
        Command there, and what the law makes of the recorded measurements.
    used : (K,) array of bool
        Rows that the gains rest on; the others are the first ones and those at the limit.
    quantum : float
        Step of the command's column, 0 for none.
    saturated : float
        Share of the rows at the limit.
    every : int
        Samples of the law per row of the log.
    candidates : tuple of Candidate
        What was tried, best first.
    unit : str
        Unit of the command, "" when the log does not say.
    """

    law: SampledLaw
    command: str
    feedforward: Mapping[str, float]
    channels: tuple[Channel, ...]
    gains: Mapping[str, Gain]
    structure: str
    rows: NDArray[np.int64]
    recorded: Array
    reproduced: Array
    used: NDArray[np.bool_]
    quantum: float
    saturated: float
    every: int
    candidates: tuple[Candidate, ...]
    unit: str = ""

    @property
    def residual(self) -> Array:
        """Recorded minus reproduced command (K,)."""
        return self.recorded - self.reproduced

    @property
    def largest(self) -> float:
        """Largest residual over all rows but the first three, which a log may have filled with junk."""
        return float(np.abs(self.residual[3:]).max())

    @property
    def explained(self) -> float:
        """Fit percent of the command: 100 (1 - rms residual / standard deviation)."""
        u = self.recorded[3:]
        spread = float(np.std(u))
        return 100.0 * (1.0 - float(np.sqrt(np.mean(self.residual[3:] ** 2))) / spread) if spread else -100.0

    @property
    def quality(self) -> Quality:
        """How much of the log the law tells; "rounding" is within one step of the command's column."""
        if self.largest <= EXACT * float(np.ptp(self.recorded[3:])):
            return "exact"
        if self.quantum and self.largest <= self.quantum * (1 + 1e-6):
            return "rounding"
        return "partial" if self.explained >= POOR else "poor"

    @property
    def sentence(self) -> str:
        """How much of the log the law tells, in words."""
        unit = f" {self.unit}" if self.unit else ""
        n = self.rows.size
        if self.quality == "exact":
            return f"The law reproduces all {n} commands to {self.largest:.1g}{unit}: exact."
        if self.quality == "rounding":
            half = 100 * float(np.mean(np.abs(self.residual[3:]) <= 0.5 * self.quantum * (1 + 1e-6)))
            return (
                f"The law reproduces all {n} commands to {self.largest / self.quantum:.2f} steps of the column"
                f" ({self.quantum:.4g}{unit}), {half:.3g} % of them to its rounding: exact but for the rounding."
            )
        told = f"The law explains {self.explained:.1f} % of the command and misses up to {self.largest:.3g}{unit}"
        if self.quality == "poor":
            return f"{told}: no linear law of these signals made this command."
        if self.every > 1:
            return (
                f"{told}: not the whole law. The rows seem to be every {_th(self.every)} sample of a faster servo,"
                " whose differences they cannot show; its gains are good to a few percent."
            )
        return (
            f"{told}: not the whole law. Something is missing (another signal, a filter, a dead zone), the rows are"
            " a decimation of the servo's samples, or the command is no feedback and follows from the plant's motion."
        )


def _th(n: int) -> str:
    return {2: "second", 3: "third"}.get(n, f"{n}th")
