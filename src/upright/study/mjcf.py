"""A study of the rig that an MJCF file describes, to be completed by runs."""

from __future__ import annotations

from dataclasses import MISSING, fields

from upright.physics import name_of
from upright.quantities import with_unit
from upright.rig.hardware import SERVO
from upright.rig.mjcf import FromMjcf
from upright.study.rig import actuator_unit
from upright.study.text import TomlTable, study_text

DIGITS = 15


def study_of_mjcf(read: FromMjcf, file: str) -> str:
    """Text of the study: every number as the file has it; the runs stand ready."""
    rig, plant = read.rig, type(read.rig.plant)
    head = TomlTable()
    head.line(f"# Rig of {file}, read by `upright init`. Numbers are as the file has them; ask for one by")
    head.line('# m_p = { guess = "0.2 kg" }, and name its log under [[runs]]. All keys: `upright identify --keys`.')
    for sentence in (read.coordinates, *read.left_out):
        head.line(f"# {sentence}")
    head.key("title", rig.name)
    about, numbers, drive = TomlTable("[rig]"), TomlTable("[parameters]", file), TomlTable("[actuator]", file)
    about.key("plant", name_of(plant))
    defaults = {f.name: f.default for f in fields(plant) if f.default is not MISSING}
    for name, value in rig.plant.parameters().items():
        if value != defaults.get(name) or name == "g":
            numbers.key(name, with_unit(value, plant.quantity(name).unit, DIGITS))
    drive.key("gain", with_unit(rig.gain, actuator_unit(plant, "actuator.gain", rig.unit), DIGITS))
    for name, entry in rig.hardware.entries.items():
        table = about if name in SERVO else drive
        unit = entry.unit if name in SERVO else actuator_unit(plant, f"actuator.{name}", rig.unit)
        table.key(name, with_unit(entry.value, unit, DIGITS) if unit != "1" else entry.value, file, digits=DIGITS)
    command = TomlTable("[drive]", "the unit of its commands; add the column of the log that has them")
    command.key("unit", rig.unit)
    return study_text([head, about, numbers, drive, command])
