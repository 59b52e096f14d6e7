"""A study of a record: a draft, with the caller's known and estimated numbers in place of its guesses."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence, Set
from contextlib import nullcontext
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from upright.errors import BadInput, nearest
from upright.physics import Plant, called_by_its_name, find, name_of
from upright.physics.actuator import ACTUATOR
from upright.readers import inspect
from upright.records import Record
from upright.rig import Rig
from upright.rig.drive import GAIN
from upright.study.draft.draft import draft
from upright.study.draft.known_rig import state_rig
from upright.study.load import Study, load_study
from upright.study.text import toml

Number = float | str
LOG = "log.csv"


def study_of_record(
    record: Record, plant: type[Plant] | Rig | None = None, *, known: Mapping[str, Number] | None = None,
    ask: Sequence[str] | Mapping[str, Number] | None = None, columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None, window: tuple[float, float] | None = None,
) -> Study:  # fmt: skip
    """Study of one record.

    Parameters
    ----------
    plant : type of Plant or Rig, optional
        Recognised from the columns when omitted; a rig's numbers count as `state_rig` says.
    known : mapping of name to number or text, optional
        Numbers that are given [SI], or as text with unit and, perhaps, uncertainty: ``{"m_p": "223.5 g"}``.
    ask : sequence of names, or mapping of name to guess, optional
        What to estimate, and nothing else; without it what the draft asks and `known` leaves.
    columns : mapping of coordinate (or drive) to column, optional
        Where the columns are called otherwise.
    units : mapping of coordinate or column to unit, optional
        Where the record does not say.
    window : (start, stop), optional
        Part to fit [s]; the rest is left out.

    Raises
    ------
    BadInput
        When a name fits neither the plant nor the record, or nothing can be recognised.
    """
    record = _renamed(record, columns or {}, units or {})
    rig, plant = (plant, type(plant.plant)) if isinstance(plant, Rig) else (None, plant)
    study, plant = _drafted(record, plant, {*(known or ()), *(ask or ())})
    values = study.setdefault("parameters", {})
    _own_force(study, plant, weighs=ask is None)
    given: dict[str, Number] = {}
    if rig is not None:
        state_rig(study, rig)
        given = {**rig.plant.parameters(), **({GAIN: rig.gain} if "gain" in study["actuator"] else {})}
    _answer(values, study.setdefault("actuator", {}), plant, known or {}, ask, given)
    if not study["actuator"]:
        del study["actuator"]
    if window is not None:
        first = {key: value for key, value in study["runs"][0].items() if key != "label"}
        study["runs"] = [{**first, "window": [float(x) for x in window], "role": "fit"}]
    file = record.provenance.file
    study["title"] = Path(file).stem if file else "log"
    return load_study(
        Path(f"{study['title']}.toml"), text="\n".join(_lines(study)) + "\n", records={LOG: record}, plant=plant
    )


def _renamed(record: Record, columns: Mapping[str, str], units: Mapping[str, str]) -> Record:
    back = {column: name for name, column in columns.items()}
    for column in back:
        record[column]  # a sentence when it is not there
    signals = {back.get(name, name): values for name, values in record.signals.items()}
    stated = {back.get(name, name): unit for name, unit in record.units.items()}
    for name, unit in units.items():
        name = back.get(name, name)
        if name not in signals:
            raise BadInput(f"units names columns, got '{name}'; {nearest(name, signals)}")
        stated[name] = unit
    roles = {role: tuple(back.get(n, n) for n in getattr(record, role)) for role in ("inputs", "outputs")}
    return record.replace(signals=signals, units=stated, **roles)


def _drafted(record: Record, plant: type[Plant] | None, given: Set[str]) -> tuple[dict[str, Any], type[Plant]]:
    """Draft and plant; of a plant in no file only where a number is left to guess."""
    name = name_of(plant) if plant is not None else ""
    if plant is not None and not name and _without_default(plant) <= given:
        return _plain(record, plant), plant
    with called_by_its_name(plant) if plant is not None and not name else nullcontext(name) as called:
        study = tomllib.loads(draft(record, inspect(record), Path(LOG), Path("study.toml"), plant=called))
        return study, find(study["rig"]["plant"])


def _without_default(plant: type[Plant]) -> set[str]:
    """Numbers that a plant cannot do without."""
    defaults = {f.name for f in fields(plant) if f.default is not MISSING}  # type: ignore[arg-type]
    return set(plant.names()) - defaults


def _plain(record: Record, plant: type[Plant]) -> dict[str, Any]:
    """Study of a plant whose numbers are all given: columns bear the names of its coordinates and inputs."""
    study: dict[str, Any] = {"rig": {"plant": plant.__name__}, "parameters": {}, "sensors": {}}
    for c in plant.coordinates:
        if c.name in record.signals:
            study["sensors"][c.name] = {"column": c.name, "unit": record.units[c.name] or c.unit}
    if not study["sensors"]:
        wanted = ", ".join(c.name for c in plant.coordinates)
        raise BadInput(
            f"{plant.__name__} moves in {wanted}, and the log has the columns {', '.join(record.names)}; say which is "
            f'which: columns={{"{plant.coordinates[0].name}": "{record.names[0]}"}}.'
        )
    driven = [i for i in plant.inputs if i.name in record.signals]
    if driven:
        study["drive"] = {"column": driven[0].name, "unit": record.units[driven[0].name] or driven[0].unit}
    study["defaults"] = {"unknown": ["initial"]}
    study["runs"] = [{"file": LOG, "role": "fit"}]
    return study


def _own_force(study: dict[str, Any], plant: type[Plant], *, weighs: bool) -> None:
    """A column that bears the name of the plant's force, and its unit or none, is that force, and `weighs` the masses.

    Its limit and the controller's period are not specified.
    """
    drive, actuator = study.get("drive", {}), study.get("actuator", {})
    force = next((i for i in plant.inputs if i.name == drive.get("column")), None)
    if force is None:
        return
    actuator.pop("limit", None)
    study["rig"].pop("servo_period", None)
    if not weighs or "gain" not in actuator or drive.setdefault("unit", force.unit) != force.unit:
        return
    del actuator["gain"]
    for name, value in study["parameters"].items():
        if isinstance(value, dict) and value.get("assumed") and plant.quantity(name).unit == "kg":
            study["parameters"][name] = {"guess": value["value"]}


def _answer(
    values: dict[str, Any], actuator: dict[str, Any], plant: type[Plant], known: Mapping[str, Number],
    ask: Sequence[str] | Mapping[str, Number] | None, given: Mapping[str, Number],
) -> None:  # fmt: skip
    """Replace guesses of a draft by what is known and estimated; what is not estimated then is as a rig has it."""
    names = (*plant.names(), *ACTUATOR)
    estimated = [] if ask is None else list(ask)
    inertia = values.get("J_p")
    if ask is None and "l_cg" in known and isinstance(inertia, dict) and inertia.get("assumed"):
        estimated += {"J_p"} - {*known, *given}  # a draft without a length takes the pendulum for a simple one
    for name in (*known, *estimated):
        if name not in names:
            raise BadInput(f"{plant.__name__} has no number '{name}'; {nearest(name, names)}")
        if name in known and name in estimated:
            raise BadInput(f"'{name}' cannot be known and estimated at once; leave it out of one.")

    def table(name: str) -> tuple[dict[str, Any], str]:
        return (actuator, name.partition(".")[2]) if name in ACTUATOR else (values, name)

    guesses = {n: v["guess"] for n, v in values.items() if isinstance(v, dict) and "guess" in v}
    guesses |= {f"actuator.{n}": v["guess"] for n, v in actuator.items() if isinstance(v, dict) and "guess" in v}
    for name, value in known.items():
        where, key = table(name)
        where[key] = _text(value, plant, name)
    starts = {
        n: ask[n] if isinstance(ask, Mapping) else guesses.get(n) or given.get(n) or _guess(values, plant, n)
        for n in estimated
    }
    for name in guesses if ask is not None else ():
        where, key = table(name)
        if name in given:
            where[key] = _text(given[name], plant, name)
        elif name not in known:
            del where[key]
    for name, start in starts.items():
        where, key = table(name)
        where[key] = {"guess": _text(start, plant, name)}
    missing = [n for n in plant.names() if n not in values and n in _without_default(plant)]
    if missing:
        raise BadInput(
            f"{plant.__name__} needs {', '.join(missing)}, neither known nor estimated; measure and pass"
            f' known={{"{missing[0]}": ...}}, or ask for it with a guess.'
        )


def _text(value: Number, plant: type[Plant], name: str) -> Any:
    """A number with its unit; text as it is; the numbers of a drive have the unit that the study gives them."""
    if isinstance(value, str):
        number, mark, spread = re.sub(r"\+/-|±", "+-", value).partition("+-")
        return {"value": number.strip(), "uncertainty": spread.strip()} if mark else value
    unit = plant.quantity(name).unit if name in plant.names() else ""
    return f"{float(value)!r} {unit}" if unit not in ("", "1") else float(value)


def _guess(values: Mapping[str, Any], plant: type[Plant], name: str) -> Number:
    """First guess of what the draft does not ask: its placeholder, a tenth of ``m l^2``, the other joint's friction."""
    from upright.units import parse

    def number(of: str) -> float:
        value = values.get(of, 0.0)
        value = value.get("guess", value.get("value", 0.0)) if isinstance(value, dict) else value
        return parse(value, plant.quantity(of).unit) if isinstance(value, str) else float(value)

    names = plant.names()
    if name in names and number(name) != 0:
        return number(name)
    if name == "J_p" and {"m_p", "l_cg"} <= set(names) and number("m_p") * number("l_cg") > 0:
        return 0.1 * number("m_p") * number("l_cg") ** 2
    other = name.replace("_1", "_2", 1)
    if name.startswith("b_1") and other in names and number(other) > 0:
        return number(other)
    raise BadInput(
        f'{name} is to be estimated and no guess of it can be read from the log; pass ask={{"{name}": "..."}}.'
    )


def _lines(study: Mapping[str, Any]) -> Iterator[str]:
    """A study as TOML: plain keys, then tables, then tables in lists."""
    for key, value in study.items():
        if not isinstance(value, dict) and not _is_tables(value):
            yield f"{key} = {toml(value, 17)}"
    for key, value in study.items():
        if isinstance(value, dict):
            nested = {k: v for k, v in value.items() if key == "sensors" and isinstance(v, dict)}
            if len(nested) < len(value) or not value:
                yield f"[{key}]"
                for name, v in value.items():
                    if name not in nested:
                        yield f"{name} = {toml(v, 17)}"
            for name, inner in nested.items():
                yield f"[{key}.{name}]"
                for k, v in inner.items():
                    yield f"{k} = {toml(v, 17)}"
        elif _is_tables(value):
            for entry in value:
                yield f"[[{key}]]"
                for k, v in entry.items():
                    yield f"{k} = {toml(v, 17)}"


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, dict) for v in value)
