"""An identified rig for Gymnasium: the few lines by which it finds the environment."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from upright.exports.controller import harmless
from upright.exports.episodes import DRAWS, Episodes
from upright.exports.targets import RigExport, RigTarget
from upright.report.page import Chapter, Part, Points, Step
from upright.report.symbols import number, typed


def module(rig: str, fit: str, limit: float | None, first_line: str = "") -> tuple[str, str]:
    """Name of the environment, and text of a module that registers it.

    `fit` is a path from the module's folder, `first_line` what the module says of it first.
    """
    name = f"upright/{''.join(c for c in rig.rpartition(':')[2] if c.isalnum()) or 'rig'}-v0"
    head = harmless(f"{first_line} ".lstrip())
    options = "" if limit is None else f', "limit": {limit!r}'
    return (
        name,
        f'''\
"""{head}The rig of {Path(fit).name} as an environment of Gymnasium, written by upright export."""

from pathlib import Path

import gymnasium

gymnasium.register(
    id="{name}",
    entry_point="upright.exports.environment:RigEnv",
    vector_entry_point="upright.exports.environment:RigVectorEnv",
    max_episode_steps=500,
    kwargs={{"fit": str(Path(__file__).parent / {Path(fit).as_posix()!r}){options}}},
)

if __name__ == "__main__":
    env = gymnasium.make_vec("{name}", num_envs=1024)
    env.reset(seed=0)
    env.action_space.seed(0)
    ends = sum(int(env.step(env.action_space.sample())[2].sum()) for _ in range(100))
    print(f"{{env.num_envs}} rigs, 100 steps each, random commands: {{ends}} falls")
''',
    )


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
