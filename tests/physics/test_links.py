"""Do the plants of two links agree with each other and with what is known of them?"""

import math

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from upright.physics import DoublePendulum, DoublePendulumAbsolute, FlexibleLink, find
from upright.simulation import simulate

LINKS = {
    "m_1": 0.35, "m_2": 0.2, "l_1": 0.2, "l_c1": 0.11, "l_c2": 0.13, "J_1": 1e-3, "J_2": 8e-4, "b_1": 5e-3, "b_2": 2e-3,
    "b_1c": 3e-3, "b_1q": 1e-3, "b_2q": 1e-3,
}  # fmt: skip


@pytest.mark.parametrize("b_2c", [0.0, 2e-2])
def test_relative_and_absolute_angles_are_one_motion(b_2c):
    rng = np.random.default_rng(5)
    first, second = rng.uniform(-1, 1, (2, 8)), rng.uniform(-1, 1, (2, 8))  # angle and speed of each link, absolute
    absolute = np.vstack([first, second]).T
    relative = np.vstack([first, second - first]).T
    torque = 0.05 * np.sin(0.02 * np.arange(400))[:, None]
    p = {"b_2c": b_2c}
    a = simulate(DoublePendulumAbsolute(**LINKS), p, absolute, torque, 5e-3, samples=400, substeps=8)
    r = simulate(DoublePendulum(**LINKS), p, relative, torque, 5e-3, samples=400, substeps=8)
    np.testing.assert_allclose(r[:, :2], a[:, :2], rtol=0, atol=1e-8)
    np.testing.assert_allclose(r[:, 2:] + r[:, :2], a[:, 2:], rtol=0, atol=1e-8)
    stuck = r[:, 3] == 0
    assert 0.2 < stuck.mean() < 0.6 if b_2c else not stuck.any()
    assert np.all(a[:, 3][stuck] == a[:, 1][stuck])  # links that stick turn as one, to the last bit


def test_what_two_links_lose_is_what_friction_took_at_both_joints():
    links = DoublePendulumAbsolute(**LINKS, b_2c=2e-2)
    t = 1e-3 * np.arange(3001)
    x = simulate(links, {}, [1.2, 0.0, -0.5, 3.0], None, 1e-3, samples=t.size)[:, :, 0]
    first, second = np.abs(x[:, 1]), np.abs(x[:, 3] - x[:, 1])
    dry = 3e-3 * first + 2e-2 * second + 1e-3 * (first**3 + second**3)
    lost = cumulative_trapezoid(links.power_lost(x) + dry, t, initial=0)
    energy = links.energy(x)
    assert (second == 0).mean() > 0.2
    # trapezoids of 1 ms across kinks of |v| where a joint turns: a few 1e-6 of what is lost
    np.testing.assert_allclose(energy[0] - energy, lost, rtol=0, atol=1e-5 * lost[-1])


def test_equal_point_masses_swing_at_the_textbooks_frequencies():
    # two masses on two strings alike: w^2 = (2 -+ sqrt 2) g/l (Landau and Lifshitz, Mechanics, section 23)
    links = DoublePendulum(m_1=0.4, m_2=0.4, l_1=0.3, l_c1=0.3, l_c2=0.3)
    found = np.sort(np.abs(np.linalg.eigvals(links.linear("hanging").A).imag))[::2]
    expected = np.sqrt((2 + math.sqrt(2) * np.array([-1, 1])) * 9.81 / 0.3)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_every_equilibrium_of_two_links_stands_still_and_only_one_is_stable():
    for plant in (DoublePendulum, DoublePendulumAbsolute):
        links = plant(**LINKS)
        growing = {at: np.linalg.eigvals(links.linear(at).A).real.max() for at in plant.equilibria}
        assert {at for at, rate in growing.items() if rate < 0} == {"hanging"}


def test_a_flexible_link_swings_as_two_inertias_on_a_spring():
    link = FlexibleLink(J_h=2e-3, J_l=4e-3, k_s=1.4)
    found = np.abs(np.linalg.eigvals(link.linear("rest").A).imag).max()
    assert found == pytest.approx(math.sqrt(1.4 * (1 / 2e-3 + 1 / 4e-3)), rel=1e-12)


def test_a_pendubot_is_a_double_pendulum_driven_at_its_first_joint():
    assert find("pendubot") is DoublePendulum
