"""What is known about the rig whose record this is: a plant's name, a study, or a fit made before?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from upright.doctor.case import Case, Place
from upright.errors import BadInput
from upright.identification import Parameter
from upright.physics import Plant, find
from upright.readers.inspection import Inspection
from upright.records import Array, Record
from upright.study.draft.recognise import Recognised, drive_column, recognise
from upright.study.sensors import Drive, Sensor

COUNTERS = (2 * math.pi, 360.0, 65536.0, 4294967296.0)
"""Turns that counters are known to make, in rad, deg and counts."""


@dataclass(frozen=True, kw_only=True)
class Known:
    """A rig as it was said to be: plant, parameters, and which column is what; all but the plant may be empty."""

    name: str
    plant: type[Plant]
    parameters: Mapping[str, Parameter] = field(default_factory=dict[str, Parameter])
    sensors: Mapping[str, Sensor] = field(default_factory=dict[str, Sensor])
    drive: Drive | None = None
    locked: tuple[str, ...] = ()

    @property
    def friction(self) -> frozenset[str]:
        """Names of the parameters that only dissipate."""
        derived = self.plant.derived()
        dry = {n for j in self.plant.joints for n in vars(j).values() if isinstance(n, str)}
        return frozenset(n for n in self.plant.names() if n in dry or _names(derived.power_lost, n))


def _names(expression: str, name: str) -> bool:
    import re

    return re.search(rf"\b{name}\b", expression) is not None


def read_known(text: str, log: str = "") -> Known:
    """Rig of a plant's name, a study (TOML) or a ``fit.json``; `log` is the file whose run a study may describe.

    Raises
    ------
    BadInput
        When it is none of these.
    """
    path = Path(text)
    if path.suffix == ".json" or (path.is_dir() and (path / "fit.json").is_file()):
        from upright.study.fit_file import read_fit

        fit = read_fit(path / "fit.json" if path.is_dir() else path)
        parameters = {n: Parameter(name=n, value=v) for n, v in fit.values.items()}
        return Known(name=text, plant=find(fit.plant, path.parent), parameters=parameters)
    if path.suffix == ".toml":
        return _study(path, log)
    try:
        return Known(name=text, plant=find(text))
    except BadInput as error:
        raise BadInput(
            f"--rig {text}: {error}; it may be a plant's name, a study (TOML) or the fit.json of `upright identify`"
        ) from None


def _study(path: Path, log: str) -> Known:
    from upright.study.rig import read_plant, read_rig
    from upright.study.sensors import drive_unit, read_drives, read_sensors
    from upright.study.text import Section, StudyText

    text = StudyText(path)
    study = text.root()
    plant = read_plant(study)
    rig = read_rig(study, plant, drive_unit(study))
    entries = study.values.get("runs", [])
    run = Section(text, ("runs",), {})
    for i, values in enumerate(entries if isinstance(entries, list) else []):
        if isinstance(values, dict) and Path(str(values.get("file", ""))).name == Path(log).name:
            run = Section(text, ("runs", i), values)
            break
    run = run.over(study.section("defaults"))
    sensors = {n: s for n, (s, _) in read_sensors(study, run, plant).items()}
    drives = read_drives(study, run, plant)
    drive = drives[0] if drives and drives[0].what and "loop" not in run else None
    locked: object = run.values.get("locked", ())
    names = tuple(str(n) for n in locked) if isinstance(locked, list | dict) else ()
    return Known(name=str(path), plant=plant, parameters=rig.parameters, sensors=sensors, drive=drive, locked=names)


def case_of(record: Record, seen: Inspection, known: Known | None) -> Case:
    """Record and rig brought together."""
    if known is None or not (known.sensors and any(s.column in record.signals for s in known.sensors.values())):
        return _recognised(record, seen, known)
    places: dict[str, Place] = {}
    moduli: dict[str, tuple[float, ...]] = {}
    for name, sensor in known.sensors.items():
        if sensor.column not in record.signals or name in known.locked:
            continue
        y, quantum, _ = sensor.read(record)
        x = record[sensor.column]
        factor = sensor.factor(sensor.column_unit(record, x))
        own = seen.column(sensor.column).quantum.step * factor
        places[name] = Place(column=sensor.column, y=y, quantum=quantum or own)
        turn = 2 * math.pi / factor if sensor.coordinate.unit == "rad" and factor else 0.0
        moduli[sensor.column] = tuple({m for m in (turn, *COUNTERS) if m})
    u, drive = np.zeros(record.t.size), ""
    if known.drive is not None:
        u = known.drive.read(record)
        plain = known.drive.what.strip("`")
        drive = plain if plain in record.signals else known.drive.what
    return Case(
        record=record,
        seen=seen,
        rig=known.name,
        plant=known.plant,
        parameters=known.parameters,
        places=places,
        zeroed=True,
        drive=drive,
        u=u,
        moduli=moduli,
        locked=known.locked,
    )


def _recognised(record: Record, seen: Inspection, known: Known | None) -> Case:
    """Columns found by name and kind; a plant that needs angles gets none from counts of an unknown encoder."""
    try:
        found: Recognised | None = recognise(record, seen, _name(known.plant) if known else "")
    except BadInput:
        found = None
    column = found.drive if found else drive_column(record, seen)
    drive = column.name if column is not None else ""
    u: Array = record[drive].copy() if drive else np.zeros(record.t.size)
    if column is not None and any(lie.startswith("the first samples are outliers") for lie in column.lies):
        u[:3] = u[3]
    if known is None or found is None:
        return Case(record=record, seen=seen, drive=drive, u=u, rig=known.name if known else "",
                    plant=known.plant if known else None)  # fmt: skip
    chain = not any(c.name in ("theta", "psi", "x") for c in known.plant.coordinates)
    places: dict[str, Place] = {}
    for coordinate in known.plant.coordinates:
        c = found.columns.get(coordinate.name)
        factor = {"rad": 1.0, "": 1.0, "deg": math.pi / 180, "m": 1.0, "mm": 1e-3}.get(c.guess if c else "", 0.0)
        if c is None or not (factor or chain or coordinate.unit == "m"):
            continue
        factor = factor or 1.0
        zero = found.rest[coordinate.name]
        places[coordinate.name] = Place(
            column=c.name, y=factor * (record[c.name] - zero), quantum=factor * c.quantum.step
        )
    return Case(
        record=record, seen=seen, rig=known.name, plant=known.plant, places=places, drive=drive, u=u,
        moduli={p.column: COUNTERS for p in places.values()},
    )  # fmt: skip


def _name(plant: type[Plant]) -> str:
    """Name by which a built-in plant is found; others cannot be recognised by name."""
    from upright.physics import BUILT_IN

    return next((n for n, p in BUILT_IN.items() if p is plant), "")
