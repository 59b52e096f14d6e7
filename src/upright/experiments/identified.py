"""A rig as an identification leaves it known: numbers of a fit.json or a study, and what else the covariance allows."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from upright.basis import DESCRIBED, Basis
from upright.control.trial import GAIN, ServoRig, driven
from upright.errors import BadInput, ImpossiblePhysics
from upright.experiments.makes import MAKES, Make, make_of, make_rig, sheet
from upright.physics import Plant, find, name_of
from upright.physics.actuator import ACTUATOR
from upright.records import Array
from upright.records.record import of_twin
from upright.report.page import Table
from upright.study.description import (
    Entry,
    RigDescription,
    check_vendor,
    meaning_of,
    read_description,
    turn_of,
)
from upright.study.fitted import FittedModel, read_fit
from upright.study.load import Study
from upright.study.rig import read_plant, read_rig
from upright.study.sensors import drive_unit
from upright.study.text import StudyText, number
from upright.systems import StateSpace
from upright.trust import before_running

MORE = ACTUATOR.keys() - {f"actuator.{n}" for n in ("gain", "limit", "delay", "lag", "offset", "start", "end")}
"""Numbers of the drive that nothing else of a `ServoRig` tells."""
DAILY = 0.13
"""Relative spread of dry friction from one run to the next, as between two runs of one day on an ECP 205."""
EXCESS = 0.5
"""Most by which friction close to rest exceeds sliding friction (Stribeck), as a share of that."""
STRIBECK_SPEEDS = {"rad": (0.05, 0.5), "m": (0.005, 0.05)}
"""Speeds between which that excess fades [rad/s or m/s]: a hundredth to a tenth of those of an identification."""


@dataclass(frozen=True, kw_only=True)
class IdentifiedRig:
    """A plant with its numbers, what a unit of command does, and other sets of numbers that the fit allows as well.

    Attributes
    ----------
    plant : Plant
    name : str
        As files call the plant.
    gain : float
        Force per unit of command.
    unit : str
        Of the command.
    delay : float
        Of the drive [s].
    lag : float
        Time constant of the drive [s], which the linear model leaves out.
    draws : tuple of (Plant, float)
        Plants and gains drawn from the fit's covariance; empty without one.
    description : RigDescription
        Drive, encoders and servo, as far as fit or study says.
    basis : Basis
        The fit's own verdict, or that there is no fit.
    """

    plant: Plant
    name: str
    gain: float
    unit: str
    delay: float = 0.0
    lag: float = 0.0
    draws: tuple[tuple[Plant, float], ...] = ()
    description: RigDescription = field(default_factory=RigDescription)
    basis: Basis = DESCRIBED

    @property
    def make(self) -> Make:
        """The make whose plant this is.

        Raises
        ------
        BadInput
            When none of the makes has such a plant.
        """
        return make_of(
            self.plant,
            f"none of the makes {', '.join(MAKES)} is a '{self.name}'; its drive and encoders are not known, so design "
            "for it (upright design) and simulate with control.ServoRig.",
        )

    @property
    def more(self) -> Mapping[str, float]:
        """What else the drive does, besides gain, limit, delay, lag and offset."""
        return {f"actuator.{n}": e.value for n, e in self.description.entries.items() if f"actuator.{n}" in MORE}

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
        """Model about an equilibrium, from the command to the coordinates; see `linearize`."""
        return driven(self.plant, {**self.more, GAIN: self.gain}, at, side=side)

    def spread(self, at: str) -> list[StateSpace]:
        """The same for the draws."""
        return [driven(plant, {**self.more, GAIN: gain}, at) for plant, gain in self.draws]

    def described(
        self, given: Mapping[str, Entry | None] | None = None, *, vendor: str = "",
        needs: Collection[str] = ("limit", "servo_period", "counts"), who: str = "a simulation",
        form: str = "--{} {}",
    ) -> RigDescription:  # fmt: skip
        """What is known of drive, encoders and servo: what a call gives, what the fit says, the data sheet named.

        Parameters
        ----------
        given : mapping of str to Entry, optional
            Options of the command line; None is none.
        vendor : str, optional
            Data sheet chosen by name; the fit's own choice when empty.
        needs : collection of str
            What may not be missing; ``"counts"`` is those of every encoder.
        who : str
            Verb that asks.
        form : str
            How its caller gives a number by name: an option, an argument ``"{}={}"``; empty where only files say it.

        Raises
        ------
        BadInput
            When something is missing, with the options and keys that say it.
        """
        chosen = check_vendor(vendor or self.description.vendor)
        said = replace(self.description, vendor=chosen).given(given or {})
        if chosen:
            said = said.over(sheet(chosen, self.plant, self.unit))
        counts = {f"counts.{c.name}": form.format("counts", 4096) for c in self.plant.coordinates}
        options = {"limit": "10", "servo_period": '"2 ms"', "travel": "0.2"}
        options = {n: form.format(n.removeprefix("servo_"), value) for n, value in options.items()}
        wanted = {n: w for n, w in options.items() if n in needs} | (counts if "counts" in needs else {})
        said.demand(wanted, who, sheet=form.format("vendor", "NAME") or 'vendor = "NAME" in RIG.toml')
        if "delay" not in said.entries and "servo_period" in said.entries:
            late = Entry(value=said.entries["servo_period"].value, unit="s", source="assumed: one servo period")
            said = said.given({"delay": late})
        return said

    def rig(self, said: RigDescription | None = None) -> ServoRig:
        """The rig as identified, with the drive and encoders that are described.

        Where a vendor's data sheet was chosen, dry friction that the fit leaves at zero is that of his rig as designed.

        Parameters
        ----------
        said : RigDescription, optional
            As `described` gives it.
        """
        said = said or self.described()
        make = self.made_by(said.vendor)
        return ServoRig(
            name=make.name if make else said.name or self.name, plant=self._with_friction(make), gain=self.gain,
            limit=said.entries["limit"].value, converter=said.value("converter", 0.0),
            delay=said.entries["delay"].value, lag=said.value("lag", 0.0), offset=said.value("offset", 0.0),
            unit=self.unit or "V",
            counts=tuple(said.entries[f"counts.{c.name}"].value / turn_of(c.unit) for c in self.plant.coordinates),
            period=said.entries["servo_period"].value, travel=said.value("travel", math.inf),
            speed_limit=said.value("speed_limit", math.inf), twist=said.value("twist", math.inf), more=self.more,
            basis=self.basis,
        )  # fmt: skip

    def twin(self, rig: ServoRig, said: RigDescription, seed: int) -> ServoRig:
        """Another rig to run on: one of the vendor's make, or, of a rig of one's own, one that the covariance allows.

        Raises
        ------
        BadInput
            When there is neither.
        """
        make = self.made_by(said.vendor)
        if make is not None:
            return make_rig(make.key, seed)
        if not self.draws:
            raise BadInput(
                "a rig to run on is drawn from the fit's covariance, and this fit has none; give no seed, or "
                "identify the rig from its logs (upright identify)."
            )
        plant, gain = self.draws[int(np.random.default_rng([seed, 59]).integers(len(self.draws)))]
        return replace(rig, plant=plant, gain=gain, seed=seed, name=f"a rig that the fit of {rig.name} allows")

    def doubts(self, said: RigDescription, truth: ServoRig | None = None) -> tuple[str, ...]:
        """What of the description is somebody else's or assumed, and whether what runs is another rig."""
        out: list[str] = []
        sheets = [n for n, e in said.entries.items() if e.source.startswith("data sheet")]
        if sheets:
            out.append(f"From the data sheet of the {said.vendor}, not said of this rig: {_list(sheets)}.")
        make = self.made_by(said.vendor)
        if make is not None and self._with_friction(make) != self.plant:
            out.append(f"The fit knows no dry friction; simulations have that of the {make.name} as designed.")
        assumed = [n for n, e in said.entries.items() if e.source.startswith("assumed")]
        if assumed:
            out.append(f"Assumed, not measured: {_list(assumed)}.")
        ran = "" if truth is None else of_twin(truth.name, truth.seed).rig
        if make is not None and truth is not None and said.name and said.name != ran:
            out.append(f"The fit is of another rig ({said.name}) than the one that runs ({ran}).")
        return tuple(out)

    def made_by(self, vendor: str) -> Make | None:
        """Make of the vendor that has this plant, None where he has none, or none was chosen."""
        of_his = (m for m in MAKES.values() if m.vendor == vendor and type(m.plant) is type(self.plant))
        return next(of_his, None)

    def _with_friction(self, make: Make | None) -> Plant:
        dry = [n for n in ("b_1c", "b_2c") if n in self.plant.names()]
        if make is None or not dry or any(getattr(self.plant, n) for n in dry):
            return self.plant
        return self.plant.replace(**{n: getattr(make.plant, n) for n in dry})

    def allowed(self, rig: ServoRig, lanes: int, seed: int) -> Mapping[str, Array]:
        """Parameters of `lanes` rigs that the fit allows: numbers, friction close to rest, dry friction of the day.

        Parameters
        ----------
        rig : ServoRig
            As `rig` gives it; without draws its friction alone varies.
        lanes : int
        seed : int
        """
        rng = np.random.default_rng([seed, 53])
        out: dict[str, Array] = {}
        if self.draws:
            rows = [self.draws[i % len(self.draws)] for i in range(lanes)]
            drawn = {n: np.array([getattr(plant, n) for plant, _ in rows]) for n in rig.plant.names()}
            drawn[GAIN] = np.array([gain for _, gain in rows])
            out = {name: values for name, values in drawn.items() if np.ptp(values) > 0}
        return of_the_day(rig.plant, close_to_rest(rig.plant, out, rng, lanes), rng, lanes)


