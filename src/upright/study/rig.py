"""Known and estimated numbers of the rig: [rig], [parameters] and [actuator] of a study."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from upright.errors import BadInput
from upright.identification.model.grey_box import SUBSTEPS, GreyBox, Parameter
from upright.physics import Plant, find
from upright.physics.actuator import ACTUATOR
from upright.quantities import Quantity
from upright.study.keys import names
from upright.study.sensors import assumed_scales
from upright.study.text import SOURCES, Section, as_written, in_si
from upright.trust import before_running
from upright.units import uncertainty


def read_plant(study: Section) -> type[Plant]:
    """Plant that [rig] names."""
    rig = study.section("rig")
    if "rig" not in study:
        raise study.error("rig", 'a study needs a table [rig] with plant = "furuta" or another plant')
    rig.check(names("rig"))
    name = rig.text_of("plant", "cart-pendulum")
    with study.text.at(("rig", "plant")):
        before_running(name, study.text.path)
        return find(name, study.text.path.parent)


def plant_relative_to(folder: Path, plant: str, before: Path) -> str:
    """Name of a plant, the file of the user's own relative to a folder instead of to the one `before`."""
    if ".py:" not in plant:
        return plant
    file, _, name = plant.rpartition(":")
    there = (before / file).resolve()
    with suppress(ValueError):  # on another drive
        there = Path(os.path.relpath(there, folder.resolve()))
    return f"{there.as_posix()}:{name}"


def read_rig(study: Section, plant: type[Plant], drive_unit: str, fixed: Mapping[str, float] | None = None) -> GreyBox:
    """Rig of a study.

    Parameters
    ----------
    study : Section
        The whole study.
    plant : type of Plant
        From `read_plant`.
    drive_unit : str
        Unit of the command, which the actuator's gain is stated per; "" when unknown.
    fixed : mapping of str to float, optional
        Values [SI] of a model fitted before; they replace what the study says, and nothing is estimated.
    """
    section, actuator = study.section("parameters"), study.section("actuator")
    section.check(plant.names(), f"parameter of {plant.__name__} called")
    actuator.check(names("actuator"))

    def read(table: Section, key: str, name: str, what: Quantity, default: Callable[[], float]) -> Parameter:
        if key in table and name not in known:
            return read_parameter(table, key, name, what)
        value = known[name] if name in known else default()
        return Parameter(name=name, value=value, unit=what.unit, meaning=what.meaning)

    known = fixed or {}
    parameters = {
        name: read(section, name, name, plant.quantity(name), lambda name=name: _default(study, plant, name))
        for name in plant.names()
    }
    for name, number in ACTUATOR.items():
        key = name.partition(".")[2]
        what = Quantity(
            unit=actuator_unit(plant, name, drive_unit),
            meaning=number.meaning,
            lower=0.0 if number.never_negative else -math.inf,
            open_lower=key == "knee",
        )
        parameters[name] = read(actuator, key, name, what, lambda number=number: number.default)
    rig = study.section("rig")
    substeps = rig.whole("substeps", 1, most=SUBSTEPS)
    return GreyBox(
        plant=plant, parameters=parameters, substeps=substeps, guessed=rig.flag("guessed"),
        assumed_scales=assumed_scales(study, plant),
    )  # fmt: skip


def _default(study: Section, plant: type[Plant], name: str) -> float:
    """Value of a parameter that the study does not mention: the plant's default."""
    what = plant.quantity(name)
    value = next(f.default for f in fields(plant) if f.name == name)  # type: ignore[arg-type]
    if value is MISSING:
        raise study.error(
            "parameters",
            f"{plant.__name__} needs {name} ({what.meaning}, in {what.unit}) under [parameters]: known, as in"
            f' {name} = "1 {what.unit}", or estimated, as in {name} = {{ guess = "1 {what.unit}" }}',
        )
    return float(value)  # type: ignore[arg-type]


def actuator_unit(plant: type[Plant], name: str, drive_unit: str) -> str:
    """Unit of one actuator number; the gain's is the input's force per unit of the command."""
    force = plant.inputs[0].unit if plant.inputs else "1"
    place = next((c.unit for c in plant.coordinates if plant.inputs and c.name == plant.inputs[0].on), "1")
    drive, braking = drive_unit or "1", per(force, f"{place}/s")
    return {
        "force per command": force if drive == "1" else per(force, drive),
        "command": drive,
        "time": "s",
        "speed": f"{place}/s",
        "force per speed": braking,
        "force": force,
        "per command": f"1/{drive}" if drive != "1" else "1",
        "force per speed per command": braking if drive == "1" else f"{braking}/{drive}",
    }[ACTUATOR[name].unit]


