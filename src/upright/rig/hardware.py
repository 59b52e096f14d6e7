"""Drive, encoders, servo and travel of a rig, each number with its source.

A study says it once, `fit.json` carries it, and every verb that simulates or designs takes it from there. A number that
is missing is requested, or taken from a vendor's data sheet chosen by name; it is never filled in.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from upright.errors import BadInput, nearest
from upright.physics import Plant
from upright.physics.actuator import ACTUATOR
from upright.quantities import with_unit

VENDORS = ("ECP 205", "ECP 210")
"""Whose data sheets are known; `rig.makes` has them."""
DRIVE_SIGN = "drive_sign"
"""Entry of a drive that a positive command turns backwards: -1."""
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
        return f"{with_unit(self.value, self.unit, 6)} ({self.source})"


@dataclass(frozen=True, kw_only=True)
class Hardware:
    """A rig's drive, encoders, servo and travel, as far as they are known.

    Attributes
    ----------
    name : str, optional
        As its owner, or its logs, call it.
    vendor : str, optional
        One of `VENDORS` whose data sheet gives what is left out here.
    entries : mapping of str to Entry
        ``"limit"``, ``"lag"`` and so on as under [actuator]; ``"drive_sign"``; ``"converter"``; ``"servo_period"``,
        ``"travel"``, ``"speed_limit"``, ``"twist"``; and by coordinate ``"counts.theta"`` (per turn or metre),
        ``"sign.theta"`` and ``"offset.theta"``.
    """

    name: str | None = None
    vendor: str | None = None
    entries: Mapping[str, Entry] = field(default_factory=dict[str, Entry])

    def over(self, base: Mapping[str, Entry]) -> Hardware:
        """The same with what it leaves out taken from `base`."""
        return replace(self, entries={**base, **self.entries})

    def with_entries(self, entries: Mapping[str, Entry | None]) -> Hardware:
        """The same with entries put in the place of its own, such as options; None is no entry."""
        return replace(self, entries={**self.entries, **{n: e for n, e in entries.items() if e is not None}})

    def value(self, name: str, default: float) -> float:
        """Value of an entry, or the default, which has to mean that there is none of it."""
        return self.entries[name].value if name in self.entries else default

    def as_commanded(self) -> tuple[float, Hardware]:
        """Sign of the drive, and the same without it: numbers of commands then hold for those that the log has."""
        sign = self.value(DRIVE_SIGN, 1.0)
        entries = {n: e for n, e in self.entries.items() if n != DRIVE_SIGN}
        if "offset" in entries:
            entries["offset"] = replace(entries["offset"], value=sign * entries["offset"].value)
        return sign, replace(self, entries=entries)

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
            With every option and key of the study by which they could be given.
        """
        missing = [n for n in wanted if n not in self.entries]
        if not missing:
            return
        vendors = " or ".join(f'"{v}"' for v in VENDORS)
        missing_numbers = "; ".join(
            f"{meaning_of(n)} ({' or '.join(w for w in (wanted[n], place_of(n)) if w)})" for n in missing
        )
        raise BadInput(
            f"{who} needs numbers that neither the study nor its fit has: {missing_numbers}. "
            f"{'Give the option, or write the key' if any(wanted.values()) else 'Write them'} into the study and "
            f"identify again; {sheet} takes the data sheet of an {vendors}."
        )

    def unlike(self, other: Hardware) -> tuple[str, ...]:
        """Sentences on what the other, a rig that a fit of this one is applied to, differs in."""
        out: list[str] = []
        for what, mine, others in (("", self.name, other.name), ("vendor ", self.vendor, other.vendor)):
            if mine and others and mine != others:
                out.append(f"The fit is of another rig ({what}{mine}) than the study ({what}{others}).")
        for name in self.entries.keys() & other.entries.keys():
            mine, others = self.entries[name], other.entries[name]
            fixed = name.startswith("counts.") or {mine.source, others.source} <= {"known", "measured"}
            if fixed and not name.startswith("offset.") and not math.isclose(mine.value, others.value, rel_tol=1e-3):
                fit, study = (with_unit(e.value, e.unit, 5) for e in (mine, others))
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
        DRIVE_SIGN: "sign of the drive", "converter": "smallest step of the command", "servo_period": "servo period",
        "travel": "how far the driven body may go either way", "speed_limit": "speed at which the drive trips",
        "twist": "how far the ends of the shaft may go apart",
        "counts": f"encoder counts of {of}", "sign": f"sign of the encoder of {of}",
        "offset": f"reading at which {of} is zero",
    }[kind]  # fmt: skip


def place_of(name: str) -> str:
    """How a study gives an entry."""
    kind, _, of = name.partition(".")
    if of:
        return f"[sensors.{of}] {'counts_per_rev or counts_per_m' if kind == 'counts' else kind}"
    if kind == DRIVE_SIGN:
        return "[drive] sign = -1"
    if kind in SERVO:
        return f'[rig] {kind} = "{"2 ms" if kind == "servo_period" else "..."}"'
    return f'[actuator] {kind} = "..."'


def check_vendor(name: str | None) -> str | None:
    """Name of a vendor's rig as it came, None included.

    Raises
    ------
    BadInput
        When no data sheet of it is known.
    """
    if name is not None and name not in VENDORS:
        raise BadInput(f"there is no data sheet of '{name}'; {nearest(name, VENDORS)} (known are {', '.join(VENDORS)})")
    return name


def force_unit(kind: type[Plant]) -> str:
    """Unit of the plant's input, "" without one."""
    return kind.inputs[0].unit if kind.inputs else ""


def driven_unit(plant: type[Plant]) -> str:
    """Unit of the coordinate that the first input drives, "1" without one."""
    return next((c.unit for c in plant.coordinates if plant.inputs and c.name == plant.inputs[0].on), "1")


def turn_of(unit: str) -> float:
    """SI in which an encoder's counts are counted: a turn, or a metre."""
    return 2 * math.pi if unit == "rad" else 1.0


def counts_unit(unit: str) -> str:
    """Unit of the counts of an encoder of a coordinate in a `unit`."""
    return "1/rev" if unit == "rad" else f"1/{unit}"
