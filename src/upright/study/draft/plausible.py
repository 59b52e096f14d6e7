"""Would a laboratory have a rig with the numbers that a log suggests? If not, units or clock are the likely cause."""

from __future__ import annotations

from collections.abc import Mapping

from upright.physics import Plant
from upright.quantities import with_unit

ON_A_BENCH = {"kg": (1e-3, 30.0), "kg m^2": (1e-7, 3.0), "m": (5e-3, 5.0), "N/m": (1e-1, 1e5), "N m/rad": (1e-4, 1e3)}
"""Least and most of a mass, an inertia, a length and a stiffness that stand on a bench, by unit."""


def implausible(plant: type[Plant], values: Mapping[str, float], *, scaled_by: str) -> list[str]:
    """Sentences on numbers that no laboratory rig has, with the likely cause; zero is no number.

    `scaled_by`: what masses and stiffnesses are in proportion to; empty when to nothing.
    """
    odd: list[str] = []
    for name in plant.names():
        what, value = plant.quantity(name), abs(values.get(name, 0.0))
        low, high = ON_A_BENCH.get(what.unit, (0.0, float("inf")))
        if value and not low <= value <= high:
            odd.append(f"{name} = {with_unit(value, what.unit, 2)}")
    if not odd:
        return []
    cause = "the unit of a column or of the clock"
    if scaled_by:
        cause += f", or {scaled_by}"
    return [f"No laboratory rig has {', '.join(odd)}, which this log would need: {cause} is likely not what it seems."]
