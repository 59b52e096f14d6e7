"""Is the angle of a pendulum recovered from a marker's place or a gyroscope's speed, and its length with it?

The motion is SciPy's solution of a pendulum with viscous and dry friction; what the logs show of it is made by hand.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import upright as up
from upright.errors import BadInput
from upright.readers import inspect, read_source
from upright.readers.source import Source
from upright.study.draft.derived import derived_angle
from upright.study.draft.draft import draft
from upright.study.load import load_study

LENGTH = 0.33  # J_A/(m_p l_cg) [m]
RATE = 100.0
T = np.arange(0, 16, 1 / RATE)


def swing():
    def slope(_, y):
        return [y[1], -9.81 / LENGTH * np.sin(y[0]) - 0.02 * y[1] - 0.15 * np.tanh(y[1] / 0.01)]

    return solve_ivp(slope, (0, T[-1]), [0.9, 0.0], t_eval=T, rtol=1e-9, atol=1e-10, max_step=0.01).y


THETA, OMEGA = swing()
BIAS = 0.02  # rad/s


def table(names, columns, clock=lambda t: f"{t:.6f}"):
    rows = [
        "\t".join([clock(t), *(f"{v:.6e}" for v in row)]) for t, row in zip(T, np.column_stack(columns), strict=True)
    ]
    return "\n".join(["\t".join(["t", *names]), *rows]) + "\n"


def noise(size, seed):
    return np.random.default_rng(seed).normal(0, size, T.size)


def marker(*, downwards=False, names=("x", "y"), clock=lambda t: f"{t:.6f}"):
    x, y = 0.12 + 0.42 * np.sin(THETA) + noise(3e-4, 1), -0.05 - 0.42 * np.cos(THETA) + noise(3e-4, 2)
    return table(names, [x, -y if downwards else y], clock)


def gyroscope(tilt=0.0):
    """About an axis tilted by so much [rad] between the phone's y and z."""
    names = [f"Gyroscope {axis} (rad/s)" for axis in "xyz"]
    turn = [0 * OMEGA, np.sin(tilt) * OMEGA, np.cos(tilt) * OMEGA + BIAS]
    return table(names, [w + noise(0.01, 3 + i) for i, w in enumerate(turn)])


def cosine(names, turned=0.0):
    """As simulators log a pendulum whose zero is `turned` from hanging, with the speed beside it."""
    angle = THETA + noise(1e-3, 6) - turned
    return table((*names, "thdot"), [np.cos(angle), np.sin(angle), OMEGA])


def log_of(text):
    return read_source(Source(file="log.txt", data=text.encode()))


def in_unit(unit, per):
    """A gyroscope's speed in another unit, `per` of it in 1 rad/s."""
    return table((f"gyro ({unit})",), [per * (OMEGA + noise(0.01, 5) + BIAS)])


LOGS = {
    "marker": marker(),
    "picture": marker(downwards=True),
    "captured": marker(names=("bob X [m]", "bob Z [m]")),
    "cosine": cosine(("cos_th", "sin_th"), np.pi),
    "functions": cosine(("Cos(theta)", "Sin(theta)")),
    "words": cosine(("cosine", "sine"), 2.0),
    "gyroscope": gyroscope(),
    "tilted": gyroscope(0.6),
    "degrees": in_unit("deg/s", 180 / np.pi),
    "degree signs": in_unit("°/s", 180 / np.pi),
    "rpm": in_unit("rpm", 60 / (2 * np.pi)),
}


PLACES = ("marker", "picture", "captured", "cosine", "functions", "words")


