"""A rig as everything speaks of it: plant, drive, sensors, servo, covariance, and where each number comes from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from numbers import Real
from typing import Any

import numpy as np

from upright.basis import DESCRIBED, Basis
from upright.errors import BadInput, nearest
from upright.physics import Plant, name_of
from upright.physics.actuator import ACTUATOR
from upright.records import Array
from upright.renamed import former
from upright.rig.drive import GAIN, MORE, driven, saturation
from upright.rig.hardware import Entry, Hardware, counts_unit, driven_unit, force_unit, meaning_of, place_of, turn_of
from upright.rig.mounting import Mounting
from upright.shown import Shown
from upright.systems import StateSpace
from upright.units import in_unit

_ENTRIES = {
    "limit": "limit", "converter": "converter", "delay": "delay", "lag": "lag", "offset": "offset",
    "period": "servo_period", "travel": "travel", "speed_limit": "speed_limit", "twist": "twist",
}  # fmt: skip

_ASIDE = 1e-6
"""So far off an equilibrium is a rig that rests on a kink."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Rig(Shown):
    """A plant with its numbers, and what is known of the drive, the encoders and the servo about it.

    ``rig["l_cg"]`` is a number of its plant [SI].
    What nobody gave is missing: `limit`, `period` and `counts` say in a sentence that they are needed, and a delay, a
    lag, an offset or a converter step that nobody gave is none.

    Attributes
    ----------
    plant : Plant
    name : str, optional
        As its owner or its make calls it; as its plant is called when omitted.
    gain : float
        Force per unit of command.
    unit : str, optional
        Of the command; that of the plant's force when omitted.
    hardware : Hardware
        Drive, encoders, servo and travel, each number with its source.
    sources : mapping of str to str
        Where the plant's numbers and ``"actuator.gain"`` come from: ``"known"``, ``"identified"``, ``"assumed"`` or
        ``"guessed"``; a number that is not named was given.
    draws : tuple of (Plant, float)
        Plants and gains drawn from a fit's covariance; empty without one.
    scales : tuple of float, optional
        What the encoders show over what is true; None where the counts per unit are right.
    mounting : Mounting, optional
        What else the encoders show: play and shafts off centre. Logs have both; a loop, which stays about one point,
        has the error and the slope that a shaft off centre has there.
    seed : int
        Which rig of its make; 0 is the one as designed.
    basis : Basis
        Where its numbers come from, and how far they can be trusted.
    """

    plant: Plant
    name: str = None  # type: ignore[assignment] # filled in below
    gain: float = 1.0
    unit: str = None  # type: ignore[assignment]
    hardware: Hardware = field(default_factory=Hardware)
    sources: Mapping[str, str] = field(default_factory=dict[str, str])
    draws: tuple[tuple[Plant, float], ...] = ()
    scales: tuple[float, ...] | None = None
    mounting: Mounting | None = None
    seed: int = 0
    basis: Basis = DESCRIBED

    def __post_init__(self) -> None:
        kind = type(self.plant)
        if self.name is None:  # type: ignore[reportUnnecessaryComparison]
            object.__setattr__(self, "name", name_of(kind) or kind.__name__)
        if self.unit is None:  # type: ignore[reportUnnecessaryComparison]
            object.__setattr__(self, "unit", force_unit(kind))
        if self.scales and len(self.scales) != len(self.plant.coordinates):
            n = len(self.plant.coordinates)
            raise BadInput(f"a rig with {n} coordinates needs {n} scales of its encoders, got {self.scales}.")

    def __dir__(self) -> list[str]:
        return [
            "basis", "converter", "counts", "delay", "drive", "gain", "known", "lag", "limit", "linear", "name",
            "offset", "outputs", "period", "plant", "plot", "replace", "resolution", "sources", "speed_limit",
            "states", "travel", "twist", "unit",
        ]  # fmt: skip

    def __getitem__(self, name: str) -> float:
        """A number of the plant, by its name [SI]."""
        numbers = self.plant.parameters()
        if name not in numbers:
            raise BadInput(f"{self.name} has no parameter '{name}'; {nearest(name, numbers)}")
        return numbers[name]

    @classmethod
    def known(
        cls, plant: Plant, *, name: str | None = None, gain: float | str = 1.0, unit: str = "V", **numbers: Any
    ) -> Rig:  # fmt: skip
        """A rig whose numbers are known.

        Parameters
        ----------
        plant : Plant
        name : str, optional
        gain : float or str
            Force per unit of command: ``0.65`` or ``"0.65 N m/V"``.
        unit : str
            Of the command.
        **numbers
            ``limit``, ``period``, ``counts`` and the others that `replace` takes.

        Raises
        ------
        BadInput
            When a number is none that a rig can have.

        Examples
        --------
        >>> import upright as up
        >>> arm = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4)
        >>> rig = up.Rig.known(arm, gain="0.65 N m/V", limit="10 V", period="2 ms", counts=4096, travel="120 deg")
        >>> rig.limit, rig.period, round(rig.travel, 4)
        (10.0, 0.002, 2.0944)
        """
        if not isinstance(plant, Plant):  # type: ignore[reportUnnecessaryIsInstance]
            raise BadInput(f"a rig has a plant with numbers, such as up.Pendulum(m_p=...), got {plant!r:.40}.")
        strength = in_unit(gain, f"({force_unit(type(plant))})/({unit})")
        return cls(plant=plant, name=name, gain=strength, unit=unit).replace(**numbers)  # type: ignore[arg-type]

    def replace(self, **changes: Any) -> Rig:
        """The same rig with something else in it.

        Parameters
        ----------
        **changes
            Attributes; or numbers of the hardware, with their unit in text (``"2 ms"``) or SI and in the command's
            unit, as the gain: ``limit``, ``converter``, ``delay``, ``lag``, ``offset``, ``period``, ``travel``,
            ``speed_limit``, ``twist``, of which an infinite one is none; ``counts`` of the encoders per turn or metre,
            one number for all or one for each coordinate; and ``more``.

        Raises
        ------
        BadInput
            When there is no such number, or a rig cannot have it.
        """
        attributes = {f.name for f in fields(self)}
        unknown = sorted(changes.keys() - attributes - _ENTRIES.keys() - {"counts", "more"})
        if unknown:
            names = [*_ENTRIES, "counts", *attributes]
            raise BadInput(f"a rig has no '{unknown[0]}'; {nearest(unknown[0], names)}")
        plant: Plant = changes.get("plant", self.plant)
        if not isinstance(plant, Plant):  # type: ignore[reportUnnecessaryIsInstance]
            raise BadInput(f"a rig has a plant with numbers, such as up.Pendulum(m_p=...), got {plant!r:.40}.")
        place, unit = driven_unit(type(plant)), changes.get("unit", self.unit)
        if "gain" in changes:
            force = plant.inputs[0].unit if plant.inputs else ""
            changes["gain"] = in_unit(changes["gain"], f"({force})/({unit})")
        units = {
            "limit": unit, "converter": unit, "offset": unit, "delay": "s", "lag": "s", "period": "s",
            "travel": place, "speed_limit": f"{place}/s", "twist": place,
        }  # fmt: skip
        entries: dict[str, Entry] = {}
        gone: set[str] = set()
        for name in [n for n in _ENTRIES if n in changes]:
            value = in_unit(changes.pop(name), units[name])
            if name in ("limit", "period") and not 0 < value < math.inf:
                raise BadInput(f"the {name} of a rig must be positive and finite, got {value:g}.")
            if math.isfinite(value):
                entries[_ENTRIES[name]] = Entry(value=value, unit=units[name], source="known")
            else:
                gone.add(_ENTRIES[name])
        if "more" in changes:
            more: Mapping[str, float] = changes.pop("more")
            gone |= {name.partition(".")[2] for name in self.more}
            entries |= {
                name.partition(".")[2]: Entry(value=value, unit=ACTUATOR[name].unit, source="known")
                for name, value in more.items()
            }
        if "counts" in changes:
            entries |= _counts(plant, changes.pop("counts"))
        hardware: Hardware = changes.pop("hardware", self.hardware)
        if entries or gone:
            remaining = {n: e for n, e in hardware.entries.items() if n not in gone}
            hardware = replace(hardware, entries=remaining | entries)
        return replace(self, hardware=hardware, **changes)

    @property
    def guessed(self) -> frozenset[str]:
        """Numbers of the plant and the drive that somebody guessed, for an identification to start from."""
        return frozenset(n for n, source in self.sources.items() if source == "guessed")

    def changed(self, **parameters: float) -> Rig:
        """The same rig with other parameters of its plant."""
        return replace(self, plant=self.plant.replace(**parameters))

    def _number(self, name: str) -> float:
        if name not in self.hardware.entries:
            raise BadInput(
                f"{self.name or 'the rig'} has no {meaning_of(name)}, which is needed; give it to rig.replace, or "
                f"write {place_of(name)} into its study."
            )
        return self.hardware.entries[name].value

    @property
    def limit(self) -> float:
        """Largest command, in its unit."""
        return self._number("limit")

    @property
    def period(self) -> float:
        """Servo period [s]."""
        return self._number("servo_period")

    @property
    def counts(self) -> tuple[float, ...]:
        """Encoder counts per turn or metre, one for each coordinate."""
        return tuple(self._number(f"counts.{c.name}") for c in self.plant.coordinates)

    @property
    def per_unit(self) -> tuple[float, ...]:
        """Encoder counts per rad or m, one for each coordinate."""
        units = (c.unit for c in self.plant.coordinates)
        return tuple(n / turn_of(unit) for n, unit in zip(self.counts, units, strict=True))

    @property
    def converter(self) -> float:
        """Smallest step of the command; 0 without one."""
        return self.hardware.value("converter", 0.0)

    @property
    def delay(self) -> float:
        """From a sample of the encoders to its command at work, computation included [s]."""
        return self.hardware.value("delay", 0.0)

    @property
    def lag(self) -> float:
        """Time constant of the drive [s], which the linear model leaves out."""
        return self.hardware.value("lag", 0.0)

    @property
    def offset(self) -> float:
        """Command that the drive adds by itself."""
        return self.hardware.value("offset", 0.0)

    @property
    def travel(self) -> float:
        """How far the driven coordinate may go either way before a stop or a cable ends it [m or rad]."""
        return self.hardware.value("travel", math.inf)

    @property
    def speed_limit(self) -> float:
        """Speed of the driven coordinate at which the drive trips [m/s or rad/s]."""
        return self.hardware.value("speed_limit", math.inf)

    @property
    def twist(self) -> float:
        """How far the last coordinate may go from the first before the shaft between them trips the rig [m or rad]."""
        return self.hardware.value("twist", math.inf)

    @property
    def more(self) -> Mapping[str, float]:
        """What else the drive does: numbers of `physics.actuator.ACTUATOR`, such as ``"actuator.force_limit"``."""
        return {f"actuator.{n}": e.value for n, e in self.hardware.entries.items() if f"actuator.{n}" in MORE}

    @property
    def drive(self) -> Mapping[str, float]:
        """The actuator by the names of `upright.simulation.simulate`."""
        return {
            **self.more,
            GAIN: self.gain,
            "actuator.limit": self.hardware.value("limit", math.inf),
            "actuator.delay": self.delay,
            "actuator.lag": self.lag,
            "actuator.offset": self.offset,
        }

    @property
    def saturation(self) -> float:
        """Smallest command at which the drive gives all that it can, at rest: that of its command or of its force."""
        return saturation(self.drive)

    @property
    def resolution(self) -> Array:
        """Resolution of each encoder [m or rad], shape (coordinates,)."""
        return 1.0 / np.array(self.per_unit)

    quantum = former("resolution")

    @property
    def shown(self) -> Array:
        """What each encoder shows over what is true, shape (coordinates,)."""
        return np.array(self.scales) if self.scales else np.ones(len(self.plant.coordinates))

    @property
    def states(self) -> tuple[str, ...]:
        """Coordinates, each followed by its velocity."""
        return self.plant.state_names()

    @property
    def state_units(self) -> list[str]:
        """Unit of every state."""
        return [u for c in self.plant.coordinates for u in (c.unit, f"{c.unit}/s")]

    @property
    def outputs(self) -> tuple[str, ...]:
        """What is measured: the coordinates."""
        return tuple(c.name for c in self.plant.coordinates)

    @property
    def output_units(self) -> list[str]:
        """Unit of every output."""
        return [c.unit for c in self.plant.coordinates]

    def linear(self, at: str, *, side: float = 0.0) -> StateSpace:
        """Model about an equilibrium, from the command to the coordinates; dry friction, lag and counts left out.

        See `Plant.linear`.
        """
        return driven(self.plant, {**self.more, GAIN: self.gain}, at, side=side)

    @cached_property
    def fastest_mode(self) -> float:
        """Magnitude of the fastest mode about any equilibrium [rad/s], on either side where it rests on a kink."""
        models = (self.linear(at, side=side) for at in self.plant.equilibria for side in (-_ASIDE, _ASIDE))
        return max((float(np.abs(np.linalg.eigvals(model.A)).max()) for model in models), default=0.0)

    def spread(self, at: str) -> list[StateSpace]:
        """The same for the draws."""
        return [driven(plant, {**self.more, GAIN: gain}, at) for plant, gain in self.draws]


def _counts(plant: Plant, counts: float | Sequence[float]) -> dict[str, Entry]:
    n = len(plant.coordinates)
    each: tuple[Any, ...] = tuple(counts) if isinstance(counts, Sequence | np.ndarray) else (counts,) * n
    if len(each) != n or any(not isinstance(c, Real) or not 0 < float(c) < math.inf for c in each):
        raise BadInput(f"a rig with {n} coordinates needs {n} positive numbers of counts, got {each}.")
    return {
        f"counts.{c.name}": Entry(value=float(per), unit=counts_unit(c.unit), source="known")
        for c, per in zip(plant.coordinates, each, strict=True)
    }
