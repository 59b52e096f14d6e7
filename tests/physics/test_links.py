"""Do the plants of two links agree with each other and with what is known of them?"""

import math

import numpy as np
import pytest

from upright.physics import DoublePendulum, DoublePendulumAbsolute, FlexibleLink, find
from upright.simulation import simulate

LINKS = {
    "m_1": 0.35, "m_2": 0.2, "l_1": 0.2, "l_c1": 0.11, "l_c2": 0.13, "J_1": 1e-3, "J_2": 8e-4, "b_1": 5e-3, "b_2": 2e-3,
    "b_1c": 3e-3, "b_1q": 1e-3,
}  # fmt: skip


def test_relative_and_absolute_angles_are_one_motion():
    rng = np.random.default_rng(5)
    first, second = rng.uniform(-1, 1, (2, 8)), rng.uniform(-1, 1, (2, 8))  # angle and speed of each link, absolute
    absolute = np.vstack([first, second]).T
    relative = np.vstack([first, second - first]).T
    torque = 0.05 * np.sin(0.02 * np.arange(400))[:, None]
    a = simulate(DoublePendulumAbsolute(**LINKS), {}, absolute, torque, 5e-3, samples=400, substeps=8)
    r = simulate(DoublePendulum(**LINKS), {}, relative, torque, 5e-3, samples=400, substeps=8)
    np.testing.assert_allclose(r[:, :2], a[:, :2], rtol=0, atol=1e-8)
    np.testing.assert_allclose(r[:, 2:] + r[:, :2], a[:, 2:], rtol=0, atol=1e-8)


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
