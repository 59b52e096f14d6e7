"""Do the forces that a motion needs do the work that its energies ask for?"""

import math

import numpy as np
import pytest

from upright.physics import CartPendulum, Furuta, chain
from upright.physics.equations import needed_force, small_motions

PLANTS = [
    Furuta(m_p=0.135, l_cg=0.184, r=0.15, J_d=7.2e-3, J_p=6e-4, J_a=2e-5, b_1=2e-3, b_2=4e-5),
    CartPendulum(m_c=0.6, m_p=0.135, l_cg=0.15, J_p=6e-4, b_1=1.2, b_2=3e-5),
    chain(2, "rectilinear")(m_1=1.1, m_2=1.07, k_12=398.0, c_1=2.2, c_2=2.0),
]


@pytest.mark.parametrize("plant", PLANTS, ids=lambda p: type(p).__name__)
def test_power_needed_is_energy_gained_and_lost(plant):
    """On any motion, made or not: force times speed = d(T + V)/dt + 2 D."""
    h = 1e-5
    t = np.linspace(0, 2, 40)

    def motion(t):
        q = np.array([0.7 * np.sin(2 * t), 1.9 * np.cos(3 * t + 0.4)])
        v = np.array([1.4 * np.cos(2 * t), -5.7 * np.sin(3 * t + 0.4)])
        a = np.array([-2.8 * np.sin(2 * t), -17.1 * np.cos(3 * t + 0.4)])
        return q, v, a

    def energy(t):
        q, v, _ = motion(t)
        return plant.energy(np.column_stack([q[0], v[0], q[1], v[1]]))

    q, v, a = motion(t)
    tau = needed_force(plant.derived_for(plant.parameters()), plant.parameters(), q, v, a)
    gained = (energy(t + h) - energy(t - h)) / (2 * h)
    lost = plant.power_lost(np.column_stack([q[0], v[0], q[1], v[1]]))
    assert np.sum(tau * v, axis=0) == pytest.approx(gained + lost, abs=1e-7 * np.abs(gained).max())


@pytest.mark.parametrize("plant", PLANTS, ids=lambda p: type(p).__name__)
@pytest.mark.parametrize("turn", [0.0, math.pi])
def test_small_motions_of_many_rigs_are_those_of_each(plant, turn):
    derived = plant.derived_for(plant.parameters())
    point = {c: (turn if c == "theta" else 0.0) for c in derived.coordinates}
    some = {n: v * np.array([1.0, 1.1, 0.7]) for n, v in plant.parameters().items()}
    lanes = small_motions(derived, {**some, **point}, (3,))
    for k in range(3):
        one = small_motions(derived, {**{n: float(v[k]) for n, v in some.items()}, **point})
        for alone, among in zip(one, lanes, strict=True):
            assert alone == pytest.approx(among[k], abs=1e-12)
