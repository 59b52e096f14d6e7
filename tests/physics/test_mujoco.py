"""Do our equations move like MuJoCo's bodies? Every specimen, from 20 random states, for 5 seconds."""

import numpy as np
import pytest

from tests.physics.specimens import SPECIMENS
from tests.physics.text import swing
from upright.simulation import simulate

mujoco = pytest.importorskip("mujoco")

DURATION = 5.0  # s
THROWS = 20


def throws(specimen):
    """Random states, coordinates and velocities interleaved, shape (THROWS, nx)."""
    rng = np.random.default_rng(20)
    x = np.empty((THROWS, 2 * len(specimen.plant.coordinates)))
    x[:, 0::2] = rng.uniform(-specimen.swing, specimen.swing, x[:, 0::2].shape)
    x[:, 1::2] = rng.uniform(-specimen.speed, specimen.speed, x[:, 1::2].shape)
    return x


def thrown(specimen, states):
    """Where MuJoCo brings these states in `DURATION`."""
    model = mujoco.MjModel.from_xml_string(specimen.mjcf)
    data = mujoco.MjData(model)
    assert [model.joint(i).name for i in range(model.njnt)] == [c.name for c in specimen.plant.coordinates]
    out = np.empty_like(states)
    for row, x in zip(out, states, strict=True):
        mujoco.mj_resetData(model, data)
        data.qpos, data.qvel = x[0::2], x[1::2]
        mujoco.mj_step(model, data, nstep=round(DURATION / model.opt.timestep))
        row[0::2], row[1::2] = data.qpos, data.qvel
    return out


@pytest.mark.parametrize("name", SPECIMENS)
def test_moves_like_mujoco(name):
    """Both take fourth-order steps, 0.25 ms here and 1 ms there, whose error is below 2e-7 for all specimens."""
    specimen = SPECIMENS[name]
    states = throws(specimen)
    motion = simulate(specimen.plant, {}, states, None, 1e-3, samples=2, substeps=4, every=5000)
    assert np.abs(motion[-1].T - thrown(specimen, states)).max() < 1e-6


@pytest.mark.parametrize("name", SPECIMENS)
def test_the_derived_text_alone_moves_like_mujoco(name):
    """The same without the kernel: two states, Dormand and Prince."""
    specimen = SPECIMENS[name]
    states = throws(specimen)[:2]
    ours = np.array([swing(specimen.plant, x, DURATION)[-1] for x in states])
    assert np.abs(ours - thrown(specimen, states)).max() < 1e-6
