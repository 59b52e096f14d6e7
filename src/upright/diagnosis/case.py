"""A record together with what is known about its rig: a plant's name, a study, or a fit made before."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from upright.diagnosis.findings import Curve, Panel
from upright.errors import BadInput
from upright.physics import Plant, find, name_of
from upright.readers.inspection import Column, Inspection
from upright.records import Array, Record
from upright.records.columns import ANGLES, LENGTHS
from upright.rig import Hardware, Rig
from upright.study.description import rig_with_guesses
from upright.study.draft.recognise import RATE, drive_column, recognise
from upright.study.rig import read_plant, read_rig
from upright.study.sensors import Drive, Sensor, Wiring, drive_unit, read_drives, read_sensors
from upright.study.stored_rig import read_stored_rig
from upright.study.text import Section, StudyText

COUNTERS = (2 * math.pi, 360.0, 65536.0, 4294967296.0)
"""Turns that counters are known to make, in rad, deg and counts."""

HELD = 0.2
"""A body that moves less than this part of the largest motion was held."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """A coordinate as it was measured: `y` (N,) and its `resolution` in `unit`, and the column it came from.

    The unit is the coordinate's, or counts where counts per turn or metre are not specified.
    """

    column: str
    y: Array
    resolution: float
    unit: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """A record with what is known about its rig.

    Attributes
    ----------
    record, inspection
        The log, and what is known about it before any model.
    rig : Rig or None
        With the numbers that are known; None where only the plant's name is, or the wiring of its columns is not
        specified.
    places : mapping of str to Place
        Measured coordinates.
    zeroed : bool
        Whether each coordinate's zero is specified, rather than taken from the record.
    drive : str
        Column of the effort; empty when there is none.
    u : (N,) array
        Effort in the actuator's unit.
    moduli : mapping of str to tuple of float
        Turns the counter behind a column may make, in the column's unit.
    locked : tuple of str
        Coordinates known not to move.
    stated : mapping of str to Sensor or Drive
        What a study says of each coordinate, and of ``"effort"``; what is found wrong is so with that.
    """

    record: Record
    inspection: Inspection
    plant: type[Plant] | None = None
    rig: Rig | None = None
    places: Mapping[str, Place] = field(default_factory=dict[str, Place])
    zeroed: bool = False
    drive: str = ""
    u: Array = field(default_factory=lambda: np.zeros(0))
    moduli: Mapping[str, tuple[float, ...]] = field(default_factory=dict[str, "tuple[float, ...]"])
    locked: tuple[str, ...] = ()
    stated: Mapping[str, Sensor | Drive] = field(default_factory=dict[str, "Sensor | Drive"])

    @property
    def measured(self) -> tuple[Column, ...]:
        """Columns that measure a place: those of the coordinates, the record's outputs, else what looks like one."""
        named = [p.column for p in self.places.values()]
        if named:
            return tuple(self.inspection.column(name) for name in named)
        stated = self.record.outputs or self.record.names
        return tuple(
            c for c in self.inspection.columns if c.name in stated and not (c.drive or c.constant or tells_time(c))
        )

    @property
    def driven(self) -> bool:
        """Whether an effort column ever leaves zero."""
        return bool(self.drive) and bool(np.any(self.u))

    @property
    def chained(self) -> bool:
        """Whether the bodies are alike, so that one that hardly moves beside another was held."""
        if self.plant is not None:
            derived, n = self.plant.derived(without=frozenset(self.plant.optional)), len(self.plant.coordinates)
            apart = sum(text != "0" for text in derived.mass) == n  # joined by forces alone
            return apart and not derived.trig and len({c.unit for c in self.plant.coordinates}) == 1
        return all(column_unit(c) in ("counts", *LENGTHS) for c in self.measured)

    def moves(self, name: str) -> bool:
        """Whether a coordinate moves by more than 3 % of the largest motion in the same unit."""
        unit = {c.name: c.unit for c in self.plant.coordinates} if self.plant else {}
        spans = {n: float(np.ptp(p.y)) for n, p in self.places.items() if unit.get(n) == unit.get(name)}
        return spans.get(name, 0.0) > 0.03 * max(spans.values(), default=0.0)

    def span(self, c: Column) -> float:
        """Range of a column in the record, which may be mended when the inspection was not."""
        return float(np.ptp(self.record[c.name]))

    def widest(self, unit: str) -> Column:
        """Measured column in a unit that covers the largest range."""
        return max((c for c in self.measured if column_unit(c) == unit), key=self.span)

    def beside(self, c: Column) -> float:
        """Range of a measured column as a share of the largest in the same unit; 0 where nothing moves."""
        return self.span(c) / (self.span(self.widest(column_unit(c))) or 1.0)

    def held(self, c: Column) -> bool:
        """Whether a body hardly moves beside another one that is alike."""
        return self.chained and self.beside(c) < HELD

    def coordinate(self, column: str) -> str:
        """Coordinate that a column measures, or a placeholder that a reader replaces."""
        return next((n for n, p in self.places.items() if p.column == column), "COORDINATE")

    def corrected(self, who: str, factor: float) -> str:
        """Lines of a study that multiply a coordinate, or the effort, by a factor on top of what is stated now."""
        stated = self.stated.get(who)
        sign = stated.sign if stated is not None else 1.0
        scale = (stated.scale if stated is not None else None) or 1.0
        table = "drive" if who == "effort" else f"sensors.{who}"
        line = f"sign = {-sign:.0f}" if factor == -1 else f"scale = {scale * factor:.4g}"
        return f"[{table}]\n{line}"

    def over_time(self, *columns: str) -> tuple[Panel, ...]:
        """Columns over the whole record, those that the log has."""
        present = [self.inspection.column(name) for name in columns if name in self.record.signals]
        return tuple(self._panel(c, slice(None), "steps" if c.stepwise else "line") for c in present)

    def near(self, column: str, i: int) -> Panel:
        """Readings of a column near sample `i`."""
        return self._panel(self.inspection.column(column), slice(max(i - 40, 0), i + 40), "points")

    def _panel(self, c: Column, rows: slice, style: Literal["line", "steps", "points"]) -> Panel:
        unit = column_unit(c)
        curve = Curve(name=c.name, t=self.record.t[rows], y=self.record[c.name][rows], style=style)
        return Panel(label=f"{c.name} [{unit}]" if unit else c.name, curves=(curve,))


