"""Sensors whose reading is no place by itself, but a voltage: a potentiometer, a Hall sensor, a laser."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

from upright import units
from upright.errors import BadInput, nearest
from upright.records.record import Record

_AS_IN = 'as in --scale "CH2=30 deg/V"'


def in_places(record: Record, scales: Mapping[str, str]) -> Record:
    """The record with each of these columns as the angle [rad] or place [m] that its scale makes of it.

    Raises
    ------
    BadInput
        When there is no such column, or a scale is no angle or length per unit of its column.
    """
    signals, logged = dict(record.signals), dict(record.units)
    for name, scale in scales.items():
        if name not in signals:
            raise BadInput(f"The log has no column '{name}' to scale; {nearest(name, list(signals))}")
        unit, by = place_per(scale, record.units[name])
        if not by:
            of_one = f" per {record.units[name]}" if record.units[name] else ""
            raise BadInput(f"The scale of '{name}' is an angle or a length{of_one}, {_AS_IN}; got '{scale[:40]}'.")
        signals[name], logged[name] = by * record[name], unit
    return record.replace(signals=signals, units=logged)


def place_per(scale: str, logged: str) -> tuple[str, float]:
    """Unit of the place that a scale makes of a column, and how much [SI] one unit of it is; 0 where it is no place."""
    for unit in ("rad", "m"):
        with suppress(BadInput):
            return unit, units.parse(scale, f"{unit}/({logged})" if logged else unit) * units.scale(logged or "1")
    return "", 0.0
