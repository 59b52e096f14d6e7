"""The study of what was logged at a rig: numbers as its owner wrote them, runs as they came."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from upright.experiments.stand.known import Known, bench_values, model_of
from upright.experiments.stand.stand import APPLIED, TestStand
from upright.files import read_text, replace_file
from upright.quantities import with_unit
from upright.rig.makes import make_of
from upright.study.rig import plant_relative_to
from upright.study.text import TomlTable, study_text, table

Tables = dict[str, dict[str, Any]]


def write_study(
    stand: TestStand, path: Path, title: str, runs: Sequence[Mapping[str, Any]], *,
    known: Sequence[Known] = (), drive: bool = True, actuator: Mapping[str, Any] | None = None,
) -> Path:  # fmt: skip
    """A study of logs of this rig.

    Parameters
    ----------
    runs : sequence of mappings
        As `[[runs]]` has them.
    known : sequence of Known
        Numbers that an earlier experiment found, in the place of what the owner wrote.
    drive : bool
        Whether something drove; what stands between command and force is otherwise left as it is guessed.
    actuator : mapping, optional
        Entries of [actuator] that the owner's study leaves out.
    """
    tables_of_rig = _tables_of(stand, path.parent)
    units = {k.name: stand.rig.plant.quantity(k.name).unit for k in known}
    numbers = {
        k.name: {"value": with_unit(k.value, units[k.name], 10), "uncertainty": with_unit(k.stderr, units[k.name], 4)}
        for k in known
    }
    parameters = tables_of_rig.get("parameters", {}) | numbers
    written = table("[parameters]")
    for name, value in parameters.items():
        written.key(name, value)
    tables: list[TomlTable] = [
        table("", title=title, source=f"logs of {stand.rig.name}"),
        table("[rig]", digits=10, **({"servo_period": f"{stand.rig.period:.10g} s"} | tables_of_rig["rig"])),
        written,
    ]
    if drive:
        written_drive = {**(actuator or {}), **tables_of_rig.get("actuator", {})}
        tables += [table("[actuator]", digits=10, **_late(stand, written_drive)),
                   table("[drive]", column=APPLIED, unit=stand.rig.unit)]  # fmt: skip
    for c, per in zip(stand.rig.plant.coordinates, stand.rig.per_unit, strict=True):
        counts = {"counts_per_rev": per * 2 * math.pi} if c.unit == "rad" else {"counts_per_m": per}
        tables.append(table(f"[sensors.{c.name}]", digits=10, column=c.name, unit=c.unit, **counts))
    tables += [table("[defaults]", unknown=["initial"]), *(table("[[runs]]", digits=10, **run) for run in runs)]
    replace_file(path, study_text(tables).encode())
    return path


def _late(stand: TestStand, actuator: Mapping[str, Any]) -> dict[str, Any]:
    """The drive with its delay: a sample where not specified, and estimated where nothing else is late."""
    if "delay" in actuator or not stand.rig.delay:
        return dict(actuator)
    assumed = f"{stand.rig.delay:.10g} s"
    return {**actuator, "delay": assumed if "lag" in actuator else {"guess": assumed, "min": 0}}


def _tables_of(stand: TestStand, folder: Path) -> Tables:
    """Tables of the owner's study, a plant of his own still found from where the new one lies."""
    source = stand.study
    if source is None:
        return _of_make(stand)
    tables: Tables = tomllib.loads(read_text(source))
    if "plant" in tables["rig"]:
        tables["rig"]["plant"] = plant_relative_to(folder, str(tables["rig"]["plant"]), source.parent)
    return {k: tables[k] for k in ("rig", "parameters", "actuator") if k in tables}


def _of_make(stand: TestStand) -> Tables:
    """What the maker designed, and what the bench says of this twin."""
    make = make_of(stand.rig.plant)
    start = model_of(make, bench_values(stand.twin, make), make.bench)
    values: Tables = {"parameters": {}, "actuator": {}}
    for name, p in start.parameters.items():
        where, _, key = name.rpartition(".")
        value = with_unit(p.value, p.unit, 10)
        entry: Any = {"guess": value, "min": 0} if p.estimate else value
        if p.uncertainty:
            entry = {"value": value, "uncertainty": with_unit(p.uncertainty, p.unit, 4)}
        values[where or "parameters"][key] = entry
    return {"rig": {"plant": make.plant_name, "vendor": make.vendor}, **values}