@pytest.mark.parametrize("name", LOGS)
def test_the_angle_is_that_of_the_pendulum(name):
    record = log_of(LOGS[name])
    found = derived_angle(record, inspect(record), places=name in PLACES)
    assert found is not None
    angle = found.in_place(record)["theta"] * {"rad": 1.0, "deg": np.pi / 180}[found.unit]
    angle = angle * np.sign(np.corrcoef(angle, THETA)[0, 1])
    off = angle - THETA
    # a marker's place is off by 0.3 mm of 420; a speed's integral wanders by 0.01 rad/s sqrt(16 s/100 Hz) = 4 mrad,
    # and the drift that the turning points show is known as well as the line through their middles
    assert np.std(off - off.mean()) < (0.002 if name in PLACES else 0.02)


def test_two_carts_and_two_angles_are_no_marker():
    called = log_of(table(("cos_1", "sin_1"), [THETA, OMEGA]))
    assert derived_angle(called, inspect(called), places=True) is None
    carts = log_of(table(("x", "y"), [0.1 * np.sin(3 * T), 0.1 * np.cos(2 * T)]))
    assert derived_angle(carts, inspect(carts), places=True) is None
    own = log_of(table(("theta [rad]", "Gyroscope z (rad/s)"), [THETA, OMEGA]))
    assert derived_angle(own, inspect(own), places=True) is None


@pytest.mark.parametrize("name", ["captured", "tilted", "cosine"])
def test_a_drafted_study_finds_the_length_unedited(name, tmp_path):
    log = tmp_path / "log.txt"
    log.write_text(LOGS[name], encoding="utf-8")
    record = up.read(log)
    text = draft(record, inspect(record), log, tmp_path / "study.toml")
    assert "[columns.theta]" in text
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    low, high = up.identify(tmp_path / "study.toml").ratios["J_A/(m_p l_cg)"].interval
    assert low < LENGTH < high
    assert high - low < 0.01 * LENGTH


def test_a_clock_of_four_digits_is_the_clock_that_was_written():
    period = 1 / 30
    t = period * np.arange(600)
    record = log_of("\n".join(["t\ty", *(f"{a:.3E}\t{np.sin(9 * a):.5f}" for a in t)]) + "\n")
    # the last stamps are rounded to 10 ms; 599 periods bear half of that
    np.testing.assert_allclose(np.diff(record.t), period, rtol=0, atol=5e-3 / 599)
    assert "significant digits" in " ".join(record.provenance.notes)


STUDY = """
[rig]
plant = "pendulum"
[parameters]
m_p = 1.0
l_cg = { guess = 0.3 }
J_p = 0.0
[columns.theta]
formula = "atan2(`x` - 0.12, -(`y` + 0.05))"
unit = "rad"
[sensors.theta]
unit = "rad"
[[runs]]
label = "swing"
file = "log.txt"
"""


def study(text, tmp_path):
    (tmp_path / "log.txt").write_text(LOGS["marker"], encoding="utf-8")
    return load_study(tmp_path / "study.toml", text=text)


def test_a_study_computes_a_column(tmp_path):
    (run,) = study(STUDY, tmp_path).runs
    assert np.abs(run.y[:, 0] - THETA[: len(run.y)]).max() < 0.005


@pytest.mark.parametrize(
    ("was", "now", "sentence"),
    [
        ("[columns.theta]", "[columns.x]", "the log has a column 'x' of its own"),
        ("atan2(`x`", "atan2(`w`", "names the column 'w'"),
        ("atan2(`x` - 0.12,", "atan(", "calls 'atan'"),
        ("formula", "formule", "no key 'formule'"),
    ],
)
def test_a_column_that_cannot_be_computed_is_a_sentence(was, now, sentence, tmp_path):
    with pytest.raises(BadInput, match=sentence):
        study(STUDY.replace(was, now), tmp_path)


def test_the_doctor_looks_at_the_column_that_a_study_computes(tmp_path):
    (tmp_path / "log.txt").write_text(LOGS["marker"], encoding="utf-8")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    diagnosis = up.doctor(tmp_path / "log.txt", rig=str(tmp_path / "study.toml"))
    assert not [f for f in diagnosis.findings if f.severity == "error"]
