"""An identified rig for co-simulation, as a unit of FMI 3.0."""

from __future__ import annotations

from collections.abc import Mapping

from upright.exports.fmu import archive, unit_of
from upright.exports.targets import RigExport, RigTarget
from upright.report.page import Chapter, Part, Points, Step
from upright.report.symbols import typed


def _write(export: RigExport) -> tuple[Mapping[str, bytes], Chapter]:
    """The unit, with a library where a C compiler is found."""
    unit, file = unit_of(export.rig), export.folder / "rig.fmu"
    content, where = archive(unit)
    warnings = unit.remarks if where else (*unit.remarks, "No C compiler was found: the unit has C sources alone.")
    inputs, outputs = (", ".join(f"{v.name} [{v.unit or '1'}]" for v in group) for group in (unit.inputs, unit.states))
    page = Chapter(
        title=f"{export.rig.name} for co-simulation", warnings=warnings,
        verdict=f"{export.called} is a unit of FMI 3.0" + (f" with a library for {where}." if where else "."),
        parts=(Part("What it takes and gives", (Points((
            f"Inputs: {inputs or 'none'}; outputs: {outputs}.",
            f"Parameters, to be set before the first step: {', '.join(v.name for v in unit.parameters)}; "
            f"initial state: {', '.join(v.name for v in unit.starts)}.",
            "Steps of whole milliseconds; an input is held for a step.",
        )),)),),
        steps=(
            Step("Check and run it.", f"pip install fmpy && fmpy validate {typed(file)} && fmpy simulate {typed(file)} "
                 f"--start-values {unit.states[-2].name}_start 0.5 --show-plot"),
        ),
        numbers={"platform": where},
    )  # fmt: skip
    return {file.name: content}, page


TARGET = RigTarget(name="fmu", order=45, write=_write)
