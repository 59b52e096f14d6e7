"""Tables that every drafted study has, whatever its plant: rig, drive, sensors, runs."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from upright import units
from upright.identification.model.runs import FITTED_SHARE
from upright.physics import Plant
from upright.physics.statement import Coordinate
from upright.quantities import with_unit
from upright.readers.inspection import DAC_COUNTS_PER_VOLT, Column
from upright.records import Record
from upright.records.analogue import place_per
from upright.records.columns import ANGLES, LENGTHS
from upright.study.draft.recognise import in_dac_counts
from upright.study.text import TomlTable, Value, toml
from upright.study.windows import digits_within

PLACES = (*ANGLES, *LENGTHS)
EFFORTS = ("V", "A", "N", "N m", "m/s^2", "rad/s^2")
"""Units of commands: a gain per mV would call a thousandth of it by the same number."""
CHANGES, SWINGS, ACTS = 2, 3.0, 0.1
"""Changes of a command, swings, and share of the command before, that the end of a log needs to test a model."""

ROLES = {"fit": "fitted", "predict": "scored by a fit without it"}


def rig_toml(name: str, plant: type[Plant], record: Record, period: float = 0.0) -> TomlTable:
    """Plant and its coordinates, and a `period` [s] coarser than the log's when there is one."""
    table = TomlTable("[rig]")
    coordinates = ", ".join(f"{c.name} [{c.unit}] {c.meaning}" for c in plant.coordinates)
    table.key("plant", name, f"coordinates: {coordinates}")
    if period:
        table.key("period", f"{period * 1e3:.6g} ms", f"the log has a sample every {record.period * 1e3:.4g} ms")
    return table


def assumed(value: float, unit: str, digits: int = 3) -> dict[str, Value]:
    """A number that nobody measured: what rests on it is no fact."""
    return {"value": with_unit(value, unit, digits), "assumed": True}


def parameters_left_at_zero(table: TomlTable, plant: type[Plant], names: Iterable[str]) -> None:
    """Add parameters that nobody asks for yet, commented out."""
    names = list(names)
    if names:
        table.line("# zero until estimated:")
    for name in names:
        what = plant.quantity(name)
        unit = "" if what.unit == "1" else f" {what.unit}"
        table.key(name, {"guess": f"0{unit}"}, what.meaning, off=True)


def command_unit(c: Column) -> tuple[str, float]:
    """Unit of a command without a prefix, and its factor on the column; the unit is empty when nobody says."""
    if in_dac_counts(c):
        return "V", 1 / DAC_COUNTS_PER_VOLT
    unit = c.unit or c.guess
    whole = next((w for w in EFFORTS if units.known(unit) and units.same_dimension(unit, w)), "")
    return (whole, units.scale(unit)) if whole else (unit, 1.0)


def no_drive_table() -> TomlTable:
    """What to fill in when a column drives after all."""
    table = TomlTable("# [drive]")
    table.key("column", "...", "no column commands a drive, so the runs are free", off=True)
    return table


def drive_table(c: Column, unit: str, scale: float, *, reversed_: bool) -> TomlTable:
    """The command's column; `reversed_`: it first moves the driven body down."""
    table = TomlTable("[drive]")
    own = c.unit or c.guess
    raw = unit if scale == 1.0 else "DAC counts" if own in ("", "counts") else own
    table.key("column", c.name, f"{c.low:.4g} to {c.high:.4g} {raw}".rstrip())
    table.key("unit", unit or "V", off=not unit)
    if scale != 1.0:
        table.key("scale", scale, f"{1 / scale:g} {raw} per {unit}")
    if reversed_:
        table.key("sign", -1, "the first command moves the column down")
    return table