def close_to_rest(
    plant: Plant, others: Mapping[str, Array], rng: np.random.Generator, lanes: int
) -> Mapping[str, Array]:  # fmt: skip
    """The same rigs with the friction that they may have close to rest, of which a fit of sliding friction is blind.

    A fit that knows of a break-away level says itself what it is.
    """
    units = {c.name: c.unit for c in plant.coordinates}
    out = dict(others)
    for joint in plant.joints:
        names = (joint.coulomb, joint.stiction, joint.stribeck_speed)
        sliding, known = (getattr(plant, n) if n else 0.0 for n in names[:2])
        if not all(names) or not sliding or known:
            continue
        low, high = STRIBECK_SPEEDS[units.get(joint.on, "rad")]
        excess = rng.uniform(0.0, EXCESS, lanes)
        out[joint.stiction] = (1 + excess) * out.get(joint.coulomb, np.full(lanes, sliding))
        out[joint.stribeck_speed] = np.exp(rng.uniform(math.log(low), math.log(high), lanes))
    return out


def of_the_day(
    plant: Plant, others: Mapping[str, Array], rng: np.random.Generator, lanes: int
) -> Mapping[str, Array]:  # fmt: skip
    """The same rigs, each joint with the dry friction of its day, close to rest as well as sliding."""
    out = dict(others)
    for joint in plant.joints:
        names = [n for n in (joint.coulomb, joint.stiction) if n and (n in out or getattr(plant, n))]
        today = np.exp(rng.normal(0, DAILY, lanes)) if names else np.ones(lanes)
        out |= {n: today * out.get(n, np.full(lanes, getattr(plant, n))) for n in names}
    return out


