"""Does the exported MJCF move in MuJoCo as the identified rig moves here?"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from tests.exports.rigs import fit_file
from tests.physics.specimens import SPECIMENS
from upright.errors import BadInput
from upright.exports.mjcf import model
from upright.physics import BUILT_IN, DoublePendulumAbsolute, Furuta, Pendulum, chain
from upright.rig.hardware import Entry
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
    with pytest.raises(BadInput, match="the target fmu"):
        model(strange)


def parsed(rig, **how):
    """Text of the model as a tree, and what it says of itself."""
    text, told = model(rig, **how)
    return ET.fromstring(text), told


def numbers(text):
    return [float(word) for word in text.split()]


def test_a_body_carries_the_numbers_of_its_parameters_and_a_line_as_long_as_it_is(tmp_path):
    """Of a Furuta pendulum: the arm about z, the rod about minus x at its end, gravity along the tilted table."""
    plant = Furuta(
        m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, J_a=1e-4, b_1=6e-4, b_2=2e-4, b_1c=3e-3, b_2c=4e-3,
        k_psi=0.7, tilt_x=0.28, tilt_y=0.0, g=10.0,
    )  # fmt: skip
    root, _ = parsed(identified(tmp_path, plant))
    arm, rod = root.findall(".//body")
    joint = {"psi": arm.find("joint").attrib, "theta": rod.find("joint").attrib}
    assert {n: (j["name"], j["type"], j["axis"]) for n, j in joint.items()} == {
        "psi": ("psi", "hinge", "0 0 1"), "theta": ("theta", "hinge", "-1 0 0"),
    }  # fmt: skip
    wanted = {"psi": (6e-4, 0.7, 3e-3), "theta": (2e-4, 0.0, 4e-3)}
    for name, values in wanted.items():
        assert tuple(float(joint[name][k]) for k in ("damping", "stiffness", "frictionloss")) == values
    inertial = rod.find("inertial").attrib
    assert (numbers(inertial["pos"]), float(inertial["mass"])) == ([0, 0, -0.19], 0.135)
    assert numbers(inertial["diaginertia"]) == [6e-4, 6e-4, 1e-4]
    own = arm.find("inertial").attrib
    assert numbers(own["diaginertia"]) == [0.0055, 0.0055, 0.011]  # about z all of J_d
    assert numbers(own["pos"]) == [0, 0, 0]
    assert (numbers(arm.attrib["pos"]), numbers(rod.attrib["pos"])) == ([0, 0, 0], [0.16, 0, 0])
    assert numbers(arm.find("geom").attrib["fromto"]) == [0, 0, 0, 0.16, 0, 0]
    assert numbers(rod.find("geom").attrib["fromto"]) == [0, 0, 0, 0, 0, -0.38]
    option = root.find("option").attrib
    assert numbers(option["gravity"]) == pytest.approx([2.8, 0.0, -9.6])  # 10 (0.28, 0, 0.96)
    assert (float(option["timestep"]), root.attrib["model"]) == (1e-3, "furuta")


def test_gravity_has_the_table_s_tilt_in_both_directions(tmp_path):
    plant = Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, tilt_x=0.36, tilt_y=0.48, g=10.0)
    root, _ = parsed(identified(tmp_path, plant))
    assert numbers(root.find("option").attrib["gravity"]) == pytest.approx([3.6, 4.8, -8.0])


@pytest.mark.parametrize(("J_a", "taken"), [(1.2e-3, True), (1.3e-3, False)])
def test_no_rod_turns_harder_about_its_length_than_twice_about_its_middle(J_a, taken, tmp_path):
    rig = identified(tmp_path, Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, J_a=J_a))
    if taken:
        assert model(rig)
    else:
        with pytest.raises(BadInput, match=r"J_a = 0.0013 kg m\^2, is above twice its transverse one, J_p = 0.0006"):
            model(rig)


def test_the_first_rod_of_a_double_pendulum_reaches_to_the_second_hinge(tmp_path):
    plant = SPECIMENS["double-pendulum"].plant
    root, _ = parsed(identified(tmp_path, plant))
    upper, lower = root.findall(".//body")
    assert numbers(upper.find("geom").attrib["fromto"])[3:] == pytest.approx([0, 0, -plant.l_1])
    assert numbers(lower.attrib["pos"]) == [0, 0, -plant.l_1]
    assert numbers(lower.find("geom").attrib["fromto"])[3:] == pytest.approx([0, 0, -2 * plant.l_c2])
    for body, m, J, l_cg in ((upper, plant.m_1, plant.J_1, plant.l_c1), (lower, plant.m_2, plant.J_2, plant.l_c2)):
        own = body.find("inertial").attrib
        assert (float(own["mass"]), numbers(own["diaginertia"]), numbers(own["pos"])) == (m, [J] * 3, [0, 0, -l_cg])


def test_a_point_mass_keeps_as_little_inertia_as_mujoco_takes(tmp_path):
    """1e-12 kg m^2: a millionth of a gram at a metre."""
    root, _ = parsed(identified(tmp_path, Pendulum(m_p=0.2, l_cg=0.25, J_p=0.0)))
    assert numbers(root.find(".//inertial").attrib["diaginertia"]) == [1e-12] * 3


@pytest.mark.parametrize("kind", ["rectilinear", "torsional"])
def test_carts_stand_beside_and_disks_below_each_other_joined_to_ground_and_neighbour(kind, tmp_path):
    letter = "m" if kind == "rectilinear" else "J"
    values = {f"{letter}_{i}": 0.1 * i for i in (1, 2)} | {"k_1": 3.0, "k_12": 5.0, "c_1": 0.1, "c_2": 0.2, "c_12": 0.7}
    plant = chain(2, kind)(**values, f_1c=0.01, f_2c=0.02, a_2=0.05)
    root, _ = parsed(read_stored_rig(fit_file(tmp_path, plant, name=f"{kind}-2")))
    first, second = root.findall(".//body")
    places = [numbers(b.attrib["pos"]) for b in (first, second)]
    beside = [[0, 0.3, 0], [0, 0.6, 0]]
    np.testing.assert_allclose(places, beside if kind == "rectilinear" else [[0, 0, -0.1], [0, 0, -0.2]])
    joints = [b.find("joint").attrib for b in (first, second)]
    assert [float(j["stiffness"]) for j in joints] == [3.0, 0.0]
    assert [float(j["damping"]) for j in joints] == [0.1, 0.2]
    assert [float(j["frictionloss"]) for j in joints] == [0.01, 0.02]
    assert {(j["type"], j["axis"]) for j in joints} == {
        ("slide", "1 0 0") if kind == "rectilinear" else ("hinge", "0 0 1")
    }  # fmt: skip
    total = second.find("inertial").attrib
    if kind == "rectilinear":
        assert float(total["mass"]) == pytest.approx(0.25)  # with what was added to it
    assert numbers(total["diaginertia"])[2] == pytest.approx(0.25)
    (spring,) = root.findall(".//tendon/fixed")
    assert (float(spring.attrib["stiffness"]), float(spring.attrib["damping"])) == (5.0, 0.7)
    assert [(e.attrib["joint"], e.attrib["coef"]) for e in spring] == [
        (plant.coordinates[0].name, "-1"), (plant.coordinates[1].name, "1"),
    ]  # fmt: skip
    assert numbers(root.find("option").attrib["gravity"]) == [0, 0, 0]


def test_nine_bodies_in_a_row_are_known_and_one_alone_has_no_spring_between(tmp_path):
    plant = chain(9)(**{f"m_{i}": 1.0 for i in range(1, 10)}, **{f"k_{i}{i + 1}": 2.0 for i in range(1, 9)})
    root, _ = parsed(replace(identified(tmp_path, RIGS["pendulum"]), plant=plant, name="rectilinear-9"))
    assert len(root.findall(".//body")) == 9
    assert len(root.findall(".//tendon/fixed")) == 8
    one, _ = parsed(replace(identified(tmp_path, RIGS["pendulum"]), plant=chain(1)(m_1=1.0), name="rectilinear-1"))
    assert one.find("tendon") is None


def described(rig, **values):
    """The rig with more said of its drive."""
    entries = {n: Entry(value=v, unit="", source="known") for n, v in values.items()}
    return replace(rig, hardware=replace(rig.hardware, entries=entries))


def test_the_drive_has_its_gain_limits_lag_and_what_it_loses_with_speed(tmp_path):
    rig = identified(tmp_path, RIGS["pendulum"])
    root, _ = parsed(described(rig, lag=0.02, limit=5.0, force_limit=0.25, slope=1e-3, damping=2e-3, standby=4e-3))
    drive = root.find(".//actuator/general").attrib
    assert (drive["joint"], numbers(drive["gainprm"]), drive["biastype"]) == ("theta", [0.5], "affine")
    assert numbers(drive["biasprm"]) == pytest.approx([0, 0, -7e-3])
    assert (drive["dyntype"], numbers(drive["dynprm"])) == ("filter", [0.02])
    assert (drive["ctrllimited"], numbers(drive["ctrlrange"])) == ("true", [-5, 5])
    assert (drive["forcelimited"], numbers(drive["forcerange"])) == ("true", [-0.25, 0.25])
    plain, _ = parsed(described(rig.replace(lag=0.0)))
    assert not {"dyntype", "ctrlrange", "forcerange"} & plain.find(".//actuator/general").attrib.keys()
    assert numbers(plain.find(".//actuator/general").attrib["biasprm"]) == [0, 0, 0]


@pytest.mark.parametrize(
    ("drive", "said"),
    [
        ({"delay": 0.01}, "Left out: dead time of the drive."), ({"offset": -0.2}, "Left out: offset of the drive."),
        ({"knee": 3.0}, "Left out: its torque-speed curve."), ({"droop": 0.1}, "Left out: its falling gain."),
        ({"relaxation": 0.1}, "Left out: braking that builds up."),
        ({"damping_rise": 0.1}, "Left out: braking by the command."),
        ({"damping": 0.1}, "Approximate: the drive brakes whether it is commanded or not."),
        ({"standby": 0.1}, "Approximate: the drive brakes whether it is commanded or not."),
        ({"delay": 0.0, "offset": 0.0, "knee": np.inf, "slope": 0.1, "limit": 5.0}, ""),
    ],
)  # fmt: skip
def test_each_thing_that_mujoco_has_not_is_said_by_itself(drive, said, tmp_path):
    rig = identified(tmp_path, Pendulum(m_p=0.2, l_cg=0.25, J_p=1e-3))
    assert model(described(rig, **drive))[1] == ((said,) if said else ())


@pytest.mark.parametrize(
    ("friction", "said"),
    [
        ({"b_2c": 1e-3}, "Approximate: Coulomb friction is frictionloss"),
        ({"b_2q": 1e-3}, "Left out: quadratic drag of theta."),
        ({"b_2s": 1e-3, "v_2s": 0.1}, "Left out: break-away friction of theta."), ({"b_2": 1e-3}, ""),
    ],
)  # fmt: skip
def test_each_kind_of_friction_that_mujoco_has_not_is_said_by_itself(friction, said, tmp_path):
    told = model(identified(tmp_path, Pendulum(m_p=0.2, l_cg=0.25, J_p=1e-3, **friction)))[1]
    assert len(told) == bool(said)
    assert not said or told[0].startswith(said)
