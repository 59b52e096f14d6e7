"""The makes of rigs of the laboratory: whatever an experiment knows of a rig before it is measured, in one table.

ECP 210 (rectilinear: two carts), ECP 205 (torsional: two disks), and both with the A51 pendulum (linear, furuta); every
seed is another rig of the same make. Sizes are those of the public guides where there are any; masses are chosen so
that the modes lie where the paper's tables put them: the pendulums' unstable pole near 7.98 rad/s, the flexible modes
near 27.1 rad/s. Nothing about the A51 is published, so its rod and weight are plausible brass parts from a shop.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from upright.errors import BadInput, nearest
from upright.physics import CartPendulum, Furuta, Plant, added_inertia, added_mass, chain, name_of
from upright.records.record import of_twin
from upright.rig.hardware import VENDORS, Entry, Hardware, driven_unit, turn_of
from upright.rig.rig import Rig

COUNTS = 16_000
"""Encoder counts per turn of every joint (ECP 205)."""
SERVO = 0.884e-3
"""Servo period of the ECP controller [s]; it logs every n-th sample."""
PER_TURN = COUNTS / (2 * math.pi)
"""Counts per radian."""
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

_BRASS = 8500.0  # kg/m^3
_SPREAD = {"m": 0.02, "J": 0.02, "k": 0.04, "r": 0.01, "b": 0.14, "c": 0.14, "f": 0.14}
_chain: Any = chain  # whose classes are made at run time
_ARM = 2.9e-4  # kg m^2, the arm that carries the pendulum, from its drawing


@dataclass(frozen=True, kw_only=True)
class BrassPendulum:
    """Hollow rod hinged at its end with a disk-shaped weight on it, all brass; lengths [m].

    `weight_at` is the distance from the hinge to the middle of the weight.
    """

    length: float = 0.330
    outer: float = 9.53e-3
    bore: float = 7.94e-3
    weight_diameter: float = 44e-3
    weight_thickness: float = 6e-3
    weight_at: float = 0.200

    def parameters(self) -> dict[str, float]:
        """Mass, centre of gravity, transverse and axial inertia by the names of `Furuta`, from solid geometry."""
        rod = _BRASS * math.pi / 4 * (self.outer**2 - self.bore**2) * self.length
        weight = _BRASS * math.pi / 4 * (self.weight_diameter**2 - self.outer**2) * self.weight_thickness
        m_p = rod + weight
        l_cg = (rod * self.length / 2 + weight * self.weight_at) / m_p
        rod_square, weight_square = self.outer**2 + self.bore**2, self.weight_diameter**2 + self.outer**2
        transverse_rod = rod * (self.length**2 / 12 + rod_square / 16 + (self.length / 2 - l_cg) ** 2)
        transverse_weight = weight * (self.weight_thickness**2 / 12 + weight_square / 16 + (self.weight_at - l_cg) ** 2)
        axial = (rod * rod_square + weight * weight_square) / 8
        return {"m_p": m_p, "l_cg": l_cg, "J_p": transverse_rod + transverse_weight, "J_a": axial}


NOMINAL = Furuta(
    **BrassPendulum().parameters(),
    r=0.150,
    J_d=7.2e-3,  # disk 2.5e-3, arm 0.5e-3, two 500 g masses at 6.5 cm 4.2e-3
    b_1=6e-4,  # drive belt off
    b_1c=1.5e-3,
    b_2=3e-5,
    b_2c=2.5e-4,
)
"""The Furuta pendulum as designed."""


@dataclass(frozen=True, kw_only=True)
class Oscillator:
    """One body on a spring to ground, as experiment 1a loads and steps it; friction holds it, encoders count.

    Attributes
    ----------
    kind : {"rectilinear", "torsional"}
    plant : Plant
        As designed, without added masses.
    counts, gain, limit : float
        Of encoder and drive: counts per m or rad, N or N m per V, largest command [V].
    step : float
        Command of a step [V].
    piece : float
        Inertia that one of the 500 g masses adds nominally [kg or kg m^2].
    tolerance : float
        Relative standard uncertainty of that.
    """

    kind: Literal["rectilinear", "torsional"]
    plant: Plant
    counts: float
    gain: float
    limit: float
    step: float
    piece: float
    tolerance: float

    @property
    def inertia(self) -> str:
        """Name of the body's inertia: ``m_1`` or ``J_1``."""
        return self.plant.names()[0]

    @property
    def bare(self) -> str:
        """Symbol of that without added masses: ``m_0`` or ``J_0``."""
        return self.inertia.replace("1", "0")

    @property
    def unit(self) -> str:
        """Unit of the inertia."""
        return self.plant.quantity(self.inertia).unit


