"""How does a column of a log become a coordinate or a command on a uniform time base?"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright import units
from upright.errors import BadInput
from upright.physics import Coordinate
from upright.records import Record
from upright.study import expressions

Array = NDArray[np.float64]

_UNIFORM = 0.02  # samples off the grid by less than this part of a period count as on it
_GAP, _HOPELESS = 5, 100  # periods without a sample: told, refused


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Column of a log that measures one coordinate: ``sign * scale * (reading - offset)``.

    `unit` "" means as the log says. `scale` None means that unit and counts say all; on a column of another
    kind, such as V, it is SI per unit of the column. `offset` is a reading, as text or in the column's unit.
    `resolution` is in SI; 0 means not given.
    """

    coordinate: Coordinate
    column: str
    unit: str = ""
    counts_per_rev: float = 0.0
    counts_per_m: float = 0.0
    scale: float | None = None
    sign: float = 1.0
    offset: float | str = 0.0
    resolution: float = 0.0

    @property
    def per_count(self) -> float:
        """SI per count, 0 when not given."""
        if self.counts_per_rev:
            return 2 * math.pi / self.counts_per_rev
        return 1 / self.counts_per_m if self.counts_per_m else 0.0

    def column_unit(self, record: Record, readings: Array) -> str:
        """Unit of the column; whole numbers are taken for counts when counts_per_* is given and no unit is."""
        unit = self.unit or record.units.get(self.column, "")
        unit = unit if units.known(unit) else ""
        if not unit and self.per_count and np.ptp(readings) > 2 and (readings == np.round(readings)).all():
            return "counts"
        return unit

    def factor(self, unit: str) -> float:
        """SI per unit of the column."""
        needed = self.coordinate.unit
        if not unit or units.same_dimension(unit, needed):
            return units.scale(unit) * (1.0 if self.scale is None else self.scale)
        if units.same_dimension(unit, "counts") and self.per_count:
            return self.per_count * (1.0 if self.scale is None else self.scale)
        if self.scale is None:
            counts = f"counts_per_{'rev' if needed == 'rad' else 'm'} = ... or "
            ways = f'{counts if units.same_dimension(unit, "counts") else ""}scale = "... {needed}/{unit}"'
            raise BadInput(f"column '{self.column}' is in {unit}, so {self.coordinate.name} needs {ways}")
        return self.scale

    def line(self, record: Record) -> tuple[float, float]:
        """Coordinate [SI] per unit of the column, sign included, and the reading at which the coordinate is zero."""
        unit = self.column_unit(record, record[self.column])
        factor = self.factor(unit)
        zero = self.offset
        if isinstance(zero, str) and unit and not units.same_dimension(unit, self.coordinate.unit):
            try:
                zero = units.parse(zero, self.coordinate.unit) / factor  # "180 deg" of a column in counts
            except BadInput:
                zero = units.in_unit(zero, unit)
        elif isinstance(zero, str):
            zero = units.parse(zero, self.coordinate.unit) / units.scale(unit)
        return self.sign * factor, zero

    def read(self, record: Record) -> tuple[Array, float, tuple[str, ...]]:
        """Coordinate (N,) [SI] at the record's own instants, its resolution [SI], and what was noticed."""
        readings = record[self.column]
        factor, zero = self.line(record)
        values = factor * (readings - zero)
        notes: tuple[str, ...] = ()
        if self.coordinate.unit == "rad" and np.abs(np.diff(values)).max(initial=0.0) > 1.5 * math.pi:
            values = np.unwrap(values)
            notes = (f"{self.column} jumps by a turn and was unwrapped",)
        return values, self.resolution or self.per_count, notes


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Command of one input: a column or an expression on columns, times `scale` and `sign`; nothing is a free run.

    `place` says where the study states it.
    """

    what: str = ""
    unit: str = ""
    scale: float = 1.0
    sign: float = 1.0
    place: tuple[str | int, ...] = ()

    def read(self, record: Record) -> Array:
        """Command (N,) in the drive's unit at the record's own instants."""
        if not self.what:
            return np.zeros(record.t.size)
        return self.sign * self.scale * expressions.evaluate(self.what, record.signals, record.t)


@dataclass(frozen=True, kw_only=True)
class Grid:
    """Uniform time base of one run, and how a record is brought onto it."""

    source: Array
    t: Array
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, t: Array, period: float = 0.0) -> Grid:
        """Grid at `period` [s], or at the record's own when 0.

        Raises
        ------
        BadInput
            When the record is silent for most of the window, or the period leaves too few samples.
        """
        steps = np.diff(t)
        median = float(np.median(steps))
        own = float(steps[steps < 1.5 * median].mean())
        period = period or own
        count = math.floor((t[-1] - t[0]) / period * (1 + 1e-9) + 1e-6) + 1
        if count < 8:
            raise BadInput(f"{count} samples of {period:g} s are too few for a run; at least 8 are needed")
        notes: list[str] = []
        gap = int(np.argmax(steps))
        if steps[gap] > max(_HOPELESS * own, 0.05 * (t[-1] - t[0])):
            raise BadInput(
                f"the log is silent from t = {t[gap]:g} to {t[gap + 1]:g} s; make one run of the part before"
                " and one of the part after"
            )
        if steps[gap] > _GAP * own:
            several = int((steps > _GAP * own).sum())
            notes.append(
                f"{several} gap(s) bridged by straight lines, the longest {steps[gap]:.3g} s at {t[gap]:.4g} s"
            )
        return cls(source=t, t=t[0] + period * np.arange(count), notes=tuple(notes))

    @property
    def uniform(self) -> bool:
        """Whether the record's own samples are the grid."""
        if self.t.size != self.source.size:
            return False
        return bool(np.abs(self.t - self.source).max() < _UNIFORM * (self.t[1] - self.t[0]))

    def outputs(self, values: Array) -> Array:
        """Measured values on the grid, straight lines between samples."""
        return values if self.uniform else np.interp(self.t, self.source, values)

    def commands(self, values: Array) -> Array:
        """Commands on the grid, each held until the next."""
        if self.uniform:
            return values
        slack = 1e-6 * (self.t[1] - self.t[0])
        return values[np.clip(np.searchsorted(self.source, self.t + slack, side="right") - 1, 0, None)]

    def told(self) -> tuple[str, ...]:
        """What was done to the time base, in words."""
        if self.uniform:
            return self.notes
        period = self.t[1] - self.t[0]
        return (*self.notes, f"resampled from {self.source.size} to {self.t.size} samples of {period * 1e3:.4g} ms")
