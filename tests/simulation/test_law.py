"""Does a controller with a state of its own compute what its matrices say?"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from tests.simulation.conftest import BLOCK, FURUTA
from upright.errors import BadInput
from upright.laws import Law, state_feedback
from upright.simulation import Simulator, choose, ensemble, simulate

SPRING = {**BLOCK, "m": 0.8, "k": 12.0, "c": 0.4}
A = np.array([[0.0, 1.0], [-12.0 / 0.8, -0.4 / 0.8]])
B = np.array([0.0, 1.0 / 0.8])


def held(dt):
    """Plant over a time during which the force is held: transition matrix and what a unit force adds."""
    E = expm(np.vstack([np.column_stack([A, B]), np.zeros((1, 3))]) * dt)
    return E[:2, :2], E[:2, 2]


def plain(law, x, r, uff, dt, n, limit=math.inf, delay=0.0):
    """States and commands of the block under a law written out, the block stepped by matrix exponentials."""
    M = [np.asarray(getattr(law, name), dtype=float) for name in "ABCD"]
    z = np.zeros(len(M[0])) if law.initial is None else np.asarray(law.initial, dtype=float)
    whole, part = int(delay), delay - int(delay)
    late, soon = held(part * dt), held((1.0 - part) * dt)
    x, u, rows, over = np.asarray(x, dtype=float), [0.0] * (whole + 1), [], 0
    for k in range(n):
        y = math.floor(x[0] / law.resolution + 0.5) * law.resolution if law.resolution else x[0]
        w = np.array([y, *r[min(k, len(r) - 1)]])
        c = uff[k] + M[2][0] @ z + M[3][0] @ w
        c = math.floor(c / law.command_resolution + 0.5) * law.command_resolution if law.command_resolution else c
        beyond, c = abs(c) > limit, min(max(c, -limit), limit)
        over += beyond
        stands = (np.eye(len(z)) == M[0]).all(axis=1) & (beyond and law.windup == "hold")
        z = np.where(stands, z, M[0] @ z + M[1] @ w)
        u.append(c)
        rows.append([*x, c])
        x = soon[0] @ (late[0] @ x + late[1] * u[-2 - whole]) + soon[1] * u[-1 - whole]
    return np.array(rows), over / n


def pid(kp, ki, kd, alpha, dt):
    """u = kp e + ki sum(e) dt + kd d, d[k] = alpha d[k-1] + (1-alpha) (r_1 - y[k] + y[k-1])/dt; states: sum, y, d."""
    rate = (1.0 - alpha) / dt
    e, d = np.array([-1.0, 1.0, 0.0]), np.array([-rate, 0.0, rate * dt])
    return {
        "A": [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, rate, alpha]],
        "B": [dt * e, [1.0, 0.0, 0.0], d],
        "C": [[ki, kd * rate, kd * alpha]],
        "D": [kp * e + ki * dt * e + kd * d],
    }


DT = 0.02
PID = pid(9.0, 14.0, 1.1, 0.4, DT)
R = np.column_stack([0.2 * np.sin(np.arange(90) * 0.15), np.cos(np.arange(90) * 0.15)])


def test_a_pid_is_the_recursion_written_by_hand(block):
    n, x = 120, np.array([0.1, 0.0])
    step, total, before, d, path = held(DT), 0.0, 0.1, 0.0, []
    for k in range(n):
        r, r_dot = R[min(k, 89)]
        e = r - x[0]
        total += e * DT
        d = 0.4 * d + 0.6 * (r_dot * DT - (x[0] - before)) / DT
        before = x[0]
        u = 9.0 * e + 14.0 * total + 1.1 * d
        path.append([*x, u])
        x = step[0] @ x + step[1] * u
    law = Law(**PID, references=R, initial=[0.0, 0.1, 0.0])
    for lanes in (1, 2):
        y = simulate(block, SPRING, [[0.1, 0.0]] * lanes, None, DT, samples=n, substeps=8, loop=law)
        assert y.shape == (n, 3, lanes)
        # RK4 with w h = 0.01: (w h)^5/120 of the amplitude per step, times the gains in the command
        assert np.allclose(y.transpose(2, 0, 1), path, rtol=0, atol=1e-8)


def test_an_observer_with_its_gain_is_what_python_control_makes_of_it(block):
    import control

    Ad, Bd = held(DT)
    K, L, n = np.array([[5.0, 1.5]]), np.array([[0.9], [4.0]]), 100
    # z is the state predicted from the sample before; the command uses the prediction
    observer = {"A": Ad - Bd[:, None] @ K - L @ [[1.0, 0.0]], "B": np.hstack([L, Bd[:, None], np.zeros((2, 1))])}
    law = Law(**observer, C=-K, D=[[0.0, 1.0, 0.0]], references=R, initial=[0.05, 0.0])
    plant = control.ss(Ad, Bd[:, None], [[1.0, 0.0]], 0.0, DT, inputs=["u"], outputs=["y"], name="plant")
    rule = control.ss(law.A, law.B[:, :2], law.C, np.array(law.D)[:, :2], DT, inputs=["y", "r"], outputs=["u"])
    whole = control.interconnect([plant, rule], inputs=["r"], outputs=["y", "u"])
    r = R[np.minimum(np.arange(n), 89), 0]
    truth = control.forced_response(whole, np.arange(n) * DT, r, X0=[0.2, -0.3, 0.05, 0.0]).outputs
    y = simulate(block, SPRING, [[0.2, -0.3]] * 2, None, DT, samples=n, substeps=8, loop=law)
    assert np.allclose(y[:, [0, 2], 0].T, truth, rtol=0, atol=1e-8)


def test_state_feedback_about_a_target_is_a_law_whose_references_hold_it(rotary):
    p = {**FURUTA, "b_1": 5e-3, "b_2": 2e-4, "actuator.limit": 0.12}
    dt, n, alpha, resolution = 1e-3, 150, 0.7, 2 * math.pi / 4096
    K, target = np.array([0.22, 0.2, -2.5, -0.3]), np.array([0.1, math.pi])
    reference, uff = 0.1 * np.sin(np.arange(n) * 0.1), 0.01 * np.cos(np.arange(n) * 0.2)
    loop = state_feedback(K, dt, memory=alpha, k_pf=0.22, target=target, references=reference, resolution=resolution)
    rate, O, I = (1.0 - alpha) / dt, np.zeros((2, 2)), np.eye(2)
    x0 = np.array([0.0123, 0.0, math.pi + 0.1234, 0.0])
    law = Law(
        A=np.block([[O, O], [-rate * I, alpha * I]]),
        B=np.block([[I, np.zeros((2, 2))], [rate * I, np.zeros((2, 2))]]),
        C=-np.concatenate([-rate * K[1::2], alpha * K[1::2]])[None],
        D=np.concatenate([-K[0::2] - rate * K[1::2], [0.22, K[0::2] @ target]])[None],
        references=np.column_stack([reference, np.ones(n)]),
        resolution=resolution,
        initial=[*(np.floor(x0[0::2] / resolution + 0.5) * resolution), 0.0, 0.0],
    )
    for lanes in (1, 2):
        a, b = (
            simulate(rotary, p, np.tile(x0, (lanes, 1)), uff, dt, samples=n, substeps=2, loop=c) for c in (loop, law)
        )
        assert 0 < np.mean(np.abs(a[:, 4]) == 0.12) < 1  # saturated at times
        assert np.allclose(a, b, rtol=0, atol=1e-11)


@pytest.mark.parametrize("windup", ["free", "hold"])
@pytest.mark.parametrize("step", [0.0, 0.05])
def test_limit_windup_and_rounded_commands_are_those_of_a_plain_loop(block, windup, step):
    n, uff = 150, 0.1 * np.cos(np.arange(150) * 0.3)
    law = Law(**PID, references=R * 2, windup=windup, command_resolution=step, initial=[0.0, 0.123, 0.0])
    truth, over = plain(law, [0.123, 0.0], R * 2, uff, DT, n, limit=2.5)
    assert 0.1 < over < 0.9
    p = {**SPRING, "actuator.limit": 2.5}
    for lanes in (1, 2):
        y = simulate(block, p, [[0.123, 0.0]] * lanes, uff, DT, samples=n, substeps=8, loop=law)
        assert np.allclose(y.transpose(2, 0, 1), truth, rtol=0, atol=1e-7)
    e = ensemble(block, p, [[0.123, 0.0]] * 2, uff, DT, samples=n, substeps=8, loop=law)
    assert np.allclose(e.saturated, over, rtol=0, atol=0.5 / n)
    assert np.allclose(e.final.T, truth[-1, :2], rtol=0, atol=1e-7)


def test_holding_the_state_ends_the_overshoot_that_windup_makes(block):
    # a long step against the limit: the integral that runs on has to be worked off on the other side
    r = np.full((2, 2), [0.19, 0.0])
    p = {**SPRING, "actuator.limit": 2.4}
    highest = {}
    for windup in ("free", "hold"):
        law = Law(**pid(9.0, 60.0, 2.5, 0.4, DT), references=r, windup=windup)
        highest[windup] = simulate(block, p, [0.0, 0.0], None, DT, samples=400, substeps=4, loop=law)[:, 0, 0].max()
    assert highest["hold"] < highest["free"]


@pytest.mark.parametrize("delay", [0.25, 1.0, 1.6])
def test_a_delayed_law_is_the_exactly_discretized_one(block, delay):
    n = 60
    law = Law(**pid(4.0, 3.0, 0.4, 0.4, DT), references=R, delay=delay, resolution=0.0, initial=[0.0, 0.3, 0.0])
    truth, _ = plain(law, [0.3, 0.0], R, np.zeros(n), DT, n, delay=delay)
    y = simulate(block, SPRING, [[0.3, 0.0]] * 2, None, DT, samples=n, substeps=20, loop=law)
    # four or five of twenty substeps fit the delay exactly
    assert np.allclose(y[:, :, 0], truth, rtol=0, atol=1e-7)


def test_encoders_round_before_the_law(block):
    n, resolution = 40, 0.01
    law = Law(**PID, references=R, resolution=resolution, initial=[0.0, 0.12, 0.0])
    truth, _ = plain(law, [0.1234, 0.0], R, np.zeros(n), DT, n)
    y = simulate(block, SPRING, [[0.1234, 0.0]] * 2, None, DT, samples=n, substeps=8, loop=law)
    assert np.allclose(y[:, :, 0], truth, rtol=0, atol=1e-8)


def test_matrices_and_first_states_may_differ_between_lanes(block):
    laws = [pid(9.0, 14.0, 1.1, 0.4, DT), pid(4.0, 2.0, 0.6, 0.7, DT)]
    initial = np.array([[0.0, 0.1], [0.1, 0.2], [0.0, -0.5]])
    stacked = {name: np.stack([np.array(law[name]) for law in laws], axis=-1) for name in "ABCD"}
    both = simulate(block, SPRING, [0.1, 0.0], None, DT, samples=80, loop=Law(**stacked, references=R, initial=initial))
    for i, law in enumerate(laws):
        one = Law(**law, references=R, initial=initial[:, i])
        alone = simulate(block, SPRING, [0.1, 0.0], None, DT, samples=80, loop=one)
        assert np.allclose(both[:, :, i], alone[:, :, 0], rtol=0, atol=1e-12)


def test_a_restarted_lane_follows_its_part_of_the_references(block):
    law = Law(**PID, references=R, initial=[0.0, 0.1, 0.0])
    whole = simulate(block, SPRING, [0.1, 0.0], None, DT, samples=90, substeps=2, loop=law)[:, :, 0]
    z = [np.array([0.0, 0.1, 0.0])]
    for k in range(60):
        z.append(np.array(PID["A"]) @ z[-1] + np.array(PID["B"]) @ [whole[k, 0], *R[k]])
    start = np.array([0, 20, 60])
    again = Law(**PID, references=R, initial=np.array(z)[start].T)
    y = simulate(block, SPRING, whole[start, :2], None, DT, samples=30, substeps=2, start=start, loop=again)
    for i, s in enumerate(start):
        assert np.allclose(y[:, :, i], whole[s : s + 30], rtol=0, atol=1e-11)


def test_a_law_without_state_or_reference_is_a_gain(block):
    law = Law(A=np.zeros((0, 0)), B=np.zeros((0, 1)), C=np.zeros((1, 0)), D=[[-4.0]])
    loop = state_feedback([4.0, 0.0], DT)
    a, b = (simulate(block, SPRING, [0.3, 0.0], None, DT, samples=60, loop=c) for c in (law, loop))
    assert np.allclose(a, b, rtol=0, atol=1e-14)


def test_a_wrong_law_is_answered_in_a_sentence(block):
    good = {**PID, "references": R}
    with pytest.raises(BadInput, match=r"B of a law .* needs shape \(3, 3\), got \(3, 2\)"):
        Law(**{**good, "B": np.zeros((3, 2))})
    with pytest.raises(BadInput, match="needs two axes"):
        Law(**{**good, "D": [1.0, 2.0, 3.0]})
    loop = Law(**{**good, "references": np.zeros((5, 3))})
    with pytest.raises(BadInput, match=r"needs shape \(1, 4\), got \(1, 3\)"):
        simulate(block, SPRING, [0.0, 0.0], None, DT, samples=2, loop=loop)
    with pytest.raises(BadInput, match="windup"):
        Law(**good, windup="clamp")
    with pytest.raises(BadInput, match=r"initial state of the law needs shape \(3,\)"):
        Law(**good, initial=[0.0])
    law = Law(**{**good, "A": np.zeros((3, 3, 2))})
    with pytest.raises(BadInput, match="lanes"):
        simulate(block, SPRING, np.zeros((3, 2)), None, DT, samples=2, loop=law)
    with pytest.raises(BadInput, match="without a flavour for it"):
        Simulator(derived=block, flavour=choose(block, SPRING), dt=DT, loop=Law(**good))


def plain_sum(terms):
    """From left to right, each operation rounded by itself, as IEEE 754 says and Python does."""
    total = 0.0
    for factor, value in terms:
        total += factor * value
    return total


@pytest.mark.parametrize(("lanes", "step"), [(1, 0.0), (2, 0.0), (2, 0.003)])
def test_commands_are_those_of_the_sums_written_out_bit_for_bit(rotary, lanes, step):
    """What a rig's own computer finds from the same readings, so that a program on it can be checked by this one."""
    rng, n, dt = np.random.default_rng(5), 200, 1e-3
    resolution, target = 2 * math.pi / 16000, [0.1, math.pi]
    C, D = rng.normal(size=(1, 3)), np.array([[0.7, -3.1, 0.2]])
    law = Law(
        A=[[0.3, 0.1, 0.0], [0.0, 1.0, 0.0], [0.1, 0.2, 0.5]], B=rng.normal(size=(3, 3)) * 0.01, C=C * 0.1, D=D,
        begin=rng.normal(size=(3, 2)), target=target, references=rng.normal(size=(n, 1)) * 0.1, resolution=resolution,
        command_resolution=step,
    )  # fmt: skip
    x0 = [0.0, 0.0, math.pi + 0.05, 0.0]
    motion = simulate(rotary, {**FURUTA, "actuator.limit": 0.3}, [x0] * lanes, None, dt, samples=n, loop=law)[:, :, -1]
    r = law.signal()[:, 0].tolist()
    per, z, expected = 1.0 / resolution, [0.0] * 3, []
    for k, x in enumerate(motion[:, [0, 2]].tolist()):
        y = [math.floor(q * per + 0.5) * resolution - rest for q, rest in zip(x, target, strict=True)]
        if k == 0:
            z = [plain_sum(zip(row, y, strict=True)) for row in law.begin.tolist()]
        w = [*y, r[k]]
        c = plain_sum(zip([*law.C[0].tolist(), *law.D[0].tolist()], [*z, *w], strict=True))
        c = math.floor(c * (1.0 / step) + 0.5) * step if step else c
        expected.append(min(max(c, -0.3), 0.3))
        rows = zip(law.A.tolist(), law.B.tolist(), strict=True)
        z = [plain_sum(zip([*a, *b], [*z, *w], strict=True)) for a, b in rows]
    assert 0 < np.mean(np.abs(expected) == 0.3) < 1
    assert motion[:, 4].tolist() == expected
