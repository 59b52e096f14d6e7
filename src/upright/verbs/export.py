"""A designed law or an identified rig, written for a loop that runs elsewhere."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput, nearest
from upright.files import keeps_its_inputs, read_text, replace_file
from upright.verbs.answer import Answer
from upright.verbs.pages import folder

if TYPE_CHECKING:
    from upright.exports.controller import SampledController

LAWS = ("c", "arduino", "python", "matlab", "simulink")
"""Forms of a law, `exports.targets.TARGETS`."""
RIGS = ("gymnasium", "mjcf", "fmu")
"""Forms of an identified rig."""


@keeps_its_inputs
def export(
    source: Any, *, to: str, out: str | os.PathLike[str] = "upright-export", single: bool = False,
    limit: float | None = None,
) -> Answer[tuple[str, ...]]:  # fmt: skip
    """A designed law as a program for the computer that closes the loop, or an identified rig for other simulators.

    A program repeats the commands of upright's own kernel bit for bit in double precision, and carries a replay by
    which it tests itself.

    Parameters
    ----------
    source : path, answer of `design`, or Law
        Of a law design.json or its folder; of a rig fit.json or its folder.
    to : str
        A law as ``"c"``, ``"arduino"``, ``"python"``, ``"matlab"`` (GNU Octave too) or ``"simulink"``; a rig as
        ``"gymnasium"``, an environment whose every episode has another rig that the fit allows, ``"mjcf"``, a
        model of MuJoCo, or ``"fmu"``, a unit for co-simulation (FMI 3.0).
    out : path
        Folder for the files.
    single : bool
        Of a law, single precision (the command line's ``--float``); its commands miss by a converter's step at times.
    limit : float, optional
        Of a rig, the largest command, in its unit; the fit's when omitted.

    Returns
    -------
    Answer
        Of the names of the files.

    Raises
    ------
    BadInput
        When there is no such form, or what was given cannot be written in it.
    """
    if to not in (*LAWS, *RIGS):
        raise BadInput(f"--to is one of {', '.join((*LAWS, *RIGS))}, got '{to}'; {nearest(to, (*LAWS, *RIGS))}")
    if to in LAWS:
        if limit is not None:
            raise BadInput("the limit of a law is the one that it was designed with; give --limit to upright design.")
        made, name = _controller(source)
        return _law(made, name, to, folder(out), single)
    if single:
        raise BadInput("--float is of laws; a rig is simulated in double precision.")
    if not isinstance(source, str | os.PathLike):
        raise BadInput(f"a rig is exported from its fit.json or the folder of it, got {type(source).__name__}.")
    return _RIG[to](Path(source), folder(out), limit)


def _controller(source: Any) -> tuple[SampledController, str]:
    """The law to be written, and what it is called by."""
    from upright.exports.controller import of_design, of_law

    if isinstance(source, Answer) and "law" in (source.numbers or {}):
        from upright.files import plain_values

        return of_design(plain_values(source.numbers), "this design"), "this design"
    if not isinstance(source, str | os.PathLike):
        return of_law(source), "this law"
    path = Path(source)
    path = path / "design.json" if path.is_dir() else path
    if not path.exists():
        raise BadInput(f"{path} does not exist; `upright design ... -o FOLDER` writes FOLDER/design.json.")
    try:
        content = json.loads(read_text(path))
    except (UnicodeDecodeError, ValueError, RecursionError):
        raise BadInput(f"{path} is no design.json; `upright design ... -o FOLDER` writes one.") from None
    return of_design(content, str(path)), str(path)


def _law(made: SampledController, name: str, to: str, at: Path, single: bool) -> Answer[tuple[str, ...]]:
    from upright.exports.targets import TARGETS
    from upright.exports.vector import self_test
    from upright.report.page import Chapter, Part, Points, Step
    from upright.report.symbols import number, typed

    target, test = TARGETS[to], self_test(made)
    texts = target.write(made, test, single)
    files = [replace_file(at / file, text.encode()) for file, text in texts.items()]
    unit, step = made.command_unit, float(made.converter.max(initial=0.0))
    warnings: list[str] = []
    if not math.isfinite(made.law.limit):
        warnings.append("Nobody said how large a command may be, so the program limits none: design with --limit.")
    exact = f"{len(test.readings)} samples are replayed and compared bit for bit"
    miss = f"{number(test.single, 2)} {unit}".strip()
    if single:
        exact = f"{len(test.readings)} samples are replayed and may miss by {miss} in single precision"
        if test.single > step * 1.001:
            than = f"more than the converter's step of {number(step, 2)} {unit}" if step else "which no converter hides"
            warnings.append(f"Single precision may move a command by {miss}, {than}; a slower period moves it less.")
    elif to == "arduino":
        warnings.append(f"On boards whose double has 32 bits commands may miss by {miss}.")
    told = Chapter(
        title=f"{made.title} for {target.name}", verdict=f"{name} is written for {target.name}; {exact}.",
        parts=(Part("What it takes and gives", (Points(tuple(made.facts)),)),), warnings=tuple(warnings),
        steps=(
            Step("Let it test itself where it will run.", target.test.format(folder=typed(at))), Step(target.onward)
        ),
        numbers={
            "to": to, "files": [str(f) for f in files], "period": made.law.period, "limit": made.law.limit,
            "samples": len(test.readings), "single_precision_misses": test.single,
        },
    )  # fmt: skip
    return Answer(tuple(str(f) for f in files), told, files)


def _gymnasium(source: Path, at: Path, limit: float | None) -> Answer[tuple[str, ...]]:
    from upright.experiments.identified import read_identified
    from upright.exports.episodes import DRAWS, Episodes
    from upright.exports.registration import module
    from upright.report.page import Chapter, Part, Points, Step
    from upright.report.symbols import number, typed

    rig = read_identified(source, draws=DRAWS)
    lanes = Episodes(rig, 1, limit=limit)
    path = source / "fit.json" if source.is_dir() else source
    name, text = module(rig.name, os.path.relpath(path.resolve(), at.resolve()), limit)
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
    return Answer((str(file),), told, [file])


def _mjcf(source: Path, at: Path, limit: float | None) -> Answer[tuple[str, ...]]:
    from upright.experiments.identified import read_identified
    from upright.exports.mjcf import model
    from upright.report.page import Chapter, Step
    from upright.report.symbols import typed

    rig = read_identified(source, draws=0)
    if limit is not None:
        raise BadInput(_LIMIT)
    text, told = model(rig)
    file = replace_file(at / "rig.xml", text.encode())
    numbers = {"to": "mjcf", "files": [str(file)], "remarks": list(told)}
    viscous = "springs, viscous friction and the drive are those of the fit" + "." * (not told)
    chapter = Chapter(
        title=f"{rig.name} for MuJoCo", verdict=f"{source} is written as MJCF; {viscous}"
        + (", and what MuJoCo has otherwise is said below." if told else ""), warnings=told, numbers=numbers,
        steps=(Step("Look at it.", f"pip install mujoco && python -m mujoco.viewer --mjcf={typed(file)}"),),
    )  # fmt: skip
    return Answer((str(file),), chapter, [file])


def _fmu(source: Path, at: Path, limit: float | None) -> Answer[tuple[str, ...]]:
    from upright.experiments.identified import read_identified
    from upright.exports.fmu import build, unit_of
    from upright.report.page import Chapter, Part, Points, Step
    from upright.report.symbols import typed

    if limit is not None:
        raise BadInput(_LIMIT)
    rig = read_identified(source, draws=0)
    unit = unit_of(rig)
    content, where = build(unit)
    file = replace_file(at / "rig.fmu", content)
    warnings = unit.told if where else (*unit.told, "No C compiler was found, so the unit has its sources alone.")
    taken, given = (", ".join(f"{v.name} [{v.unit or '1'}]" for v in group) for group in (unit.inputs, unit.states))
    told = Chapter(
        title=f"{rig.name} for co-simulation", warnings=warnings,
        verdict=f"{source} is a unit of FMI 3.0" + (f" with a library for {where}." if where else "."),
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
    return Answer((str(file),), told, [file])


_LIMIT = "the limit is that of the fit; --limit is for --to gymnasium."
_RIG: Mapping[str, Callable[[Path, Path, float | None], Answer[tuple[str, ...]]]] = {
    "gymnasium": _gymnasium,
    "mjcf": _mjcf,
    "fmu": _fmu,
}
