"""What do the keys of a law mean? Gains with their units, limits, filters and references of `loop`, one reader each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop import Filter, SampledLaw
from upright.physics import Plant
from upright.records import Record
from upright.study import expressions
from upright.study.rig import per
from upright.study.sensors import Drive, Grid, Sensor
from upright.study.text import Section, show, si
from upright.units import in_unit

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Scene:
    """What a loop is read against: the run's data, sensors by coordinate, drive, the command's unit and its column."""

    plant: type[Plant]
    record: Record
    grid: Grid
    sensors: Mapping[str, Sensor]
    drive: Drive
    unit: str
    command: str

    @property
    def period(self) -> float:
        """Time between two rows [s]."""
        return float(self.grid.t[1] - self.grid.t[0])


def limited(section: Section, law: SampledLaw) -> SampledLaw:
    """The law with what the study says about its limit, what its sums do there, and its delay."""
    windup: Any = section.values.get("windup", "free")
    if windup not in ("free", "hold"):
        raise section.error("windup", f'windup must be "free" or "hold", got {show(windup)}')
    limit = section.positive("limit", "", 1.0) if "limit" in section else np.inf
    return replace(law, limit=limit, windup=windup, delay=section.number("delay", "1", 0.0))


def is_raw(section: Section) -> bool:
    """Whether gains are between the log's own columns."""
    units = section.values.get("units", "SI")
    if units not in ("SI", "log"):
        raise section.error("units", f'units must be "SI" or "log", got {show(units)}')
    return units == "log"


def filter_of(section: Section, period: float) -> Filter:
    """How differences are smoothed."""
    taps: Any = section.values.get("taps", [1, 0])
    if not isinstance(taps, list) or len(taps) != 2 or abs(sum(taps) - 1) > 1e-6:
        raise section.error("taps", f"taps must be two numbers that sum to 1, such as [0.2, 0.8], got {show(taps)}")
    tau = section.number("tau", "s", 0.0)
    return Filter(pole=Filter.of(tau, period).pole, second=float(taps[1]))


def every_of(section: Section, scene: Scene) -> int:
    """Samples of the law per row."""
    return matching(section, scene.period / section.positive("period", "s", 1.0)) if "period" in section else 1


def matching(section: Section, ratio: float) -> int:
    """Whole samples of the law per row."""
    every = round(ratio)
    if every < 1 or abs(ratio - every) > 0.02 * every:
        raise section.error(
            "period", f"the law is evaluated {ratio:.4g} times per row; it must be a whole number of times, so set the"
            " run's own period to that of the law, or to a multiple",
        )  # fmt: skip
    return every


def columns_of(section: Section, key: str) -> tuple[str, ...]:
    """Names of columns under `key`."""
    value: Any = section.values.get(key, [])
    items = value if isinstance(value, list) else [value]
    if not all(isinstance(item, str) for item in items):
        raise section.error(key, f"{key} of a law to recover must name columns, got {show(value)}")
    return tuple(items)


def several(section: Section, key: str, count: int, units: Sequence[str]) -> list[float]:
    """A gain per measured coordinate; a single number stands for the first."""
    value: Any = section.values.get(key, 0.0)
    items = value if isinstance(value, list) else [value]
    if len(items) > count:
        raise section.error(key, f"{key} has {len(items)} values for {count} measured coordinates")
    with section.text.at(section.place(key)):
        found = [
            in_unit(item, unit) if unit and isinstance(item, str) else si(item, "1", key)
            for item, unit in zip(items, units, strict=False)
        ]
    return found + [0.0] * (count - len(found))


def gain_unit(unit: str, coordinate: str, time: str) -> str:
    """Unit of a gain: of the command over that of the coordinate, of its sum or of its rate."""
    if not unit:
        return ""
    return {"": per(unit, coordinate), "s": per(unit, f"{coordinate} s"), "/s": per(unit, f"{coordinate}/s")}[time]


def first_of(scene: Scene, name: str, *, raw: bool = False) -> float:
    """First reading of a coordinate, as the law sees it."""
    sensor = scene.sensors.get(name)
    if sensor is None:
        return 0.0
    return float(scene.record[sensor.column][0]) if raw else float(sensor.read(scene.record)[0][0])


def gain(section: Section, key: str, above: str, below: str) -> float:
    """A gain in the command's unit per SI of what it multiplies."""
    value: Any = section.values[key]
    with section.text.at(section.place(key)):
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise section.error(key, f"{key} must be a number or text with a unit, got {show(value)}")
        return in_unit(value, per(above, below)) if above else section.number(key, "")


def reference_of(value: Any, unit: str, section: Section, scene: Scene) -> Array:
    """One number (1,), or (N,) from a column or an expression."""
    with section.text.at(section.place("reference")):
        if isinstance(value, str) and not value[:1].isdigit() and value[:1] not in "+-.":
            return scene.grid.commands(expressions.evaluate(value, scene.record.signals, scene.record.t))
        return np.array([si(value, unit, "reference")])
