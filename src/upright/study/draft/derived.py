"""The angle of a pendulum whose log holds none.

From its cosine and sine, from the place of a marker on it, or from what a gyroscope turns.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.interpolate import CubicSpline

from upright.readers.inspection import Column, Inspection
from upright.records import Array, Record
from upright.study import expressions
from upright.study.text import TomlTable, toml
from upright.units import same_dimension, scale

NAME = "theta"
"""Column that is computed."""
ROUND = 0.02
"""What a marker's distance from the middle may vary by, of the radius (rms), for its path to be an arc."""
SHORTEST = 0.3
"""Arc [rad] whose middle can be seen."""
_MOST = 4000
"""Samples that show where the middle is."""
_ALIGNED = 0.999
"""Share of an axis in the turning from which on the others say nothing."""
_TURNING = re.compile(r"rad|deg|°|rev|rpm|turn", re.IGNORECASE)
_COSINE = re.compile(r"cos(?:ine)?(?![a-rt-z])", re.IGNORECASE)
_AXIS = re.compile(r"(?<![a-z])[xyz](?![a-z])", re.IGNORECASE)


@dataclass(frozen=True)
class DerivedAngle:
    """A column to compute, from which others, and the sentence that says so."""

    formula: str
    unit: str
    of: tuple[str, ...]
    doubt: str

    def in_place(self, record: Record) -> Record:
        """The record with this column instead of those that it is computed from."""
        angle = expressions.evaluate(self.formula, record.signals, record.t)
        if self.formula.startswith("atan2"):
            angle = np.asarray(np.unwrap(angle), dtype=np.float64)
        left = {name: values for name, values in record.signals.items() if name not in self.of}
        units = {name: record.units[name] for name in left}
        return record.replace(signals={**left, NAME: angle}, units={**units, NAME: self.unit})

    @property
    def table(self) -> TomlTable:
        """As a study states it."""
        table = TomlTable(f"[columns.{NAME}]")
        table.line(f"formula = {toml(self.formula)}   # {self.doubt}")
        table.key("unit", self.unit)
        return table


def derived_angle(record: Record, inspection: Inspection, *, places: bool) -> DerivedAngle | None:
    """The angle that a log without one shows; None where it has its own, or shows none.

    `places`: whether columns of the log are places already, so that no speed has to be integrated.
    """
    if NAME in record.signals:
        return None
    moves = [c for c in inspection.columns if not c.constant]
    if (angle := _by_its_cosine(record, moves)) is not None:
        return angle
    if any(c.drive for c in inspection.columns) or record.inputs:
        return None
    for pair in combinations([c for c in moves if _AXIS.search(c.name)], 2):
        if _of_one_thing(pair) and (angle := _on_an_arc(record, pair[0].name, pair[1].name)) is not None:
            return angle
    return None if places else _turned(record, moves)


def _by_its_cosine(record: Record, moves: Sequence[Column]) -> DerivedAngle | None:
    """The angle whose cosine and sine two columns are called, and are."""
    names = {c.name.lower(): c.name for c in moves}
    for cosine in (c.name for c in moves if _COSINE.search(c.name)):
        sine = names.get(_COSINE.sub("sin", cosine.lower()), names.get(_COSINE.sub("sine", cosine.lower()), ""))
        if sine and float(np.abs(np.hypot(record[cosine], record[sine]) - 1).max()) < ROUND:
            return DerivedAngle(
                formula=f"atan2(`{sine}`, `{cosine}`)", unit="rad", of=(cosine, sine),
                doubt=f"'{cosine}' and '{sine}' are cosine and sine of an angle, which is computed.",
            )  # fmt: skip
    return None


def _of_one_thing(columns: Sequence[Column]) -> bool:
    """Whether columns have one name but for the letter of their axis, and one unit."""
    stems = {_AXIS.sub("*", c.name) for c in columns}
    return len(stems) == 1 and len({c.unit for c in columns}) == 1


