"""Does a study say in SI what its author wrote? Logs come from closed forms: cos(w t) and sin(w t)."""

import math

import numpy as np
import pytest

from upright.identification.study import load_study

T = np.arange(2000) * 0.005
THETA = 0.3 * np.cos(6 * T)
X = 0.05 * np.sin(2 * T)

RIG = """
[rig]
plant = "cart-pendulum"
[parameters]
m_c = "0.5 kg"
m_p = "107 g"
l_cg = { value = "23 cm", uncertainty = "2 mm" }
J_p = { guess = "1.6e-3 kg m^2", max = "50 kg cm^2" }
b_1c = { guess = 0.2 }
"""
SENSORS = """
[sensors.theta]
[sensors.x]
"""


@pytest.fixture
def study(tmp_path):
    """Load a study written beside a log with the given columns; time and the two coordinates if none are given."""

    def load(text, *, t=T, log="log.csv", name="study.toml", **columns):
        columns = columns or {"theta": THETA, "x": X, "v": 2 * T}
        rows = np.column_stack([t, *columns.values()])
        np.savetxt(tmp_path / log, rows, "%.17g", ",", header=",".join(["t", *columns]), comments="")
        (tmp_path / name).write_text(text)
        return load_study(tmp_path / name)

    return load


def one(study):
    (run,) = study.runs
    return run


RUN = '[[runs]]\nfile = "log.csv"\n'


def test_parameters_arrive_in_si_whatever_their_unit(study):
    p = study(RIG + SENSORS + RUN).rig.parameters
    assert p["m_p"].value == pytest.approx(0.107)
    assert (p["l_cg"].value, p["l_cg"].uncertainty) == pytest.approx((0.23, 0.002))
    assert p["J_p"].value == 1.6e-3
    assert (p["J_p"].lower, p["J_p"].upper) == pytest.approx((0.0, 5e-3))
    assert p["b_1c"].unit == "N"
    assert p["g"].value == 9.81


def test_only_guesses_are_asked(study):
    assert study(RIG + SENSORS + RUN).rig.estimated == ("J_p", "b_1c")


def test_an_uncertainty_in_percent_is_of_the_value(study):
    text = RIG.replace('"2 mm"', '"5 %"')
    assert study(text + SENSORS + RUN).rig.parameters["l_cg"].uncertainty == pytest.approx(0.05 * 0.23)


@pytest.mark.parametrize(
    ("drive", "gain", "value", "unit"),
    [
        ('[drive]\ncolumn = "v"\nunit = "V"', '"5.25 N/V"', 5.25, "N/V"),
        ('[drive]\ncolumn = "v"\nunit = "V"', '"5.25 mN/mV"', 5.25, "N/V"),
        ('[drive]\ncolumn = "v"\nunit = "mV"', '"5.25 N/V"', 5.25e-3, "N/mV"),
        ('[drive]\ncolumn = "v"\nunit = "counts"', '"2 mN/count"', 2e-3, "N/counts"),
        ('[drive]\ncolumn = "v"', '"5.25 N/V"', 5.25, "N/V"),
        ('[drive]\ncolumn = "v"', "5.25", 5.25, "N"),
    ],
)
def test_the_gain_is_force_per_unit_of_the_command(study, drive, gain, value, unit):
    p = study(f"{RIG}[actuator]\ngain = {gain}\n{drive}\n{SENSORS}{RUN}").rig.parameters["actuator.gain"]
    assert (p.value, p.unit) == (pytest.approx(value), unit)


def test_actuator_numbers_left_out_pass_the_command_as_it_is(study):
    p = study(RIG + SENSORS + RUN).rig.parameters
    names = ("gain", "offset", "limit", "lag", "delay", "slope")
    assert [p[f"actuator.{n}"].value for n in names] == [1.0, 0.0, math.inf, 0.0, 0.0, 0.0]