def tells_time(c: Column) -> bool:
    """Whether a column only counts rows or repeats the time."""
    return any("the time" in s or "index" in s for s in c.remarks)


def tells_speed(c: Column) -> bool:
    """Whether a column is a rate, which a stop changes at once and no count is lost from."""
    return column_unit(c).endswith("/s") or RATE.search(c.name) is not None


def column_unit(c: Column) -> str:
    """Unit of a column as the log or its look says; empty when neither does."""
    return c.unit or c.guess


def read_known(text: str, log: str = "") -> tuple[Rig | type[Plant], Wiring]:
    """Rig, or kind of plant, and wiring by a plant's name, a study (TOML), a ``fit.json`` or an MJCF file.

    Parameters
    ----------
    log : str
        File whose run a study may describe.

    Raises
    ------
    BadInput
        When it is none of these.
    """
    path = Path(text)
    if path.suffix in (".json", ".xml") or (path.is_dir() and (path / "fit.json").is_file()):
        return replace(read_stored_rig(path, draws=0), name=text), Wiring()
    if path.suffix == ".toml":
        return _study(path, log)
    try:
        return find(text), Wiring()
    except BadInput as error:
        unknown = f"{str(error).rstrip('.')}.".replace("?.", "?")
        raise BadInput(
            f"--rig {text}: {unknown} A rig is a plant's name, a study or RIG.toml, a fit.json or an MJCF file."
        ) from None


