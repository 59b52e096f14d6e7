"""The makes of rigs of the laboratory, a file of `models/` each: the rig as designed, and what the course asks of it.

ECP 210 (rectilinear: two carts), ECP 205 (torsional: two disks), and both with the A51 pendulum (linear, furuta); every
seed is another rig of the same make.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np

from upright.errors import BadInput, nearest
from upright.physics import Furuta, Plant, added_inertia, added_mass, find, name_of
from upright.records.record import of_twin
from upright.rig.brass import BrassPendulum
from upright.rig.hardware import VENDORS, Entry, Hardware, driven_unit
from upright.rig.rig import Rig
from upright.units import parse

COUNTS = 16_000
"""Encoder counts per turn of every joint (ECP 205)."""
SERVO = 0.884e-3
"""Servo period of the ECP controller [s]; it logs every n-th sample."""
PER_METRE = 16_000 / 0.0706
"""Counts per metre (ECP 210)."""
CONVERTER = 10 / 32768
"""Smallest step of the command [V]."""
LAG = 2e-3
"""Time constant of the drive [s]."""
MASS_RADIUS = 0.025
"""Of one brass mass of 500 g [m]."""
WIDEST = 0.5
"""Radius that no disk on a bench exceeds [m]; that of an ECP 205 is 0.13."""
MOTOR_AND_BELT = 5e-4
"""Inertia that the disk loses with its drive belt [kg m^2], by the maker's guide."""

_SPREAD = {"m": 0.02, "J": 0.02, "k": 0.04, "r": 0.01, "b": 0.14, "c": 0.14, "f": 0.14}


@dataclass(frozen=True, kw_only=True)
class BodyOnSpring:
    """How experiment 1a loads and steps one body on a spring to ground; friction holds it, encoders count.

    Attributes
    ----------
    rig : Rig
        As designed, without added masses.
    step : float
        Command of a step [V].
    piece : float
        Inertia that one of the 500 g masses adds nominally [kg or kg m^2].
    tolerance : float
        Relative standard uncertainty of that.
    """

    kind: Literal["rectilinear", "torsional"]
    rig: Rig
    step: float
    piece: float
    tolerance: float

    @property
    def inertia(self) -> str:
        """Name of the body's inertia: ``m_1`` or ``J_1``."""
        return self.rig.plant.names()[0]

    @property
    def bare(self) -> str:
        """Symbol of that without added masses: ``m_0`` or ``J_0``."""
        return self.inertia.replace("1", "0")

    @property
    def unit(self) -> str:
        """Unit of the inertia."""
        return self.rig.plant.quantity(self.inertia).unit


@dataclass(frozen=True, kw_only=True)
class Mounted:
    """What the later experiments add to the body that experiment 1a weighed: 500 g masses, and what a drawing tells.

    `each` is the nominal inertia of one mass, `rest` that of all else, `rest_error` its standard error
    [kg or kg m^2]; `bare` says how the body is freed to be weighed, `later` begins a sentence on how it is used.
    """

    pieces: int
    each: float
    rest: float = 0.0
    rest_error: float = 0.0
    bare: str
    later: str


@dataclass(frozen=True, kw_only=True)
class Make:
    """A rig as designed, and what the course asks of it before it is measured.

    Attributes
    ----------
    key : str
        As commands call it.
    stream : int
        Number of its own in the seeds of its rigs.
    rig : Rig
        As designed; 4.884 V is what the vendor's program lets through in its exported logs.
    pendulum : BrassPendulum or None
        What it carries.
    shaft : str
        3: make of the rig without its pendulum, a second inertia on the shaft instead.
    body, on_spring, mounted : str, BodyOnSpring, Mounted
        1a: inertia that is weighed, the body on its spring, what the later experiments add to it.
    band : (float, float)
        1b: excited frequencies [rad/s]; below, dry friction holds the rig; above, it hardly moves.
    reach, fastest : tuple of float
        1b: requested amplitude of each coordinate [m or rad], the pendulum nearly linear, carts clear of their stops;
        and the speed it may not exceed: an arm whose mean square speed comes near g/l flings its hanging pendulum out.
    bench : mapping of str to float
        1b: what is weighed, balanced on an edge or ruled, and how well (relative standard deviation).
    sought : tuple of str
        1b: what the response is to tell.
    start : (float, float)
        2: tilt [rad] and speed [rad/s] with which a clumsy hand lets the pendulum go.
    pulse : float
        3: size of the pulses that identify the shaft [V].
    push, anchor : float
        4: speed that a careless hand gives the freed body [m/s or rad/s]; stiffness of a soft spring that keeps it
        home [N/m or N m/rad].
    """

    key: str
    stream: int
    rig: Rig
    pendulum: BrassPendulum | None
    shaft: str
    body: str
    on_spring: BodyOnSpring
    mounted: Mounted
    band: tuple[float, float]
    reach: tuple[float, float]
    fastest: tuple[float, float]
    bench: Mapping[str, float]
    sought: tuple[str, ...]
    start: tuple[float, float]
    pulse: float
    push: float
    anchor: float

    @property
    def vendor(self) -> str:
        """Whose rig it is, as studies name the data sheet."""
        return next(v for v in VENDORS if self.rig.name.startswith(v))

    @property
    def plant_name(self) -> str:
        """As studies call the plant."""
        return name_of(type(self.rig.plant))

    @property
    def gain_unit(self) -> str:
        """Unit of the drive's gain."""
        return f"{self.rig.plant.inputs[0].unit}/V"