def test_the_slope_is_force_per_speed_and_times_are_seconds(study):
    p = study(
        RIG + '[actuator]\nslope = "2 N s/m"\nlag = "20 ms"\ndelay = { guess = "1 ms", max = "5 ms" }\n' + SENSORS + RUN
    )
    assert p.rig.parameters["actuator.slope"].value == 2
    assert p.rig.parameters["actuator.lag"].value == pytest.approx(0.02)
    assert p.rig.parameters["actuator.delay"].estimate


@pytest.mark.parametrize(
    ("sensor", "reading"),
    [
        ("", THETA),
        ('unit = "deg"', np.degrees(THETA)),
        ('unit = "mrad"', 1e3 * THETA),
        ('unit = "rev"', THETA / (2 * math.pi)),
        ("sign = -1", -THETA),
        ("scale = 2.0", THETA / 2),
        ("offset = 0.25", THETA + 0.25),
        ('offset = "180 deg"', THETA + math.pi),
        ('offset = "180 deg"\nsign = -1', math.pi - THETA),
        ('unit = "deg"\noffset = 180', np.degrees(THETA) + 180),
        ('unit = "V"\nscale = "35 deg/V"\noffset = "2.5 V"', np.degrees(THETA) / 35 + 2.5),
        ('unit = "V"\nscale = 0.5', THETA / 0.5),
        ('unit = "mV"\nscale = "35 deg/V"', 1e3 * np.degrees(THETA) / 35),
        ('unit = "counts"\nscale = 0.001', THETA / 0.001),
        ('unit = "counts"\ncounts_per_rev = 16000', THETA * 16000 / (2 * math.pi)),
        ('unit = "counts"\ncounts_per_rev = 16000\noffset = 120', THETA * 16000 / (2 * math.pi) + 120),
    ],
)
def test_a_sensor_turns_readings_into_the_coordinate(study, sensor, reading):
    run = one(study(RIG + f"[sensors.theta]\n{sensor}\n" + RUN, theta=reading, x=X))
    np.testing.assert_allclose(run.y[:, 0], THETA, rtol=0, atol=1e-12)


def test_whole_numbers_are_counts_when_counts_per_turn_are_given(study):
    counts = np.round(THETA * 4096 / (2 * math.pi))
    run = one(study(RIG + "[sensors.theta]\ncounts_per_rev = 4096\n" + RUN, theta=counts, x=X))
    assert run.quantum == pytest.approx((2 * math.pi / 4096,))
    assert np.abs(run.y[:, 0] - THETA).max() <= math.pi / 4096 + 1e-12  # half a count


def test_radians_stay_radians_and_counts_per_turn_set_their_resolution(study):
    run = one(study(RIG + "[sensors.theta]\ncounts_per_rev = 14400\nsign = -1\n" + RUN))
    np.testing.assert_array_equal(run.y[:, 0], -THETA)
    assert run.quantum == pytest.approx((2 * math.pi / 14400,))


def test_a_position_in_counts_needs_counts_per_metre(study):
    run = one(study(RIG + '[sensors.x]\nunit = "counts"\ncounts_per_m = 226629\n' + RUN, x=X * 226629))
    np.testing.assert_allclose(run.y[:, 0], X, atol=1e-12)
    assert run.quantum == pytest.approx((1 / 226629,))


def test_an_angle_that_jumps_by_a_turn_is_unwrapped(study):
    spinning = 5 * T
    wrapped = np.angle(np.exp(1j * spinning))
    run = one(study(RIG + "[sensors.theta]\n" + RUN, theta=wrapped, x=X))
    np.testing.assert_allclose(run.y[:, 0], spinning, atol=1e-9)
    assert "unwrapped" in run.source


def test_a_drive_may_be_arithmetic_on_columns(study):
    run = one(study(RIG + SENSORS + '[drive]\nexpression = "2.5*(0.2 - x)"\nunit = "V"\n' + RUN))
    np.testing.assert_allclose(run.u[:, 0], 2.5 * (0.2 - X), atol=1e-15)


