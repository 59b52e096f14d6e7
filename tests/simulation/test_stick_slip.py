"""Does dry friction stop, hold and let go exactly when and where it should?"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from tests.simulation.conftest import BLOCK, FURUTA
from upright.physics.oscillators import Rectilinear2
from upright.simulation import Held, simulate

LANES = pytest.mark.parametrize("lanes", [1, 3])


def lanes_of(x0, lanes):
    return np.tile(x0, (lanes, 1))


@LANES
def test_a_block_on_a_spring_loses_4_F_c_over_k_per_cycle_and_rests_where_friction_holds(block, lanes):
    m, k, F_c, x0 = 1.3, 40.0, 0.7, 0.5
    p = {**BLOCK, "m": m, "k": k, "F_c": F_c}
    half = np.pi * np.sqrt(m / k)
    steps = 400
    x = simulate(block, p, lanes_of([x0, 0.0], lanes), None, half / steps, samples=30 * steps + 1)
    turns = [x0]
    while k * abs(turns[-1]) > F_c:  # each half swing is a cosine about the shifted centre, then maybe it holds
        turns.append(-np.sign(turns[-1]) * (abs(turns[-1]) - 2 * F_c / k))
    at = np.arange(len(turns)) * steps
    # the sum of RK4 errors over half a cycle of 400 steps: (2 pi/800)^5 x 400 / 120 is 1e-10
    assert np.allclose(x[at, 0, :].T, turns, rtol=0, atol=1e-9)
    assert np.allclose(x[-1, 0], turns[-1], rtol=0, atol=1e-9)
    assert np.all(x[(len(turns) - 1) * steps + 1 :, 1] == 0.0)
    assert np.all(x[(len(turns) - 1) * steps + 1 :, 0] == x[-1, 0])


@LANES
def test_a_block_on_a_slope_does_not_creep_by_one_bit(block, lanes):
    p = {**BLOCK, "g_s": 1.0, "F_c": 0.5, "F_s": 1.0000001}
    x = simulate(block, p, lanes_of([0.1234567, 0.0], lanes), None, 1e-3, samples=11, every=100_000)
    assert np.all(x[:, 0] == 0.1234567)
    assert np.all(x[:, 1] == 0.0)


@LANES
def test_a_sliding_block_stops_after_v_squared_over_2_mu_g(block, lanes):
    v, mu_g = 0.731, 3.3
    p = {**BLOCK, "F_c": mu_g}
    x = simulate(block, p, lanes_of([0.0, v], lanes), None, 0.01, samples=101)
    assert np.allclose(x[-1, 0], v**2 / (2 * mu_g), rtol=1e-13, atol=0)
    stop = v / mu_g
    t = np.arange(101) * 0.01
    assert np.allclose(x[:, 1].T, np.maximum(v - mu_g * t, 0.0), rtol=0, atol=1e-14)
    assert np.all(x[t > stop, 1] == 0.0)


@LANES
def test_a_slowly_pulled_block_breaks_away_when_the_spring_reaches_the_stiction_level(pair, lanes):
    k, speed, F_c, F_s, dt = 20.0, 0.3, 1.0, 1.7, 1e-3
    p = {"m_1": 1.0, "m_2": 1.0, "k": k, "k_w": 0.0, "F_1": 0.0, "F_2": F_c, "S_1": 0.0, "S_2": F_s}
    t = np.arange(401) * dt / 2
    held = {"x1": Held(q=speed * t, v=np.full(401, speed), a=np.zeros(401))}
    x = simulate(pair, p, lanes_of([0, speed, 0, 0], lanes), None, dt, samples=201, held=held)
    away = F_s / (k * speed)  # = 0.28333 s, between two samples... of the grid extended below
    held = {"x1": Held(q=speed * np.arange(801) * dt / 2, v=np.full(801, speed), a=np.zeros(801))}
    x = simulate(pair, p, lanes_of([0, speed, 0, 0], lanes), None, dt, samples=401, held=held)
    t = np.arange(401) * dt
    w = np.sqrt(k)
    s = np.maximum(t - away, 0.0)
    # after the break: x'' = k (v t - x) - F_c
    exact = speed * s - speed / w * np.sin(w * s) + (F_s - F_c) / k * (1 - np.cos(w * s))
    assert np.all(x[t <= away, 2] == 0.0)
    # the step of the jump in acceleration is located, so RK4's own error remains: (w dt)^4 x travel
    assert np.allclose(x[:, 2].T, exact, rtol=0, atol=1e-11)


@LANES
def test_a_stuck_block_is_released_at_once_by_a_jump_of_the_input(block, lanes):
    p = {**BLOCK, "F_c": 1.0, "F_s": 1.5}
    u = np.where(np.arange(100) < 40, 1.4, 1.6)
    x = simulate(block, p, lanes_of([0.0, 0.0], lanes), u, 0.01, samples=101)
    s = np.maximum(np.arange(101) * 0.01 - 0.4, 0)
    assert np.allclose(x[:, 0].T, 0.6 * s**2 / 2, rtol=0, atol=1e-15)


def test_a_block_at_rest_without_friction_follows_its_spring_beside_lanes_with_friction():
    """The force on the second block grows from exactly nothing, and so does what its friction could hold."""
    k, dt = 2.23, 0.002
    pair = Rectilinear2(m_1=0.0097, m_2=0.0076, k_12=k)
    u = np.where(np.arange(1000) < 50, 0.0, 0.5)
    x = simulate(pair, {"f_2c": np.array([0.0, 1e-3])}, np.zeros((2, 4)), u, dt, samples=1001, substeps=10)
    A = np.array([[0, 1, 0, 0], [-k / 0.0097, 0, k / 0.0097, 0], [0, 0, 0, 1], [k / 0.0076, 0, -k / 0.0076, 0]])
    times = dt * np.arange(1001)
    expected = lsim(
        (A, [[0], [1 / 0.0097], [0], [0]], np.eye(4), np.zeros((4, 1))), np.append(u, 0.5), times, interp=False
    )
    assert np.allclose(x[:, :, 0], expected[1], rtol=1e-7, atol=1e-7)  # fourth order, 0.2 ms, a mode of 23 rad/s


def test_a_force_between_the_coulomb_and_the_stiction_level_moves_only_what_moves(block):
    p = {**BLOCK, "F_c": 1.0, "F_s": 2.0}
    u = np.full(10, 1.5)
    x = simulate(block, p, [[0.0, 0.0], [0.0, 0.1], [0.0, -0.1]], u, 0.1, samples=11)
    t = np.arange(11) * 0.1
    assert np.all(x[:, :, 0] == 0.0)
    assert np.allclose(x[:, 1, 1], 0.1 + 0.5 * t, atol=1e-14)
    assert np.allclose(x[-1, 0, 2], -(0.1**2) / (2 * 2.5), rtol=1e-12)  # decelerated by 2.5, then held


def reference_pair(p, x0, t_end):
    """Two coupled blocks by scipy's events, in its own words: each mode is a smooth system."""

    def net(x):
        spring = p["k"] * (x[2] - x[0])
        return np.array([spring - p["k_w"] * x[0], -spring])

    F, S = np.array([p["F_1"], p["F_2"]]), np.array([p["S_1"], p["S_2"]])
    m = np.array([p["m_1"], p["m_2"]])
    x, t, path = np.array(x0, float), 0.0, [(0.0, np.array(x0, float))]
    for _ in range(100):
        mode = np.sign(x[1::2])
        for i in range(2):
            if mode[i] == 0 and abs(net(x)[i]) > S[i]:
                mode[i] = np.sign(net(x)[i])

        def f(_, x, mode=mode):
            a = np.where(mode == 0, 0.0, (net(x) - mode * F) / m)
            return np.array([x[1], a[0], x[3], a[1]])

        events = []
        for i in range(2):
            if mode[i] != 0:
                events.append(lambda _, x, i=i, mode=mode: mode[i] * x[2 * i + 1])
                events[-1].direction = -1
            else:
                events.append(lambda _, x, i=i: S[i] - abs(net(x)[i]))
            events[-1].terminal = True
        r = solve_ivp(f, (t, t_end), x, method="DOP853", rtol=1e-13, atol=1e-14, events=events)
        x, t = r.y[:, -1].copy(), r.t[-1]
        for i in range(2):
            if r.t_events[i].size and mode[i] != 0:
                x[2 * i + 1] = 0.0
            elif r.t_events[i].size:
                x[2 * i + 1] = 1e-300 * np.sign(net(x)[i])
        path.append((t, x.copy()))
        if r.status == 0:
            return path
    raise AssertionError("too many events")