def _rig(name: str, rig: Mapping[str, Any], plant: Mapping[str, Any], **more: float) -> Rig:
    """A rig as designed, in the words of `Rig.known`; what every ECP has alike is not in its file."""
    numbers = {n: v for n, v in plant.items() if n != "kind"}
    kind: Any = find(plant["kind"])
    built = kind(**numbers, **{n: v for n, v in more.items() if n in kind.names()})
    return Rig.known(built, name=name, converter=CONVERTER, delay=SERVO, lag=LAG, period=SERVO, **rig)


def _si(entry: Any) -> Any:
    """Numbers in SI of texts with their units, in lists and tables too."""
    if isinstance(entry, Mapping):
        return {n: _si(v) for n, v in entry.items()}
    if isinstance(entry, list):
        return tuple(_si(v) for v in entry)
    return parse(entry) if isinstance(entry, str) else entry


def _piece(table: Mapping[str, Any]) -> float:
    """Inertia that a 500 g mass adds: itself to a cart, at its bolt circle to a disk."""
    return added_inertia(1, parse(table["radius"]), mass_radius=MASS_RADIUS) if "radius" in table else added_mass(1)


def _body(key: Any, table: Mapping[str, Any]) -> BodyOnSpring:
    rig = _rig(f"a {key} rig", table["rig"], table["plant"])
    return BodyOnSpring(
        kind=key, rig=rig, step=parse(table["step"]), piece=_piece(table), tolerance=parse(table["tolerance"])
    )


def _make(key: str, content: Mapping[str, Any]) -> Make:
    response, w = content["frequency"], content["weighing"]
    pendulum = BrassPendulum(**_si(content["pendulum"])) if "pendulum" in content else None
    known = pendulum.parameters() if pendulum else {}
    later: dict[str, Any] = {"pulse": 0.0, "push": 0.0, "anchor": 0.0, "start": (0.0, 0.0)}
    for part in ("regulation", "tracking", "free_swing"):
        later |= _si(content.get(part, {}))
    return Make(
        key=key, stream=content["stream"], rig=_rig(content["name"], content["rig"], content["plant"], **known),
        pendulum=pendulum, shaft=content["shaft"], body=w["body"], on_spring=BODIES[content["shaft"]],
        mounted=Mounted(
            pieces=w["pieces"], each=_piece(w), rest=_si(w.get("rest", 0.0)), rest_error=_si(w.get("rest_error", 0.0)),
            bare=w["bare"], later=w["later"],
        ),
        band=_si(response["band"]), reach=_si(response["reach"]),
        fastest=_si(response.get("fastest", [math.inf, math.inf])),
        bench=_si(response["bench"]), sought=tuple(response["sought"]), **later,
    )  # fmt: skip


_FILES = {
    key: tomllib.loads((Path(__file__).parent / "models" / f"{key}.toml").read_text(encoding="utf-8"))
    for key in ("furuta", "linear", "rectilinear", "torsional")
}
BODIES = {key: _body(key, content["on_spring"]) for key, content in _FILES.items() if "on_spring" in content}
"""Bodies on a spring by their kind."""
MAKES: Mapping[str, Make] = {key: _make(key, content) for key, content in _FILES.items()}
"""The makes by key, the paper's own first."""
PENDULUMS = tuple(key for key, make in MAKES.items() if make.pendulum)
"""Makes that swing and are held upright."""
SHAFTS = tuple(key for key, make in MAKES.items() if not make.pendulum)
"""Makes with two inertias on a shaft."""
NOMINAL = cast("Furuta", MAKES["furuta"].rig.plant).replace(b_1=6e-4, b_1c=1.5e-3)
"""The Furuta pendulum as designed, its drive belt off."""


