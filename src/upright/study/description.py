"""What a study says of its rig's drive, encoders, servo and travel."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from upright.errors import BadInput
from upright.identification import GreyBox, Parameter
from upright.physics import Plant
from upright.physics.actuator import ACTUATOR
from upright.rig import Rig
from upright.rig.drive import GAIN
from upright.rig.hardware import (
    DRIVE_SIGN,
    SERVO,
    VENDORS,
    Entry,
    Hardware,
    check_vendor,
    counts_unit,
    driven_unit,
    force_unit,
    turn_of,
)
from upright.study.sensors import Sensor, drive_sign, read_sensors
from upright.study.text import Section, source_of
from upright.units import denominator, parse


def read_hardware(study: Section, plant: type[Plant], rig: GreyBox, logs: Collection[str] = ()) -> Hardware:
    """What a study says of its rig besides the plant's numbers.

    Parameters
    ----------
    study : Section
        The whole study.
    rig : GreyBox
        As read from the same study.
    logs : collection of str, optional
        What the logs call their rig, which counts where the study gives no name and they agree.
    """
    section, actuator = study.section("rig"), study.section("actuator")
    called = section.text_of("name", "bench 3") if "name" in section else None
    vendor = section.text_of("vendor", VENDORS[0]) if "vendor" in section else None
    with section.at("vendor"):
        check_vendor(vendor)
    entries = {
        key: Entry(value=p.value, unit=p.unit, source="identified" if p.estimate else source_of(actuator.values[key]))
        for key, p in ((n.partition(".")[2], rig.parameters[n]) for n in ACTUATOR)
        if key in actuator
    }
    place = driven_unit(plant)
    units = {n: place + unit if unit in ("", "/s") else unit for n, unit in SERVO.items()}
    places = [(actuator, "converter", rig.parameters["actuator.limit"].unit)]
    for table, key, unit in (*places, *((section, n, u) for n, u in units.items())):
        if key in table:
            value, source = table.stated(key, unit)
            entries[key] = Entry(value=value, unit=unit, source=source)
    entries |= _dac(actuator, rig.parameters["actuator.limit"].unit)
    for sensor, place in read_sensors(study, Section(study.text, (), {}), plant).values():
        entries |= {} if sensor.of else _encoder(place, sensor)  # counts of a sum are not those of its coordinate
    if plant.inputs and drive_sign(study, plant.inputs[0].name) < 0:
        entries[DRIVE_SIGN] = Entry(value=-1.0, unit="1", source="known")
    named = {*logs}.pop() if len({*logs}) == 1 else ""
    return Hardware(name=called or named, vendor=vendor, entries=entries)


def _dac(actuator: Section, unit: str) -> dict[str, Entry]:
    """Step of a converter that its bits and its range, from -range to range, give."""
    present = [key for key in ("bits", "range") if key in actuator]
    if not present:
        return {}
    if len(present) < 2 or "converter" in actuator:
        raise actuator.error(
            present[0], "a converter has bits and range, as in bits = 12, range = \"10 V\" of one from -10 to 10 V, or "
            "its step alone, converter = \"4.88 mV\""
        )  # fmt: skip
    value, source = actuator.stated("range", unit)
    return {"converter": Entry(value=2 * value / 2 ** actuator.whole("bits", 12, 32), unit=unit, source=source)}


def _encoder(section: Section, sensor: Sensor) -> dict[str, Entry]:
    """Counts, sign and offset of one encoder, as far as specified."""
    c, out = sensor.coordinate, dict[str, Entry]()
    step = sensor.resolution or sensor.per_count
    if step:
        key = next(k for k in ("resolution", "counts_per_rev", "counts_per_m") if k in section)
        units = {"resolution": c.unit, "counts_per_rev": "1", "counts_per_m": "1/m"}
        out[f"counts.{c.name}"] = Entry(
            value=turn_of(c.unit) / step, unit=counts_unit(c.unit), source=section.stated(key, units[key])[1]
        )
    if "sign" in section:
        out[f"sign.{c.name}"] = Entry(value=sensor.sign, unit="1", source="known")
    if "offset" in section:
        text = isinstance(sensor.offset, str)
        with section.at("offset"):
            offset = _offset(sensor)
        out[f"offset.{c.name}"] = Entry(value=offset, unit=c.unit if text else sensor.unit or "", source="known")
    return out


def _offset(sensor: Sensor) -> float:
    try:
        return parse(sensor.offset, sensor.coordinate.unit) if isinstance(sensor.offset, str) else sensor.offset
    except BadInput:
        return parse(sensor.offset, sensor.unit)  # type: ignore[arg-type]


def rig_with_guesses(model: GreyBox, name: str, hardware: Hardware) -> Rig:
    """The rig of a study's model, its guesses counting as its numbers."""
    kind, numbers = model.plant, model.parameters
    plant = kind(**{n: numbers[n].value for n in kind.names()})
    values = {n: p.value for n, p in numbers.items()}
    sources = {n: _source(numbers[n]) for n in (*kind.names(), GAIN) if n in numbers}
    per = numbers[GAIN].unit if GAIN in numbers else ""
    return replace(rig_of_numbers(plant, name, values, per, hardware), sources=sources)


def _source(p: Parameter) -> str:
    return "guessed" if p.estimate else "assumed" if p.assumed else "known"


def rig_of_numbers(plant: Plant, name: str, values: Mapping[str, float], per: str, hardware: Hardware) -> Rig:
    """A rig whose commands are those of its log, which a study turns where its drive has a sign.

    `per` is the unit of the drive's gain, ``N m/V``, which tells that of the command.
    """
    force = force_unit(type(plant))
    unit = denominator(per) if "/" in per and per != force else force
    sign, as_commanded = hardware.as_commanded()
    name = name.rpartition(":")[2]  # the class of a plant in a file of the user's own
    return Rig(plant=plant, name=name, gain=sign * values.get(GAIN, 1.0), unit=unit, hardware=as_commanded)