def test_drive_sign_and_scale_apply_and_a_run_may_replace_the_drive(study):
    drive = '[drive]\ncolumn = "v"\nsign = -1\nscale = 10\n'
    more = '[[runs]]\nlabel = "free"\nfile = "log.csv"\ndrive = 0\n'
    more += '[[runs]]\nlabel = "other"\nfile = "log.csv"\ndrive = { expression = "3*v", sign = 1 }\n'
    first, free, other = study(RIG + SENSORS + drive + RUN + more).runs
    np.testing.assert_allclose(first.u[:, 0], -20 * T)
    np.testing.assert_array_equal(free.u, 0)
    np.testing.assert_allclose(other.u[:, 0], 60 * T)


def test_a_plant_without_drive_runs_free(study):
    np.testing.assert_array_equal(one(study(RIG + SENSORS + RUN)).u, np.zeros((T.size, 1)))


def test_a_window_keeps_its_part_of_the_record(study):
    run = one(study(RIG + SENSORS + RUN + "window = [1.0, 2.0]\n"))
    np.testing.assert_allclose(run.t, T[200:401])
    np.testing.assert_allclose(run.y[:, 1], THETA[200:401])
    run = one(study(RIG + SENSORS + RUN + 'window = ["500 ms", "end"]\n'))
    assert (run.t[0], run.t[-1]) == pytest.approx((0.5, T[-1]))


def test_several_windows_of_one_file_are_several_runs(study):
    text = (
        RIG
        + SENSORS
        + RUN
        + 'window = [0, 5]\n[[runs]]\nlabel = "tail"\nfile = "log.csv"\nwindow = [5, "end"]\nrole = "predict"\n'
    )
    first, tail = study(text).runs
    assert (first.label, first.role, tail.role) == ("log", "fit", "predict")
    assert tail.t[0] == pytest.approx(5)


def test_a_locked_body_is_not_compared_and_a_held_one_is_prescribed(study):
    locked = one(study(RIG + SENSORS + RUN + 'locked = { x = "5 mm" }\n'))
    assert locked.measured == ("theta",)
    assert locked.held == {"x": pytest.approx(0.005)}
    held = one(study(RIG + SENSORS + RUN + 'held = ["x"]\n'))
    assert held.measured == ("theta",)
    np.testing.assert_allclose(held.held["x"], X)


def test_a_locked_body_needs_no_column(study):
    run = one(study(RIG + SENSORS + RUN + 'locked = ["x"]\n', theta=THETA))
    assert run.held == {"x": 0.0}


def test_what_a_run_says_about_itself_arrives(study):
    run = one(
        study(
            RIG
            + SENSORS
            + '[defaults]\nunknown = ["initial", "friction"]\nhorizon = "0.5 s"\n'
            + RUN
            + 'label = "half"\nknown = { m_p = "200 g" }\ninitial = { theta = "90 deg", x_dot = 0 }\nscore_from = "2 s"\n'
            + "sensors.theta.sign = -1\n"
        )
    )
    assert run.known == {"m_p": pytest.approx(0.2)}
    assert run.initial == {"theta": pytest.approx(math.pi / 2), "x_dot": 0.0}
    assert run.unknown == ("initial", "friction")
    assert (run.horizon, run.score_from, run.label) == (0.5, 2.0, "half")
    np.testing.assert_array_equal(run.y[:, 1], -THETA)


def test_a_loop_carries_gains_in_the_order_of_the_states(study):
    loop = 'loop = { gains = { x = "2.5 V/m", theta_dot = "0.1 V s/rad" }, reference = "where(t < 1, 0, 0.2)" }\n'
    drive = '[drive]\ncolumn = "v"\nunit = "V"\n'
    run = one(study(RIG + SENSORS + drive + RUN + loop))
    assert run.loop.gains == (2.5, 0.0, 0.0, 0.1)
    assert run.loop.k_pf == 2.5
    np.testing.assert_array_equal(run.loop.reference, np.where(T < 1, 0, 0.2))
    np.testing.assert_array_equal(run.u, 0)  # what the law commands is not fed in a second time


