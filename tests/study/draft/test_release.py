"""Does the window of a draft begin after the hand has let go, and not later than it must?"""

import numpy as np
import pytest

from upright.physics import CartPendulum, Pendulum
from upright.simulation import Held, simulate

DT = 0.01
PENDULUM = Pendulum(m_p=0.2, l_cg=0.3, J_p=2e-3, b_2=2e-3, b_2c=1e-3)
PERIOD = 2 * np.pi * np.sqrt((2e-3 + 0.2 * 0.3**2) / (0.2 * 9.81 * 0.3))


def lifted(to: float, held_at: float, seconds: float) -> np.ndarray:
    """A hand takes a pendulum from rest to an angle and back to where it holds it for some seconds."""
    still = np.zeros(100)
    up = 0.5 * to * (1 - np.cos(np.linspace(0, np.pi, 100)))
    back = held_at + 0.5 * (to - held_at) * (1 + np.cos(np.linspace(0, np.pi, 80)))
    return np.concatenate([still, up, back, np.full(round(seconds / DT), held_at)])


def swing(angle: float, n: int = 2000) -> np.ndarray:
    return simulate(PENDULUM, {}, [angle, 0.0], None, DT, samples=n, substeps=2)[:, 0, 0]


@pytest.mark.parametrize("seconds", [0.2, 1.5])
@pytest.mark.parametrize(("to", "held_at"), [(1.2, 0.9), (0.5, 0.4), (2.6, 2.0), (1.0, 1.0)])
def test_the_window_begins_after_the_hand_has_let_go(drafted, to, held_at, seconds):
    hand = lifted(to, held_at, seconds)
    theta = np.concatenate([hand, swing(held_at)])
    theta += 5e-4 * np.random.default_rng(1).normal(size=theta.size)
    _, study = drafted(t=np.arange(theta.size) * DT, theta=theta)
    release = hand.size * DT
    assert release - 0.05 * PERIOD <= study.runs[0].t[0] < release + PERIOD


def test_a_swing_that_nobody_touches_begins_within_its_first_period(drafted):
    theta = swing(1.5)
    _, study = drafted(t=np.arange(theta.size) * DT, theta=theta)
    assert study.runs[0].t[0] < PERIOD


def test_a_pendulum_that_its_cart_throws_is_not_held(drafted):
    t = np.arange(2500) * DT
    x = 0.08 * np.sin(2.2 * np.clip(t - 2, 0, None)) * (t > 2)
    theta = simulate(
        CartPendulum(m_c=1.0, m_p=0.2, l_cg=0.3, J_p=2e-3, b_2=2e-3), {}, [0.0] * 4, None, DT, samples=t.size,
        substeps=2, held={"x": Held(q=x)},
    )[:, 2, 0]  # fmt: skip
    _, study = drafted(t=t, x=x, theta=theta)
    assert study.runs[0].t[0] < 2.0


def test_a_pendulum_lifted_beside_its_moving_cart_is_released_first(drafted):
    hand = lifted(1.2, 0.9, 0.5)
    n = 2000
    t = np.arange(hand.size + n) * DT
    x = 0.05 * np.sin(2.2 * np.clip(t - 0.5, 0, None))
    theta = simulate(
        CartPendulum(m_c=1.0, m_p=0.2, l_cg=0.3, J_p=2e-3, b_2=2e-3), {}, [x[hand.size], 0.0, 0.9, 0.0], None, DT,
        samples=n, substeps=2, held={"x": Held(q=x[hand.size :])},
    )[:, 2, 0]  # fmt: skip
    _, study = drafted(t=t, x=x, theta=np.concatenate([hand, theta]))
    release = hand.size * DT
    assert release - 0.05 * PERIOD <= study.runs[0].t[0] < release + PERIOD


def released(dt, noise, angle, seconds=50.0, seed=3):
    """Time and angle of a pendulum let go at the first sample, and the last second at which it still swings."""
    n = round(seconds / dt) + 1
    t = np.arange(n) * dt
    theta = simulate(PENDULUM, {}, [angle, 0.0], None, dt, samples=n, substeps=max(2, round(dt / 5e-3)))[:, 0, 0]
    swinging = t[np.flatnonzero(np.abs(theta) > 0.05 * angle)[-1]]
    return t, theta + noise * np.random.default_rng(seed).normal(size=n), float(swinging)


@pytest.mark.parametrize("dt", [2e-3, 1e-2, 5e-2])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 5e-3, 2e-2])
@pytest.mark.parametrize("angle", [0.5, 1.5])
def test_noise_is_no_hand(drafted, angle, noise, dt):
    t, theta, swinging = released(dt, noise, angle)
    _, study = drafted("pendulum", t=t, theta=theta)
    assert study.runs[0].t[0] < PERIOD
    assert study.runs[-1].t[-1] > swinging
    # w^2 = m g l/(J + m l^2) of small swings, and the length of the simple pendulum: what the search starts from
    equal = PENDULUM.l_cg + PENDULUM.J_p / (PENDULUM.m_p * PENDULUM.l_cg)
    assert study.model.parameters["l_cg"].value == pytest.approx(equal, rel=0.1)


@pytest.mark.parametrize("noise", [2e-3, 1e-2, 2e-2])
@pytest.mark.parametrize(("to", "held_at"), [(1.2, 0.9), (0.5, 0.4), (1.0, 1.0)])
def test_a_hand_is_found_under_noise(drafted, noise, to, held_at):
    hand = lifted(to, held_at, 1.5)
    theta = np.concatenate([hand, swing(held_at)])
    theta += noise * np.random.default_rng(2).normal(size=theta.size)
    _, study = drafted("pendulum", t=np.arange(theta.size) * DT, theta=theta)
    release = hand.size * DT
    assert release - 0.05 * PERIOD <= study.runs[0].t[0] < release + PERIOD


def test_a_swing_that_hardly_decays_is_kept_from_its_release(drafted):
    t = np.arange(5000) * DT
    theta = 0.4 * np.exp(-2e-3 * t) * np.cos(6.0 * t)  # 10 % in 50 s
    _, study = drafted("pendulum", t=t, theta=theta)
    assert study.runs[0].t[0] < 2 * np.pi / 6.0


def test_a_pendulum_that_is_held_upright_is_not_free_before_it_falls(drafted):
    # upright gravity pulls at no angle, so no hand is felt: 3 s at 3.1 rad, then a simulated fall
    held = np.full(300, 3.1)
    theta = np.concatenate([held, swing(3.1, 3000)])
    _, study = drafted("pendulum", t=np.arange(theta.size) * DT, theta=theta)
    assert held.size * DT - DT <= study.runs[0].t[0] < held.size * DT + 2 * PERIOD  # it lingers before it falls
