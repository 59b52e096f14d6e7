"""Is the rig that is read from an MJCF file the one that MuJoCo moves? MuJoCo's accelerations are the oracle."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest

import upright as up
from tests.physics.specimens import SPECIMENS
from tests.physics.text import acceleration
from upright.exports.mjcf import model
from upright.rig.mjcf import read_mjcf
from upright.simulation import simulate
from upright.study.stored_rig import read_stored_rig

mujoco = pytest.importorskip("mujoco")
ROD = '<inertial pos="0 0 -0.2" mass="0.3" diaginertia="2e-3 2e-3 1e-5"/>'
CART = '<inertial pos="0 0 0" mass="0.8" diaginertia="1 1 1"/>'
SLIDE = '<joint name="rail" type="slide" axis="1 0 0"/>'
PIVOT = '<joint name="pole" axis="0 -1 0"/>'
MOTOR = '<motor joint="rail"/>'


def written(path, bodies, *, actuator="", more="", option=""):
    """An MJCF file: angles in radians, contacts as MuJoCo's default."""
    path.write_text(
        f'<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81" {option}/>{more}<worldbody>{bodies}</worldbody>'
        f"<actuator>{actuator}</actuator></mujoco>"
    )
    return path


def cart(rail=SLIDE, pivot=PIVOT, rod=ROD):
    return f"<body>{rail}{CART}<body>{pivot}{rod}</body></body>"


def arm(pivot='<joint name="pole" axis="-1 0 0"/>', rod=ROD, at="0.2 0 0", turn='<joint name="arm" axis="0 0 1"/>'):
    hub = '<inertial pos="0 0 0" mass="1" diaginertia="0.005 0.005 0.01"/>'
    return f'<body>{turn}{hub}<body pos="{at}">{pivot}{rod}</body></body>'


def furthest(path, joints):
    """Difference of accelerations over the largest at 50 random states, joints as (order, sign, zero) say."""
    order, sign, zero = joints
    plant = up.from_mjcf(path).plant.replace(**{
        j.coulomb: 0.0 for j in up.from_mjcf(path).plant.joints
    })  # fmt: skip
    m = mujoco.MjModel.from_xml_path(str(path))
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    data, a = mujoco.MjData(m), acceleration(plant.derived_for(plant.parameters()), plant.parameters())
    rng, there, here = np.random.default_rng(5), [], []
    for _ in range(50):
        q, v, u = rng.uniform(-3, 3, m.nv), rng.uniform(-5, 5, m.nv), rng.uniform(-2, 2)
        data.qpos, data.qvel, data.qfrc_applied = q, v, 0.0
        data.qfrc_applied[order[0]] = u
        mujoco.mj_forward(m, data)
        there.append(data.qacc[order])
        here.append(sign * a(sign * (q[order] - zero), sign * v[order], (sign[0] * u,)))
    return np.abs(np.array(there) - here).max() / np.abs(there).max()


def along(n, sign=None, zero=0.0):
    """Joints in the file's order."""
    return np.arange(n), np.ones(n) if sign is None else np.array(sign), np.zeros(n) + zero


@pytest.mark.parametrize("name", SPECIMENS)
def test_a_file_moves_as_mujoco_moves_it_and_gives_the_numbers_it_was_written_with(name, tmp_path):
    """Bodies typed by hand, not by our exporter; a mass added to a body is part of it in the file."""
    plant, path = SPECIMENS[name].plant, tmp_path / "rig.xml"
    path.write_text(SPECIMENS[name].mjcf)
    rig = up.from_mjcf(path)
    # rounding of MuJoCo's quaternions and of our elimination: 1e-15, times a mass matrix' condition of up to 1e3
    assert furthest(path, along(len(plant.coordinates))) < 1e-9
    wanted, got = plant.parameters(), rig.plant.parameters()
    if "a_1" in wanted:
        first = next(iter(wanted))
        wanted = {**wanted, first: wanted[first] + wanted["a_1"], "a_1": 0.0}
    if type(rig.plant) is type(plant):
        assert got == pytest.approx(wanted, rel=1e-12, abs=1e-15)
    assert set(rig.sources.values()) == {"rig.xml"}