OSCILLATORS = {
    o.kind: o
    for o in (
        # cart 1 of the ECP 210 between two springs of 195 N/m
        Oscillator(
            kind="rectilinear", plant=_chain(1, "rectilinear")(m_1=0.77, k_1=390.0, c_1=1.2, f_1c=0.2),
            counts=PER_METRE, gain=5.25, limit=5.0, step=1.0, piece=added_mass(1), tolerance=2e-3,
        ),
        # the lower disk of the ECP 205, 2.5e-3 kg m^2 and motor and belt, its shaft clamped above; the tolerance is
        # 0.2 % of the mass and 0.1 mm of the bolt circle
        Oscillator(
            kind="torsional", plant=_chain(1, "torsional")(J_1=3.0e-3, k_1=2.7, c_1=5e-3, f_1c=0.012),
            counts=PER_TURN, gain=0.65, limit=10.0, step=0.7,
            piece=added_inertia(1, 0.065, mass_radius=MASS_RADIUS), tolerance=4e-3,
        ),
    )
}  # fmt: skip
"""Bodies on a spring by their kind."""


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
    """What is known of a rig before it is measured.

    Attributes
    ----------
    key, name : str
        As commands and as reports call it.
    stream : int
        Number of its own in the seeds of its rigs.
    plant : Plant
        As designed.
    pendulum : BrassPendulum or None
        What it carries.
    gain, limit : float
        Of the drive: N or N m per V, largest command [V]; 4.884 V is what the vendor's program lets through in its
        exported logs.
    counts : tuple of float
        Encoder counts per m or rad.
    travel : float
        How far the driven body may go: rail, the pendulum's cable, stops of the carts [m or rad].
    body, oscillator, mounted : str, Oscillator, Mounted
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
    shaft : str
        3: make of the rig without its pendulum, a second inertia on the shaft instead.
    pulse, twist : float
        3: size of the pulses that identify the shaft [V]; distance of its ends at which it trips [rad].
    push, anchor : float
        4: speed that a careless hand gives the freed body [m/s or rad/s]; stiffness of a soft spring that keeps it
        home [N/m or N m/rad].
    """

    key: str
    name: str
    stream: int
    plant: Plant
    pendulum: BrassPendulum | None = None
    gain: float
    limit: float = 5.0
    counts: tuple[float, float]
    travel: float = math.inf
    body: str
    oscillator: Oscillator
    mounted: Mounted
    band: tuple[float, float]
    reach: tuple[float, float]
    fastest: tuple[float, float] = (math.inf, math.inf)
    bench: Mapping[str, float]
    sought: tuple[str, ...]
    start: tuple[float, float] = (0.0, 0.0)
    shaft: str
    pulse: float = 0.0
    twist: float = math.inf
    push: float = 0.0
    anchor: float = 0.0

    @property
    def vendor(self) -> str:
        """Whose rig it is, as studies name the data sheet."""
        return next(v for v in VENDORS if self.name.startswith(v))

    @property
    def plant_name(self) -> str:
        """As studies call the plant."""
        return name_of(type(self.plant))

    @property
    def gain_unit(self) -> str:
        """Unit of the drive's gain."""
        return f"{self.plant.inputs[0].unit}/V"


_ON_CART = BrassPendulum(weight_at=0.14)
_PENDULUM = ("J_p", "b_1", "b_2", "b_1c", "b_2c")
_SHAFT = ("k_12", "c_1", "c_2", "f_1c", "f_2c")

