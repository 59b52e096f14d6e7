"""What is known of a rig besides the numbers of its plant: drive, encoders, servo and travel, each with its source.

A study says it once, `fit.json` carries it, and every verb that simulates or designs takes it from there. A number that
nobody said is asked for, or taken from a vendor's data sheet that somebody chose by name; it is never filled in.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from upright.errors import BadInput, nearest
from upright.identification import Rig
from upright.physics import Plant
from upright.physics.actuator import ACTUATOR
from upright.study.sensors import Sensor, read_sensors
from upright.study.text import Section, number, source_of
from upright.units import parse

VENDORS = ("ECP 205", "ECP 210")
"""Whose data sheets are known; `experiments.makes` has them."""
SERVO = {"servo_period": "s", "travel": "", "speed_limit": "/s", "twist": ""}
"""Numbers under [rig]; what is "" or "/s" is in the unit of the driven coordinate, or per second of it."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One number of a rig, SI or in the command's unit, and where it comes from.

    `source` is ``"known"``, ``"measured"``, ``"assumed"``, ``"identified"``, an option such as ``"--limit"``, or
    a data sheet by name.
    """

    value: float
    unit: str
    source: str

    def __str__(self) -> str:
        return f"{number(self.value, self.unit, 6)} ({self.source})"


@dataclass(frozen=True, kw_only=True)
class RigDescription:
    """A rig's drive, encoders, servo and travel, as far as somebody said.

    Attributes
    ----------
    name : str
        As its owner, or its logs, call it; may be empty.
    vendor : str
        One of `VENDORS` whose data sheet says what is left out here; empty for a rig of one's own.
    entries : mapping of str to Entry
        ``"limit"``, ``"lag"`` and so on as under [actuator]; ``"converter"``; ``"servo_period"``, ``"travel"``,
        ``"speed_limit"``, ``"twist"``; and by coordinate ``"counts.theta"`` (per turn or metre), ``"sign.theta"`` and
        ``"offset.theta"``.
    """

    name: str = ""
    vendor: str = ""
    entries: Mapping[str, Entry] = field(default_factory=dict[str, Entry])

    def over(self, base: Mapping[str, Entry]) -> RigDescription:
        """The same with what it leaves out taken from `base`."""
        return replace(self, entries={**base, **self.entries})

    def given(self, entries: Mapping[str, Entry | None]) -> RigDescription:
        """The same with entries put in the place of its own, such as options; None is no entry."""
        return replace(self, entries={**self.entries, **{n: e for n, e in entries.items() if e is not None}})

    def value(self, name: str, default: float) -> float:
        """Value of an entry, or the default, which has to mean that there is none of it."""
        return self.entries[name].value if name in self.entries else default

    def demand(self, wanted: Mapping[str, str], who: str, *, sheet: str) -> None:
        """Ask for entries that are not there.

        Parameters
        ----------
        wanted : mapping of str to str
            Names of entries, and how the caller gives each: ``{"limit": "--limit 10"}``; "" where it has no way.
        who : str
            Verb that needs them.
        sheet : str
            How the caller names a data sheet: ``"--vendor NAME"``.

        Raises
        ------
        BadInput
            With every option and key of the study by which they could be said.
        """
        missing = [n for n in wanted if n not in self.entries]
        if not missing:
            return
        vendors = " or ".join(f'"{v}"' for v in VENDORS)
        asked = "; ".join(f"{meaning_of(n)} ({' or '.join(w for w in (wanted[n], place_of(n)) if w)})" for n in missing)
        raise BadInput(
            f"{who} needs what neither the study nor its fit says: {asked}. "
            f"{'Give it as shown, or write it' if any(wanted.values()) else 'Write it'} into the study and identify "
            f"again; {sheet} takes a data sheet by name ({vendors}) where the rig is one of those."
        )

    def unlike(self, other: RigDescription) -> tuple[str, ...]:
        """Sentences on what the other, a rig that a fit of this one is applied to, differs in."""
        out: list[str] = []
        for what, mine, others in (("", self.name, other.name), ("vendor ", self.vendor, other.vendor)):
            if mine and others and mine != others:
                out.append(f"The fit is of another rig ({what}{mine}) than the study ({what}{others}).")
        for name in self.entries.keys() & other.entries.keys():
            mine, others = self.entries[name], other.entries[name]
            fixed = name.startswith("counts.") or {mine.source, others.source} <= {"known", "measured"}
            if fixed and not name.startswith("offset.") and not math.isclose(mine.value, others.value, rel_tol=1e-3):
                fit, study = (number(e.value, e.unit, 5) for e in (mine, others))
                out.append(f"Is it the same rig? Its {meaning_of(name)}: {fit} in the fit, {study} in the study.")
        return tuple(sorted(out))

    def plain(self) -> dict[str, Any]:
        """As `fit.json` holds it."""
        table = {n: {"value": e.value, "unit": e.unit, "source": e.source} for n, e in self.entries.items()}
        return {"name": self.name, "vendor": self.vendor, "entries": table}


def meaning_of(name: str) -> str:
    """What an entry says, in a few words."""
    kind, _, of = name.partition(".")
    if f"actuator.{name}" in ACTUATOR:
        return ACTUATOR[f"actuator.{name}"].meaning
    return {
        "converter": "smallest step of the command", "servo_period": "servo period",
        "travel": "how far the driven body may go either way", "speed_limit": "speed at which the drive trips",
        "twist": "how far the ends of the shaft may go apart",
        "counts": f"encoder counts of {of}", "sign": f"sign of the encoder of {of}",
        "offset": f"reading at which {of} is zero",
    }[kind]  # fmt: skip


def place_of(name: str) -> str:
    """How a study says an entry."""
    kind, _, of = name.partition(".")
    if of:
        return f"[sensors.{of}] {'counts_per_rev or counts_per_m' if kind == 'counts' else kind}"
    if kind in SERVO:
        return f'[rig] {kind} = "{"2 ms" if kind == "servo_period" else "..."}"'
    return f'[actuator] {kind} = "..."'


def check_vendor(name: str) -> str:
    """Name of a vendor's rig as it came, "" included.

    Raises
    ------
    BadInput
        When no data sheet of it is known.
    """
    if name and name not in VENDORS:
        raise BadInput(f"there is no data sheet of '{name}'; {nearest(name, VENDORS)} (known are {', '.join(VENDORS)})")
    return name


def read_description(study: Section, plant: type[Plant], rig: Rig, logs: Collection[str] = ()) -> RigDescription:
    """What a study says of its rig besides the plant's numbers.

    Parameters
    ----------
    study : Section
        The whole study.
    plant : type of Plant
    rig : Rig
        As read from the same study.
    logs : collection of str, optional
        What the logs call their rig, which counts where the study gives no name and they agree.
    """
    section, actuator = study.section("rig"), study.section("actuator")
    called = section.text_of("name", "bench 3") if "name" in section else ""
    vendor = section.text_of("vendor", VENDORS[0]) if "vendor" in section else ""
    with section.at("vendor"):
        check_vendor(vendor)
    entries = {
        key: Entry(value=p.value, unit=p.unit, source="identified" if p.estimate else source_of(actuator.values[key]))
        for key, p in ((n.partition(".")[2], rig.parameters[n]) for n in ACTUATOR)
        if key in actuator
    }
    place = driven_unit(plant)
    units = {n: place + unit if unit in ("", "/s") else unit for n, unit in SERVO.items()}
    asked = [(actuator, "converter", rig.parameters["actuator.limit"].unit)]
    for table, key, unit in (*asked, *((section, n, u) for n, u in units.items())):
        if key in table:
            value, source = table.stated(key, unit)
            entries[key] = Entry(value=value, unit=unit, source=source)
    for sensor, place in read_sensors(study, Section(study.text, (), {}), plant).values():
        entries |= {} if sensor.of else _encoder(place, sensor)  # counts of a sum are not those of its coordinate
    named = {*logs}.pop() if len({*logs}) == 1 else ""
    return RigDescription(name=called or named, vendor=vendor, entries=entries)


def driven_unit(plant: type[Plant]) -> str:
    """Unit of the coordinate that the first input drives, "1" without one."""
    return next((c.unit for c in plant.coordinates if plant.inputs and c.name == plant.inputs[0].on), "1")


def turn_of(unit: str) -> float:
    """SI in which an encoder's counts are counted: a turn, or a metre."""
    return 2 * math.pi if unit == "rad" else 1.0