def test_a_loop_reference_may_be_a_length(study):
    run = one(study(RIG + SENSORS + RUN + 'loop = { gains = { x = 2.5 }, reference = "20 cm", k_pf = 1 }\n'))
    assert (run.loop.reference, run.loop.k_pf) == (pytest.approx(0.2), 1.0)


def test_jittering_samples_are_brought_onto_the_period_they_jitter_about(study):
    rng = np.random.default_rng(1)
    t = T + rng.uniform(-1e-3, 1e-3, T.size)
    run = one(study(RIG + SENSORS + RUN, t=t, theta=0.3 * np.cos(6 * t), x=np.zeros_like(t)))
    assert run.period == pytest.approx(0.005, rel=1e-4)
    # straight lines between samples h apart: error below h^2/8 max |theta''|
    bound = (7e-3) ** 2 / 8 * 0.3 * 36
    assert np.abs(run.y[:, 1] - 0.3 * np.cos(6 * run.t)).max() < bound
    assert "resampled" in run.source


def test_commands_are_held_not_interpolated(study):
    step = np.where(T < 3.0, 0.0, 1.0)
    run = one(study(RIG + SENSORS + '[drive]\ncolumn = "v"\n' + RUN + 'period = "2 ms"\n', theta=THETA, x=X, v=step))
    np.testing.assert_array_equal(run.u[:, 0], np.where(run.t < 3.0 - 1e-9, 0.0, 1.0))
    assert run.period == pytest.approx(0.002)


def test_a_whole_multiple_of_the_period_picks_samples(study):
    run = one(study(RIG.replace('"cart-pendulum"', '"cart-pendulum"\nperiod = "20 ms"') + SENSORS + RUN))
    np.testing.assert_allclose(run.y[:, 1], THETA[::4], atol=1e-12)


def test_lost_samples_are_told(study):
    keep = np.ones(T.size, bool)
    keep[700:710] = False
    run = one(study(RIG + SENSORS + RUN, t=T[keep], theta=THETA[keep], x=X[keep]))
    assert "1 gap(s)" in run.source
    assert run.t.size == T.size


def test_a_user_plant_is_found_beside_the_study(study, tmp_path):
    (tmp_path / "my_plant.py").write_text(
        "from upright.physics import Coordinate, Plant\n"
        "from upright.quantities import quantity\n"
        "class Mass(Plant):\n"
        '    m: float = quantity("kg", "mass", above=0)\n'
        '    coordinates = (Coordinate("x", "m", "place"),)\n'
        "    @staticmethod\n"
        "    def energies(p, q, v):\n"
        "        return p.m * v[0] ** 2 / 2, 0, 0\n"
    )
    run = study('[rig]\nplant = "my_plant.py:Mass"\n[parameters]\nm = { guess = 1 }\n[sensors.x]\n' + RUN)
    assert run.rig.plant.__name__ == "Mass"
    assert one(run).u.shape == (T.size, 0)


def test_data_may_lie_elsewhere(study, tmp_path):
    study(RIG + SENSORS + RUN)
    (tmp_path / "there").mkdir()
    (tmp_path / "log.csv").rename(tmp_path / "there" / "log.csv")
    assert one(load_study(tmp_path / "study.toml", data=tmp_path / "there")).t.size == T.size


def test_a_fitted_model_replaces_every_number_and_asks_nothing(study, tmp_path):
    study(RIG + SENSORS + RUN)
    rig = load_study(tmp_path / "study.toml", fixed={"J_p": 2e-3, "m_c": 0.7, "actuator.gain": 3.0}).rig
    assert rig.estimated == ("b_1c",)
    assert [rig.parameters[n].value for n in ("J_p", "m_c", "actuator.gain")] == [2e-3, 0.7, 3.0]
