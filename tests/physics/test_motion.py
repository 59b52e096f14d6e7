"""Do the invariants of mechanics hold along the kernel's motions, for every plant?"""

import numpy as np
import pytest

from tests.physics.specimens import SPECIMENS
from tests.physics.test_equations import MOTOR, frictionless
from tests.physics.text import swing
from upright.simulation import simulate

FREE = {name: frictionless(specimen.plant) for name, specimen in SPECIMENS.items()}


def start(plant):
    """First coordinate moved, last one moved further: far from rest, below the separatrix."""
    x = plant.state()
    x[0::2] += np.linspace(0.2, 1.2, len(plant.coordinates)) if len(plant.coordinates) > 1 else 1.2
    return x


@pytest.mark.parametrize("name", FREE)
def test_energy_is_conserved_without_friction_for_100_s(name):
    """The kernel's order is 4: at 0.1 ms its drift over 100 s is far below 1e-10 of the energy put in."""
    plant = FREE[name]
    x = simulate(plant, {}, start(plant), None, 0.01, samples=10_001, substeps=100)[:, :, 0]
    energy = plant.energy(x)
    put_in = energy[0] - plant.energy(plant.state())
    assert np.abs(energy - energy[0]).max() < 1e-10 * put_in


@pytest.mark.parametrize("name", SPECIMENS)
def test_halving_the_step_divides_the_error_by_16(name):
    """Fourth order, judged against Dormand and Prince."""
    plant = SPECIMENS[name].plant
    exact = swing(plant, start(plant), 1.0, rtol=1e-13)[-1]
    coarse, fine = (
        np.abs(simulate(plant, {}, start(plant), None, 1.0, samples=2, substeps=n)[-1, :, 0] - exact).max()
        for n in (400, 800)
    )
    assert np.log2(coarse / fine) == pytest.approx(4, abs=0.3)  # terms of fifth order still show


def test_motor_settles_at_the_current_and_speed_of_its_circuit():
    """With a rod too light to be lifted by its spin: V = R i + k w and k i = b w, so w = k V / (k^2 + R b)."""
    motor = MOTOR.replace(b_1=1e-3, b_2=1e-5, m_p=1e-4, J_p=1e-8)
    V = 2.0
    b, R, k = motor.b_1, motor.R_m, motor.k_t
    speed = k * V / (k**2 + R * b)
    current = b * speed / k
    x = simulate(motor, {}, motor.state(), np.array([V]), 0.01, samples=1001, substeps=200)[-1, :, 0]
    assert x[motor.state_names().index("psi_dot")] == pytest.approx(speed, rel=1e-6)
    assert x[motor.state_names().index("charge_dot")] == pytest.approx(current, rel=1e-6)


def test_motor_current_rises_with_the_time_constant_of_its_winding():
    """Within a tenth of the winding's time constant the arm has not moved: i = V/R (1 - exp(-R t / L))."""
    V, tau = 2.0, MOTOR.L_m / MOTOR.R_m
    x = simulate(MOTOR.replace(J_d=10.0), {}, MOTOR.state(), np.array([V]), tau, samples=4, substeps=50)[:, :, 0]
    rise = V / MOTOR.R_m * (1 - np.exp(-np.arange(4)))
    np.testing.assert_allclose(x[:, -1], rise, rtol=1e-6)
