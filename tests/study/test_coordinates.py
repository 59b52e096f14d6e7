"""Are coordinates read where a column measures a sum of several, and refused where that does not tell them?"""

import math
import re

import numpy as np
import pytest

from tests.study.crane_log import RIG, RUN, THETA, T, X, one
from upright.errors import BadInput
from upright.identification import identify
from upright.physics import DoublePendulum, DoublePendulumAbsolute
from upright.simulation import simulate

TIP = '[sensors.x]\ncolumn = "tip"\nexpression = "x + 0.3*theta"\n'
LAW = '[actuator]\ngain = "2 N/V"\n[drive]\ncolumn = "v"\nunit = "V"\n'
LINKS = """
[rig]
plant = "double-pendulum-absolute"
[parameters]
m_1 = 0.35
m_2 = 0.2
l_1 = 0.2
l_c1 = 0.11
l_c2 = { guess = 0.11 }
J_1 = 1e-3
J_2 = { guess = 1.5e-3 }
b_1 = { guess = 2e-3 }
b_2 = { guess = 4e-3 }
b_1c = { guess = 1e-3 }
b_2c = { guess = 2e-3 }
[sensors.theta_1]
[[runs]]
file = "log.csv"
"""
RELATIVE = '[sensors.theta_2]\ncolumn = "enc2"\nexpression = "theta_2 - theta_1"\n'
TRUTH = {
    "m_1": 0.35, "m_2": 0.2, "l_1": 0.2, "l_c1": 0.11, "l_c2": 0.13, "J_1": 1e-3, "J_2": 8e-4, "b_1": 5e-3, "b_2": 2e-3,
    "b_1c": 3e-3, "b_2c": 8e-3,
}  # fmt: skip


@pytest.mark.parametrize(
    ("sensors", "columns"),
    [
        (TIP + "[sensors.theta]\n", {"tip": X + 0.3 * THETA, "theta": THETA}),
        (
            TIP + 'unit = "mm"\nsign = -1\noffset = "20 mm"\n[sensors.theta]\nunit = "deg"\n',
            {"tip": 20 - 1e3 * (X + 0.3 * THETA), "theta": np.degrees(THETA)},
        ),
        (
            TIP + '[sensors.theta]\ncolumn = "b"\nexpression = "2*(theta - 5*x)"\n',
            {"tip": X + 0.3 * THETA, "b": 2 * THETA - 10 * X},
        ),
    ],
    ids=["one", "units", "both"],
)
def test_coordinates_are_told_by_as_many_sums(study, sensors, columns):
    run = one(study(RIG + sensors + RUN, **columns))
    assert run.measured == ("x", "theta")
    np.testing.assert_allclose(run.y, np.column_stack([X, THETA]), rtol=0, atol=1e-13)
    assert "x read as" in run.source


def test_a_locked_coordinate_needs_no_sensor(study):
    run = one(study(RIG + TIP + RUN + 'locked = { theta = "0.5 rad" }\n', tip=X + 0.15))
    np.testing.assert_allclose(run.y[:, 0], X, rtol=0, atol=1e-15)


def test_a_held_coordinate_may_be_read_from_a_sum(study):
    run = one(study(RIG + TIP + "[sensors.theta]\n" + RUN + 'held = ["x"]\n', tip=X + 0.3 * THETA, theta=THETA))
    np.testing.assert_allclose(run.held["x"], X, rtol=0, atol=1e-15)


def test_steps_of_two_encoders_add_up_as_their_roundings_scatter(study):
    per_m, per_rev = 20_000, 4096
    tip, theta = np.round((X + 0.3 * THETA) * per_m), np.round(THETA * per_rev / (2 * math.pi))
    counts = f'unit = "counts"\ncounts_per_m = {per_m}\n[sensors.theta]\nunit = "counts"\ncounts_per_rev = {per_rev}\n'
    run = one(study(RIG + TIP + counts + RUN, tip=tip, theta=theta))
    scatter = np.std(run.y[:, 0] - X)  # of 2000 roundings: off by 1.6 % (one sigma)
    assert run.resolution[0] / math.sqrt(12) == pytest.approx(scatter, rel=0.06)


