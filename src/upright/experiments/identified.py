"""A rig as an identification leaves it known: numbers of a fit.json or a study, and what else the covariance allows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from upright.control.trial import ServoRig
from upright.errors import BadInput, ImpossiblePhysics
from upright.experiments.makes import MAKES, Make, make_of, make_rig
from upright.physics import Linear, Plant, find
from upright.records import Array
from upright.study.fitted import FittedModel, read_fit
from upright.study.rig import read_plant, read_rig
from upright.study.sensors import drive_unit
from upright.study.text import StudyText
from upright.trust import before_running

GAIN = "actuator.gain"
DAILY = 0.13
"""Relative spread of dry friction from one run to the next, as between two runs of one day on an ECP 205."""


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
    """

    plant: Plant
    name: str
    gain: float
    unit: str
    delay: float = 0.0
    lag: float = 0.0
    draws: tuple[tuple[Plant, float], ...] = ()

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

    def linear(self, at: str) -> Linear:
        """Model about an equilibrium, from the command to the coordinates."""
        return _driven(self.plant, self.gain, at)

    def spread(self, at: str) -> list[Linear]:
        """The same for the draws."""
        return [_driven(plant, gain, at) for plant, gain in self.draws]

    def rig(self, said: ServoRig | None = None) -> ServoRig:
        """The rig as identified, with drive and encoders as said in its data sheet.

        Dry friction, delay and lag that the fit leaves at zero are taken as said, too: nobody's rig is without.

        Parameters
        ----------
        said : ServoRig, optional
            The make's own as designed when omitted.
        """
        said = said or make_rig(self.make.key)
        dry = [n for n in ("b_1c", "b_2c") if n in self.plant.names()]
        plant = self.plant
        if dry and not any(getattr(plant, n) for n in dry):
            plant = plant.replace(**{n: getattr(said.plant, n) for n in dry})
        return replace(
            said, plant=plant, gain=self.gain, unit=self.unit or said.unit, delay=self.delay or said.delay,
            lag=self.lag or said.lag, scales=(),
        )  # fmt: skip

    def allowed(self, rig: ServoRig, lanes: int, seed: int) -> Mapping[str, Array]:
        """Parameters of `lanes` rigs that the fit's covariance allows, dry friction as it may be on the day.

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
        for name in ("b_1c", "b_2c"):
            if name in rig.plant.names() and getattr(rig.plant, name):
                today = np.exp(rng.normal(0, DAILY, lanes))
                out[name] = today * out.get(name, np.full(lanes, getattr(rig.plant, name)))
        return out


def _driven(plant: Plant, gain: float, at: str) -> Linear:
    model = plant.linear(at)
    return replace(model, B=model.B * gain)


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


def _from_study(path: Path) -> IdentifiedRig:
    study = StudyText(path).root()
    kind, unit = read_plant(study), drive_unit(study)
    values = {n: p.value for n, p in read_rig(study, kind, unit).parameters.items()}
    plant = kind(**{n: values[n] for n in kind.names()})
    return _with_drive(plant, study.section("rig").text_of("plant", "furuta"), values, unit or _force(kind))


def _force(kind: type[Plant]) -> str:
    return kind.inputs[0].unit if kind.inputs else ""


def _from_fit(path: Path, seed: int, draws: int) -> IdentifiedRig:
    fitted = read_fit(path)
    before_running(fitted.plant, path)
    kind = find(fitted.plant, path.parent)
    try:
        plant = kind(**{n: v for n, v in fitted.values.items() if n in kind.names()})
    except TypeError:
        raise BadInput(f"{path} does not hold every parameter of '{fitted.plant}'; identify again.") from None
    per, force = fitted.unit(GAIN), _force(kind)
    unit = per.rpartition("/")[2].strip("()") if "/" in per and per != force else force
    known = _with_drive(plant, fitted.plant, fitted.values, unit)
    return replace(known, draws=tuple(_drawn(fitted, plant, known.gain, seed, draws)))


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
