"""How do columns become coordinates and commands? [sensors], [drive] and [inputs] of a study, per run."""

from __future__ import annotations

from typing import Any

from upright import units
from upright.physics import Coordinate, Plant
from upright.study.columns import Drive, Sensor
from upright.study.keys import names
from upright.study.text import Section, show


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
            out[name] = read_sensor(section, coordinate), section
    return out


def read_sensor(section: Section, coordinate: Coordinate) -> Sensor:
    """One sensor."""
    name = coordinate.name
    for key, needed in (("counts_per_rev", "rad"), ("counts_per_m", "m")):
        if key in section and coordinate.unit != needed:
            right = "counts_per_m" if coordinate.unit == "m" else "counts_per_rev"
            raise section.error(key, f"{name} is in {coordinate.unit}, so give {right} or scale, not {key}")
    per = {
        key: section.positive(key, unit, 1.0) if key in section else 0.0
        for key, unit in (("counts_per_rev", "1"), ("counts_per_m", "1/m"))
    }
    return Sensor(
        coordinate=coordinate,
        column=section.text_of("column", name) if "column" in section else name,
        unit=read_unit(section),
        scale=_scale(section, coordinate) if "scale" in section else None,
        sign=read_sign(section),
        offset=_offset(section),
        resolution=section.positive("resolution", coordinate.unit, 1.0) if "resolution" in section else 0.0,
        **per,
    )


def read_unit(section: Section) -> str:
    """Unit that a table states, "" when it does not."""
    if "unit" not in section:
        return ""
    unit = section.text_of("unit", "counts")
    with section.text.at(section.place("unit")):
        units.scale(unit)
    return unit


def read_sign(section: Section) -> float:
    """+1 or -1."""
    sign: Any = section.values.get("sign", 1)
    if isinstance(sign, bool) or sign not in (1, -1):
        raise section.error("sign", f"sign must be 1 or -1, got {show(sign)}")
    return float(sign)


def _scale(section: Section, coordinate: Coordinate) -> float:
    """Scale as a number, or as text: SI of the coordinate per unit of the column."""
    value: Any = section.values["scale"]
    if isinstance(value, str):
        unit = section.values.get("unit", "")
        with section.text.at(section.place("scale")):
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
        with section.text.at(section.place("offset")):
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
    if isinstance(value, str):
        table = Section(section.text, section.place(key), {"expression": value})
        table.places = {"expression": section.place(key)}
        return table
    if isinstance(value, int | float) and not isinstance(value, bool):
        table = Section(section.text, section.place(key), {"expression": repr(float(value))})
        table.places = {"expression": section.place(key)}
        return table
    return section.section(key)


def _drive(own: Section, shared: Section, *, free: bool) -> Drive:
    both = own.over(shared)
    source = own if "column" in own or "expression" in own else shared
    if "column" in source and "expression" in source:
        raise source.error("expression", "a drive has either a column or an expression, got both")
    if both.values and not free and "column" not in source and "expression" not in source:
        raise both.error(next(iter(both.values)), 'a drive needs column = "v" or expression = "2.5*(0.2 - z)"')
    key = "column" if "column" in source else "expression"
    what = "" if free or key not in source else source.text_of(key, "v")
    return Drive(
        what=f"`{what}`" if key == "column" and what else what,
        unit=read_unit(both),
        scale=both.number("scale", "1", 1.0),
        sign=read_sign(both),
        place=source.place(key),
    )


def drive_unit(study: Section) -> str:
    """Unit of the first input's command: as stated, or as the actuator's gain implies, or ""."""
    tables = [study.section("drive"), study.section("defaults").values.get("drive")]
    inputs: Any = study.values.get("inputs", {})
    tables += list(inputs.values()) if isinstance(inputs, dict) else []
    tables += [run.get("drive") for run in study.values.get("runs", []) if isinstance(run, dict)]
    for table in tables:
        values: Any = table.values if isinstance(table, Section) else table
        if isinstance(values, dict) and isinstance(values.get("unit"), str) and units.known(values["unit"]):
            return values["unit"]
    gain: Any = study.section("actuator").values.get("gain")
    if isinstance(gain, dict):
        gain = gain.get("guess", gain.get("value"))
    below = gain.rpartition("/")[2].strip(" ()") if isinstance(gain, str) and "/" in gain else ""
    return below if below and units.known(below) else ""