def test_a_law_on_coordinates_begins_at_what_the_sum_tells(study):
    loop = '[runs.loop]\ngains = { x = "2 V/m" }\n'
    columns = {"tip": X + 0.3 * THETA + 0.01, "theta": THETA, "v": 0 * T}
    run = one(study(RIG + LAW + TIP + "[sensors.theta]\n" + RUN + loop, **columns))
    assert run.loop.law.initial[0] == pytest.approx(0.01, abs=1e-15)


@pytest.mark.parametrize(
    ("sensors", "run", "says"),
    [
        (TIP, "", "no sensor determines theta: add [sensors.theta], lock theta in this run, or state the plant in"),
        (TIP + '[sensors.theta]\nexpression = "theta + x/0.3"\n', "", "x, theta do not determine these coordinates"),
        ('[sensors.x]\nexpression = "2*theta"\n', "", "measures '2*theta', without x in it; call it [sensors.theta]"),
        ('[sensors.x]\nexpression = "x + tip"\n', "", "'tip' is no coordinate"),
        ('[sensors.x]\nexpression = "x*theta"\n', "", "is no sum of coordinates times numbers"),
        ('[sensors.x]\nexpression = "x*1e299*1e299"\n', "", "factors beyond 1e300"),
        ("[sensors.x]\nexpression = 3\n", "", "got 3"),
        (TIP + "[sensors.theta]\n", 'unknown = ["scale.x"]\n', "scale.x is of one sensor"),
        (TIP + "[sensors.theta]\n", 'shared = { scale.theta = "today" }\n', "scale.theta is of one sensor"),
        (TIP + "[sensors.theta]\n", 'unknown = ["offset.theta"]\n', "ask for offset, one of each coordinate"),
        (TIP + "[sensors.theta]\n", '[[ladder]]\nname = "a"\nunknown = ["offset.theta"]\n', "ask for offset, one of"),
        (TIP + "[sensors.theta]\n", '[runs.loop]\nkind = "pid"\nunits = "log"\nkp = 2\n', "write the law in SI"),
        (TIP + "[sensors.theta]\n", "[runs.loop]\ngains = { x = 2 }\nquantized = true\n", "write the law in SI"),
        (TIP + "[sensors.theta]\n", '[runs.loop]\nkind = "recover"\n', "write the law in SI"),
    ],
)  # fmt: skip
def test_what_a_sum_does_not_tell_is_a_sentence(study, sensors, run, says):
    with pytest.raises(BadInput, match=r"study.toml, line \d+: [^\n]*" + re.escape(says)):
        study(RIG + LAW + sensors + RUN + run, tip=X, theta=THETA, v=0 * T)


def test_the_zero_of_a_sensor_that_no_other_coordinate_needs_may_be_asked(study):
    asked = RIG + TIP + "[sensors.theta]\n" + RUN + 'unknown = ["initial", "offset.x"]\n'
    assert "offset.x" in one(study(asked, tip=X, theta=THETA)).unknown


@pytest.fixture(scope="module")
def swing():
    """Absolute angles of a double pendulum with dry joints, stated and simulated in relative ones."""
    x = simulate(DoublePendulum(**TRUTH), {}, [1.4, 0.0, -1.8, 0.0], None, 5e-3, samples=801, substeps=4)
    return np.cumsum(x[:, ::2, 0], axis=1)


@pytest.mark.parametrize("noise", [0.0, 2e-3])
def test_relative_encoders_identify_a_plant_in_absolute_angles(study, swing, noise):
    first, second = swing.T
    a, b, c = noise * np.random.default_rng(5).standard_normal((3, len(swing)))
    t = 5e-3 * np.arange(len(swing))
    by_camera = study(LINKS + "[sensors.theta_2]\n", t=t, theta_1=first + a, theta_2=second + c)
    by_encoders = study(LINKS + RELATIVE, t=t, theta_1=first + a, enc2=second - first + b)
    fits = [identify(s.model, s.runs) for s in (by_camera, by_encoders)]
    assert by_encoders.model.plant is DoublePendulumAbsolute
    for name in by_camera.model.estimated:
        camera, encoders = (fit.estimates[name] for fit in fits)
        if noise:  # the two share the noise of the first angle alone: at most as far apart as their errors together
            assert abs(camera.value - encoders.value) < 4 * math.hypot(camera.stderr, encoders.stderr)
            assert abs(encoders.value - TRUTH[name]) < 4 * encoders.stderr
        else:
            assert encoders.value == pytest.approx(camera.value, rel=1e-6)
            assert encoders.value == pytest.approx(TRUTH[name], rel=1e-4)