def sensor_table(
    coordinate: Coordinate, c: Column, zero: float, counts: tuple[int, str], *, driven: bool, mirrored: bool = False
) -> TomlTable:
    """One sensor; `zero` is the reading at rest, `counts` its counts per turn or metre if it counts, and their source.

    `mirrored`: it counts against the coordinate.
    """
    name, turns = coordinate.name, coordinate.unit == "rad"
    count: dict[str, Value]
    table = TomlTable(f"[sensors.{name}]")
    table.key("column", c.name, f"{c.low:.6g} to {c.high:.6g} {c.guess}".rstrip())
    if c.guess:
        table.key("unit", c.guess, "" if c.unit else "guessed; the log does not say")
    if c.guess == "counts" and turns and c.counts_per_turn:
        count = {"value": c.counts_per_turn, "measured": True}
        table.key("counts_per_rev", count, "after which the column begins again, as after a turn")
    elif c.guess == "counts":
        count = {"value": counts[0], "assumed": True}
        table.key("counts_per_rev" if turns else "counts_per_m", count, f"MEASURE: {counts[1]}")
    elif c.resolution.counts_per_rev and turns:
        table.key("counts_per_rev", {"value": c.resolution.counts_per_rev, "measured": True}, "from the column's steps")
    elif c.resolution.step and not c.resolution.decimals and c.guess in PLACES:
        step = {"value": f"{c.resolution.step:.4g} {c.guess}", "measured": True}
        table.key("resolution", step, "from the column's steps")
    elif (most := c.resolution.step or c.resolution.hidden) and c.guess in PLACES:
        why = "MEASURE: no encoder steps are visible; decimals or noise would hide steps up to this size"
        table.key("resolution", {"value": f"{most:.3g} {c.guess}", "assumed": True}, why)
    where = "lay before the first command" if driven else "comes to rest"
    zero = zero if abs(zero) > 1e-9 * (c.high - c.low) else 0.0  # a motion that has died out ends in rounding
    table.key("offset", zero, f"reading at which {name} is zero, here where it {where}", digits=9)
    if mirrored:
        table.key("sign", -1, "it swings opposite to the plant's angle")
    else:
        table.key("sign", -1, "when the column counts the other way", off=True)
    return table


def as_logged(tables: Sequence[TomlTable], record: Record, scales: Mapping[str, str]) -> None:
    """Say in the sensors of a draft what the log holds, and by which scale it becomes a place."""
    for table in tables:
        stated = tomllib.loads(str(table)).get("sensors", {}) if table.lines[0].startswith("[sensors.") else {}
        for sensor in stated.values():
            if (name := sensor["column"]) not in scales:
                continue
            unit = record.units[name]
            zero = sensor["offset"] / place_per(scales[name], unit)[1]
            given = [f"scale = {toml(scales[name])}   # as given"]
            for i, line in enumerate(table.lines):
                if line.startswith("column ="):
                    span = f"{record[name].min():.6g} to {record[name].max():.6g} {unit}".rstrip()
                    table.lines[i] = f"{line.partition('   # ')[0]}   # {span}"
                elif line.startswith("unit ="):
                    table.lines[i] = "\n".join([f"unit = {toml(unit)}", *given] if unit else given)
                elif line.startswith("offset ="):
                    table.lines[i] = line.replace(line.split()[2], toml(zero, 9), 1)


def driven_runs(
    record: Record, drive: Column | None, window: tuple[float, float], frequency: float, label: str
) -> list[tuple[str, float, float, str]]:
    """The window as one run; where a command moves the rig for several swings in both parts the last third is kept."""
    start, stop = window
    split = start + FITTED_SHARE * (stop - start)
    if drive is not None:
        t, u = record.t, record[drive.name]
        parts = [u[(t >= start) & (t < split)], u[(t >= split) & (t <= stop)]]
        changes = min(int(np.count_nonzero(np.diff(part) != 0)) for part in parts)
        swings = frequency * (stop - split) / (2 * np.pi)
        if changes >= CHANGES and swings > SWINGS and np.std(parts[1]) >= ACTS * np.std(parts[0]):
            return [(f"{label} start", start, split, "fit"), (f"{label} tail", split, stop, "predict")]
    return [(label, start, stop, "fit")]


def run_tables(file: str, runs: Iterable[tuple[str, float, float, str]]) -> list[TomlTable]:
    """Runs of one log by label, first and last second, and role."""
    tables: list[TomlTable] = []
    for label, start, stop, role in runs:
        table = TomlTable("[[runs]]")
        table.key("label", label)
        table.key("file", file)
        table.key("window", [start, stop], "s", digits=digits_within(5, start, stop))
        table.key("role", role, ROLES[role])
        if role == "predict":
            table.key("refit", True, "then fitted too, where the fit without it leaves a number undetermined")
        tables.append(table)
    return tables
