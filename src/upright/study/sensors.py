"""Columns of a log as coordinates and commands on a uniform time base: [columns], [sensors], [drive] and [inputs]."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from upright import units
from upright.errors import BadInput
from upright.physics import Coordinate, Plant
from upright.physics.combination import combination
from upright.records import Array, Record
from upright.study import expressions
from upright.study.keys import names
from upright.study.text import Section, as_written, in_si

_UNIFORM = 0.02  # samples off the grid by less than this part of a period count as on it
_ON_GRID = 1e-6  # and by less than this as at the grid's instant
_MOST = 10_000_000  # samples of a run, some 80 MB for each of its signals
_GAP, _HOPELESS = 5, 100  # periods without a sample: reported, refused


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Column of a log that measures one coordinate, or a sum `of` several: ``sign * scale * (reading - offset)``.

    `of` has the factor of each coordinate in the sum; empty is the coordinate itself. Without a `unit` it is as the log
    says. `scale` None means that unit and counts say all; on a column of another kind, such as V, it is SI per unit of
    the column. `offset` is a reading, as text or in the column's unit. `resolution` is in SI.
    """

    coordinate: Coordinate
    column: str
    of: Mapping[str, float] = field(default_factory=dict[str, float])
    unit: str | None = None
    counts_per_rev: float | None = None
    counts_per_m: float | None = None
    scale: float | None = None
    sign: float = 1.0
    offset: float | str = 0.0
    resolution: float | None = None

    @property
    def per_count(self) -> float | None:
        """SI per count, where the counts are given."""
        if self.counts_per_rev is not None:
            return 2 * math.pi / self.counts_per_rev
        return None if self.counts_per_m is None else 1 / self.counts_per_m

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
            way = f'scale = "... {needed}/{unit}"'
            if units.same_dimension(unit, "counts"):
                ways = f"so {self.coordinate.name} needs counts_per_{'rev' if needed == 'rad' else 'm'} = ... or {way}"
            else:
                ways = f"but {self.coordinate.name} is in {needed}: correct the unit, or give {way}"
            raise BadInput(f"column '{self.column}' is in {unit}, {ways}")
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
        """What is measured (N,) [SI] at the record's own instants, its resolution [SI], and what was noticed."""
        readings = record[self.column]
        factor, zero = self.line(record)
        values = _placed(readings, zero, factor, self.per_count)
        notes: tuple[str, ...] = ()
        if self.coordinate.unit == "rad" and np.abs(np.diff(values)).max(initial=0.0) > 1.5 * math.pi:
            values = np.asarray(np.unwrap(values), dtype=np.float64)
            notes = (f"{self.column} jumps by a turn and was unwrapped",)
        return values, self.resolution or self.per_count or 0.0, notes


def _placed(readings: Array, zero: float, factor: float, step: float | None) -> Array:
    """Coordinate [SI] from readings, a text's rounding undone, so that no unit it was written in makes a difference.

    Angles on the grid of an encoder's `step` [SI] are put there; 250 mm are 0.25 m to the last bit.
    """
    values = factor * readings
    if step:
        on_grid = np.round(values / step) * step
        if 1e-12 * step < float(np.abs(values - on_grid).max()) < ROUNDED * step:
            return on_grid - factor * zero
    if abs(factor) in units.PARTS:
        return units.converted(readings, factor) - units.converted(zero, factor)
    return factor * (readings - zero)


ROUNDED = 1e-3
"""Share of an encoder's step within which its text has to lie."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Command of one input: a column or an expression on columns, times `scale` and `sign`; nothing is a free run.

    `place` says where the study states it.
    """

    what: str | None = None
    unit: str | None = None
    scale: float = 1.0
    sign: float = 1.0
    place: tuple[str | int, ...] = ()

    def read(self, record: Record) -> Array:
        """Command (N,) in the drive's unit at the record's own instants."""
        if self.what is None:
            return np.zeros(record.t.size)
        return self.sign * units.converted(expressions.evaluate(self.what, record.signals, record.t), self.scale)


