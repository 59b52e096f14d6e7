"""How many steps a second does a learner get, beside the public environment of the same kind?

A step is 20 ms of a Furuta pendulum with exact dry friction on both joints (once without any, as the public environment
has none), on a rig drawn from a covariance, with reward, ends and resets. Every parallel copy gets another action.

The public environment is CartPole-v1, without friction, in one Euler step of 20 ms. It runs twice: as Gymnasium runs
any environment in a vector (`SyncVectorEnv`), and in its hand-written NumPy version, which no other environment has.
CPU seconds of one thread, in turns.
"""

from __future__ import annotations

import platform
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import Contender, Line, Target, compare, page

ASKED = 50.0
STEPS = 1e6
MAIN, SWINGS = "upright, balance, 4,096 lanes", "upright, swing_up, 4,096 lanes"


def drawn(dry: float) -> Any:
    """A rig of the size of a laboratory's, its numbers known to a percent, with so much of its dry friction."""
    from upright.physics import Furuta
    from upright.rig import Rig
    from upright.rig.hardware import Entry, Hardware

    plant = Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-4, b_2=1e-4, b_1c=2e-3 * dry,
                   b_2c=1e-4 * dry)  # fmt: skip
    rng = np.random.default_rng(0)
    names = ("m_p", "l_cg", "J_d", "J_p", "b_1", "b_2", "b_1c", "b_2c")
    rows = 1 + 0.01 * rng.normal(size=(1024, len(names) + 1))
    draws = tuple(
        (plant.replace(**{n: getattr(plant, n) * by for n, by in zip(names, row, strict=False)}), 0.05 * row[-1])
        for row in rows.tolist()
    )
    limit = {"limit": Entry(value=5.0, unit="V", source="known")}
    return Rig(plant=plant, name="furuta", gain=0.05, unit="V", draws=draws, hardware=Hardware(entries=limit))


def ours(lanes: int, task: str, dry: float = 1.0) -> Callable[[], Contender]:
    """This project's vector environment."""

    def build() -> Contender:
        from upright.exports.environment import RigVectorEnv

        asked = Target(most=1 / ASKED) if lanes > 1000 else None  # fewer hardly pay for the call
        return stepped(RigVectorEnv(drawn(dry), lanes, task=task), target=asked)

    return build


def public(lanes: int, mode: str) -> Callable[[], Contender]:
    """CartPole-v1 of Gymnasium."""

    def build() -> Contender:
        import gymnasium

        return stepped(gymnasium.make_vec("CartPole-v1", num_envs=lanes, vectorization_mode=mode))

    return build


def stepped(env: Any, target: Target | None = None) -> Contender:
    """A vector environment under random actions."""
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(20)]

    def run() -> None:
        for action in actions:
            env.step(action)

    return Contender(name="", run=run, share=env.num_envs * len(actions) / STEPS, target=target)


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """CPU seconds per million steps of an environment."""
    builders = {
        "CartPole-v1, SyncVectorEnv, 64 lanes": public(64, "sync"),
        "CartPole-v1 by hand for NumPy, 4,096 lanes": public(4096, "vector_entry_point"),
    }
    builders |= {
        f"upright, {task}, {lanes:,} lanes": ours(lanes, task)
        for task in ("balance", "swing_up")
        for lanes in (256, 4096)
    }
    builders["upright, balance, no dry friction, 4,096 lanes"] = ours(4096, "balance", 0.0)
    named = {name: lambda name=name, build=build: replace(build(), name=name) for name, build in builders.items()}
    lines = compare(named, rounds=5 if quick else 25, progress=progress)
    if markdown is not None:
        markdown.write_text(_page(lines), encoding="utf-8")
    return lines


def _page(lines: list[Line]) -> str:
    rows = [f"Measured on one core ({platform.machine()}), Python {platform.python_version()}.", ""]
    rows += ["| | million steps a second (quartiles) | times the first (quartiles) |", "|---|---|---|"]
    for line in lines:
        if line.seconds is None or line.ratio is None:
            rows.append(f"| {line.contender} | {line.note} | |")
            continue
        rate, high, low = (1 / s for s in line.seconds)
        ratio, most, least = (1 / r for r in line.ratio)
        asked = f", asked {ASKED:g}" if line.target else ""
        speed, times = f"{rate:.3g} ({low:.3g} to {high:.3g})", f"{ratio:.3g} ({least:.3g} to {most:.3g})"
        rows.append(f"| {line.contender} | {speed} | {times}{asked} |")
    return page("gym", "Steps of an environment", __doc__, ["", *rows], headline({
        line.contender: (1 / line.seconds[0], 1 / line.ratio[0]) for line in lines if line.seconds and line.ratio
    }))  # fmt: skip


def headline(rates: Mapping[str, tuple[float, float]]) -> str:
    """The result in a sentence, from million steps a second of each and how many times the first's that is."""
    steps, times = rates[MAIN]
    other = rates[SWINGS][1]
    return (
        f"4,096 rigs with dry friction make {steps:.3g} million steps a second, {times:.3g} times as many as "
        f"CartPole-v1 in Gymnasium's usual vector, and {other:.3g} times where they swing up ({ASKED:g} required)."
    )
