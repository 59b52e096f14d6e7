"""Does the exported MJCF move in MuJoCo as the identified rig moves here?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.exports.rigs import fit_file
from tests.physics.specimens import SPECIMENS
from upright.errors import BadInput
from upright.exports.mjcf import model
from upright.physics import BUILT_IN, DoublePendulumAbsolute, Pendulum
from upright.simulation import simulate
from upright.study.stored_rig import read_stored_rig
from upright.verbs.export import export

mujoco = pytest.importorskip("mujoco")
RIGS = {name: SPECIMENS[name].plant for name in SPECIMENS if name != "double pendulum"}
QUICK = {"pendulum", "cart-pendulum", "furuta out of level", "double-pendulum", "torsional-2"}


def identified(folder, plant, **more):
    kinds = {kind: name for name, kind in BUILT_IN.items()}
    name = kinds.get(type(plant), "rectilinear-4")
    return read_stored_rig(fit_file(folder, plant, name=name, **more))


def moved(text: str, x0, u: float, seconds: float):
    """Coordinates and speeds of MuJoCo at the end, and the model."""
    m = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(m)
    data.qpos, data.qvel, data.ctrl = x0[0::2], x0[1::2], u
    mujoco.mj_step(m, data, nstep=round(seconds / m.opt.timestep))
    return np.column_stack([data.qpos, data.qvel]).ravel(), m


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in RIGS])
def test_springs_viscous_friction_and_drive_move_alike(name, tmp_path):
    """Fourth-order steps of 1 ms there, 0.25 ms here, for 3 s: errors below 2e-7, as in tests/physics."""
    plant = RIGS[name]
    rig = identified(tmp_path, plant, values={"actuator.slope": 2e-3})
    rng = np.random.default_rng(7)
    x0 = rng.uniform(-0.5, 0.5, 2 * len(plant.coordinates))
    there, m = moved(model(rig)[0], x0, 0.2, 3.0)
    assert [m.joint(i).name for i in range(m.njnt)] == [c.name for c in plant.coordinates]
    drive = {"actuator.gain": 0.5, "actuator.slope": 2e-3}
    here = simulate(plant, drive, x0, np.full((1, 1), 0.2), 1e-3, samples=2, substeps=4, every=3000)[-1, :, 0]
    assert np.abs(here - there).max() < 1e-6


def test_a_limited_drive_with_lag_acts_alike(tmp_path):
    """The lag is a first-order filter in both: Euler's in MuJoCo, whose steps of 0.1 ms err by h/2 of its rise."""
    plant = RIGS["cart-pendulum"]
    rig = identified(tmp_path, plant, values={"actuator.lag": 0.05})
    text = model(rig, timestep=1e-4)[0]
    there, _ = moved(text, np.zeros(4), 9.0, 0.5)
    drive = {"actuator.gain": 0.5, "actuator.lag": 0.05, "actuator.limit": 5.0}
    u = np.vstack([np.zeros((1, 1)), np.full((1, 1), 9.0)])  # at rest before, so that the lag begins at zero
    here = simulate(plant, drive, np.zeros(4), u, 1e-4, samples=2, every=5001)[-1, :, 0]
    speed = np.abs(here[1::2]).max()
    assert np.abs(here - there).max() < 5e-4 * max(speed, 1.0)


def test_dry_friction_takes_as_much_of_every_swing(tmp_path):
    """In both the amplitude falls by 2 b_2c/(m g l) per half swing while it slides, as Coulomb's friction does."""
    plant = Pendulum(m_p=0.2, l_cg=0.25, J_p=2e-3, b_2c=2e-3)
    text, told = model(identified(tmp_path, plant))
    assert any("Approximate" in line for line in told)
    m = mujoco.MjModel.from_xml_string(text)
    data, turns, before = mujoco.MjData(m), [0.1], 0.0
    data.qpos = 0.1
    for _ in range(6000):
        mujoco.mj_step(m, data)
        if data.qvel[0] * before < 0:
            turns.append(abs(data.qpos[0]))
        before = data.qvel[0]
    lost = 2 * 2e-3 / (0.2 * plant.g * 0.25)
    falls = -np.diff(turns)[:3]
    # small angles: sin differs by 0.1**2/6, 0.2 %; the soft constraint gives way for a few of 500 ms at every turn
    np.testing.assert_allclose(falls, lost, rtol=0.05)


def test_absolute_angles_become_joints_of_bodies(tmp_path):
    values = {"m_1": 0.35, "m_2": 0.2, "l_1": 0.2, "l_c1": 0.11, "l_c2": 0.13, "J_1": 1e-3, "J_2": 8e-4, "b_2": 2e-3}
    plant = DoublePendulumAbsolute(**values)
    text, told = model(identified(tmp_path, plant))
    x0 = np.array([0.4, 0.2, -0.3, 0.5])
    there, _ = moved(text, [0.4, 0.2, -0.7, 0.3], 0.0, 3.0)
    here = simulate(plant, {}, x0, None, 1e-3, samples=2, substeps=4, every=3000)[-1, :, 0]
    assert np.abs(here[:2] - there[:2]).max() < 1e-6
    assert np.abs(here[2:] - here[:2] - there[2:]).max() < 1e-6
    assert any("theta_2 - theta_1" in line for line in told)


def test_what_mujoco_has_not_is_said(tmp_path):
    plant = Pendulum(m_p=0.2, l_cg=0.25, b_2q=1e-4, b_2s=2e-3)
    rig = identified(tmp_path, plant)
    late = replace(rig, hardware=replace(rig.hardware, entries=identified(
        tmp_path, plant, delay={"value": 0.01, "unit": "s", "source": "known"}).hardware.entries))  # fmt: skip
    text, told = model(late)
    assert mujoco.MjModel.from_xml_string(text).nv == 1  # a point mass too
    for words in ("quadratic drag of theta", "break-away", "dead time"):
        assert any(words in line for line in told), words
        assert words in text
    assert not any("brakes" in line for line in told)
    braking = identified(tmp_path, plant, damping={"value": 0.01, "unit": "N m s/rad", "source": "known"})
    assert any("brakes whether it is commanded" in line for line in model(braking)[1])


def test_the_command_writes_a_model_that_mujoco_loads(tmp_path):
    path = fit_file(tmp_path, RIGS["furuta"], name="furuta", stderr={"m_p": 1e-3})
    done = export(path, to="mjcf", out=tmp_path)
    assert mujoco.MjModel.from_xml_path(done.value[0]).nu == 1


def test_a_plant_of_one_s_own_is_refused_with_what_takes_it(tmp_path):
    rig = identified(tmp_path, RIGS["pendulum"])
    strange = replace(rig, plant=SPECIMENS["double pendulum"].plant)
    with pytest.raises(BadInput, match="--to fmu"):
        model(strange)