@dataclass(frozen=True, kw_only=True)
class Wiring:
    """Which column of a log is what, and which coordinates were locked meanwhile; all of it may be empty.

    `study` has the columns that are computed from those of the log, see `with_derived`.
    """

    sensors: Mapping[str, Sensor] = field(default_factory=dict[str, Sensor])
    drive: Drive | None = None
    locked: tuple[str, ...] = ()
    study: Section | None = None


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
            When the record has a gap too long to bridge, or the period leaves too few samples.
        """
        steps = np.diff(t)
        median = float(np.median(steps))
        own = float(steps[steps < 1.5 * median].mean())
        period = period or own
        count = math.floor((t[-1] - t[0]) / period * (1 + 1e-9) + 1e-6) + 1
        if count > _MOST:
            raise BadInput(
                f"{t[-1] - t[0]:g} s in steps of {period:g} s are {count:.3g} samples, and a run may have {_MOST:.0e};"
                " take a longer period or a shorter window"
            )
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

    def references(self, values: Array) -> Array:
        """What a program reads at the instants of the grid: the last value before each."""
        if self.uniform:
            return values
        slack = _ON_GRID * (self.t[1] - self.t[0])
        return values[np.clip(np.searchsorted(self.source, self.t + slack, side="right") - 1, 0, None)]

    def commands(self, values: Array) -> Array:
        """Commands on the grid: the mean over each interval of what was held there, so that impulses are kept."""
        if self.uniform:
            return values
        since = (self.source[1:] - self.t[0]) / (self.t[1] - self.t[0])
        interval = np.floor(since + _ON_GRID).astype(np.int64)
        left = 1.0 - (since - interval)  # share of its interval for which a change lasts
        inside = (left < 1.0 - _ON_GRID) & (interval < self.t.size)
        changed = np.bincount(interval[inside], (np.diff(values) * left)[inside], minlength=self.t.size)
        return self.references(values) + changed

    def description(self) -> tuple[str, ...]:
        """What was done to the time base, in sentences."""
        if self.uniform:
            return self.notes
        period = self.t[1] - self.t[0]
        return (*self.notes, f"resampled from {self.source.size} to {self.t.size} samples of {period * 1e3:.4g} ms")


def with_derived(record: Record, study: Section) -> Record:
    """The record with the columns of the study's ``[columns.NAME]``; each may use those before it.

    Raises
    ------
    BadInput
        With the study's line, when the log has a column of that name or a formula cannot be evaluated.
    """
    columns = study.section("columns")
    signals, logged = dict(record.signals), dict(record.units)
    for name in columns.values:
        column = columns.section(name)
        column.check(names("columns"))
        if name in signals:
            raise columns.error(name, f"the log has a column '{name}' of its own; choose another name")
        formula = column.text_of("formula", "atan2(x, -y)")
        with column.at("formula"):
            signals[name] = expressions.evaluate(formula, signals, record.t)
        logged[name] = read_unit(column) or ""
    return record.replace(signals=signals, units=logged) if columns.values else record


def read_sensors(study: Section, run: Section, plant: type[Plant]) -> dict[str, tuple[Sensor, Section]]:
    """Sensors of one run by coordinate, the rig's with the run's changes on top, and where each one is written."""
    shared, own = study.section("sensors"), run.section("sensors")
    coordinates = {c.name: c for c in plant.coordinates}
    for table in (shared, own):
        table.check(coordinates, f"coordinate of {plant.__name__} called")
    out: dict[str, tuple[Sensor, Section]] = {}
    for name, coordinate in coordinates.items():
        if name in shared or name in own:
            for table in (shared, own):
                table.section(name).check(names("sensors"))
            section = own.section(name).over(shared.section(name))
            out[name] = read_sensor(section, coordinate, plant), section
    return out


def assumed_scales(study: Section, plant: type[Plant]) -> dict[str, float]:
    """Counts per turn or metre that nobody measured, of sensors whose columns are in counts."""
    out: dict[str, float] = {}
    for name, (sensor, section) in read_sensors(study, Section(study.text, (), {}), plant).items():
        for key, unit in (("counts_per_rev", "1"), ("counts_per_m", "1/m")):
            if key in section and sensor.unit and units.same_dimension(sensor.unit, "counts"):
                counts, source = section.stated(key, unit)
                out |= {f"sensors.{name}.{key}": counts} if source == "assumed" else {}
    return out


def read_sensor(section: Section, coordinate: Coordinate, plant: type[Plant]) -> Sensor:
    """One sensor."""
    name = coordinate.name
    for key, needed in (("counts_per_rev", "rad"), ("counts_per_m", "m")):
        if key in section and coordinate.unit != needed:
            right = "counts_per_m" if coordinate.unit == "m" else "counts_per_rev"
            raise section.error(key, f"{name} is in {coordinate.unit}, so give {right} or scale, not {key}")
    per = {
        key: section.stated(key, unit)[0] if key in section else None
        for key, unit in (("counts_per_rev", "1"), ("counts_per_m", "1/m"))
    }
    return Sensor(
        coordinate=coordinate,
        column=section.text_of("column", name) if "column" in section else name,
        of=_sum(section, coordinate, plant) if "expression" in section else {},
        unit=read_unit(section),
        scale=_scale(section, coordinate) if "scale" in section else None,
        sign=read_sign(section),
        offset=_offset(section),
        resolution=section.stated("resolution", coordinate.unit)[0] if "resolution" in section else None,
        **per,
    )


def _sum(section: Section, coordinate: Coordinate, plant: type[Plant]) -> dict[str, float]:
    """Factors of the coordinates that a column measures the sum of; empty for the coordinate itself."""
    text = section.text_of("expression", "theta_2 - theta_1")
    with section.at("expression"):
        factors = combination(text, [c.name for c in plant.coordinates])
        if not all(math.isfinite(f) for f in factors.values()):
            raise BadInput(f"'{text}' has factors beyond 1e300")
    if coordinate.name not in factors:
        raise section.error("expression", f"[sensors.{coordinate.name}] measures '{text}', without {coordinate.name} in"
                            f" it; call it [sensors.{next(iter(factors))}], or mend the expression")  # fmt: skip
    return {} if factors == {coordinate.name: 1.0} else factors


def read_unit(section: Section) -> str | None:
    """Unit that a table states."""
    if "unit" not in section:
        return None
    unit = section.text_of("unit", "counts")
    with section.at("unit"):
        units.scale(unit)
    return unit


def read_sign(section: Section) -> float:
    """+1 or -1."""
    sign: Any = section.values.get("sign", 1)
    if isinstance(sign, bool) or sign not in (1, -1):
        raise section.error("sign", f"sign must be 1 or -1, got {as_written(sign)}")
    return float(sign)


def _scale(section: Section, coordinate: Coordinate) -> float:
    """Scale as a number, or as text: SI of the coordinate per unit of the column."""
    value: Any = section.values["scale"]
    if isinstance(value, str):
        unit = section.values.get("unit", "")
        with section.at("scale"):
            needed = coordinate.unit
            if unit and not units.same_dimension(unit, needed):
                return units.parse(value, f"{needed}/({unit})") * units.scale(unit)
            return units.parse(value)
    scale = section.number("scale", "1")
    if scale == 0:
        raise section.error("scale", "scale must not be zero; a coordinate that is not measured has no sensor")
    return scale


def _offset(section: Section) -> float | str:
    value: Any = section.values.get("offset", 0.0)
    if isinstance(value, str):
        with section.at("offset"):
            units.parse(value)
        return value
    return section.number("offset", "1", 0.0)


def read_drives(study: Section, run: Section, plant: type[Plant]) -> list[Drive]:
    """Command of each input of the plant in one run."""
    inputs = [i.name for i in plant.inputs]
    closed = "loop" in run
    drives: list[Drive] = []
    for table in (study.section("inputs"), run.section("inputs")):
        table.check(inputs, f"input of {plant.__name__} called")
    for k, name in enumerate(inputs):
        shared = study.section("inputs").section(name)
        if k == 0:
            shared = shared.over(study.section("drive"))
        own = _as_table(run.section("inputs"), name)
        if k == 0:
            own = own.over(_as_table(run, "drive"))
        for table in (shared, own):
            table.check(names("drive"))
        drives.append(_drive(own, shared, free=closed and not own.values))
    if "drive" in study.values and not inputs:
        raise study.error("drive", f"{plant.__name__} has no input to drive; leave [drive] out")
    return drives


def _as_table(section: Section, key: str) -> Section:
    """Drive of a run, where a plain text stands for its column or expression and 0 for none."""
    value: Any = section.values.get(key, {})
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        return section.section(key)
    if not isinstance(value, str):
        with section.at(key):
            value = repr(in_si(value, "", key))
    table = Section(section.text, section.place(key), {"expression": value})
    table.places = {"expression": section.place(key)}
    return table


def _drive(own: Section, shared: Section, *, free: bool) -> Drive:
    both = own.over(shared)
    source = own if "column" in own or "expression" in own else shared
    if "column" in source and "expression" in source:
        raise source.error("expression", "a drive has either a column or an expression, got both")
    if both.values and not free and "column" not in source and "expression" not in source:
        raise both.error(next(iter(both.values)), 'a drive needs column = "v" or expression = "2.5*(0.2 - z)"')
    key = "column" if "column" in source else "expression"
    what = None if free or key not in source else source.text_of(key, "v")
    return Drive(
        what=f"`{what}`" if key == "column" and what else what,
        unit=read_unit(both),
        scale=both.number("scale", "1", 1.0),
        sign=read_sign(both),
        place=source.place(key),
    )


def drive_sign(study: Section, name: str) -> float:
    """Sign of the force, by the plant's coordinate, that a positive value of the first input's column gives."""
    table = study.section("inputs").section(name).over(study.section("drive"))
    return read_sign(table) * math.copysign(1.0, table.number("scale", "1", 1.0))


def drive_unit(study: Section) -> str:
    """Unit of the first input's command: as stated, or as the actuator's gain implies, or ""."""
    tables = [study.section("drive"), study.section("defaults").values.get("drive")]
    inputs: Any = study.values.get("inputs", {})
    tables += list(inputs.values()) if isinstance(inputs, dict) else []
    runs: Any = study.values.get("runs", [])
    tables += [run.get("drive") for run in (runs if isinstance(runs, list) else []) if isinstance(run, dict)]
    for table in tables:
        values: Any = table.values if isinstance(table, Section) else table
        if isinstance(values, dict) and isinstance(values.get("unit"), str) and units.known(values["unit"]):
            return values["unit"]
    gain: Any = study.section("actuator").values.get("gain")
    if isinstance(gain, dict):
        gain = gain.get("guess", gain.get("value"))
    below = units.denominator(gain).strip() if isinstance(gain, str) else ""
    return below if below and units.known(below) else ""
