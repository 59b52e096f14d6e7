"""An identified rig for MuJoCo, as a model in its MJCF."""

from __future__ import annotations

from collections.abc import Mapping

from upright.exports.mjcf import model
from upright.exports.targets import RigExport, RigTarget
from upright.report.page import Chapter, Step
from upright.report.symbols import typed


def _write(export: RigExport) -> tuple[Mapping[str, bytes], Chapter]:
    """A model of MuJoCo, and what MuJoCo has otherwise."""
    text, remarks = model(export.rig)
    file = export.folder / "rig.xml"
    viscous = "springs, viscous friction and the drive are those of the fit" + "." * (not remarks)
    chapter = Chapter(
        title=f"{export.rig.name} for MuJoCo", verdict=f"{export.called} is written as MJCF; {viscous}"
        + (", and differences in MuJoCo are listed below." if remarks else ""), warnings=remarks,
        numbers={"remarks": list(remarks)},
        steps=(Step("Look at it.", f"pip install mujoco && python -m mujoco.viewer --mjcf={typed(file)}"),),
    )  # fmt: skip
    return {file.name: text.encode()}, chapter


TARGET = RigTarget(name="mjcf", order=40, write=_write)
