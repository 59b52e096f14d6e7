"""Does a draft know a pendulum that is kept upright from one that hangs? Logs from the linear equations of motion."""

import math
import os
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

import upright as up
from upright.identification.estimate import identify
from upright.readers import inspect, read
from upright.study.draft.draft import draft
from upright.study.load import load_study

G, LENGTH, ARM = 9.81, 0.086, 0.085
DT = 0.002
T = np.arange(5000) * DT
COUNT = 2 * math.pi / 2048


def balanced(up=1.0, pull=28.0, fade=4.0):
    """Arm, pendulum and volts of a rotary pendulum near upright (`up` 1) or hanging (-1), encoders rounded.

    Linearized fig. 3a with the arm's acceleration as it comes from the volts: upright an arm throws the pendulum back.
    """
    gains = holding(up, pull, fade)
    q, v = np.zeros(2), np.zeros(2)
    rows = np.zeros((T.size, 3))
    rng = np.random.default_rng(7)
    dither = np.repeat(rng.uniform(-0.5, 0.5, T.size // 50), 50)
    for k in range(T.size):
        u = float(np.dot(gains, [*q, *v])) + dither[k]
        rows[k] = *(np.round(q / COUNT) * COUNT), u
        a = pull * u - fade * v[0]
        v = v + DT * np.array([a, up * (G * q[1] - ARM * a) / LENGTH])
        q = q + DT * v
    return rows.T


def holding(up, pull, fade):
    """Gains of u = K x that hold both, by linear quadratic regulation."""
    A = np.zeros((4, 4))
    A[0, 2] = A[1, 3] = 1.0
    A[2, 2] = -fade
    A[3] = up * (np.array([0, G, 0, 0]) - ARM * A[2]) / LENGTH
    B = np.array([[0.0], [0.0], [pull], [-up * ARM * pull / LENGTH]])
    P = solve_continuous_are(A, B, np.diag([1.0, 10.0, 0.1, 0.1]), np.eye(1))
    return -(B.T @ P)[0]


@pytest.mark.slow
@pytest.mark.parametrize("sign", [1, -1])
def test_a_pendulum_that_falls_away_from_where_it_is_kept_stands(drafted, sign):
    psi, theta, u = balanced()
    text, study = drafted(t=T, voltage=u, psi=psi, theta=sign * theta)
    run, tail = study.runs
    assert (run.role, tail.role) == ("fit", "predict")
    assert tail.t[0] == pytest.approx(2 / 3 * T[-1], abs=0.01)
    assert "balanced upright" in text
    assert run.restart == "kalman"
    np.testing.assert_allclose(run.horizon, [0.05, 0.2])
    assert abs(run.y[:, 1] - math.pi).max() < 0.5
    # counted against the plant's angle, a positive reading is on the other side of upright
    tilt = run.y[:, 1] - math.pi
    assert np.corrcoef(tilt, theta[: tilt.size])[0, 1] > 0.99


def test_the_length_is_that_of_the_pendulum_and_the_arm_that_of_the_arm(drafted):
    psi, theta, u = balanced()
    _, study = drafted(t=T, voltage=u, psi=psi, theta=theta)
    given = study.model.parameters
    assert given["l_cg"].value == pytest.approx(LENGTH, rel=0.3)  # from 30 % off, fits converge
    assert given["r"].value == pytest.approx(ARM, rel=0.3)  # the uncertainty that the draft states
    gained = given["actuator.gain"].value / (given["J_d"].value + given["m_p"].value * given["r"].value ** 2)
    assert 0.5 < gained / 28.0 < 2


def test_a_reversed_drive_is_told_upright_too(drafted):
    psi, theta, u = balanced()
    text, _ = drafted(t=T, voltage=-u, psi=psi, theta=theta)
    assert "sign = -1   # the first" in text


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "reversed_"), [(100.0, False), (-100.0, True)])
def test_a_drive_that_pulls_by_little_is_not_taken_for_reversed(drafted, scale, reversed_):
    """A hundred times the command for the same motion: 0.28 rad/s^2 per volt, which is above nothing."""
    psi, theta, u = balanced()
    text, _ = drafted(t=T, voltage=scale * u, psi=psi, theta=theta)
    assert "balanced upright" in text
    assert ("sign = -1   # the first" in text) == reversed_