def make_named(key: str | None, *, option: str = "--rig") -> Make:
    """Make that an option of the command line names; `BadInput` where there is none."""
    if key is None or key not in MAKES:
        raise BadInput(f"{option} names a rig model, and '{key}' is none; {nearest(key or '', MAKES)}")
    return MAKES[key]


def make_of(plant: Plant, refusal: str = "") -> Make:
    """Make whose plant this is; where none has such a plant, `BadInput` says so, or the `refusal`."""
    for make in MAKES.values():
        if isinstance(plant, type(make.rig.plant)):
            return make
    raise BadInput(refusal or f"none of the rig models {', '.join(MAKES)} is a {type(plant).__name__}.")


def make_of_rig(rig: Rig) -> Make:
    """The make whose plant a rig has.

    Raises
    ------
    BadInput
        When none of the makes has such a plant.
    """
    return make_of(
        rig.plant,
        f"none of the rig models {', '.join(MAKES)} is a '{rig.name}'; its drive and encoders are not known, so design "
        "for it (upright design) and simulate with up.simulate.",
    )


def make_of_vendor(vendor: str | None, plant: Plant) -> Make | None:
    """Make of a vendor that has this plant, None where he has none, or none was named."""
    return next((m for m in MAKES.values() if m.vendor == vendor and type(m.rig.plant) is type(plant)), None)


def sheet(vendor: str, plant: Plant, unit: str = "V") -> dict[str, Entry]:
    """What a vendor's data sheet says of drive, encoders and servo of a rig with this plant, commanded in `unit`."""
    source = f"data sheet of the {vendor}"
    make = make_of_vendor(vendor, plant)
    per = {"rad": (float(COUNTS), "1/rev")} | ({"m": (PER_METRE, "1/m")} if vendor == "ECP 210" else {})
    numbers = {f"counts.{c.name}": per[c.unit] for c in plant.coordinates if c.unit in per}
    numbers |= {"servo_period": (SERVO, "s"), "delay": (SERVO, "s"), "lag": (LAG, "s")}
    if unit in ("", "V"):
        numbers |= {"converter": (CONVERTER, "V")} | ({"limit": (make.rig.limit, "V")} if make else {})
    far = () if make is None else (("travel", make.rig.travel), ("twist", make.rig.twist))
    numbers |= {name: (value, driven_unit(type(plant))) for name, value in far if math.isfinite(value)}
    return {name: Entry(value=value, unit=unit, source=source) for name, (value, unit) in numbers.items()}


def hardware_of_make(rig: Rig) -> Hardware:
    """What a fit of a make's rig says of it: name and vendor; the data sheet is that of the make."""
    return Hardware(name=of_twin(rig.name, rig.seed).rig, vendor=make_of(rig.plant).vendor)


def make_rig(key: str, seed: int = 0) -> Rig:
    """A rig of a make.

    Inertias differ by two percent, springs by four, an arm by one, friction by a seventh, the drive's gain by two; of a
    pendulum the rod's length by one, its weight by two in thickness and place; seed 0 is the rig as designed.

    Raises
    ------
    BadInput
        When there is no such make.
    """
    if key not in MAKES:
        raise BadInput(f"there is no rig model '{key}'; take one of {', '.join(MAKES)}.")
    make = MAKES[key]
    rig = make.rig
    if not seed:
        return rig
    rng = np.random.default_rng([seed, 41, make.stream])
    changed: dict[str, float] = {}
    if make.pendulum:
        parts = replace(
            make.pendulum,
            length=make.pendulum.length * rng.normal(1, 0.01),
            weight_thickness=make.pendulum.weight_thickness * rng.normal(1, 0.02),
            weight_at=make.pendulum.weight_at * rng.normal(1, 0.02),
        )
        changed = {n: v for n, v in parts.parameters().items() if n in rig.plant.names()}
    for name, value in rig.plant.parameters().items():
        spread = _SPREAD.get(name[0], 0.0)
        if value and name not in changed and name != "g":
            changed[name] = value * math.exp(rng.normal(0, spread))
    return replace(rig.changed(**changed), gain=rig.gain * math.exp(rng.normal(0, 0.02)), seed=seed)


def check_radius(radius: float) -> float:
    """Radius of a bolt circle [m], as it came.

    Raises
    ------
    BadInput
        When no disk has it.
    """
    if not 0 < radius <= WIDEST:
        raise BadInput(
            f"a bolt circle has a radius above 0 and up to {100 * WIDEST:g} cm, got {100 * radius:g} cm; those of an"
            " ECP 205 have 2 to 9 cm."
        )
    return radius