MAKES: Mapping[str, Make] = {
    make.key: make
    for make in (
        Make(
            key="furuta",
            name="ECP 205 + A51, Furuta pendulum",
            stream=1,
            shaft="torsional",
            plant=NOMINAL.replace(b_1=2e-3, b_1c=8e-3),  # drive belt on
            pendulum=BrassPendulum(),
            gain=0.65,
            counts=(PER_TURN, PER_TURN),
            travel=2 * math.pi,
            body="J_d",
            oscillator=OSCILLATORS["torsional"],
            mounted=Mounted(
                pieces=2,
                each=added_inertia(1, 0.060, mass_radius=MASS_RADIUS),
                rest=_ARM,
                rest_error=0.03 * _ARM,
                bare="Pendulum and arm are taken off, the shaft is clamped above; the disk swings with motor and belt.",
                later="With two 500 g masses at 6 cm and the arm (from its drawing) mounted, the disk of the pendulum "
                "has",
            ),
            band=(3.0, 35.0),
            reach=(0.6, 0.18),
            fastest=(3.0, math.inf),
            bench={"m_p": 2e-3, "l_cg": 3e-3, "r": 3e-3},
            sought=("J_d", *_PENDULUM),
            start=(math.radians(12), 2.2),
            push=0.15,
            anchor=0.04,  # on which the disk alone would swing at a third of the pendulum's frequency
        ),
        Make(
            key="linear",
            name="ECP 210 + A51, pendulum on a cart",
            stream=0,
            shaft="rectilinear",
            plant=CartPendulum(
                m_c=0.60,  # cart without its masses
                **{n: v for n, v in _ON_CART.parameters().items() if n != "J_a"},
                b_1=1.2,
                b_1c=0.25,
                b_2=3e-5,
                b_2c=2.5e-4,
            ),
            pendulum=_ON_CART,
            gain=5.25,
            counts=(PER_METRE, PER_TURN),
            travel=0.20,
            body="m_c",
            oscillator=OSCILLATORS["rectilinear"],
            mounted=Mounted(
                pieces=0,
                each=added_mass(1),
                bare="The pendulum is taken off; the cart swings between two springs to ground.",
                later="The cart carries the pendulum without masses on it:",
            ),
            band=(5.0, 45.0),
            reach=(0.025, 0.18),
            bench={"m_p": 2e-3, "l_cg": 3e-3},
            sought=("m_c", *_PENDULUM),
            start=(math.radians(12), 1.5),
            push=0.05,
            anchor=20.0,
        ),
        Make(
            key="rectilinear",
            name="ECP 210, two carts",
            stream=2,
            shaft="rectilinear",
            plant=_chain(2, "rectilinear")(m_1=1.10, m_2=1.07, k_12=398.0, c_1=2.2, c_2=2.0, f_1c=0.2, f_2c=0.1),
            gain=5.25,
            counts=(PER_METRE, PER_METRE),
            travel=0.03,
            body="m_1",
            oscillator=OSCILLATORS["rectilinear"],
            mounted=Mounted(
                pieces=1,
                each=added_mass(1),
                bare="Cart 2 is clamped; cart 1, its mass unbolted, swings on the spring between the two.",
                later="With one 500 g mass bolted on, as later, cart 1 has",
            ),
            band=(6.0, 70.0),
            reach=(0.02, 0.02),
            bench={"m_2": 3e-3},
            sought=("m_1", *_SHAFT),
            pulse=0.6,
        ),
        Make(
            key="torsional",
            name="ECP 205, two disks",
            stream=3,
            shaft="torsional",
            plant=_chain(2, "torsional")(
                J_1=7.8e-3, J_2=6.9e-3, k_12=2.7, c_1=1.2e-2, c_2=1.0e-2, f_1c=8e-3, f_2c=2e-3
            ),
            gain=0.65,
            limit=10.0,
            counts=(PER_TURN, PER_TURN),
            body="J_1",
            oscillator=OSCILLATORS["torsional"],
            mounted=Mounted(
                pieces=2,
                each=OSCILLATORS["torsional"].piece,
                bare="Disk 2 is clamped; disk 1, its masses unbolted, swings on the shaft between the two.",
                later="With two 500 g masses at 6.5 cm bolted on, as later, disk 1 has",
            ),
            band=(4.0, 70.0),
            reach=(0.4, 0.4),
            bench={"J_2": 1e-2},
            sought=("J_1", *_SHAFT),
            pulse=0.4,
            twist=math.radians(25),
        ),
    )
}
"""The makes by key, the paper's own first."""
PENDULUMS = tuple(key for key, make in MAKES.items() if make.pendulum)
"""Makes that swing and are held upright."""
SHAFTS = tuple(key for key, make in MAKES.items() if not make.pendulum)
"""Makes with two inertias on a shaft."""


