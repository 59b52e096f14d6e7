"""Is a log of a cart or an arm whose drive commands acceleration, as a stepper's does, drafted as what it is?"""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import upright as up
from upright.readers import inspect, read
from upright.study.draft.draft import draft

G, M, L, J = 9.81, 0.08, 0.18, 9e-4  # J about the centre of gravity
B, RADIUS = 2e-4, 0.12
J_A = J + M * L**2
PERIOD = 5e-3


def commanded(t):
    """Accelerations of a cart [m/s^2] that leave it where it was."""
    s = np.maximum(t - 1.0, 0.0)
    return np.where(t >= 1.0, 1.2 * np.cos(7.0 * s) + 0.8 * np.cos(4.0 * s), 0.0)


def hanging(t, a):
    """Angles of a pendulum whose hinge is accelerated by `a`, held between samples [rad]; by SciPy."""
    x, out = np.zeros(2), [0.0]
    for push in a[:-1]:

        def rates(_, z, push=push):
            return [z[1], (-M * G * L * np.sin(z[0]) - M * L * np.cos(z[0]) * push - B * z[1]) / J_A]

        x = solve_ivp(rates, (0.0, PERIOD), x, rtol=1e-9, atol=1e-11).y[:, -1]
        out.append(x[0])
    return np.array(out)


def logged(path, seconds, *, per=1e3, place="cart_mm", command="accel_mm_s2", scale=1e3, off=0.0):
    """What a stepper's board writes: its place, the angle in steps of 0.15 deg, the acceleration that it commands."""
    t = PERIOD * np.arange(round(seconds / PERIOD))
    a = commanded(t)
    v = np.concatenate([[0.0], np.cumsum(PERIOD * a[:-1])])
    x = np.concatenate([[0.0], np.cumsum(PERIOD * v[:-1] + PERIOD**2 / 2 * a[:-1])])
    theta = np.round(np.degrees(hanging(t, a)) / 0.15) * 0.15
    x = np.round(per * x / 0.025) * 0.025
    table = np.column_stack([1e3 * t, x, theta, np.round(scale * a + off)])
    np.savetxt(path, table, delimiter=",", header=f"time_ms,{place},angle_deg,{command}", comments="", fmt="%.6g")
    return path


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return logged(tmp_path_factory.mktemp("stepper") / "log.csv", 12.0)


def drafted(path):
    record = read(path)
    return tomllib.loads(draft(record, inspect(record), path, path.with_suffix(".toml")))


def test_an_acceleration_that_the_cart_follows_is_its_drive(log):
    study = drafted(log)
    assert study["drive"] == {"column": "accel_mm_s2", "unit": "m/s^2", "scale": 0.001}
    mass, gain = study["parameters"]["m_c"], study["actuator"]["gain"]
    assert mass == "1e+05 kg"
    assert gain == "1e+05 N/(m/s^2)"  # 1 m/s^2 of a cart that the pendulum cannot move
    assert "held" not in study["defaults"]


def test_one_that_the_cart_does_not_follow_is_not(tmp_path):
    """Another signal under the same name, and one in a unit that it cannot be in."""
    lines = logged(tmp_path / "a.csv", 4.0).read_text().splitlines()
    other = [lines[0], *(f"{row.rpartition(',')[0]},{1e3 * np.sin(0.03 * k):.0f}" for k, row in enumerate(lines[1:]))]
    (tmp_path / "other.csv").write_text("\n".join(other))
    logged(tmp_path / "feet.csv", 4.0, scale=1e3 / 0.3048)
    for name in ("other", "feet"):
        study = drafted(tmp_path / f"{name}.csv")
        assert study["defaults"]["held"] == ["x"]
        assert "drive" not in study


@pytest.mark.slow
def test_the_pendulum_on_it_is_identified_and_the_gains_hold_the_ode(log, tmp_path):
    up.init(log, out=tmp_path / "study.toml")
    text = (tmp_path / "study.toml").read_text(encoding="utf-8")
    weighed = {'m_p = { value = "0.1 kg", assumed = true }': f'm_p = "{M} kg"',
               'J_p = { value = "0 kg m^2", assumed = true }': f'J_p = "{J} kg m^2"'}  # fmt: skip
    for line, known in weighed.items():
        assert line in text
        text = text.replace(line, known)
    (tmp_path / "study.toml").write_text(text.replace("guessed = true", ""), encoding="utf-8")
    fit = up.identify(tmp_path / "study.toml")
    for name, truth in {"l_cg": L, "b_2": B}.items():
        e = fit.estimates[name]
        assert abs(e.value - truth) < 4 * e.stderr + 2e-3 * truth  # counts are no noise: they err alike for a while
    design = up.design(fit, at="inverted", poles="-3, -4, -5+-2j", limit="20 m/s^2", period="5 ms")
    # x'' = u, J_A theta'' = m g l theta - B theta' + m l u upright, where theta is measured from there
    A = np.array([[0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1], [0, 0, M * G * L / J_A, -B / J_A]])
    b = np.array([0, 1, 0, M * L / J_A])
    closed = np.linalg.eigvals(A - np.outer(b, design.K[0]))
    assert np.sort_complex(closed) == pytest.approx(np.sort_complex(np.array([-3, -4, -5 + 2j, -5 - 2j])), rel=0.02)
    assert np.linalg.norm(expm((A - np.outer(b, design.K[0])) * 4.0)) < 0.01
