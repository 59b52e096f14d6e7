"""What reaches the plant through limit, offset, gain, delay, lag and torque-speed slope?"""

from __future__ import annotations

import numpy as np
import pytest

from tests.simulation.conftest import BLOCK
from upright.simulation import simulate


def step_after(t, start):
    """Time since `start`, zero before."""
    return np.maximum(t - start, 0.0)


@pytest.mark.parametrize("delay", [0.0, 0.003, 0.01, 0.0137, 0.0305])
@pytest.mark.parametrize("lag", [0.0, 1e-4, 0.02, 0.7])
def test_a_step_through_delay_and_lag_moves_a_free_mass_exactly(block, delay, lag):
    # the mean and the first moment of the force over each substep are exact, and a free mass asks for no more
    dt, jump, n = 0.01, 20, 81
    u = np.where(np.arange(n) < jump, 0.5, 2.0)
    p = {**BLOCK, "g_s": 0.5, "actuator.delay": delay, "actuator.lag": lag}
    for lanes in (1, 2):
        x = simulate(block, p, np.zeros((lanes, 2)), u, dt, samples=n, substeps=3)
        s = step_after(np.arange(n) * dt, jump * dt + delay)
        e = -np.expm1(-s / lag) if lag else np.ones(n)
        velocity = 1.5 * (s - lag * e)
        position = 1.5 * (s * s / 2 - lag * s + lag * lag * e)
        assert np.allclose(x[:, 1].T, velocity, rtol=0, atol=1e-13)
        assert np.allclose(x[:, 0].T, position, rtol=0, atol=1e-13)


def test_the_motion_depends_continuously_on_delay_and_lag(block):
    u = np.sign(np.sin(np.arange(200) * 0.3))
    for name in ("actuator.delay", "actuator.lag"):
        values = np.linspace(0.0, 0.03, 3001)
        p = {**BLOCK, "k": 30.0, "c": 0.5, name: values}
        x = simulate(block, p, [0.0, 0.0], u, 0.01, samples=200)[-1, 0]
        # no jump: neighbours 1e-5 s apart differ by no more than the steepest slope allows
        assert np.abs(np.diff(x)).max() < 1e-5 * 10


@pytest.mark.parametrize(("extra", "order"), [({}, 4), ({"actuator.lag": 0.1}, 3.8), ({"actuator.delay": 0.0123}, 2.9)])
def test_order_of_convergence_with_a_stiff_spring(block, extra, order):
    p, u = {**BLOCK, "k": 40.0, "c": 0.3, **extra}, np.cos(np.arange(40) * 0.4)

    def end(substeps):
        return simulate(block, p, [0.1, 0.0], u, 0.05, samples=40, substeps=substeps)[-1, :, 0]

    error = [np.abs(end(n) - end(2187)).max() for n in (9, 27, 81)]
    # other substeps have the delayed jump at other places inside them, hence the mean of two orders
    assert np.log(error[0] / error[2]) / np.log(9) > order - 0.15, error


def test_limit_offset_and_gain_act_in_this_order(block):
    u = np.array([5.0, -5.0, 0.5])
    p = {**BLOCK, "actuator.limit": 2.0, "actuator.offset": 0.25, "actuator.gain": 3.0}
    x = simulate(block, p, [0.0, 0.0], u, 1.0, samples=4)
    assert np.allclose(np.diff(x[:, 1, 0]), [3 * 2.25, 3 * -1.75, 3 * 0.75], rtol=1e-15)


def test_no_command_at_all_is_a_command_of_zero(block):
    # between them stand offset, gain and a delay that needs the sample before
    p = {**BLOCK, "actuator.delay": 0.005, "actuator.offset": 0.25, "actuator.gain": 3.0}
    x = simulate(block, p, [0.0, 0.0], None, 0.01, samples=31)
    assert np.allclose(x[:, 1, 0], 0.75 * 0.01 * np.arange(31), rtol=0, atol=1e-14)


def test_the_slope_takes_force_in_proportion_to_speed(block):
    # m v' = u - slope v
    p = {**BLOCK, "actuator.slope": 0.4}
    x = simulate(block, p, [0.0, 0.0], np.ones(50), 0.02, samples=51, substeps=4)
    t = np.arange(51) * 0.02
    assert np.allclose(x[:, 1, 0], -np.expm1(-0.4 * t) / 0.4, rtol=0, atol=1e-12)


def test_a_restarted_lane_knows_what_the_lag_has_seen(block):
    rng = np.random.default_rng(0)
    u = rng.standard_normal(120)
    p = {**BLOCK, "k": 20.0, "actuator.lag": 0.03, "actuator.delay": 0.017}
    whole = simulate(block, p, [0.0, 0.0], u, 0.01, samples=121, substeps=2)[:, :, 0]
    start = np.array([0, 50, 90])
    x = simulate(block, p, whole[start], u, 0.01, samples=31, substeps=2, start=start)
    for i, s in enumerate(start):
        assert np.allclose(x[:, :, i], whole[s : s + 31], rtol=0, atol=1e-13)