def make_named(key: str, among: tuple[str, ...] = tuple(MAKES), *, option: str = "--rig") -> Make:
    """Make that an option of the command line names.

    Raises
    ------
    BadInput
        When it is none of those that are `among` the choices.
    """
    if key not in among:
        raise BadInput(f"{option} is one of {', '.join(among)}, got '{key}'; {nearest(key, among)}")
    return MAKES[key]


def make_of(plant: Plant, refusal: str = "") -> Make:
    """Make whose plant this is; where none has such a plant, `BadInput` says so, or the `refusal`."""
    for make in MAKES.values():
        if isinstance(plant, type(make.plant)):
            return make
    raise BadInput(refusal or f"none of the makes {', '.join(MAKES)} is a {type(plant).__name__}.")


def make_of_rig(rig: Rig) -> Make:
    """The make whose plant a rig has.

    Raises
    ------
    BadInput
        When none of the makes has such a plant.
    """
    return make_of(
        rig.plant,
        f"none of the makes {', '.join(MAKES)} is a '{rig.name}'; its drive and encoders are not known, so design "
        "for it (upright design) and simulate with up.simulate.",
    )


def make_of_vendor(vendor: str, plant: Plant) -> Make | None:
    """Make of a vendor that has this plant, None where he has none, or none was named."""
    return next((m for m in MAKES.values() if m.vendor == vendor and type(m.plant) is type(plant)), None)


def sheet(vendor: str, plant: Plant, unit: str = "V") -> dict[str, Entry]:
    """What a vendor's data sheet says of drive, encoders and servo of a rig with this plant, commanded in `unit`."""
    source = f"data sheet of the {vendor}"
    make = make_of_vendor(vendor, plant)
    per = {"rad": (float(COUNTS), "1/rev")} | ({"m": (PER_METRE, "1/m")} if vendor == "ECP 210" else {})
    numbers = {f"counts.{c.name}": per[c.unit] for c in plant.coordinates if c.unit in per}
    numbers |= {"servo_period": (SERVO, "s"), "delay": (SERVO, "s"), "lag": (LAG, "s")}
    if unit in ("", "V"):
        numbers |= {"converter": (CONVERTER, "V")} | ({"limit": (make.limit, "V")} if make else {})
    if make and math.isfinite(make.travel):
        numbers |= {"travel": (make.travel, driven_unit(type(plant)))}
    if make and math.isfinite(make.twist):
        numbers |= {"twist": (make.twist, driven_unit(type(plant)))}
    return {name: Entry(value=value, unit=unit, source=source) for name, (value, unit) in numbers.items()}


def hardware_of_make(rig: Rig) -> Hardware:
    """What a fit of a make's rig says of it: name and vendor; the data sheet is that of the make."""
    return Hardware(name=of_twin(rig.name, rig.seed).rig, vendor=make_of(rig.plant).vendor)


def make_rig(key: str, seed: int = 0) -> Rig:
    """A rig of a make.

    Inertias differ by two percent, springs by four, friction by a seventh, the drive's gain by two; seed 0 is the rig
    as designed.

    Raises
    ------
    BadInput
        When there is no such make.
    """
    if key not in MAKES:
        raise BadInput(f"there is no make '{key}'; take one of {', '.join(MAKES)}.")
    make = MAKES[key]
    plant, gain = make.plant, make.gain
    if seed:
        rng = np.random.default_rng([seed, 41, make.stream])
        changed: dict[str, float] = {}
        if make.pendulum:
            parts = BrassPendulum(
                length=make.pendulum.length * rng.normal(1, 0.01),
                weight_thickness=make.pendulum.weight_thickness * rng.normal(1, 0.02),
                weight_at=make.pendulum.weight_at * rng.normal(1, 0.02),
            )
            changed = {n: v for n, v in parts.parameters().items() if n in plant.names()}
        for name, value in plant.parameters().items():
            spread = _SPREAD.get(name[0], 0.0)
            if value and name not in changed and name != "g":
                changed[name] = value * math.exp(rng.normal(0, spread))
        plant = plant.replace(**changed)
        gain *= math.exp(rng.normal(0, 0.02))
    counts = [turn_of(c.unit) * n for c, n in zip(plant.coordinates, make.counts, strict=True)]
    known = Rig.known(
        plant, name=make.name, gain=gain, limit=make.limit, converter=CONVERTER, delay=SERVO, lag=LAG,
        counts=counts, period=SERVO, travel=make.travel, twist=make.twist,
    )  # fmt: skip
    return replace(known, seed=seed)


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
