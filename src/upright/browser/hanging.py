"""The swing-up of a rig from where it hangs: designed beside everything else, and kept as a file."""

from __future__ import annotations

import json
import math
from pathlib import Path

from upright.browser.rig import HARDWARE, BenchRig
from upright.browser.runs import in_own_process
from upright.control.swing_up import design_swing_up
from upright.errors import BadInput
from upright.files import replace_file
from upright.laws import as_values
from upright.running.rig import usual_limits


def write_swing_up(rig: BenchRig, path: Path) -> str:
    """Design a swing-up within the limits of the rig's supervisor, and store its law with its basis; its gains as JSON.

    Raises
    ------
    BadInput
        When the rig has none, or can really move: the bench does not check its encoders first.
    """
    if rig.kind == HARDWARE:
        raise BadInput(
            "before a rig that can really move is swung up its encoders are checked, which the bench does not do; "
            "upright lab --rig RIG.toml --experiment 2b does."
        )
    if (rig.zero, rig.at) != ("hanging", "inverted"):
        raise BadInput(f"a swing-up begins hanging and ends inverted; {rig.name} goes from {rig.zero} to {rig.at}.")
    model, travel = rig.model, None
    limits = rig.file.limits({c.name: c.unit for c in model.plant.coordinates}, model.unit, usual_limits(model))
    if limits is not None:
        travel = limits.travel[0] if math.isfinite(limits.travel[0]) else None
        model = model.replace(limit=min(model.limit, limits.command))
    law = design_swing_up(model, travel=travel, speeds=() if limits is None else limits.speed)
    path.parent.mkdir(parents=True, exist_ok=True)
    content = {"law": as_values(law.rule(model, model.plant.state("hanging"))), "basis": rig.model.basis.plain()}
    replace_file(path, json.dumps(content).encode())
    return json.dumps(law.K.tolist())


def swing_up_apart(rig: BenchRig, path: Path) -> str:
    """The same in a process of its own."""
    return in_own_process(write_swing_up, rig, path)
