"""Does a column command the acceleration of the driven body, as a stepper motor follows it whatever the pendulum does?

The body's place is then the command integrated twice, but for where it began, how fast, and a constant error. Such a
drive is a force on a body too heavy for a pendulum to move: the command times that inertia.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from upright import units
from upright.physics import Plant
from upright.readers.inspection import Column, Inspection
from upright.records import Array, Record
from upright.records.columns import ANGLES, LENGTHS
from upright.signals.regression import LeastSquares

HEAVY = {"x": ("m_c", 1e5), "psi": ("J_d", 1e3)}
"""Inertia by driven coordinate that nothing on it moves: a millionth of it weighs a pendulum [kg, kg m^2]."""
FOLLOWED = 0.95
"""Share of the place, but for a parabola, that the command integrated twice has to explain."""
EXACT = 0.05
"""How far the unit of a command may be from the one that its column states or is taken for."""
_NAMED = re.compile(r"acc|^a(_?(cmd|ref|des))?$|_ddot|/s\^?2", re.IGNORECASE)
_UNITS = {
    "m": ("m/s^2", "mm/s^2", "cm/s^2"),
    "rad": ("rad/s^2", "deg/s^2", "rev/s^2"),
}


def acceleration_command(
    record: Record, inspection: Inspection, plant: type[Plant], columns: Mapping[str, Column]
) -> Column | None:
    """The column that commands the acceleration of the driven coordinate, with its unit; None where none does."""
    body = next((c for c in plant.coordinates if plant.inputs and c.name == plant.inputs[0].on), None)
    if body is None or body.name not in columns or body.name not in HEAVY or HEAVY[body.name][0] not in plant.names():
        return None
    place = columns[body.name]
    scale = {**ANGLES, **LENGTHS}.get(place.guess)
    if scale is None:
        return None
    taken = {c.name for c in columns.values()}
    for c in inspection.columns:
        if c.name in taken or c.constant or not _NAMED.search(c.name):
            continue
        share, per = _followed(record.t, record[c.name], scale * record[place.name])
        near = [u for u in _units_of(c, body.unit) if abs(abs(per) / units.scale(u) - 1) < EXACT]
        if share > FOLLOWED and near:
            return replace(c, unit=near[0])
    return None


def _units_of(c: Column, unit: str) -> tuple[str, ...]:
    """Units that the column may be in: the one that it states, or all that are common."""
    stated = bool(c.unit) and units.known(c.unit) and units.same_dimension(c.unit, _UNITS[unit][0])
    return (c.unit,) if stated else _UNITS[unit]


def _followed(t: Array, u: Array, x: Array) -> tuple[float, float]:
    """Share of a place, but for a parabola, that a command integrated twice explains, and place per integral."""
    step = np.diff(t, prepend=t[0])
    speed = np.cumsum(step * np.concatenate([[0.0], u[:-1]]))
    far = np.cumsum(step * np.concatenate([[0.0], speed[:-1] + 0.5 * step[1:] * u[:-1]]))
    s = (t - t[0]) / max(float(t[-1] - t[0]), 1e-300)
    parabola = np.column_stack([np.ones_like(s), s, s**2])
    with_it, alone = LeastSquares.of(np.column_stack([far, parabola]), x), LeastSquares.of(parabola, x)
    return 1 - with_it.squares / max(alone.squares, 1e-300), float(with_it.slopes[0])
