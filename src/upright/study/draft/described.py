"""What a log tells of drive, encoders and servo, for the tables of a drafted study; what it does not stands ready."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence

import numpy as np

from upright.physics import find
from upright.quantities import with_unit
from upright.readers.inspection import Inspection
from upright.records import Array, Record
from upright.records.columns import ANGLES, LENGTHS
from upright.study.draft.recognise import Recognised, in_dac_counts
from upright.study.text import TomlTable
from upright.units import scale

COUNTS = {"rad": (4096, "see the encoder"), "m": (10_000, "see the encoder")}
"""Placeholders of an encoder's counts per turn or metre."""
ECP_COUNTS = {"rad": (16000, "ECP 205 has 16000"), "m": (226629, "ECP 210 has 16000 counts per 7.06 cm")}
"""The same of ECP's rigs, for logs that are theirs."""


def is_ecp(inspection: Inspection) -> bool:
    """Whether the log itself shows that it is of an ECP rig: its export, or commands in counts of its converter."""
    return inspection.reader == "ecp" or any(in_dac_counts(c) for c in inspection.columns)


def counts_of(inspection: Inspection, unit: str) -> tuple[int, str]:
    """Counts per turn or metre to begin with, and whose they are."""
    return (ECP_COUNTS if is_ecp(inspection) else COUNTS)[unit]


def describe(tables: Sequence[TomlTable], record: Record, inspection: Inspection, recognised: Recognised) -> None:
    """Add to [rig] and [actuator] what `upright design`, `regulate` and `swing-up` need to know.

    A limit is assumed where a command is cut off; what the log only hints at is commented out, so that nobody's guess
    passes for a rig's number.
    """
    if recognised.drive is None:
        return
    plant = find(recognised.plant)
    coordinates = {c.name: c.unit for c in plant.coordinates}
    body = plant.inputs[0].on
    named = {t.lines[0].partition("]")[0] + "]": t for t in tables if t.lines}
    rig = named["[rig]"]
    if is_ecp(inspection):
        vendor = "ECP 210" if coordinates[body] == "m" else "ECP 205"
        rig.key("vendor", vendor, "the log is from an ECP rig; its data sheet fills in what is missing here")
    else:
        period = f"{record.period * 1e3:.4g} ms"
        rig.key("servo_period", {"value": period, "assumed": True}, "the log's; MEASURE if the controller is faster")
    went = _went(recognised, body, coordinates[body])
    here = "; in this log it went this far" if went[:1] != "." else ""
    rig.key("travel", went, f"MEASURE: how far it may go{here}", off=True)
    actuator, drive = (
        next((t for t in tables if t.lines[0].startswith(f"[{n}]")), None) for n in ("actuator", "drive")
    )
    if actuator is None or drive is None or any(line.startswith("limit") for line in actuator.lines):
        return
    stated = tomllib.loads(str(drive))["drive"]
    unit, factor = stated.get("unit", ""), abs(stated.get("scale", 1.0))
    most = max(abs(recognised.drive.low), abs(recognised.drive.high)) * factor
    if is_cut_off(record[recognised.drive.name], max(recognised.drive.low_share, recognised.drive.high_share)):
        limit = {"value": with_unit(most, unit, 12), "assumed": True}
        actuator.key("limit", limit, "the command is cut off there; MEASURE")
    else:
        actuator.key("limit", with_unit(most, unit), "MEASURE: command limit; the largest here", off=True)


def is_cut_off(command: Array, share: float) -> bool:
    """Whether a command that stays at its extreme for a `share` of the time varies elsewhere: no top of steps does."""
    moved = np.diff(command) != 0
    between = (np.abs(command) < np.abs(command).max())[1:] & (command[1:] != 0)
    return share > 0 and between.any() and float(np.mean(moved[between])) > 0.5


def _went(recognised: Recognised, body: str, unit: str) -> str:
    """Half of what the driven body went through, "..." where its column is in counts."""
    c = recognised.columns.get(body)
    if c is None or c.guess not in ANGLES | LENGTHS:
        return f"... {unit}"
    return with_unit((c.high - c.low) / 2 * scale(c.guess), unit)
