"""Does the sampled loop compute what a controller written out in plain Python computes?"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import cont2discrete

from tests.simulation.conftest import BLOCK, FURUTA
from tests.simulation.test_smooth_motion import lagrange
from upright.errors import BadInput
from upright.laws import state_feedback
from upright.simulation import ensemble, simulate

SPRING = {**BLOCK, "m": 0.8, "k": 12.0, "c": 0.4}
A = np.array([[0.0, 1.0], [-12.0 / 0.8, -0.4 / 0.8]])
B = np.array([[0.0], [1.0 / 0.8]])


def test_a_linear_loop_is_the_exactly_discretized_one(block):
    dt, K = 0.02, np.array([3.0, 0.7])
    Ad, Bd, *_ = cont2discrete((A, B, np.eye(2), np.zeros((2, 1))), dt)
    x, before, path, u = np.array([0.3, -0.1]), 0.3, [], []
    for _ in range(151):
        path.append(x)
        u.append(-K @ [x[0], (x[0] - before) / dt])
        x, before = Ad @ x + Bd[:, 0] * u[-1], x[0]
    loop = state_feedback(K, dt)
    for lanes in (1, 2):
        y = simulate(block, SPRING, np.tile([0.3, -0.1], (lanes, 1)), None, dt, samples=151, substeps=8, loop=loop)
        assert y.shape == (151, 3, lanes)
        # RK4 with w h = 0.01: (w h)^5/120 of the amplitude per step
        assert np.allclose(y[:, :2].transpose(2, 0, 1), path, rtol=0, atol=1e-9)
        assert np.allclose(y[:, 2].T, u, rtol=0, atol=1e-7)  # the same over dt, times the gain of the speed


@pytest.mark.parametrize("delay", [0.0, 0.25, 1.0, 1.6])
def test_a_delayed_loop_is_the_exactly_discretized_one(block, delay):
    # between samples the input changes once, at the fraction of the delay: two exact pieces per sample
    dt, K, n = 0.02, np.array([2.0, 0.3]), 60
    whole, part = int(delay), delay - int(delay)
    late = cont2discrete((A, B, np.eye(2), np.zeros((2, 1))), part * dt)[:2] if part else (np.eye(2), np.zeros((2, 1)))
    soon = cont2discrete((A, B, np.eye(2), np.zeros((2, 1))), (1 - part) * dt)[:2]
    x, path, u = np.array([0.3, 0.0]), [np.array([0.3, 0.0])], []
    for k in range(n):
        u.append(-K @ [x[0], (x[0] - path[max(k - 1, 0)][0]) / dt])
        old, new = (u[k - whole - 1] if k > whole else 0.0), (u[k - whole] if k >= whole else 0.0)
        x = soon[0] @ (late[0] @ x + late[1][:, 0] * old) + soon[1][:, 0] * new
        path.append(x)
    loop = state_feedback(K, dt, delay=delay)
    y = simulate(block, SPRING, [[0.3, 0.0]] * 2, None, dt, samples=n + 1, substeps=20, loop=loop)
    # four or five of twenty substeps fit the delay exactly; else the jump inside one is right to third order
    assert np.allclose(y[:, :2, 0], path, rtol=0, atol=1e-8)


def plain_loop(p, x, K, target, resolution, alpha, k_pf, r, uff, dt, n):
    """Encoder, differentiator, gains, limit and hold in plain Python; the plant by scipy's tightest integrator."""
    from scipy.integrate import solve_ivp

    J_A = p["J_p"] + p["m_p"] * p["l_cg"] ** 2
    e = p["m_p"] * p["r"] * p["l_cg"]

    def f(t, x, u):
        s, c = math.sin(x[2]), math.cos(x[2])
        M = np.array([[p["J_d"] + p["m_p"] * p["r"] ** 2 + J_A * s * s + p["J_a"] * c * c, -e * c], [-e * c, J_A]])
        free = lagrange(t, x, p)
        a = np.array([free[1], free[3]]) + np.linalg.solve(M, [u, 0.0])
        return [x[1], a[0], x[3], a[1]]

    before, speed, rows = None, [0.0, 0.0], []
    for k in range(n):
        y = [math.floor(x[2 * i] / resolution + 0.5) * resolution for i in range(2)]
        if before is not None:
            speed = [alpha * speed[i] + (1 - alpha) * (y[i] - before[i]) / dt for i in range(2)]
        before = y
        z = [y[0] - target[0], speed[0], y[1] - target[1], speed[1]]
        u = uff[k] + k_pf * r[k] - sum(gain * v for gain, v in zip(K, z, strict=True))
        u = min(max(u, -p["actuator.limit"]), p["actuator.limit"])
        rows.append([*x, u])
        x = solve_ivp(f, (0, dt), x, args=(u,), method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return np.array(rows)


def test_the_sampled_loop_is_the_one_written_in_plain_python(rotary):
    p = {**FURUTA, "b_1": 5e-3, "b_2": 2e-4, "actuator.limit": 0.12}
    dt, n = 1e-3, 120
    r, uff = 0.1 * np.sin(np.arange(n) * 0.1), 0.01 * np.cos(np.arange(n) * 0.2)
    resolution = 2 * math.pi / 4096
    K, target = [0.22, 0.2, -2.5, -0.3], [0.1, math.pi]
    loop = state_feedback(K, dt, memory=0.7, k_pf=0.22, target=target, references=r, resolution=resolution)
    x0 = [0.0123, 0.0, math.pi + 0.1234, 0.0]
    plain = plain_loop(p, x0, K, target, resolution, 0.7, 0.22, r, uff, dt, n)
    assert 0 < np.mean(np.abs(plain[:, 4]) == 0.12) < 1  # saturated at times
    for lanes in (1, 2):
        x = simulate(rotary, p, np.tile(x0, (lanes, 1)), uff, dt, samples=n, substeps=4, loop=loop)
        assert np.allclose(x.transpose(2, 0, 1), plain, rtol=0, atol=1e-9)


def test_gains_targets_and_prefilter_may_differ_between_lanes(block):
    K = np.array([[[1.0, 5.0], [0.1, 0.9]]])
    target, k_pf = np.array([[0.2, -0.3]]), np.array([0.5, 2.0])
    loop = state_feedback(K, 0.01, k_pf=k_pf, target=target, references=np.ones(80))
    both = simulate(block, SPRING, [0.0, 0.0], None, 0.01, samples=80, loop=loop)
    for i in range(2):
        one = state_feedback(K[0, :, i], 0.01, k_pf=k_pf[i], target=target[:, i], references=np.ones(80))
        alone = simulate(block, SPRING, [0.0, 0.0], None, 0.01, samples=80, loop=one)
        assert np.allclose(both[:, :, i], alone[:, :, 0], rtol=0, atol=1e-14)


@pytest.mark.slow
def test_an_ensemble_reduces_what_simulate_records(rotary):
    rng = np.random.default_rng(5)
    x0 = np.zeros((40, 4))
    x0[:, 2] = math.pi + rng.uniform(-0.3, 0.3, 40)
    p = {**FURUTA, "b_1c": 1e-3, "b_2c": 2e-4, "actuator.limit": 0.3}
    loop = state_feedback([0.22, 0.2, -2.5, -0.3], 1e-3, memory=0.7, target=[0.0, math.pi], resolution=1e-3)
    x = simulate(rotary, p, x0, None, 1e-3, samples=301, substeps=2, loop=loop)
    e = ensemble(rotary, p, x0, None, 1e-3, samples=301, settle=0.2, substeps=2, loop=loop)
    # 0.3 s of a loop that rounds: the two kernels may order additions differently
    assert np.allclose(e.final, x[-1, :4], rtol=0, atol=1e-6)
    assert np.allclose(e.largest, np.abs(x[:, [0, 2]]).max(axis=0), rtol=0, atol=1e-6)
    assert np.allclose(e.error[1], np.abs(x[200:, 2] - math.pi).max(axis=0), rtol=0, atol=1e-6)
    assert np.allclose(e.saturated[0], np.mean(np.abs(x[:, 4]) == 0.3, axis=0), rtol=0, atol=2 / 301)


def test_a_wrong_loop_is_answered_in_a_sentence(rotary):
    with pytest.raises(BadInput, match=r"needs shape \(1, 2\), got \(1, 1\)"):
        simulate(rotary, FURUTA, [0, 0, 0, 0], None, 1e-3, samples=2, loop=state_feedback([1.0, 2.0], 1e-3))
    with pytest.raises(BadInput, match="memory must be"):
        state_feedback([1.0, 0.0], 1e-3, memory=1.0)
    with pytest.raises(BadInput, match="sample period"):
        state_feedback([1.0, 0.0], 0.0)
