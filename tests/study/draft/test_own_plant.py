"""Does a plant of the user's own, driven at its second coordinate, go from a log of counts to a loop that holds it?

A pendulum with a driven wheel at its end: a torque that speeds the wheel up throws the pendulum the other way.
"""

from __future__ import annotations

import sys
import tomllib
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

import upright as up
from upright.trust import allow_code

PLANT = '''
from sympy import cos

from upright import Coordinate, Input, Joint, Plant, quantity


class ReactionWheel(Plant):
    """A pendulum with a driven wheel at its end."""

    J: float = quantity("kg m^2", "inertia about the pivot, the wheel a point", above=0)
    J_w: float = quantity("kg m^2", "inertia of the wheel", above=0)
    h: float = quantity("kg m", "mass times distance of the centre of gravity", above=0)
    b_p: float = quantity("N m s/rad", "viscous friction of the pivot", default=0.0, at_least=0)
    b_w: float = quantity("N m s/rad", "viscous friction of the wheel", default=0.0, at_least=0)
    c_w: float = quantity("N m", "Coulomb friction of the wheel", default=0.0, at_least=0)
    g: float = quantity("m/s^2", "gravity", default=9.81, above=0)

    coordinates = (
        Coordinate("theta", "rad", "angle of the pendulum, 0 hanging"),
        Coordinate("phi", "rad", "angle of the wheel against the pendulum"),
    )
    inputs = (Input("T", "N m", "torque of the motor", on="phi"),)
    joints = (Joint("phi", coulomb="c_w"),)
    equilibria = {"hanging": {}, "inverted": {"theta": 3.141592653589793}}

    @staticmethod
    def energies(p, q, v):
        (theta, phi), (theta_dot, phi_dot) = q, v
        kinetic = p.J * theta_dot**2 / 2 + p.J_w * (theta_dot + phi_dot) ** 2 / 2
        return kinetic, -p.g * p.h * cos(theta), p.b_p * theta_dot**2 / 2 + p.b_w * phi_dot**2 / 2
'''
TRUE = {"J_w": 6e-4, "h": 0.025, "b_p": 2e-4, "b_w": 3e-4, "c_w": 4e-4, "actuator.gain": 3e-4}
J, PERIOD = 4e-3, 5e-3
COUNTS = {"pendulum": 4096, "wheel": 1200}


def commands(samples: int) -> np.ndarray:
    rng = np.random.default_rng(7)
    u, i = np.zeros(samples), 100
    while i < samples - 100:
        width = int(rng.integers(20, 90))
        u[i : i + width] = rng.integers(-60, 60)
        i += width
    return u


def log(u: np.ndarray, sign: float = 1.0) -> str:
    """What a board prints; equations by hand, integrated by SciPy, dry friction smoothed over 0.02 rad/s."""
    p = TRUE

    def slope(_, x, command):
        theta, _, theta_dot, phi_dot = x
        torque = p["actuator.gain"] * command - p["b_w"] * phi_dot - p["c_w"] * np.tanh(phi_dot / 0.02)
        swung = (-9.81 * p["h"] * np.sin(theta) - p["b_p"] * theta_dot - torque) / J
        return theta_dot, phi_dot, swung, torque / p["J_w"] - swung

    x, rows = np.zeros(4), ["millis,pendulum,wheel,pwm"]
    for n, command in enumerate(u):
        angles = [round(x[k] / (2 * np.pi) * counts) for k, counts in enumerate(COUNTS.values())]
        rows.append(f"{1000 * PERIOD * n:.0f},{angles[0]},{angles[1]},{sign * command:.0f}")
        x = solve_ivp(slope, (0, PERIOD), x, args=(command,), rtol=1e-6, max_step=PERIOD / 2).y[:, -1]
    return "\n".join(rows) + "\n"


@pytest.fixture
def drafted(tmp_path):
    def draft(samples: int, sign: float = 1.0):
        (tmp_path / "wheel.py").write_text(PLANT, encoding="utf-8")
        (tmp_path / "log.csv").write_text(log(commands(samples), sign), encoding="utf-8")
        with allow_code():
            up.init(tmp_path / "log.csv", plant=f"{tmp_path / 'wheel.py'}:ReactionWheel", out=tmp_path / "study.toml")
        return tmp_path / "study.toml"

    return draft


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_drive_s_sign_is_that_of_the_coordinate_on_which_it_acts(drafted, sign):
    study = tomllib.loads(drafted(800, sign).read_text(encoding="utf-8"))
    assert study["drive"].get("sign", 1) == sign
    assert {n: s["column"] for n, s in study["sensors"].items()} == {"theta": "pendulum", "phi": "wheel"}


@pytest.mark.slow
def test_a_class_that_stands_in_no_file_is_drafted_as_one_that_does(monkeypatch):
    """From a data frame to a loop by objects alone; J is all that is known."""
    typed = ModuleType("typed_at_a_prompt")
    monkeypatch.setitem(sys.modules, typed.__name__, typed)
    exec(PLANT, vars(typed))
    rows = np.loadtxt(log(commands(1200)).splitlines(), delimiter=",", skiprows=1)
    turns = rows[:, 1:3] * 2 * np.pi / list(COUNTS.values())
    frame = pd.DataFrame({"t": rows[:, 0] / 1e3, "theta": turns[:, 0], "phi": turns[:, 1], "pwm": rows[:, 3]})
    fit = up.identify(frame, typed.ReactionWheel, known={"J": J})
    for name in ("J_w", "h", "actuator.gain"):
        assert fit[name].value == pytest.approx(TRUE[name], rel=0.01)
    designed = up.design(fit, at="inverted", limit=255)
    held = up.simulate(fit, designed, start={"theta": "5 deg"}, seconds=5)
    assert abs(held["theta"][-1] - np.pi) < np.radians(0.5)


@pytest.mark.slow
def test_with_its_counts_and_one_inertia_the_rest_is_found_and_a_loop_holds_it(drafted, tmp_path):
    text = drafted(3000).read_text(encoding="utf-8")
    for assumed, measured in (
        ('J = { value = "1 kg m^2", assumed = true }', f'J = {{ value = "{J} kg m^2", uncertainty = "1 %" }}'),
        ("counts_per_rev = { value = 4096, assumed = true }", "counts_per_rev = 4096"),
    ):
        assert assumed in text
        text = text.replace(assumed, measured)
    head, _, wheel = text.partition("[sensors.phi]")
    (tmp_path / "study.toml").write_text(f"{head}[sensors.phi]{wheel.replace('4096', '1200')}", encoding="utf-8")
    with allow_code():
        fit = up.identify(tmp_path / "study.toml", out=tmp_path / "out" / "fit")
        for name, true in TRUE.items():
            low, high = fit[name].interval
            assert low <= true <= high, name
            assert high - low < 0.1 * true
        gains = up.design(tmp_path / "out" / "fit" / "fit.json", at="inverted", limit="255 counts")
    p = TRUE
    M = np.array([[J + p["J_w"], p["J_w"]], [p["J_w"], p["J_w"]]])
    stiff, damped = np.diag([9.81 * p["h"], 0.0]), np.diag([-p["b_p"], -p["b_w"]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [np.linalg.solve(M, stiff), np.linalg.solve(M, damped)]])
    B = np.concatenate([np.zeros(2), np.linalg.solve(M, [0.0, p["actuator.gain"]])])
    K = np.ravel(gains.value.K)[[0, 2, 1, 3]]  # the law's states are theta, theta', phi, phi'
    assert np.linalg.eigvals(A - np.outer(B, K)).real.max() < -1