@pytest.mark.parametrize("name", ["pendulum", "cart-pendulum", "furuta out of level", "double-pendulum", "torsional-2"])
def test_what_is_exported_is_read_as_it_was(name, tmp_path):
    plant = SPECIMENS[name].plant
    dry = {j.coulomb: 0.01 * (i + 1) for i, j in enumerate(plant.joints)}
    plant = plant.replace(**dry) if name != "torsional-2" else plant.replace(a_1=0.0)
    known = up.Rig.known(plant, gain=0.65, limit=5.0, lag=0.02, more={"actuator.slope": 2e-3})
    path = tmp_path / "rig.xml"
    path.write_text(model(known)[0])
    rig = up.from_mjcf(path)
    assert rig.plant.parameters() == pytest.approx(plant.parameters(), rel=1e-12, abs=1e-15)
    assert (rig.gain, rig.limit, rig.lag) == (0.65, 5.0, 0.02)
    assert rig.more["actuator.slope"] == 2e-3
    assert rig.hardware.entries["limit"].source == "rig.xml"


def test_a_pole_that_is_drawn_upright_and_turns_the_other_way_is_read_about_hanging(tmp_path):
    """As Gymnasium's inverted pendulum: joint 0 stands, and the axis is y."""
    rod = ROD.replace("-0.2", "0.2")
    path = written(tmp_path / "rig.xml", cart(pivot='<joint name="pole" axis="0 1 0"/>', rod=rod), actuator=MOTOR)
    rig = up.from_mjcf(path)
    assert rig.plant.l_cg == pytest.approx(0.2)
    assert furthest(path, along(2, [1, -1], [0.0, math.pi])) < 1e-9
    assert read_mjcf(path).joints == {"x": "rail", "theta": "-(pole + 3.1416 rad)"}


def test_an_arm_whose_axis_points_down_is_read_with_its_lean(tmp_path):
    """Lean of 0.05 and -0.03 in the file's frame; psi counts about the file's axis."""
    lean, down = (0.05, -0.03), '<joint name="arm" axis="0 0 -1"/>'
    gravity = f"{9.81 * lean[0]} {9.81 * lean[1]} {-9.81 * math.sqrt(1 - lean[0] ** 2 - lean[1] ** 2)}"
    path = written(tmp_path / "rig.xml", arm(turn=down))
    path.write_text(path.read_text().replace("0 0 -9.81", gravity))
    plant = up.from_mjcf(path).plant
    assert (plant.tilt_x, plant.tilt_y) == pytest.approx((0.05, 0.03))
    assert furthest(path, along(2, [1, -1])) < 1e-9


def test_masses_and_inertias_of_geoms_are_those_of_their_shapes(tmp_path):
    """Closed forms: a box, and a cylinder about its middle, m (3 R^2 + h^2)/12; its density by a default."""
    box = '<geom type="box" size="0.1 0.05 0.04" mass="0.9"/>'
    rod = '<geom type="cylinder" fromto="0 0 0 0 0 -0.4" size="0.01" class="brass"/>'
    more = '<default><default class="brass"><geom density="8400"/></default></default>'
    bodies = f"<body>{SLIDE}{box}<body>{PIVOT}{rod}</body></body>"
    p = up.from_mjcf(written(tmp_path / "rig.xml", bodies, more=more)).plant
    mass = 8400 * math.pi * 0.01**2 * 0.4
    assert (p.m_c, p.m_p, p.l_cg) == pytest.approx((0.9, mass, 0.2))
    assert p.J_p == pytest.approx(mass * (3 * 0.01**2 + 0.4**2) / 12)


def test_bodies_welded_on_and_included_files_count(tmp_path):
    """A disk of 50 g at the rod's end: mass, centre of gravity and inertia by the parallel axes."""
    weight = '<body pos="0 0 -0.4"><inertial pos="0 0 0" mass="0.05" diaginertia="1e-5 1e-5 1e-5"/></body>'
    (tmp_path / "weight.xml").write_text(f"<mujocoinclude>{weight}</mujocoinclude>")
    p = up.from_mjcf(written(tmp_path / "rig.xml", cart(rod=ROD + '<include file="weight.xml"/>'))).plant
    l_cg = (0.3 * 0.2 + 0.05 * 0.4) / 0.35
    assert (p.m_p, p.l_cg) == pytest.approx((0.35, l_cg))
    assert p.J_p == pytest.approx(2e-3 + 1e-5 + 0.3 * (l_cg - 0.2) ** 2 + 0.05 * (0.4 - l_cg) ** 2)