def per(above: str, below: str) -> str:
    """Unit of a ratio; a speed below is written as time above, N s/m."""
    if below.endswith("/s"):
        return f"{above} s/{below[:-2]}"
    top = above if " " not in above else f"({above})"
    return f"{top}/({below})" if " " in below or "/" in below else f"{top}/{below}"


def read_parameter(section: Section, key: str, name: str, what: Quantity) -> Parameter:
    """One parameter in any of its forms: a number, known with uncertainty, or to estimate."""
    value = section.values[key]
    if not isinstance(value, dict):
        number = _checked(section, (key,), name, value, what)
        return Parameter(name=name, value=number, unit=what.unit, meaning=what.meaning)
    table = section.section(key)
    table.check(names("value"))
    if ("value" in table) == ("guess" in table):
        raise section.error(
            key,
            f"{name} needs either value (known) or guess (to estimate), got {as_written(value)};"
            f' for instance {key} = {{ guess = "1 {what.unit}", min = 0 }}',
        )
    estimate = "guess" in table
    ranged = not estimate and bool(table.values.get("assumed"))
    for wrong in ("uncertainty", *SOURCES) if estimate else () if ranged else ("min", "max"):
        if wrong in table:
            raise table.error(
                wrong,
                f"{name} is {'estimated from a guess' if estimate else 'known'}, so {wrong} has no meaning here;"
                f" {'write value instead of guess' if estimate else 'write guess instead of value to estimate it'}",
            )
    main = "guess" if estimate else "value"
    number = _checked(section, (key, main), name, table.values[main], what)
    if not estimate:
        sigma = _uncertainty(section, key, table.values.get("uncertainty", 0.0), number, what)
        assumed, measured = table.flag("assumed"), table.flag("measured")
        if assumed and measured:
            raise table.error("assumed", f"{name} is assumed or measured, not both; leave one out")
        if assumed and sigma > 0:
            raise table.error("assumed", f"{name} has an uncertainty, so it was measured, not assumed; leave one out")
        lower, upper = _bounds(section, key, table, what, (-math.inf, math.inf))
        if not lower <= number <= upper:
            raise table.error(
                "value", f"{name} is assumed to be {number:g} {what.unit}, outside {lower:g} to {upper:g}"
            )
        return Parameter(
            name=name, value=number, unit=what.unit, meaning=what.meaning, uncertainty=sigma, assumed=assumed,
            lower=lower, upper=upper,
        )  # fmt: skip
    lower, upper = _bounds(section, key, table, what, (what.lower, what.upper))
    if not lower <= number <= upper or lower == upper:
        raise table.error(main, f"{name} starts at {number:g} {what.unit}, outside its bounds {lower:g} to {upper:g}")
    return Parameter(
        name=name,
        value=number,
        unit=what.unit,
        meaning=what.meaning,
        estimate=True,
        lower=max(lower, what.lower),
        upper=min(upper, what.upper),
    )


def _bounds(
    section: Section, key: str, table: Section, what: Quantity, otherwise: tuple[float, float]
) -> tuple[float, float]:
    """Bounds of a guess, or the range of an assumed number."""
    lower, upper = (
        _number(section, (key, bound), table.values[bound], what) if bound in table else default
        for bound, default in zip(("min", "max"), otherwise, strict=True)
    )
    return lower, upper


def _number(section: Section, keys: tuple[str, ...], value: Any, what: Quantity) -> float:
    with section.text.at((*section.place(keys[0]), *keys[1:])):
        if isinstance(value, float) and not math.isfinite(value):  # `_checked` knows where infinity has a meaning
            return value
        return in_si(value, what.unit, keys[0])


def _checked(section: Section, keys: tuple[str, ...], name: str, value: Any, what: Quantity) -> float:
    number = _number(section, keys, value, what)
    if not (math.isinf(number) and name in ACTUATOR and number == ACTUATOR[name].default):
        with section.text.at((*section.place(keys[0]), *keys[1:])):
            what.check(name, number)
    return number


def _uncertainty(section: Section, key: str, value: Any, number: float, what: Quantity) -> float:
    if isinstance(value, str) and value.strip().endswith("%"):
        try:
            sigma = uncertainty(value, number, what.unit)
        except BadInput:
            raise section.error(key, f'uncertainty must be like "2 mm" or "1 %", got {as_written(value)}') from None
    else:
        sigma = _number(section, (key, "uncertainty"), value, what)
    if not 0 <= sigma < math.inf:
        raise section.error(key, f"the uncertainty of {key} must be zero or more, got {as_written(value)}")
    return sigma


def known_values(section: Section, plant: type[Plant]) -> dict[str, float]:
    """Parameters of a run that are known and differ, by name [SI]."""
    section.check(plant.names(), f"parameter of {plant.__name__} called")
    return {
        name: _checked(section, (name,), name, value, plant.quantity(name)) for name, value in section.values.items()
    }
