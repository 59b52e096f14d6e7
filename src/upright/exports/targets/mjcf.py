"""An identified rig for MuJoCo, as a model in its MJCF."""

from __future__ import annotations

from collections.abc import Mapping

from upright.exports.mjcf import model
from upright.exports.targets import RigExport, RigTarget
from upright.report.page import Chapter, Step
from upright.report.symbols import typed


def write(asked: RigExport) -> tuple[Mapping[str, bytes], Chapter]:
    """A model of MuJoCo, and what MuJoCo has otherwise."""
    text, told = model(asked.rig)
    file = asked.folder / "rig.xml"
    viscous = "springs, viscous friction and the drive are those of the fit" + "." * (not told)
    chapter = Chapter(
        title=f"{asked.rig.name} for MuJoCo", verdict=f"{asked.called} is written as MJCF; {viscous}"
        + (", and what MuJoCo has otherwise is said below." if told else ""), warnings=told,
        numbers={"remarks": list(told)},
        steps=(Step("Look at it.", f"pip install mujoco && python -m mujoco.viewer --mjcf={typed(file)}"),),
    )  # fmt: skip
    return {file.name: text.encode()}, chapter


TARGET = RigTarget(name="mjcf", order=40, write=write)