def test_damping_and_friction_and_armature_become_the_plants(tmp_path):
    """Armature of a slide adds to the cart's mass, that of the pole to its inertia."""
    rail = '<joint name="rail" type="slide" axis="1 0 0" damping="0.7" frictionloss="0.2" armature="0.05"/>'
    pole = '<joint name="pole" axis="0 -1 0" damping="2e-3" frictionloss="1e-3" armature="1e-3"/>'
    p = up.from_mjcf(written(tmp_path / "rig.xml", cart(rail, pole))).plant
    assert (p.m_c, p.J_p, p.b_1, p.b_2) == pytest.approx((0.85, 3e-3, 0.7, 2e-3))
    assert (p.b_1c, p.b_2c) == (0.2, 1e-3)


def test_armature_and_an_uneven_rod_of_an_arm_move_as_in_mujoco(tmp_path):
    """J_d and J_a take what makes the rod's two transverse inertias differ, exactly."""
    rod = '<inertial pos="0.01 0 -0.2" mass="0.3" diaginertia="2e-3 1.6e-3 6e-4"/>'
    path = written(tmp_path / "rig.xml", arm('<joint name="pole" axis="-1 0 0" armature="3e-4"/>', rod))
    assert furthest(path, along(2)) < 1e-9
    assert up.from_mjcf(path).plant.r == pytest.approx(0.21)  # to the rod's centre of gravity, along the hinge


def test_a_chain_is_read_from_the_driven_body_on(tmp_path):
    """Bodies in the file's order 2, 1, 3; the spring's tendon turns the second disk the other way."""
    disk = '<body><joint name="{}" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 {}"/></body>'
    bodies = disk.format("middle", 0.02) + disk.format("motor", 0.03) + disk.format("end", 0.01)
    tendon = '<fixed stiffness="{}" damping="0.1"><joint joint="{}" coef="1"/><joint joint="{}" coef="{}"/></fixed>'
    joined = tendon.format(2.0, "motor", "middle", 1) + tendon.format(3.0, "middle", "end", -1)
    path = written(tmp_path / "rig.xml", bodies, more=f"<tendon>{joined}</tendon>", actuator='<motor joint="motor"/>')
    p = up.from_mjcf(path).plant
    assert (p.J_1, p.J_2, p.J_3, p.k_12, p.k_23, p.c_12) == pytest.approx((0.03, 0.02, 0.01, 2.0, 3.0, 0.1))
    assert furthest(path, (np.array([1, 0, 2]), np.array([1, -1, -1]), np.zeros(3))) < 1e-9


@pytest.mark.parametrize(
    ("bodies", "kind"),
    [
        (f"<body>{SLIDE}{CART}</body>", "Rectilinear1"),
        (f'<body><joint axis="0 0 1"/>{CART}</body>', "Torsional1"),
        (f'<body><joint axis="0 1 0"/>{CART}</body>', "Torsional1"),  # balanced about a level axis
        (f'<body><joint axis="0 1 0"/>{ROD}</body>', "Pendulum"),
    ],
)
def test_one_body_is_a_cart_a_disk_or_a_pendulum(bodies, kind, tmp_path):
    assert type(up.from_mjcf(written(tmp_path / "rig.xml", bodies)).plant).__name__ == kind


def test_the_drive_moves_the_rig_as_mujocos_actuator_does(tmp_path):
    """Gear, a push of its own, loss with speed, and both limits; fourth-order steps of 1 ms there and 0.25 ms here."""
    drive = '<general joint="rail" gear="4" gainprm="0.5" biastype="affine" biasprm="0.1 0 -0.05" ctrllimited="true" '
    drive += 'ctrlrange="-3 3" forcelimited="true" forcerange="-1.2 1.2"/>'
    flag = 'integrator="RK4" timestep="1e-3"'
    path = written(tmp_path / "rig.xml", cart(), actuator=drive, option=flag)
    rig = up.from_mjcf(path)
    assert (rig.gain, rig.unit, rig.limit) == (2.0, "1", 3.0)
    m = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(m)
    for command, seconds in ((1.0, 1.0), (9.0, 0.5)):
        mujoco.mj_resetData(m, data)
        data.ctrl, data.qpos[1] = command, 0.3
        mujoco.mj_step(m, data, nstep=round(seconds * 1000))
        x0, u = np.array([0.0, 0.0, 0.3, 0.0]), np.full((1, 1), command)
        here = simulate(
            rig.plant, rig.drive, x0, u, 1e-3, samples=2, substeps=4, every=round(seconds * 1000)
        )[-1, :, 0]  # fmt: skip
        assert np.abs(here - np.column_stack([data.qpos, data.qvel]).ravel()).max() < 1e-6


