"""The rig that a file describes: a fit.json, an MJCF file, or a study with its guesses; or a plant's numbers alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from upright.errors import BadInput
from upright.rig import Rig
from upright.rig.hardware import force_unit
from upright.study.description import read_hardware, rig_with_guesses
from upright.study.rig import read_plant, read_rig
from upright.study.sensors import drive_unit
from upright.study.stored_fit import read_fit
from upright.study.text import StudyText


def read_stored_rig(path: Path, *, seed: int = 0, draws: int = 200) -> Rig:
    """Rig of a `fit.json` (or its folder), of an MJCF file (.xml), or of a study, whose guesses count as its numbers.

    Raises
    ------
    BadInput
        When it is neither.
    """
    path = path / "fit.json" if path.is_dir() else path
    if not path.exists():
        raise BadInput(f"{path} does not exist; name the fit.json of `upright identify`, a study or an MJCF file.")
    if path.suffix.lower() == ".xml":
        from upright.rig.mjcf import read_mjcf

        return read_mjcf(path).rig
    return read_fit(path).rig(seed=seed, draws=draws) if path.suffix == ".json" else _from_study(path)


def _from_study(path: Path) -> Rig:
    study = StudyText(path).root()
    kind, unit = read_plant(study), drive_unit(study)
    model = read_rig(study, kind, unit)
    name = study.section("rig").text_of("plant", "furuta")
    rig = rig_with_guesses(model, name, read_hardware(study, kind, model))
    return replace(rig, unit=unit or force_unit(kind))