def _list(names: Sequence[str]) -> str:
    return ", ".join(meaning_of(n) for n in names)


def rig_table(said: RigDescription) -> Table:
    """Drive, encoders and servo with what each number rests on."""
    told = {n: e for n, e in said.entries.items() if not n.startswith(("sign.", "offset."))}
    return Table(
        caption="The rig as it is described", headings=("", "value", "from"),
        rows=tuple((meaning_of(n), number(e.value, e.unit, 6), e.source)
                   for n, e in told.items()), numbers=(1,),
    )  # fmt: skip


def read_identified(path: Path, *, seed: int = 0, draws: int = 200) -> IdentifiedRig:
    """ServoRig of a `fit.json` (or the folder that holds it), or of a study, whose guesses then count as its numbers.

    Raises
    ------
    BadInput
        When it is neither.
    """
    path = path / "fit.json" if path.is_dir() else path
    if not path.exists():
        raise BadInput(f"{path} does not exist; name the fit.json of `upright identify`, or a study with its numbers.")
    return _from_fit(path, seed, draws) if path.suffix == ".json" else _from_study(path)


def rig_of_study(study: Study) -> IdentifiedRig:
    """The rig of a study, its guesses counting as its numbers."""
    kind = study.rig.plant
    values = {n: p.value for n, p in study.rig.parameters.items()}
    plant = kind(**{n: values[n] for n in kind.names()})
    gain = study.rig.parameters.get(GAIN)
    known = _with_drive(plant, study.plant, values, _command_unit("" if gain is None else gain.unit, kind))
    return replace(known, description=study.description)


