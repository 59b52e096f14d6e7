"""What is known of a rig already, in the place of what a draft of one of its logs guesses."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any

from upright import units
from upright.errors import BadInput
from upright.physics.actuator import ACTUATOR
from upright.rig import Rig
from upright.rig.drive import GAIN
from upright.rig.hardware import SERVO
from upright.study.rig import per

Tables = dict[str, Any]

GIVEN = "given"
ESTIMATED = ("identified", "guessed")
"""Sources of numbers that another log is asked for again."""


def state_rig(study: Tables, rig: Rig) -> None:
    """Write a rig's numbers into a study: given and measured ones are known, identified and guessed ones where a search
    begins, assumed ones stay so. What stands at its default is left as drafted, since nobody may have given it.

    Raises
    ------
    BadInput
        When the log commands in another unit than the rig.
    """
    plant, parameters = rig.plant, study.setdefault("parameters", {})
    defaults = {f.name: f.default for f in fields(plant) if f.default is not MISSING}
    for name, value in plant.parameters().items():
        source = rig.sources.get(name, GIVEN)
        if source not in ("known", GIVEN) or value != defaults.get(name):
            parameters[name] = _stated(value, source)
    _state_drive(study, rig)
    for coordinate in plant.coordinates:
        sensor = study["sensors"].get(coordinate.name)
        if sensor is None:
            continue
        counts, sign = (rig.hardware.entries.get(f"{n}.{coordinate.name}") for n in ("counts", "sign"))
        if counts is not None:
            sensor.pop("resolution", None)
            key = "counts_per_rev" if coordinate.unit == "rad" else "counts_per_m"
            sensor[key] = _stated(counts.value, counts.source)
        if sign is not None:
            sensor["sign"] = int(sign.value)


def _state_drive(study: Tables, rig: Rig) -> None:
    drive, actuator = study.get("drive"), study.setdefault("actuator", {})
    force = rig.plant.inputs[0].unit if rig.plant.inputs else ""
    if drive is not None:
        stated = drive.setdefault("unit", rig.unit)
        if stated and rig.unit and not units.same_dimension(stated, rig.unit):
            remedy = "pass its plant alone" if stated == force else f"give the rig its gain in {force} per {stated}"
            raise BadInput(
                f"the rig is commanded in {rig.unit}, and column {drive.get('column')} of its log is in {stated};"
                f" {remedy}, or name another column of the drive."
            )
        drive.pop("sign", None)  # the rig's gain has it
    if rig.unit != force or rig.gain != 1.0:
        gain = f"{rig.gain!r} {per(force or '1', rig.unit)}" if rig.unit != force else rig.gain
        source = rig.sources.get(GAIN, GIVEN)
        actuator["gain"] = _stated(gain, source if drive is not None else GIVEN)
    for name, entry in rig.hardware.entries.items():
        if f"actuator.{name}" in ACTUATOR or name == "converter":
            actuator[name] = _stated(entry.value, entry.source if drive is not None else GIVEN)
        elif name in SERVO:
            study["rig"][name] = _stated(entry.value, entry.source, again=False)
    if rig.hardware.vendor:
        study["rig"]["vendor"] = rig.hardware.vendor


def _stated(value: Any, source: str, *, again: bool = True) -> Any:
    """A number as a study has it."""
    if source in ESTIMATED and again:
        return {"guess": value}
    return {"value": value, source: True} if source in ("assumed", "measured") else value
