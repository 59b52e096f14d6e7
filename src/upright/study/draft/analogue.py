"""Sensors whose reading is no place by itself, but a voltage: a potentiometer, a Hall sensor, a laser."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress

from upright import units
from upright.errors import BadInput, nearest
from upright.records import Record
from upright.study.text import TomlTable, toml

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
        unit, by = _place_per(scale, record.units[name])
        if not by:
            of_one = f" per {record.units[name]}" if record.units[name] else ""
            raise BadInput(f"The scale of '{name}' is an angle or a length{of_one}, {_AS_IN}; got '{scale[:40]}'.")
        signals[name], logged[name] = by * record[name], unit
    return record.replace(signals=signals, units=logged)


def as_logged(tables: Sequence[TomlTable], record: Record, scales: Mapping[str, str]) -> None:
    """Say in the sensors of a draft what the log holds, and by which scale it becomes a place."""
    for table in tables:
        stated = tomllib.loads(str(table)).get("sensors", {}) if table.lines[0].startswith("[sensors.") else {}
        for sensor in stated.values():
            if (name := sensor["column"]) not in scales:
                continue
            unit = record.units[name]
            zero = sensor["offset"] / _place_per(scales[name], unit)[1]
            given = [f"scale = {toml(scales[name])}   # as given"]
            for i, line in enumerate(table.lines):
                if line.startswith("column ="):
                    span = f"{record[name].min():.6g} to {record[name].max():.6g} {unit}".rstrip()
                    table.lines[i] = f"{line.partition('   # ')[0]}   # {span}"
                elif line.startswith("unit ="):
                    table.lines[i] = "\n".join([f"unit = {toml(unit)}", *given] if unit else given)
                elif line.startswith("offset ="):
                    table.lines[i] = line.replace(line.split()[2], toml(zero, 9), 1)


def _place_per(scale: str, logged: str) -> tuple[str, float]:
    """Unit of the place and how much of it [SI] one unit of the column is; 0 where it is no place."""
    for unit in ("rad", "m"):
        with suppress(BadInput):
            return unit, units.parse(scale, f"{unit}/({logged})" if logged else unit) * units.scale(logged or "1")
    return "", 0.0
