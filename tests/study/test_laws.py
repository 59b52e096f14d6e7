"""Does a run's loop command what its keys say, sample by sample? Commands worked out by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.study.crane_log import RIG, RUN, SENSORS
from upright.closed_loop import ClosedLoop
from upright.errors import BadInput
from upright.records import Record
from upright.study.load import load_study
from upright.study.loop import gain_unit, state_units

DT = 0.01
T = DT * np.arange(40)
X0, THETA0 = 0.1, -0.2
RECORD = Record(t=T, signals={"x": X0 + 0 * T, "theta": THETA0 + T, "r": 3 * T, "v": 2 + 0 * T})
DRIVE = '[drive]\ncolumn = "v"\nunit = "V"\n'


def loop_of(keys: str, sensors: str = SENSORS, drive: str = DRIVE) -> ClosedLoop:
    study = RIG + sensors + drive + RUN + f"[runs.loop]\n{keys}\n"
    loop = load_study(Path("s.toml"), text=study, records={"log.csv": RECORD}).runs[0].loop
    assert loop is not None
    return loop


def refusal(keys: str) -> str:
    with pytest.raises(BadInput) as caught:
        loop_of(keys)
    return str(caught.value)


X = np.array([0.1, 0.2, 0.15, 0.15])
Q = np.array([-0.2, 0.0, 0.1, 0.3])
BOTH = np.column_stack([X, Q])
R = 3 * T[:4]


def commands(keys: str, y: np.ndarray = X[:, None], names: tuple[str, ...] = ("x",), **more) -> np.ndarray:
    return loop_of(keys, **more).follow(y, names)[0]


def rate(x: np.ndarray, first: float) -> np.ndarray:
    return np.diff(x, prepend=first) / DT


def test_state_feedback_subtracts_each_state_times_its_gain():
    gains = 'gains = { x = 2.5, x_dot = "30 mV s/m", theta = -4, theta_dot = 0.5 }\nreference = "r"\n'
    feedback = 0.03 * rate(X, X0) - 4 * Q + 0.5 * rate(Q, THETA0)
    np.testing.assert_allclose(commands(gains, BOTH, ("x", "theta")), 2.5 * (R - X) - feedback)
    np.testing.assert_allclose(commands(gains + "k_pf = 7\n", BOTH, ("x", "theta")), 7 * R - 2.5 * X - feedback)
    np.testing.assert_allclose(
        commands("gains = { theta = 2 }\nreference = 0.5\n", Q[:, None], ("theta",)), 2 * (0.5 - Q)
    )


def test_a_pid_law_weighs_the_error_its_sum_and_its_change():
    e = R - X
    np.testing.assert_allclose(commands('kind = "pid"\nkp = 2\nreference = "r"'), 2 * e)
    np.testing.assert_allclose(commands('kind = "pid"\nki = 5\nreference = "r"'), 5 * DT * np.cumsum(e))
    told = commands('kind = "pid"\nkd = 0.3\nreference = "r"\non = "measurement"')
    np.testing.assert_allclose(told, -0.3 * rate(X, X0), atol=1e-12)
    told = commands('kind = "pid"\nkd = 0.3\nreference = "r"')
    np.testing.assert_allclose(told, 0.3 * rate(e, 0 - X0), atol=1e-12)
    np.testing.assert_allclose(commands('kind = "pid"\nkp = 2'), -2 * X)
    np.testing.assert_allclose(commands('kind = "pid"\nkp = "2 V/cm"\nreference = "5 cm"'), 200 * (0.05 - X))


def test_a_law_of_two_coordinates_adds_up():
    keys = 'kind = "pid"\nmeasured = ["x", "theta"]\nkp = [2, "3 V/rad"]\nreference = ["r", 0.1]\n'
    np.testing.assert_allclose(commands(keys, BOTH, ("x", "theta")), 2 * (R - X) + 3 * (0.1 - Q))
    keys = 'kind = "pid"\nmeasured = ["x", "theta"]\nkp = 2\nkd = [0, 0.3]\nreference = "r"\n'
    np.testing.assert_allclose(commands(keys, BOTH, ("x", "theta")), 2 * (R - X) - 0.3 * rate(Q, THETA0), atol=1e-12)
    keys = 'kind = "general"\nmeasured = ["x", "theta"]\nD = [2, 3, 5, 7]\nreference = ["r", "20 deg"]\n'
    expected = 2 * X + 3 * Q + 5 * R + 7 * np.radians(20)
    np.testing.assert_allclose(commands(keys, BOTH, ("x", "theta")), expected)


def test_a_law_of_the_logs_own_columns_sees_their_readings():
    """x in cm, counted down from 4 cm; the drive is 10 V per unit of its column, the other way round."""
    sensors = '[sensors.theta]\n[sensors.x]\nunit = "cm"\nsign = -1\noffset = 4\n'
    drive = DRIVE + "scale = 10\nsign = -1\n"
    keys = 'kind = "pid"\nunits = "log"\nkp = 2\nreference = "r"'
    reading = 4 - 100 * X
    np.testing.assert_allclose(commands(keys, sensors=sensors, drive=drive), -10 * 2 * (R - reading))
    np.testing.assert_allclose(commands(keys + "\nsign = 1", sensors=sensors, drive=drive), 10 * 2 * (R - reading))
    si = 'kind = "pid"\nkp = 2\nreference = "r"\nsign = -1'
    np.testing.assert_allclose(commands(si), -2 * (R - X))


@pytest.mark.parametrize(("period", "every"), [("10 ms", 1), ("5 ms", 2), ("2.04 ms", 5), ("10.19 ms", 1)])
def test_a_law_may_be_evaluated_several_times_a_row(period, every):
    loop = loop_of(f'kind = "pid"\nkp = 2\nperiod = "{period}"\nreference = "r"')
    assert loop.every == every
    assert loop.law.period == pytest.approx(DT / every)
    assert loop.law.references.shape == ((39 * every + 1), 1)
    np.testing.assert_allclose(loop.law.references[: 2 * every, 0], np.repeat(R[:2], every))


def test_limits_delay_and_rounding_are_handed_on():
    loop = loop_of('kind = "pid"\nkp = 2\nlimit = 3\nwindup = "hold"\ndelay = 1\nquantized = true\nreference = 0.4')
    assert (loop.law.limit, loop.law.windup, loop.law.delay, loop.quantized) == (3, "hold", 1, True)
    assert loop.law.references.shape == (1, 1)
    plain = loop_of('kind = "pid"\nkp = 2')
    assert (plain.law.limit, plain.law.windup, plain.law.delay, plain.quantized) == (np.inf, "free", 0, False)


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ('gains = { y = 3 }', "state of CartPendulum called"),
        ("alpha = 0.5", "a loop needs gains per state, such as gains = { x = 2.5 }"),
        ("gains = { x = 1 }\nalpha = 1", "alpha must be at least 0 and below 1, got 1"),
        ("gains = { x = 1 }\nalpha = -0.1", "alpha must be at least 0 and below 1, got -0.1"),
        ('kind = "pid"\nkp = 0', "a PID law needs kp, ki or kd"),
        ('kind = "pid"\nkp = 1\nreference = [1, 2]', "1 measured coordinates take as many references, got 2"),
        ('kind = "pid"\nkp = [1, 2]', "kp has 2 values for 1 measured coordinates"),
        ('kind = "pid"\nkp = 1\ntaps = [0.5, 0.500002]', "taps must be two numbers that sum to 1"),
        ('kind = "pid"\nkp = 1\ntaps = [1]', "taps must be two numbers"),
        ('kind = "pid"\nkp = 1\ntaps = ["a", "b"]', "taps must be two numbers"),
        ('kind = "pid"\nkp = 1\ntaps = [1000000000.0, -999999999.0]', "taps must be two numbers"),
        ('kind = "pid"\nkp = 1\nperiod = "10.3 ms"', "the law is evaluated 0.9709 times per row"),
        ('kind = "pid"\nkp = 1\nperiod = "30 ms"', "it must be a whole number of times"),
        ('kind = "pid"\nkp = 1\nlimit = 0', "limit must be above zero"),
        ('kind = "general"\nA = [["a"]]', "A must be rows of numbers"),
        ('kind = "recover"', "40 commands are too few to tell a law from"),
    ],
)  # fmt: skip
def test_a_loop_that_cannot_be_is_refused(keys, sentence):
    assert sentence in refusal(keys)


def test_taps_and_alpha_at_their_limits_are_allowed():
    assert loop_of('kind = "pid"\nkd = 1\ntaps = [0.5, 0.5000005]').every == 1
    assert loop_of("gains = { x_dot = 1 }\nalpha = 0").every == 1


def test_units_of_gains_and_states_follow_from_the_coordinates():
    from upright.physics import find

    assert state_units(find("cart-pendulum")) == {
        "x": "m", "x_dot": "m/s", "theta": "rad", "theta_dot": "rad/s",
    }  # fmt: skip
    assert [gain_unit("V", "m", time) for time in ("", "s", "/s")] == ["V/m", "V/(m s)", "V s/m"]
    assert gain_unit("", "m", "s") == ""


def test_a_law_that_explains_the_command_poorly_is_refused_with_what_to_write(monkeypatch):
    from types import SimpleNamespace

    from upright.study import loop as module

    monkeypatch.setattr(
        module, "recover_law", lambda *_, **__: SimpleNamespace(quality="poor", sentence="It explains 3 %.")
    )
    said = refusal('kind = "recover"\nreference = "r"')
    assert "line 19: no law could be recovered from 'v': It explains 3 %. Write the law as kind = \"pid\"" in said