def test_travel_is_the_range_of_the_driven_joint_and_other_ranges_are_said(tmp_path):
    rail = '<joint name="rail" type="slide" axis="1 0 0" range="-0.4 0.5" limited="true"/>'
    pole = '<joint name="pole" axis="0 -1 0" range="-1 1" limited="true"/>'
    read = read_mjcf(written(tmp_path / "rig.xml", cart(rail, pole)))
    assert read.rig.travel == 0.4
    assert any("range of joint 'pole'" in line for line in read.left_out)
    assert any("nearer end" in line for line in read.left_out)
    assert "Left out: the range of joint 'pole'." in read.rig.basis.sentence


BALL = f'<body><joint type="ball"/>{ROD}</body>'
TWO = f"<body>{SLIDE}<joint axis='0 1 0'/>{ROD}</body>"
THREE = f"<body>{SLIDE}{CART}<body>{PIVOT}{ROD}<body pos='0 0 -.4'><joint axis='0 -1 0'/>{ROD}</body></body></body>"
ELBOW = f'<body>{PIVOT}{ROD}<body pos="0 0 -0.4"><joint name="elbow" axis="0 -1 0" armature="1e-3"/>{ROD}</body></body>'
SERVO = '<position joint="rail" kp="3"/>'
SPRUNG = '<joint name="pole" axis="0 -1 0" stiffness="0.4"/>'


@pytest.mark.parametrize(
    ("bodies", "more", "words"),
    [
        (f"<body>{ROD}</body>", {}, "has no joint"),
        (BALL, {}, "free or a ball"),
        (TWO, {}, "several joints"),
        (THREE, {}, r"joints \(slide, hinge, hinge\) are those of no plant .* plant of your own"),
        (cart(pivot=SPRUNG), {}, r"joint 'pole' has a spring \(0.4\)"),
        (cart(), {"option": 'density="1000" viscosity="1e-3"'}, None),
        (cart(), {"option": 'viscosity="10"'}, None),
        (cart(), {"actuator": SERVO}, "no drive of upright's"),
        (cart(), {"actuator": MOTOR * 2}, "2 actuators"),
        (cart(), {"actuator": '<motor joint="pole"/>'}, "acts on joint 'pole', and the drive of a cart-pendulum on x"),
        (ELBOW, {}, r"accelerations .* armature of a joint behind the first"),
        (cart(), {"more": '<equality><joint joint1="rail" joint2="pole"/></equality>'}, "equality constraints"),
        (arm(rod=ROD.replace("0 0 -0.2", "0 0.1 -0.2").replace("2e-3 2e-3 1e-5", "4e-3 3e-3 1.5e-3")), {}, "furuta"),
    ],
)
def test_what_none_of_our_plants_has_is_a_sentence(bodies, more, words, tmp_path):
    path = written(tmp_path / "rig.xml", bodies, **more)
    if words is None:  # a medium drags on geoms; without one there is nothing to refuse
        path.write_text(path.read_text().replace(ROD, '<geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.03"/>'))
        words = r"a medium \(density, viscosity\)"
    with pytest.raises(up.BadInput, match=rf"(?s)rig.xml: .*{words}"):
        up.from_mjcf(path)


@pytest.mark.parametrize("text", ["<mujoco><worldbody>", "<mujoco><worldbody><bodi/></worldbody></mujoco>", "a,b"])
def test_what_mujoco_cannot_read_is_its_reason(text, tmp_path):
    (tmp_path / "rig.xml").write_text(text)
    with pytest.raises(up.BadInput, match=r"MuJoCo cannot read rig.xml: "):
        up.from_mjcf(tmp_path / "rig.xml")


def test_without_mujoco_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(up.BadInput, match=r"pip install 'upright\[mujoco\]'"):
        up.from_mjcf(written(tmp_path / "rig.xml", cart()))


