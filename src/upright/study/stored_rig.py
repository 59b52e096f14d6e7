"""The rig that a fit.json or a study tells of, and other sets of numbers that the fit's covariance allows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from upright.errors import BadInput, ImpossiblePhysics
from upright.identification import GreyBox, Parameter
from upright.physics import Plant, find, name_of
from upright.rig import Hardware, Rig
from upright.rig.drive import GAIN
from upright.rig.hardware import DRIVE_SIGN
from upright.study.description import read_hardware
from upright.study.fitted import FittedModel, read_fit
from upright.study.rig import read_plant, read_rig
from upright.study.sensors import drive_unit
from upright.study.text import StudyText
from upright.trust import before_running


def read_stored_rig(path: Path, *, seed: int = 0, draws: int = 200) -> Rig:
    """Rig of a `fit.json` (or the folder that holds it), or of a study, whose guesses then count as its numbers.

    Raises
    ------
    BadInput
        When it is neither.
    """
    path = path / "fit.json" if path.is_dir() else path
    if not path.exists():
        raise BadInput(f"{path} does not exist; name the fit.json of `upright identify`, or a study with its numbers.")
    return _from_fit(path, seed, draws) if path.suffix == ".json" else _from_study(path)


def rig_with_guesses(model: GreyBox, name: str, hardware: Hardware) -> Rig:
    """The rig of a study's model, its guesses counting as its numbers."""
    kind = model.plant
    values = {n: p.value for n, p in model.parameters.items()}
    plant = kind(**{n: values[n] for n in kind.names()})
    gain = model.parameters.get(GAIN)
    unit = _command_unit("" if gain is None else gain.unit, kind)
    sources = {n: _source(model.parameters[n]) for n in (*kind.names(), GAIN) if n in model.parameters}
    return replace(_with_drive(plant, name, values, unit, hardware), sources=sources)


def _source(p: Parameter) -> str:
    return "guessed" if p.estimate else "assumed" if p.assumed else "known"


def rig_of_plant(plant: Plant) -> Rig:
    """A plant with the numbers that somebody gave, its command being its force."""
    return Rig(plant=plant, name=name_of(type(plant)) or type(plant).__name__, unit=_force(type(plant)))


def rig_of_fit(fitted: FittedModel, kind: type[Plant], *, seed: int = 0, draws: int = 200) -> Rig:
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
    unit = _command_unit(fitted.unit(GAIN), kind)
    known = _with_drive(plant, fitted.plant, fitted.values, unit, fitted.hardware)
    sources = {n: fitted.source(n) for n in (*kind.names(), GAIN) if n in fitted.values}
    return replace(known, basis=fitted.basis, sources=sources, draws=tuple(_drawn(fitted, plant, seed, draws)))


def _from_study(path: Path) -> Rig:
    study = StudyText(path).root()
    kind, unit = read_plant(study), drive_unit(study)
    model = read_rig(study, kind, unit)
    values = {n: p.value for n, p in model.parameters.items()}
    plant = kind(**{n: values[n] for n in kind.names()})
    name = study.section("rig").text_of("plant", "furuta")
    return _with_drive(plant, name, values, unit or _force(kind), read_hardware(study, kind, model))


def _force(kind: type[Plant]) -> str:
    return kind.inputs[0].unit if kind.inputs else ""


def _from_fit(path: Path, seed: int, draws: int) -> Rig:
    fitted = read_fit(path)
    before_running(fitted.plant, path)
    return rig_of_fit(fitted, find(fitted.plant, path.parent), seed=seed, draws=draws)


def _command_unit(per: str, kind: type[Plant]) -> str:
    """Unit of the command from that of the drive's gain, ``N m/V``."""
    force = _force(kind)
    return per.rpartition("/")[2].strip("()") if "/" in per and per != force else force


def _with_drive(plant: Plant, name: str, values: Mapping[str, float], unit: str, hardware: Hardware) -> Rig:
    """A rig whose commands are those of its log; a study turns the log's where its drive has a sign."""
    sign, as_commanded = hardware.as_commanded()
    return Rig(plant=plant, name=name, gain=sign * values.get(GAIN, 1.0), unit=unit, hardware=as_commanded)


def _drawn(fitted: FittedModel, plant: Plant, seed: int, draws: int) -> list[tuple[Plant, float]]:
    """Sets of numbers as the fit's standard errors and correlations scatter them; impossible ones are left out."""
    names, covariance = fitted.covariance((*plant.names(), GAIN))
    if not covariance.any():
        return []
    size, axes = np.linalg.eigh(covariance)
    rng = np.random.default_rng([seed, 17])
    moves = rng.normal(size=(draws, len(names))) * np.sqrt(np.maximum(size, 0.0)) @ axes.T
    out: list[tuple[Plant, float]] = []
    gain, sign = fitted.values.get(GAIN, 1.0), fitted.hardware.value(DRIVE_SIGN, 1.0)
    for move in moves.tolist():
        change = dict(zip(names, move, strict=True))
        moved = sign * (gain + change.pop(GAIN, 0.0))
        try:
            out.append((plant.replace(**{n: getattr(plant, n) + d for n, d in change.items()}), moved))
        except ImpossiblePhysics:
            continue
    return out
