"""An identified rig, written for other simulators."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from upright.errors import BadInput
from upright.files import replace_file
from upright.verbs.answer import Answer
from upright.verbs.handover import called, rig_of

_LIMIT = "the limit is that of the fit; --limit is for --to gymnasium."


def gymnasium(source: Any, at: Path, limit: float | None) -> Answer[tuple[str, ...]]:
    """An environment of Gymnasium, as a module that registers it."""
    from upright.exports.episodes import DRAWS, Episodes
    from upright.exports.registration import module
    from upright.report.page import Chapter, Part, Points, Step, resting_on
    from upright.report.symbols import number, typed

    rig = rig_of(source, "export", draws=DRAWS)
    lanes = Episodes(rig, 1, limit=limit)
    path = _kept(source, at)
    name, text = module(rig.name, os.path.relpath(path.resolve(), at.resolve()), limit, rig.basis.first_line())
    file = replace_file(at / "rig_env.py", text.encode())
    drawn = f"every episode has one of {len(rig.draws)} rigs drawn from its covariance"
    warnings = () if rig.draws else ("The fit has no covariance, so every episode has the same rig.",)
    told = Chapter(
        title=f"{rig.name} for Gymnasium",
        verdict=f"{path} is the environment {name}" + (f"; {drawn}." if rig.draws else "."),
        parts=(
            Part("What it takes and gives", (Points((
                f"Actions from -1 to 1, in {number(lanes.limit, 4)} {rig.unit}, held for {lanes.period:g} s.",
                f"Observations: {', '.join(lanes.names)}.",
            )),)),
        ),
        warnings=warnings,
        steps=(
            Step("Let it run a thousand rigs at once.", f"pip install 'upright[gym]' && python {typed(file)}"),
            Step(f'import rig_env; gymnasium.make_vec("{name}", num_envs=1024), or gymnasium.make("{name}"); '
                 'task="swing_up" begins hanging.'),
        ),
        numbers={"to": "gymnasium", "files": [str(file)], "environment": name, "draws": len(rig.draws)},
    )  # fmt: skip
    return Answer((str(file),), resting_on(told, rig.basis), [file])


def _kept(source: Any, at: Path) -> Path:
    """The fit.json that the environment reads when it is made; a fit in memory is written beside it."""
    from upright.verbs.fitting import FitAnswer

    if isinstance(source, FitAnswer):
        return source.save(at / "fit.json")
    if not isinstance(source, str | os.PathLike):
        raise BadInput("an environment draws its rigs from a fit; export what up.identify answered, or a fit.json.")
    path = Path(source)
    return path / "fit.json" if path.is_dir() else path


def mjcf(source: Any, at: Path, limit: float | None) -> Answer[tuple[str, ...]]:
    """A model of MuJoCo."""
    from upright.exports.mjcf import model
    from upright.report.page import Chapter, Step, resting_on
    from upright.report.symbols import typed

    rig = rig_of(source, "export", draws=0)
    if limit is not None:
        raise BadInput(_LIMIT)
    text, told = model(rig)
    file = replace_file(at / "rig.xml", text.encode())
    numbers = {"to": "mjcf", "files": [str(file)], "remarks": list(told)}
    viscous = "springs, viscous friction and the drive are those of the fit" + "." * (not told)
    chapter = Chapter(
        title=f"{rig.name} for MuJoCo", verdict=f"{called(source)} is written as MJCF; {viscous}"
        + (", and what MuJoCo has otherwise is said below." if told else ""), warnings=told, numbers=numbers,
        steps=(Step("Look at it.", f"pip install mujoco && python -m mujoco.viewer --mjcf={typed(file)}"),),
    )  # fmt: skip
    return Answer((str(file),), resting_on(chapter, rig.basis), [file])


def fmu(source: Any, at: Path, limit: float | None) -> Answer[tuple[str, ...]]:
    """A unit for co-simulation, FMI 3.0."""
    from upright.exports.fmu import build, unit_of
    from upright.report.page import Chapter, Part, Points, Step, resting_on
    from upright.report.symbols import typed

    if limit is not None:
        raise BadInput(_LIMIT)
    rig = rig_of(source, "export", draws=0)
    unit = unit_of(rig)
    content, where = build(unit)
    file = replace_file(at / "rig.fmu", content)
    warnings = unit.told if where else (*unit.told, "No C compiler was found, so the unit has its sources alone.")
    taken, given = (", ".join(f"{v.name} [{v.unit or '1'}]" for v in group) for group in (unit.inputs, unit.states))
    told = Chapter(
        title=f"{rig.name} for co-simulation", warnings=warnings,
        verdict=f"{called(source)} is a unit of FMI 3.0" + (f" with a library for {where}." if where else "."),
        parts=(Part("What it takes and gives", (Points((
            f"Inputs: {taken or 'none'}; outputs: {given}.",
            f"Parameters, to be set before the first step: {', '.join(v.name for v in unit.parameters)}; where it "
            f"begins: {', '.join(v.name for v in unit.starts)}.",
            "Steps of whole milliseconds; an input is held for a step.",
        )),)),),
        steps=(
            Step("Check and run it.", f"pip install fmpy && fmpy validate {typed(file)} && fmpy simulate {typed(file)} "
                 f"--start-values {unit.states[-2].name}_start 0.5 --show-plot"),
        ),
        numbers={"to": "fmu", "files": [str(file)], "platform": where},
    )  # fmt: skip
    return Answer((str(file),), resting_on(told, rig.basis), [file])


FORMS: Mapping[str, Callable[[Any, Path, float | None], Answer[tuple[str, ...]]]] = {
    "gymnasium": gymnasium, "mjcf": mjcf, "fmu": fmu,
}  # fmt: skip
"""What writes each form of an identified rig into a folder."""
