"""Does a study say in SI what its author wrote? Logs come from closed forms: cos(w t) and sin(w t)."""

import math

import numpy as np
import pytest

from tests.study.crane_log import RIG, RUN, SENSORS, THETA, T, X, one
from upright.errors import BadInput
from upright.study.load import load_study


def test_parameters_arrive_in_si_whatever_their_unit(study):
    p = study(RIG + SENSORS + RUN).model.parameters
    assert p["m_p"].value == pytest.approx(0.107)
    assert (p["l_cg"].value, p["l_cg"].uncertainty) == pytest.approx((0.23, 0.002))
    assert p["J_p"].value == 1.6e-3
    assert (p["J_p"].lower, p["J_p"].upper) == pytest.approx((0.0, 5e-3))
    assert p["b_1c"].unit == "N"
    assert p["g"].value == 9.81


def test_only_guesses_are_asked(study):
    assert study(RIG + SENSORS + RUN).model.estimated == ("J_p", "b_1c")


def test_an_uncertainty_in_percent_is_of_the_value(study):
    text = RIG.replace('"2 mm"', '"5 %"')
    assert study(text + SENSORS + RUN).model.parameters["l_cg"].uncertainty == pytest.approx(0.05 * 0.23)


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
    p = study(f"{RIG}[actuator]\ngain = {gain}\n{drive}\n{SENSORS}{RUN}").model.parameters["actuator.gain"]
    assert (p.value, p.unit) == (pytest.approx(value), unit)


def test_actuator_numbers_left_out_pass_the_command_as_it_is(study):
    p = study(RIG + SENSORS + RUN).model.parameters
    names = ("gain", "offset", "limit", "lag", "delay", "slope")
    assert [p[f"actuator.{n}"].value for n in names] == [1.0, 0.0, math.inf, 0.0, 0.0, 0.0]


def test_the_slope_is_force_per_speed_and_times_are_seconds(study):
    p = study(
        RIG + '[actuator]\nslope = "2 N s/m"\nlag = "20 ms"\ndelay = { guess = "1 ms", max = "5 ms" }\n' + SENSORS + RUN
    )
    assert p.model.parameters["actuator.slope"].value == 2
    assert p.model.parameters["actuator.lag"].value == pytest.approx(0.02)
    assert p.model.parameters["actuator.delay"].estimate


def test_a_drive_that_trips_and_fades_is_read_with_its_units(study):
    text = 'end = { guess = "2500 ms" }\nstandby = "2 N s/m"\nknee = "300 mm/s"\nfade = { guess = "1 N s/m" }\n'
    p = study(f"{RIG}[actuator]\n{text}start = -inf\n{SENSORS}{RUN}").model.parameters
    assert p["actuator.end"].value == pytest.approx(2.5)
    assert p["actuator.end"].estimate
    assert (p["actuator.standby"].unit, p["actuator.standby"].value) == ("N s/m", 2.0)
    assert (p["actuator.knee"].unit, p["actuator.knee"].value) == ("m/s", pytest.approx(0.3))
    assert p["actuator.fade"].lower == 0.0
    assert (p["actuator.start"].value, p["actuator.damping"].value) == (-math.inf, 0.0)
    with pytest.raises(BadInput, match="knee"):
        study(f"{RIG}[actuator]\nknee = 0\n{SENSORS}{RUN}")


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
            + 'label = "half"\nknown = { m_p = "200 g" }\ninitial = { theta = "90 deg", x_dot = 0 }\n'
            + 'score_from = "2 s"\n'
            + "sensors.theta.sign = -1\n"
        )
    )
    assert run.known == {"m_p": pytest.approx(0.2)}
    assert run.initial == {"theta": pytest.approx(math.pi / 2), "x_dot": 0.0}
    assert run.unknown == ("initial", "friction")
    assert (run.horizon, run.score_from, run.label) == (0.5, 2.0, "half")
    np.testing.assert_array_equal(run.y[:, 1], -THETA)


def test_runs_name_what_they_share_with_others(study):
    text = '[defaults]\nshared = { friction = "Monday" }\nspread = { friction = 0.15, scale.x = 0.5 }\n'
    first, second = study(
        RIG
        + SENSORS
        + text
        + RUN
        + RUN
        + 'label = "b"\nshared = { gain = "loop", scale.x = "loop", "offset.x" = "rig" }\n'
    ).runs
    assert first.shared == {"friction": "Monday"}
    assert second.shared == {"gain": "loop", "scale.x": "loop", "offset.x": "rig"}
    assert second.spread == {"friction": 0.15, "scale.x": 0.5}


def test_a_loop_carries_gains_in_the_order_of_the_states(study):
    loop = 'loop = { gains = { x = "2.5 V/m", theta_dot = "0.1 V s/rad" }, reference = "where(t < 1, 0, 0.2)" }\n'
    drive = '[drive]\ncolumn = "v"\nunit = "V"\n'
    run = one(study(RIG + SENSORS + drive + RUN + loop))
    r = np.where(T < 1, 0, 0.2)
    np.testing.assert_array_equal(run.loop.law.signal()[:, 0], r)
    u, _ = run.loop.follow(np.column_stack([X, THETA]), ("x", "theta"))
    theta_dot = np.diff(THETA, prepend=THETA[0]) / run.period  # the loop starts where the data do: no jump
    np.testing.assert_allclose(u, 2.5 * (r - X) - 0.1 * theta_dot, atol=1e-12)
    np.testing.assert_array_equal(run.u, 0)  # what the law commands is not fed in a second time


def test_a_loop_reference_may_be_a_length(study):
    run = one(study(RIG + SENSORS + RUN + 'loop = { gains = { x = 2.5 }, reference = "20 cm", k_pf = 1 }\n'))
    u, _ = run.loop.follow(np.zeros((3, 1)), ("x",))
    np.testing.assert_allclose(u, 1.0 * 0.2 + 2.5 * 0.0)


def test_a_user_plant_is_found_beside_the_study(study, tmp_path):
    (tmp_path / "my_plant.py").write_text(
        "from upright.physics import Coordinate, Plant\n"
        "from upright.quantities import quantity\n"
        "class Mass(Plant):\n"
        '    m: float = quantity("kg", "mass", above=0)\n'
        '    coordinates = (Coordinate("x", "m", "place"),)\n'
        "    @staticmethod\n"
        "    def energies(p, q, v):\n"
        "        return p.m * v[0] ** 2 / 2, 0, 0\n",
        encoding="utf-8",
    )
    run = study('[rig]\nplant = "my_plant.py:Mass"\n[parameters]\nm = { guess = 1 }\n[sensors.x]\n' + RUN)
    assert run.model.plant.__name__ == "Mass"
    assert one(run).u.shape == (T.size, 0)


def test_data_may_lie_elsewhere(study, tmp_path):
    study(RIG + SENSORS + RUN)
    (tmp_path / "there").mkdir()
    (tmp_path / "log.csv").rename(tmp_path / "there" / "log.csv")
    assert one(load_study(tmp_path / "study.toml", data=tmp_path / "there")).t.size == T.size


def test_a_fitted_model_replaces_every_number_and_asks_nothing(study, tmp_path):
    study(RIG + SENSORS + RUN)
    rig = load_study(tmp_path / "study.toml", fixed={"J_p": 2e-3, "m_c": 0.7, "actuator.gain": 3.0}).model
    assert rig.estimated == ("b_1c",)
    assert [rig.parameters[n].value for n in ("J_p", "m_c", "actuator.gain")] == [2e-3, 0.7, 3.0]
