"""An identified rig for Gymnasium: the few lines by which it finds the environment."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from upright.exports.controller import harmless
from upright.exports.episodes import DRAWS, Episodes
from upright.exports.targets import RigExport, RigTarget
from upright.exports.texts import filled
from upright.report.page import Chapter, Part, Points, Step
from upright.report.symbols import number, typed


def module(rig: str, fit: str, limit: float | None, first_line: str = "") -> tuple[str, str]:
    """Name of the environment, and text of a module that registers it.

    `fit` is a path from the module's folder, `first_line` what the module says of it first.
    """
    name = f"upright/{''.join(c for c in rig.rpartition(':')[2] if c.isalnum()) or 'rig'}-v0"
    head = harmless(f"{first_line} ".lstrip())
    options = "" if limit is None else f', "limit": {limit!r}'
    return name, filled("rig_env.py.in", head=head, file=Path(fit).name, name=name, path=repr(Path(fit).as_posix()),
                        options=options)  # fmt: skip


def _write(export: RigExport) -> tuple[Mapping[str, bytes], Chapter]:
    """An environment of Gymnasium, as a module that registers it."""
    rig, at = export.rig, export.folder
    lanes = Episodes(rig, 1, limit=export.limit)
    path, file = export.store(), at / "rig_env.py"
    name, text = module(rig.name, os.path.relpath(path.resolve(), at.resolve()), export.limit, rig.basis.first_line())
    drawn = f"every episode has one of {len(rig.draws)} rigs drawn from its covariance"
    page = Chapter(
        title=f"{rig.name} for Gymnasium",
        verdict=f"{path} is the environment {name}" + (f"; {drawn}." if rig.draws else "."),
        parts=(
            Part("What it takes and gives", (Points((
                f"Actions from -1 to 1, in {number(lanes.limit, 4)} {rig.unit}, held for {lanes.period:g} s.",
                f"Observations: {', '.join(lanes.names)}.",
            )),)),
        ),
        warnings=() if rig.draws else ("The fit has no covariance, so every episode has the same rig.",),
        steps=(
            Step("Let it run a thousand rigs at once.", f"pip install 'upright[gym]' && python {typed(file)}"),
            Step(f'import rig_env; gymnasium.make_vec("{name}", num_envs=1024), or gymnasium.make("{name}"); '
                 'task="swing_up" begins hanging.'),
        ),
        numbers={"environment": name, "draws": len(rig.draws)},
    )  # fmt: skip
    return {file.name: text.encode()}, page


TARGET = RigTarget(name="gymnasium", order=35, write=_write, limited=True, draws=DRAWS)