def _on_an_arc(record: Record, across: str, along: str) -> DerivedAngle | None:
    """The angle of a marker about the middle of the arc on which it moves."""
    step = max(record.t.size // _MOST, 1)
    x, y = record[across][::step], record[along][::step]
    algebraic, *_ = np.linalg.lstsq(np.column_stack([2 * x, 2 * y, np.ones(x.size)]), x**2 + y**2, rcond=None)
    radius = math.sqrt(max(algebraic[2] + algebraic[0] ** 2 + algebraic[1] ** 2, 0.0))
    if not radius > 0:
        return None
    x_0, y_0, radius, off = _arc(x, y, float(algebraic[0]), float(algebraic[1]), radius)
    angle = np.unwrap(np.arctan2(x - x_0, y_0 - y))
    if off > ROUND * radius or float(np.ptp(angle)) < SHORTEST:
        return None
    late = y[-max(y.size // 5, 2) :]
    hangs_up = float(np.median(late)) > y_0  # pictures count downwards
    right, down = _from(across, x_0), (_from(along, y_0) if hangs_up else f"-({_from(along, y_0)})")
    downwards = ", which counts downwards" if hangs_up else ""
    return DerivedAngle(
        formula=f"atan2({right}, {down})",
        unit="rad",
        of=(across, along),
        doubt=f"'{across}' and '{along}'{downwards} move on an arc of radius {radius:.4g}: its angle is computed.",
    )


def _arc(x: Array, y: Array, x_0: float, y_0: float, radius: float) -> tuple[float, float, float, float]:
    """Middle and radius of the circle nearest to the points, and their rms distance from it; by Gauss and Newton."""
    for _ in range(20):
        away = np.maximum(np.hypot(x - x_0, y - y_0), 1e-12 * radius)
        slopes = np.column_stack([(x_0 - x) / away, (y_0 - y) / away, -np.ones(x.size)])
        change, *_ = np.linalg.lstsq(slopes, radius - away, rcond=None)
        x_0, y_0, radius = x_0 + float(change[0]), y_0 + float(change[1]), radius + float(change[2])
        if float(np.abs(change).max()) < 1e-10 * abs(radius):
            break
    return x_0, y_0, radius, math.sqrt(float(np.mean((np.hypot(x - x_0, y - y_0) - radius) ** 2)))


def _from(name: str, zero: float) -> str:
    sign = "-" if zero >= 0 else "+"
    return f"`{name}` {sign} {abs(zero):.6g}"


def _turned(record: Record, moves: Sequence[Column]) -> DerivedAngle | None:
    """The angle through which something has turned, by its speed."""
    speeds = [c for c in moves if _TURNING.search(c.unit) and same_dimension(c.unit, "rad/s")]
    speeds = [c for c in speeds if float(record[c.name].min()) < 0]
    if not speeds:
        return None
    first = max(speeds, key=lambda c: float(np.std(record[c.name])))
    axes = [c for c in speeds if c is first or _of_one_thing((c, first))]
    signals = np.array([record[c.name] for c in axes])
    direction = np.linalg.svd(signals - np.median(signals, axis=1)[:, None], full_matrices=False)[0][:, 0]
    direction = direction * np.sign(direction[axes.index(first)])
    if direction[axes.index(first)] > _ALIGNED:
        axes, direction, signals = [first], np.ones(1), record[first.name][None]
    speed = direction @ signals
    bias = _bias(record.t, speed)
    parts = (
        [f"`{axes[0].name}`"]
        if len(axes) == 1
        else [f"{d:.5g}*`{c.name}`" for d, c in zip(direction, axes, strict=True)]
    )
    total = " + ".join(parts).replace("+ -", "- ")
    sign = "-" if bias >= 0 else "+"
    degrees = math.isclose(scale(first.unit), math.radians(1))
    factor = 1.0 if degrees else scale(first.unit)
    names = " and ".join(f"'{c.name}'" for c in axes)
    return DerivedAngle(
        formula=f"integral({total} {sign} {abs(bias):.6g})"
        if factor == 1.0
        else f"{factor:.9g}*integral({total} {sign} {abs(bias):.6g})",
        unit="deg" if degrees else "rad",
        of=tuple(c.name for c in moves),
        doubt=f"{names} measures a speed: integrated to an angle, less {bias:.3g} {first.unit} that it shows at rest.",
    )


def _bias(t: Array, speed: Array) -> float:
    """What a gyroscope shows at rest: the drift of the middle between the turning points of what it has turned."""
    bias = 0.0
    for _ in range(4):
        turned = CubicSpline(t, speed - bias).antiderivative()(t)
        width = max(5, t.size // 400)
        smooth = np.convolve(speed - bias, np.ones(width) / width, "same")
        far = np.flatnonzero(np.abs(smooth) > 0.3 * float(np.std(smooth)))  # noise about zero is no turn
        ends = np.flatnonzero(np.diff(np.signbit(smooth[far])))
        if ends.size < 4:
            return float(np.median(speed[-max(speed.size // 20, 2) :])) if bias == 0.0 and _still(speed) else bias
        extremes = np.array([_furthest(turned, *far[[k, k + 1]]) for k in ends])
        middle = (turned[extremes[:-2]] + 2 * turned[extremes[1:-1]] + turned[extremes[2:]]) / 4
        bias += float(np.polyfit(t[extremes[1:-1]], middle, 1)[0])
    return bias


def _furthest(turned: Array, start: int, stop: int) -> int:
    """Where between two samples it turned back."""
    part = turned[start : stop + 1]
    line = np.linspace(part[0], part[-1], part.size)
    return start + int(np.argmax(np.abs(part - line)))


def _still(speed: Array) -> bool:
    late = speed[-max(speed.size // 20, 2) :]
    return float(np.std(late)) < 0.05 * float(np.std(speed))
