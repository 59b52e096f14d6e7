"""Which rig is gain asked for? The numbers of a fit.json, or of a study, at another equilibrium than they came from."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from upright.errors import BadInput, ImpossiblePhysics
from upright.physics import Linear, Plant, find

GAIN = "actuator.gain"


@dataclass(frozen=True, kw_only=True)
class RigFile:
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
    late : float
        Delay of the drive [s].
    lag : float
        Time constant of the drive [s], which the linear model leaves out.
    others : tuple of (Plant, float)
        Plants and gains drawn from the fit's covariance; empty without one.
    """

    plant: Plant
    name: str
    gain: float
    unit: str
    late: float
    lag: float
    others: tuple[tuple[Plant, float], ...]

    def linear(self, at: str) -> Linear:
        """Model about an equilibrium, from the command to the coordinates."""
        return _driven(self.plant, self.gain, at)

    def spread(self, at: str) -> list[Linear]:
        """The same for the other sets of numbers."""
        return [_driven(plant, gain, at) for plant, gain in self.others]


def _driven(plant: Plant, gain: float, at: str) -> Linear:
    model = plant.linear(at)
    return replace(model, B=model.B * gain)


def read_rig_file(path: Path, *, seed: int = 0, draws: int = 200) -> RigFile:
    """Rig of a `fit.json` (or the folder that holds it), or of a study, whose guesses then count as its numbers.

    Raises
    ------
    BadInput
        When it is neither.
    """
    path = path / "fit.json" if path.is_dir() else path
    if not path.is_file():
        raise BadInput(f"{path} does not exist; name the fit.json of `upright identify`, or a study with its numbers.")
    return _from_fit(path, seed, draws) if path.suffix == ".json" else _from_study(path)


def _from_study(path: Path) -> RigFile:
    from upright.study.rig import read_plant, read_rig
    from upright.study.sensors import drive_unit
    from upright.study.text import StudyText

    study = StudyText(path).root()
    kind, unit = read_plant(study), drive_unit(study)
    values = {n: p.value for n, p in read_rig(study, kind, unit).parameters.items()}
    plant = kind(**{n: values[n] for n in kind.names()})
    name = study.section("rig").text_of("plant", "furuta")
    gain = values.get(GAIN, 1.0)
    return RigFile(
        plant=plant, name=name, gain=gain, unit=unit or _force(kind), late=values.get("actuator.delay", 0.0),
        lag=values.get("actuator.lag", 0.0), others=(),
    )  # fmt: skip


def _force(kind: type[Plant]) -> str:
    return kind.inputs[0].unit if kind.inputs else ""


def _from_fit(path: Path, seed: int, draws: int) -> RigFile:
    from upright.study.fit_file import read_fit

    fitted = read_fit(path)
    kind = find(fitted.plant, path.parent)
    values = {n: v for n, v in fitted.values.items() if n in kind.names()}
    try:
        plant = kind(**values)
    except TypeError:
        raise BadInput(f"{path} does not hold every parameter of '{fitted.plant}'; identify again.") from None
    content: Any = json.loads(path.read_text(encoding="utf-8"))
    gain = fitted.values.get(GAIN, 1.0)
    told = str((content["parameters"].get(GAIN) or {}).get("unit") or "")
    force = _force(kind)
    unit = told.rpartition("/")[2].strip("()") if "/" in told and told != force else force
    others = tuple(_drawn(content, plant, gain, seed, draws))
    return RigFile(
        plant=plant, name=fitted.plant, gain=gain, unit=unit, late=fitted.values.get("actuator.delay", 0.0),
        lag=fitted.values.get("actuator.lag", 0.0), others=others,
    )  # fmt: skip


def _drawn(content: Any, plant: Plant, gain: float, seed: int, draws: int) -> list[tuple[Plant, float]]:
    """Sets of numbers as the fit's standard errors and correlations scatter them; impossible ones are left out."""
    names = [str(n) for n in content.get("estimated", [])]
    kept = [i for i, n in enumerate(names) if n in plant.names() or n == GAIN]
    entries = [content["parameters"].get(names[i]) or {} for i in kept]
    errors = np.array([float(e.get("stderr") or 0.0) for e in entries])
    rows: Any = content.get("correlation") or []
    correlation = np.array([[float(v or 0.0) for v in row] for row in rows])
    if not kept or not errors.any() or correlation.shape != (len(names), len(names)):
        return []
    covariance = correlation[np.ix_(kept, kept)] * np.outer(errors, errors)
    size, axes = np.linalg.eigh(covariance)
    rng = np.random.default_rng([seed, 17])
    moves = rng.normal(size=(draws, len(kept))) * np.sqrt(np.maximum(size, 0.0)) @ axes.T
    out: list[tuple[Plant, float]] = []
    for move in moves:
        change = {names[i]: float(d) for i, d in zip(kept, move, strict=True)}
        own = gain + change.pop(GAIN, 0.0)
        try:
            out.append((plant.replace(**{n: getattr(plant, n) + d for n, d in change.items()}), own))
        except ImpossiblePhysics:
            continue
    return out
