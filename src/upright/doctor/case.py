"""Which record is looked at, and which of its columns is what?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from upright.identification import Parameter
from upright.physics import Plant
from upright.readers.inspection import Column, Inspection
from upright.records import Array, Record


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """A coordinate as it was measured: `y` (N,) [SI], its `quantum` [SI], and the column it came from."""

    column: str
    y: Array
    quantum: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """A record with what is known about its rig.

    Attributes
    ----------
    record, seen
        The log and its inspection.
    rig : str
        What the rig was said to be; empty when nobody said.
    plant : type of Plant or None
    parameters : mapping of str to Parameter
        Of the plant and its actuator; empty when only the plant's name is known.
    places : mapping of str to Place
        Measured coordinates.
    zeroed : bool
        Whether somebody said where each coordinate is zero, rather than the record.
    drive : str
        Column of the effort; empty when there is none.
    u : (N,) array
        Effort in the actuator's unit.
    moduli : mapping of str to tuple of float
        Turns the counter behind a column may make, in the column's unit.
    locked : tuple of str
        Coordinates known not to move.
    """

    record: Record
    seen: Inspection
    rig: str = ""
    plant: type[Plant] | None = None
    parameters: Mapping[str, Parameter] = field(default_factory=dict[str, Parameter])
    places: Mapping[str, Place] = field(default_factory=dict[str, Place])
    zeroed: bool = False
    drive: str = ""
    u: Array = field(default_factory=lambda: np.zeros(0))
    moduli: Mapping[str, tuple[float, ...]] = field(default_factory=dict[str, "tuple[float, ...]"])
    locked: tuple[str, ...] = ()

    @property
    def measured(self) -> tuple[Column, ...]:
        """Columns that measure a place: those of the coordinates, else whatever looks like one."""
        named = [p.column for p in self.places.values()]
        if named:
            return tuple(self.seen.column(name) for name in named)
        return tuple(c for c in self.seen.columns if not (c.drive or c.constant or about_time(c)))

    @property
    def driven(self) -> bool:
        """Whether an effort column ever leaves zero."""
        return bool(self.drive) and bool(np.any(self.u))

    @property
    def chained(self) -> bool:
        """Whether the bodies are alike, so that one that hardly moves beside another was held."""
        if self.plant is not None:
            return self.plant.__name__.startswith(("Rectilinear", "Torsional"))
        return all((c.unit or c.guess) in ("counts", "m", "mm") for c in self.measured)

    def moves(self, name: str, share: float = 0.03) -> bool:
        """Whether a coordinate moves beside the largest motion in the same unit."""
        unit = {c.name: c.unit for c in self.plant.coordinates} if self.plant else {}
        spans = {n: float(np.ptp(p.y)) for n, p in self.places.items() if unit.get(n) == unit.get(name)}
        return spans.get(name, 0.0) > share * max(spans.values(), default=0.0)


def about_time(c: Column) -> bool:
    """Whether a column only counts rows or repeats the time."""
    return any("the time" in s or "index" in s for s in c.lies)