@LANES
def test_two_coupled_blocks_of_which_one_sticks_follow_an_independent_event_solver(pair, lanes):
    p = {"m_1": 1.0, "m_2": 0.4, "k": 30.0, "k_w": 12.0, "F_1": 0.6, "F_2": 0.25, "S_1": 0.9, "S_2": 0.3}
    x0 = [0.30, 0.0, -0.1, 0.0]
    path = reference_pair(p, x0, 2.0)
    assert len(path) > 6  # several changes of mode took place
    x = simulate(pair, p, lanes_of(x0, lanes), None, 1e-3, samples=2001, substeps=4)
    assert np.allclose(x[-1].T, path[-1][1], rtol=0, atol=1e-10)


@LANES
def test_energy_never_rises_without_input(rotary, lanes):
    p = {**FURUTA, "b_1c": 3e-2, "b_2c": 1e-2}
    x = simulate(rotary, p, lanes_of([0.1, 2.0, 2.0, -1.0], lanes), None, 1e-3, samples=8001, substeps=2)
    scope = {**p, "sin": np.sin, "cos": np.cos}
    names = ("psi", "psi_dot", "theta", "theta_dot")
    energy = eval(f"({rotary.kinetic}) + ({rotary.potential})", scope, {n: x[:, i] for i, n in enumerate(names)})
    # RK4 at 0.5 ms conserves to 1e-9 of the energy at stake per step where friction takes next to nothing
    assert np.max(np.diff(energy, axis=0)) < 1e-12
    assert np.all(x[-1, 1::2] == 0.0)