def _encoder(section: Section, sensor: Sensor) -> dict[str, Entry]:
    """Counts, sign and offset of one encoder, as far as they are said."""
    c, out = sensor.coordinate, dict[str, Entry]()
    step = sensor.resolution or sensor.per_count
    if step:
        key = next(k for k in ("resolution", "counts_per_rev", "counts_per_m") if k in section)
        per = "1/rev" if c.unit == "rad" else f"1/{c.unit}"
        units = {"resolution": c.unit, "counts_per_rev": "1", "counts_per_m": "1/m"}
        out[f"counts.{c.name}"] = Entry(
            value=turn_of(c.unit) / step, unit=per, source=section.stated(key, units[key])[1]
        )
    if "sign" in section:
        out[f"sign.{c.name}"] = Entry(value=sensor.sign, unit="1", source="known")
    if "offset" in section:
        text = isinstance(sensor.offset, str)
        with section.at("offset"):
            offset = _offset(sensor)
        out[f"offset.{c.name}"] = Entry(value=offset, unit=c.unit if text else sensor.unit, source="known")
    return out


def _offset(sensor: Sensor) -> float:
    try:
        return parse(sensor.offset, sensor.coordinate.unit) if isinstance(sensor.offset, str) else sensor.offset
    except BadInput:
        return parse(sensor.offset, sensor.unit)  # type: ignore[arg-type]