def test_verbs_take_the_file_and_init_makes_a_study_of_the_same_rig(tmp_path):
    drive = '<motor joint="rail" gear="20" ctrllimited="true" ctrlrange="-1 1"/>'
    path = written(tmp_path / "rig.xml", cart(), actuator=drive)
    answer = up.init(path, out=tmp_path / "rig.toml")
    assert "In the file's joints: x = rail, theta = pole." in answer.value
    study, read = read_stored_rig(tmp_path / "rig.toml"), up.from_mjcf(path)
    assert study.plant.parameters() == pytest.approx(read.plant.parameters(), rel=1e-13)
    assert (study.gain, study.limit, study.unit) == (read.gain, read.limit, read.unit)
    with pytest.raises(up.BadInput, match="exists already"):
        up.init(path, out=tmp_path / "rig.toml")
    loop = {"period": "2 ms", "counts": 4096}
    by_file, by_rig = (up.design(r, poles=[-3, -4, -5, -6], **loop).value for r in (path, read))
    np.testing.assert_array_equal(by_file.K, by_rig.K)


def test_a_log_of_the_files_motion_identifies_what_the_file_has(tmp_path):
    """MuJoCo swings the pole from 1 rad; its damping is estimated, all else is the file's."""
    pole = '<joint name="theta" axis="0 -1 0" damping="2e-3"/>'
    path = written(tmp_path / "rig.xml", f"<body>{pole}{ROD}</body>", option='integrator="RK4" timestep="1e-3"')
    m = mujoco.MjModel.from_xml_path(str(path))
    data, rows = mujoco.MjData(m), []
    data.qpos = 1.0
    for _ in range(1000):
        rows.append((data.time, data.qpos[0]))
        mujoco.mj_step(m, data, nstep=10)
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t,theta", comments="")
    fit = up.identify(tmp_path / "log.csv", path, ask=["b_2"], units={"theta": "rad"})
    assert fit.plant.b_2 == pytest.approx(2e-3, rel=1e-3)
    assert fit.plant.m_p == 0.3


def left_out(path):
    return [sentence for sentence in read_mjcf(path).left_out if sentence.startswith("Left out")]


POST = '<geom type="box" size="0.01 0.01 0.1" pos="0.5 0 0" {}/>'
STICK = '<geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.01" mass="0.1" {}/>'


@pytest.mark.parametrize(
    ("post", "stick", "flag", "said"),
    [
        ("", "", "", True),  # a pole may strike what stands in the world
        ('contype="0" conaffinity="0"', "", "", False),
        ("", 'contype="0" conaffinity="0"', "", False),
        ('contype="2" conaffinity="2"', "", "", False),  # bits that do not meet
        ('contype="2" conaffinity="2"', 'contype="1" conaffinity="2"', "", True),
        ("", "", '<option><flag contact="disable"/></option>', False),
    ],
)
def test_contacts_are_left_out_aloud_where_the_file_has_some(post, stick, flag, said, tmp_path):
    """In MuJoCo two geoms touch where a bit of one's type is in the other's affinity, unless one carries the other."""
    bodies = f"{POST.format(post)}{cart(rod=STICK.format(stick))}"
    path = written(tmp_path / "rig.xml", bodies, more=flag)
    assert left_out(path) == ["Left out: contacts between bodies."] * said


def test_a_pole_and_its_own_cart_do_not_touch_and_friction_of_tendons_is_left_out_aloud(tmp_path):
    box = '<geom type="box" size="0.1 0.05 0.04" mass="0.9"/>'
    bodies = f"<body>{SLIDE}{box}<body>{PIVOT}{STICK.format('')}</body></body>"
    assert left_out(written(tmp_path / "rig.xml", bodies)) == []
    disk = '<body><joint name="{}" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 0.02"/></body>'
    for friction, said in (("", []), ('frictionloss="0.1"', ["Left out: friction of tendons."])):
        joined = (
            f'<tendon><fixed stiffness="2" {friction}><joint joint="a" coef="1"/><joint joint="b" coef="-1"/></fixed>'
        )
        path = written(tmp_path / "rig.xml", disk.format("a") + disk.format("b"), more=f"{joined}</tendon>")
        assert left_out(path) == said
