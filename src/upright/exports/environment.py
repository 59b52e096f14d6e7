"""An identified rig as an environment of Gymnasium, single or many at once, stepped by the compiled kernel."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from upright.exports.episodes import DRAWS, Episodes
from upright.rig import Rig
from upright.study.stored_rig import read_stored_rig

Floats = NDArray[np.float32]


class RigVectorEnv(VectorEnv[NDArray[Any], NDArray[Any], NDArray[Any]]):
    """Many rigs at once, each another one that the fit allows, drawn again at every reset.

    Parameters
    ----------
    fit : path or Rig
        fit.json or its folder.
    max_episode_steps : int
        After which an episode is truncated.
    draws_seed : int
        Of the rigs drawn from the fit's covariance.
    **options
        Of `Episodes`: task, at, period, limit, travel, threads.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self, fit: str | os.PathLike[str] | Rig, num_envs: int = 1, *, max_episode_steps: int = 500,
        draws_seed: int = 0, **options: Any,
    ) -> None:  # fmt: skip
        self.num_envs, self.max_episode_steps = num_envs, max_episode_steps
        self.episodes = Episodes(_rig(fit, draws_seed), num_envs, **options)
        self.single_observation_space, self.single_action_space = _spaces(self.episodes)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.render_mode = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:  # fmt: skip
        """Begin every episode anew."""
        super().reset(seed=seed)
        self.episodes.reset(np.ones(self.num_envs, dtype=np.bool_), self.np_random)
        return self.episodes.observation, {}

    def step(self, actions: Floats) -> tuple[Floats, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """One period of every lane; a lane that ended before begins anew instead, its action unused."""
        lanes = self.episodes
        before = lanes.done.copy()
        reward, terminated = lanes.step(np.asarray(actions, dtype=np.float64).reshape(self.num_envs, -1))
        lanes.reset(before, self.np_random)
        reward[before], terminated = 0.0, terminated & ~before
        truncated = lanes.steps >= self.max_episode_steps
        lanes.done = terminated | truncated
        return lanes.observation, reward, terminated, truncated, {}


class RigEnv(gymnasium.Env[NDArray[Any], NDArray[Any]]):
    """One rig, another one that the fit allows at every reset; parameters as for `RigVectorEnv`."""

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self, fit: str | os.PathLike[str] | Rig, *, draws_seed: int = 0, **options: Any
    ) -> None:  # fmt: skip
        self.episodes = Episodes(_rig(fit, draws_seed), 1, **options)
        self.observation_space, self.action_space = _spaces(self.episodes)
        self.render_mode = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:  # fmt: skip
        """Begin an episode."""
        super().reset(seed=seed)
        self.episodes.reset(np.ones(1, dtype=np.bool_), self.np_random)
        return self.episodes.observation[0], {}

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """One period."""
        reward, terminated = self.episodes.step(np.asarray(action, dtype=np.float64).reshape(1, -1))
        return self.episodes.observation[0], float(reward[0]), bool(terminated[0]), False, {}


def _rig(fit: str | os.PathLike[str] | Rig, seed: int) -> Rig:
    return fit if isinstance(fit, Rig) else read_stored_rig(Path(fit), seed=seed, draws=DRAWS)


def _spaces(lanes: Episodes) -> tuple[Box, Box]:
    """Of observations and actions, -1 to 1 for each input."""
    return (
        Box(-np.inf, np.inf, (len(lanes.names),), np.float32),
        Box(-1.0, 1.0, (len(lanes.rig.plant.inputs),), np.float32),
    )
