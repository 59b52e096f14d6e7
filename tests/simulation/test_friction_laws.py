"""Do the optional laws, quadratic drag, Stribeck and Dahl, give the forces that are written in the books?"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.simulation.conftest import BLOCK
from upright.simulation import simulate

LANES = pytest.mark.parametrize("lanes", [1, 2])


@LANES
def test_quadratic_drag_slows_as_one_over_one_plus_c_v_t(block, lanes):
    # m v' = -c v^2: v = v0 / (1 + c v0 t / m)
    v0, c = 3.0, 0.7
    x = simulate(block, {**BLOCK, "c_q": c}, np.tile([0.0, -v0], (lanes, 1)), None, 0.01, samples=101)
    t = np.arange(101) * 0.01
    assert np.allclose(x[:, 1].T, -v0 / (1 + c * v0 * t), rtol=0, atol=1e-8)


@LANES
def test_drag_and_coulomb_together_stop_where_the_closed_form_says(block, lanes):
    # m v' = -F_c - c v^2: distance (m / 2 c) ln(1 + c v0^2 / F_c)
    v0, c, F_c = 2.0, 0.5, 0.8
    p = {**BLOCK, "c_q": c, "F_c": F_c}
    x = simulate(block, p, np.tile([0.0, v0], (lanes, 1)), None, 5e-3, samples=601)
    assert np.allclose(x[-1, 0], np.log1p(c * v0**2 / F_c) / (2 * c), rtol=1e-10)
    assert np.all(x[-1, 1] == 0.0)


@LANES
def test_a_dahl_joint_yields_along_its_closed_form_of_the_way(block, lanes):
    # pushed slowly by a stiff viscous actuator? no: energy. m v dv/dx = -F(x) with F = F_c (1 - exp(-x/delta)) from
    # F = 0: v^2 = v0^2 - (2 F_c/m) (x - delta (1 - exp(-x/delta)))
    F_c, delta, v0 = 2.0, 0.02, 0.4
    p = {**BLOCK, "F_c": F_c, "delta": delta}
    push = np.zeros(41)
    push[0] = v0 / 1e-3  # an impulse gives the speed v0 within the first millisecond, over a way of 0.2 mm
    x = simulate(block, p, np.zeros((lanes, 2)), push, 1e-3, samples=41, substeps=16)
    q, v = x[1:, 0].T, x[1:, 1].T

    def lost(q):
        return 2 * F_c * (q - delta * -np.expm1(-q / delta))

    # from the end of the impulse on, while it moves forward
    assert np.all(v > 0)
    assert np.allclose(v**2 + lost(q), (v[:, :1] ** 2 + lost(q[:, :1])), rtol=0, atol=1e-10)


def test_a_dahl_joint_reverses_like_its_differential_equation(block):
    F_c, delta, k, m = 0.5, 0.05, 30.0, 1.0

    def f(_, z):
        x, v, y = z
        return [v, (-k * x - F_c * y) / m, (v - abs(v) * y) / delta]

    # at rest at x0 the deflection is zero
    r = solve_ivp(f, (0, 3), [0.4, 0.0, 0.0], method="DOP853", rtol=1e-11, atol=1e-12, max_step=1e-3)
    x = simulate(block, {**BLOCK, "k": k, "F_c": F_c, "delta": delta}, [0.4, 0.0], None, 1e-3, samples=3001, substeps=4)
    # the way within the substep of a turn is taken for straight: third order in 0.25 ms, five turns
    assert np.allclose(x[-1, :, 0], r.y[:2, -1], rtol=0, atol=1e-7)


@LANES
def test_steady_sliding_needs_the_stribeck_force(block, lanes):
    # on a slope that pulls with F_c + (F_s - F_c) exp(-(v/v_s)^2) + c v, the speed v stays as it is
    F_c, F_s, v_s, c, v = 1.0, 1.8, 0.1, 4.0, np.array([0.02, 0.08, 0.15, 0.4])
    level = F_c + (F_s - F_c) * np.exp(-((v / v_s) ** 2)) + c * v
    p = {**BLOCK, "F_c": F_c, "F_s": F_s, "v_s": v_s, "c": c, "g_s": -level}
    if lanes == 1:
        p, v = {**p, "g_s": -level[1]}, v[1:2]
    x = simulate(block, p, np.stack([0 * v, v], axis=1), None, 1e-2, samples=21)
    # unstable where the force falls with speed, by exp(8.6 s) at most: rounding stays rounding
    assert np.allclose(x[:, 1], v, rtol=0, atol=1e-14)


@LANES
def test_stick_slip_with_stribeck_follows_an_event_solver(block, lanes):
    m, k, F_c, F_s, v_s = 1.0, 25.0, 0.6, 1.0, 0.3

    def f(_, z, s):
        return [z[1], (-k * z[0] - s * (F_c + (F_s - F_c) * np.exp(-((z[1] / v_s) ** 2)))) / m]

    def halt(_, z, s):
        return s * z[1]

    halt.terminal, halt.direction = True, -1
    z, t = [0.5, 0.0], 0.0
    while k * abs(z[0]) > F_s:
        s = -np.sign(z[0])
        first = solve_ivp(f, (t, t + 1e-3), z, args=(s,), method="DOP853", rtol=1e-13, atol=1e-14)
        r = solve_ivp(f, (t + 1e-3, 9), first.y[:, -1], args=(s,), method="DOP853", rtol=1e-13, atol=1e-14, events=halt)
        z, t = [r.y[0, -1], 0.0], r.t[-1]
    x = simulate(
        block, {**BLOCK, "k": k, "F_c": F_c, "F_s": F_s, "v_s": v_s}, np.tile([0.5, 0.0], (lanes, 1)), None, 1e-3,
        samples=8001, substeps=4,
    )  # fmt: skip
    assert np.allclose(x[-1, 0], z[0], rtol=0, atol=1e-10)
    assert np.all(x[-1, 1] == 0.0)
