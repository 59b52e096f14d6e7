"""What a rig does from where it hangs: its swing-up, designed beside everything else, and its first motions."""

from __future__ import annotations

import json
import math
from pathlib import Path

from upright.browser.rig import HARDWARE, BenchRig
from upright.browser.runs import in_own_process
from upright.control.exploration import SECONDS, exploration
from upright.control.swing_up import design_swing_up
from upright.errors import BadInput
from upright.files import replace_file
from upright.laws import as_values
from upright.rig import Rig
from upright.running.rig import usual_limits
from upright.running.run import RunRequest


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
    model, travel, speeds = _limited(rig)
    law = design_swing_up(model, travel=travel, speeds=speeds)
    path.parent.mkdir(parents=True, exist_ok=True)
    content = {"law": as_values(law.rule(model, model.plant.state("hanging"))), "basis": rig.model.basis.plain()}
    replace_file(path, json.dumps(content).encode())
    return json.dumps(law.K.tolist())


def first_motions(rig: BenchRig) -> RunRequest:
    """The run that shows all of a hanging twin to an identification: its arm is pushed, its pendulum swung, and calmed.

    Raises
    ------
    BadInput
        When it does not hang, its travel has no end, or it can really move: the bench does not ask whether it is clear.
    """
    if rig.kind == HARDWARE:
        raise BadInput(
            "a rig that can really move is moved by somebody who stands beside it: upright lab --rig RIG.toml "
            "--experiment quick."
        )
    model, travel, _ = _limited(rig)
    if rig.zero != "hanging" or len(model.per_unit) != 2 or travel is None:
        raise BadInput(f"first motions are those of a hanging pendulum on a body with an end; {rig.name} has none.")
    rule = exploration(model, travel)
    return RunRequest(rig=rig.rig_path, exploration=rule, seconds=SECONDS, check=False, watch=False)


def _limited(rig: BenchRig) -> tuple[Rig, float | None, tuple[float, ...]]:
    """The rig within the limits of its supervisor, its travel where it has an end, and its largest speeds."""
    model = rig.model
    limits = rig.file.limits({c.name: c.unit for c in model.plant.coordinates}, model.unit, usual_limits(model))
    if limits is None:
        return model, None, ()
    travel = limits.travel[0] if math.isfinite(limits.travel[0]) else None
    return model.replace(limit=min(model.limit, limits.command)), travel, limits.speed


def swing_up_apart(rig: BenchRig, path: Path) -> str:
    """The same in a process of its own."""
    return in_own_process(write_swing_up, rig, path)