def test_a_hanging_pendulum_under_the_same_effort_hangs(drafted):
    psi, theta, u = balanced(up=-1.0)
    text, study = drafted(t=T, voltage=u, psi=psi, theta=theta)
    assert "balanced upright" not in text
    assert study.runs[0].horizon is None


@pytest.mark.real_data
@pytest.mark.slow
def test_a_balanced_qube_is_explained_by_its_draft(tmp_path):
    folder = Path(os.environ["UPRIGHT_REAL_DATA"]) / "furuta_qube_servo_balance"
    path = folder / "qube_20230828T161155_317_133_447.csv"
    record = read(path)
    (tmp_path / "study.toml").write_text(draft(record, inspect(record), path, tmp_path / "study.toml"), "utf-8")
    study = load_study(tmp_path / "study.toml")
    fit = identify(study.model, study.runs)
    fitted, unseen = fit.runs.values()
    assert (fitted.role, unseen.role) == ("fit", "predict")
    assert min(run.ahead[0.05]["theta"] for run in (fitted, unseen)) > 90
    # the same pendulum by its data sheet: m l_cg^2 + J_p over m l_cg of a rod of 129 mm
    assert fit.estimates["l_cg"].value == pytest.approx(2 / 3 * 0.129, rel=0.1)


@pytest.mark.slow
def test_the_friction_of_the_hinge_is_asked_where_the_angle_begins_again_upright(tmp_path):
    """0.4 mN m at the hinge are what gravity does at a quarter of a degree; a draft without it shifts the rest."""
    built = up.Furuta(
        m_p=0.085, r=0.14, l_cg=0.11, J_p=3.2e-4, J_d=2.1e-3, b_1=1.5e-3, b_1c=4e-3, b_2=1.1e-4, b_2c=4e-4
    )
    gain, counts, t = 0.0116, 8192, 0.004 * np.arange(5000)
    law = up.lqr(built.linear("inverted"), [5, 0.1, 50, 1], [0.2 / gain**2]).K
    push = 0.012 * np.sign(np.sin(1.6 * t)) * (t > 3)
    run = up.simulate(
        built, law, start={"theta": 0.05}, at="inverted", u=push, seconds=20, dt=0.004,
        counts={"psi": counts, "theta": counts},
    )  # fmt: skip
    arm, pendulum = (np.round(run[n][: t.size] * counts / (2 * np.pi)) * 360 / counts for n in ("psi", "theta"))
    rows = zip(t, arm, (pendulum + 180) % 360 - 180, run["T"][: t.size] / gain, strict=True)
    text = "time,alpha [deg],beta [deg],u [V]\n" + "".join(f"{a:.3f},{b:.4f},{c:.4f},{d:.3f}\n" for a, b, c, d in rows)
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    up.init(tmp_path / "log.csv", out=tmp_path / "study.toml")
    study = (tmp_path / "study.toml").read_text(encoding="utf-8")
    for given in ('m_p = "85 g"', 'l_cg = "11 cm"', 'r = "14 cm"', 'J_p = { guess = "1e-4 kg m^2" }'):
        study = re.sub(rf"(?m)^{given.partition(' ')[0]} = .*$", given, study)
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    fit = up.identify(tmp_path / "study.toml").value
    assert fit.trusted
    truth = {**built.parameters(), "actuator.gain": gain, "actuator.delay": 0.0}
    asked = {n: e for n, e in fit.estimates.items() if n in truth}
    assert [n for n, e in asked.items() if not e.interval[0] <= truth[n] <= e.interval[1]] == []
    assert asked["b_2c"].half < 0.1