def rig_of_plant(plant: Plant) -> IdentifiedRig:
    """A plant with the numbers that somebody gave, its command being its force."""
    return _with_drive(plant, name_of(type(plant)) or type(plant).__name__, {}, _force(type(plant)))


def _from_study(path: Path) -> IdentifiedRig:
    study = StudyText(path).root()
    kind, unit = read_plant(study), drive_unit(study)
    rig = read_rig(study, kind, unit)
    values = {n: p.value for n, p in rig.parameters.items()}
    plant = kind(**{n: values[n] for n in kind.names()})
    known = _with_drive(plant, study.section("rig").text_of("plant", "furuta"), values, unit or _force(kind))
    return replace(known, description=read_description(study, kind, rig))


def _force(kind: type[Plant]) -> str:
    return kind.inputs[0].unit if kind.inputs else ""


def _from_fit(path: Path, seed: int, draws: int) -> IdentifiedRig:
    fitted = read_fit(path)
    before_running(fitted.plant, path)
    return rig_of_fit(fitted, find(fitted.plant, path.parent), seed=seed, draws=draws)


def rig_of_fit(fitted: FittedModel, kind: type[Plant], *, seed: int = 0, draws: int = 200) -> IdentifiedRig:
    """The rig of a fit of a plant of this kind, and rigs drawn from its covariance.

    Raises
    ------
    BadInput
        When a parameter of the plant is missing.
    """
    try:
        plant = kind(**{n: v for n, v in fitted.values.items() if n in kind.names()})
    except TypeError:
        raise BadInput(f"the fit does not hold every parameter of '{fitted.plant}'; identify again.") from None
    known = _with_drive(plant, fitted.plant, fitted.values, _command_unit(fitted.unit(GAIN), kind))
    known = replace(known, description=fitted.description, basis=fitted.basis)
    return replace(known, draws=tuple(_drawn(fitted, plant, known.gain, seed, draws)))


def _command_unit(per: str, kind: type[Plant]) -> str:
    """Unit of the command from that of the drive's gain, ``N m/V``."""
    force = _force(kind)
    return per.rpartition("/")[2].strip("()") if "/" in per and per != force else force


def _with_drive(plant: Plant, name: str, values: Mapping[str, float], unit: str) -> IdentifiedRig:
    return IdentifiedRig(
        plant=plant, name=name, gain=values.get(GAIN, 1.0), unit=unit, delay=values.get("actuator.delay", 0.0),
        lag=values.get("actuator.lag", 0.0),
    )  # fmt: skip


def _drawn(fitted: FittedModel, plant: Plant, gain: float, seed: int, draws: int) -> list[tuple[Plant, float]]:
    """Sets of numbers as the fit's standard errors and correlations scatter them; impossible ones are left out."""
    names, covariance = fitted.covariance((*plant.names(), GAIN))
    if not covariance.any():
        return []
    size, axes = np.linalg.eigh(covariance)
    rng = np.random.default_rng([seed, 17])
    moves = rng.normal(size=(draws, len(names))) * np.sqrt(np.maximum(size, 0.0)) @ axes.T
    out: list[tuple[Plant, float]] = []
    for move in moves.tolist():
        change = dict(zip(names, move, strict=True))
        moved = gain + change.pop(GAIN, 0.0)
        try:
            out.append((plant.replace(**{n: getattr(plant, n) + d for n, d in change.items()}), moved))
        except ImpossiblePhysics:
            continue
    return out