def _study(path: Path, log: str) -> tuple[Rig, Wiring]:
    text = StudyText(path)
    study = text.root()
    plant = read_plant(study)
    model = read_rig(study, plant, drive_unit(study))
    entries = study.values.get("runs", [])
    run = Section(text, ("runs",), {})
    for i, values in enumerate(entries if isinstance(entries, list) else []):
        if isinstance(values, dict) and Path(str(values.get("file", ""))).name == Path(log).name:
            run = Section(text, ("runs", i), values)
            break
    run = run.over(study.section("defaults"))
    sensors = {n: s for n, (s, _) in read_sensors(study, run, plant).items() if not s.of}
    drives = read_drives(study, run, plant)
    drive = drives[0] if drives and drives[0].what and "loop" not in run else None
    locked: object = run.values.get("locked", ())
    names = tuple(str(n) for n in locked) if isinstance(locked, list | dict) else ()
    # the drive's sign is in the wiring, so not in the rig
    rig = rig_with_guesses(model, str(path), Hardware())
    return rig, Wiring(sensors=sensors, drive=drive, locked=names, study=study)


def case_of(record: Record, inspection: Inspection, rig: Rig | type[Plant] | None, wiring: Wiring) -> Case:
    """Record and rig brought together."""
    plant = type(rig.plant) if isinstance(rig, Rig) else rig
    if plant is None or not any(s.column in record.signals for s in wiring.sensors.values()):
        return _recognised(record, inspection, plant)
    places: dict[str, Place] = {}
    moduli: dict[str, tuple[float, ...]] = {}
    for name, sensor in wiring.sensors.items():
        if sensor.column not in record.signals or name in wiring.locked:
            continue
        y, resolution, _ = sensor.read(record)
        factor = sensor.factor(sensor.column_unit(record, record[sensor.column]))
        step = inspection.column(sensor.column).resolution.step
        places[name] = Place(
            column=sensor.column, y=y, resolution=resolution or step * factor, unit=sensor.coordinate.unit
        )
        turn = 2 * math.pi / factor if sensor.coordinate.unit == "rad" and factor else 0.0
        moduli[sensor.column] = tuple({m for m in (turn, *COUNTERS) if m})
    u, drive = np.zeros(record.t.size), ""
    if wiring.drive is not None:
        u = wiring.drive.read(record)
        stated = wiring.drive.what or ""
        drive = stated.strip("`") if stated.strip("`") in record.signals else stated
    return Case(
        record=record, inspection=inspection, plant=plant, rig=rig if isinstance(rig, Rig) else None,
        places=places, zeroed=True, drive=drive, u=u, moduli=moduli, locked=wiring.locked,
        stated={**wiring.sensors, **({"effort": wiring.drive} if wiring.drive is not None else {})},
    )  # fmt: skip


def _recognised(record: Record, inspection: Inspection, plant: type[Plant] | None) -> Case:
    """Columns found by name and kind; a plant that needs angles gets none from counts of an unknown encoder."""
    named = "" if plant is None else name_of(plant)
    try:
        recognised = recognise(record, inspection, named)
    except BadInput:
        recognised = None
    column = recognised.drive if recognised else drive_column(record, inspection)
    u: Array = record[column.name] if column is not None else np.zeros(record.t.size)
    if column is not None and any(remark.startswith("the first samples are outliers") for remark in column.remarks):
        u = np.concatenate([np.full(3, u[3]), u[3:]])
    places: dict[str, Place] = {}
    chain = plant is not None and not any(c.name in ("theta", "psi", "x") for c in plant.coordinates)
    for coordinate in plant.coordinates if plant is not None else ():
        c = recognised.columns.get(coordinate.name) if recognised is not None else None
        if c is None or recognised is None:
            continue
        factor = {"": 1.0, **ANGLES, **LENGTHS}.get(c.guess, 0.0)
        if factor or chain or coordinate.unit == "m":
            factor = factor or 1.0
            y = factor * (record[c.name] - recognised.rest[coordinate.name])
            unit = c.guess if c.guess == "counts" else coordinate.unit
            places[coordinate.name] = Place(column=c.name, y=y, resolution=factor * c.resolution.step, unit=unit)
    return Case(
        record=record, inspection=inspection, plant=plant, places=places,
        drive=column.name if column is not None else "", u=u,
        moduli={p.column: COUNTERS for p in places.values()},
    )  # fmt: skip
