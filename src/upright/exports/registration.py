"""The few lines by which Gymnasium finds an exported rig."""

from __future__ import annotations

from pathlib import Path

from upright.exports.controller import plain


def module(rig: str, fit: str, limit: float | None, first_line: str = "") -> tuple[str, str]:
    """Name of the environment, and text of a module that registers it.

    `fit` is a path from the module's folder, `first_line` what the module says of it first.
    """
    name = f"upright/{''.join(c for c in rig.rpartition(':')[2] if c.isalnum()) or 'rig'}-v0"
    head = plain(f"{first_line} ".lstrip())
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
