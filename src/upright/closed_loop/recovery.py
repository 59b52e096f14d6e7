"""A recovered law: its numbers with intervals, how much of the log it tells, and how it is handed on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.structures import Channel
from upright.laws import Law

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
class TriedStructure:
    """One structure that was tried: its name, how many numbers it has, and the rms that rows left out missed."""

    name: str
    parameters: int
    missed: float


@dataclass(frozen=True, kw_only=True)
class Recovery:
    """A law recovered from a log.

    Attributes
    ----------
    law : Law
        In the log's units; its references are columns of the log.
    command : str
        The column explained.
    feedforward : mapping of str to float
        Columns added to the law's output, and the factor on each.
    channels : tuple of Channel
        The law as a program writes it.
    structure : str
        In words.
    rows : (K,) int array
        Rows of the log at which the law was evaluated.
    recorded, reproduced : (K,) arrays
        Command there, and what the law makes of the recorded measurements.
    used : (K,) array of bool
        Rows that the gains rest on; the others are the first ones and those at the limit.
    resolution : float
        Step of the command's column, 0 for none.
    saturated : float
        Share of the rows at the limit.
    every : int
        Samples of the law per row of the log.
    candidates : tuple of TriedStructure
        What was tried, best first.
    unit : str
        Unit of the command, "" when the log does not say.
    """

    law: Law
    command: str
    feedforward: Mapping[str, float]
    channels: tuple[Channel, ...]
    gains: Mapping[str, Gain]
    structure: str
    rows: NDArray[np.int64]
    recorded: Array
    reproduced: Array
    used: NDArray[np.bool_]
    resolution: float
    saturated: float
    every: int
    candidates: tuple[TriedStructure, ...]
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
        if self.resolution and self.largest <= self.resolution * (1 + 1e-6):
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
            half = 100 * float(np.mean(np.abs(self.residual[3:]) <= 0.5 * self.resolution * (1 + 1e-6)))
            return (
                f"The law reproduces all {n} commands to {self.largest / self.resolution:.2f} steps of the column"
                f" ({self.resolution:.4g}{unit}), {half:.3g} % of them to its rounding: exact but for the rounding."
            )
        fit = f"The law explains {self.explained:.1f} % of the command and misses up to {self.largest:.3g}{unit}"
        if self.quality == "poor":
            return f"{fit}: no linear law of these signals made this command."
        if self.every > 1:
            return (
                f"{fit}: not the whole law. The rows seem to be every {_th(self.every)} sample of a faster servo,"
                " whose differences they cannot show; its gains are good to a few percent."
            )
        return (
            f"{fit}: not the whole law. Something is missing (another signal, a filter, a dead zone), the rows are"
            " a decimation of the servo's samples, or the command is no feedback and follows from the plant's motion."
        )


def _th(n: int) -> str:
    return {2: "second", 3: "third"}.get(n, f"{n}th")


def as_json(recovery: Recovery) -> str:
    """Everything about the law but the samples."""
    law = recovery.law
    whole: dict[str, Any] = {
        "command": recovery.command,
        "structure": recovery.structure,
        "quality": recovery.quality,
        "sentence": recovery.sentence,
        "explained_percent": recovery.explained,
        "largest_residual": recovery.largest,
        "gains": {
            name: {"value": g.value, "low": g.interval[0], "high": g.interval[1], "meaning": g.meaning}
            for name, g in recovery.gains.items()
        },
        "period_s": law.needed_period,
        "samples_per_row": recovery.every,
        "limit": law.limit if recovery.saturated else None,
        "windup": law.windup,
        "delay_samples": law.delay,
        "command_step": recovery.resolution,
        "measured": law.measured,
        "references": law.reference_names,
        "A": law.A.tolist(),
        "B": law.B.tolist(),
        "C": law.C[0].tolist(),
        "D": law.D[0].tolist(),
        "tried": [{"name": c.name, "numbers": c.parameters, "missed": c.missed} for c in recovery.candidates],
    }
    return json.dumps(whole, indent=1)


def loop_recovered(recovery: Recovery) -> str:
    """`loop` of a study that recovers the law from the log each time; coordinates stay to be named."""
    references = recovery.law.reference_names
    parts = [
        'kind = "recover"', f"command = {_text(recovery.command)}",
        f"reference = {_list([_text(r) for r in references])}" if references else "",
        f"feedforward = {_list([_text(f) for f in recovery.feedforward])}" if recovery.feedforward else "",
    ]  # fmt: skip
    return f"loop = {{ {', '.join(part for part in parts if part)} }}"


def loop_written(recovery: Recovery) -> str:
    """`loop` of a study with the gains written out, for other runs under the same law; "" when PID keys cannot say it.

    The coordinates that the columns measure are named as the columns are: the study's reader has to say which.
    """
    channels, law = recovery.channels, recovery.law
    first = channels[0]
    if recovery.feedforward or any(c.filter != first.filter for c in channels):
        return ""
    parts = ['kind = "pid"']
    for key in ("kp", "ki", "kd"):
        values = [getattr(c, key) for c in channels]
        if any(values):
            parts.append(f"{key} = {_list([f'{v:.6g}' for v in values])}")
    if first.filter.pole:
        tau = law.needed_period * first.filter.pole / (1 - first.filter.pole)
        parts.append(f'tau = "{tau:.6g} s"')
    if first.filter.second:
        parts.append(f"taps = [{1 - first.filter.second:.4g}, {first.filter.second:.4g}]")
    if first.on == "measurement":
        parts.append('on = "measurement"')
    parts.append(f"measured = {_coordinates(recovery)}")
    references = [c.reference for c in channels if c.reference is not None]
    if references:
        parts.append(f"reference = {_list([_text(r) for r in references])}")
    if recovery.saturated:
        parts.append(f"limit = {law.limit:.6g}")
    if law.windup == "hold":
        parts.append('windup = "hold"')
    if law.delay:
        parts.append(f"delay = {law.delay:g}")
    if recovery.every > 1:
        parts.append(f'period = "{law.needed_period * 1e3:.6g} ms"')
    return f'loop = {{ {", ".join(parts)}, units = "log" }}'


def _coordinates(recovery: Recovery) -> str:
    return _list([_text(f"COORDINATE OF {c.measured}") for c in recovery.channels])


def _text(name: str) -> str:
    return json.dumps(name, ensure_ascii=False)


def _list(items: list[str]) -> str:
    return items[0] if len(items) == 1 else f"[{', '.join(items)}]"
