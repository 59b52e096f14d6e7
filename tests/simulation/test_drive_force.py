"""Does the drive written in numpy give the force that the compiled kernel gives, for each number of the actuator?"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from upright.physics import find
from upright.physics.actuator import drive_force
from upright.simulation import ACTUATOR, Simulator, choose

DT, M, V = 0.01, 1e6, 0.8
PLANT = find("rectilinear-1")
IDLE = {name: what.default for name, what in ACTUATOR.items()}
# changes every seventh sample, with pauses; 0.123 and 0.777 s lie inside samples in which it does not change
COMMAND = np.repeat([0.0, 1.0, 0.4, -0.9, 0.0, 0.6, -0.3, 0.0, 0.0, 0.8, -1.0, 0.7, 0.0, 0.5, -0.2, 0.9, 0.3], 7)
NUMBERS = {
    "gain": {"gain": 2.5},
    "offset": {"offset": 0.3},
    "limit": {"limit": 0.7},
    "delay": {"delay": 0.013},
    "delayed damping": {"delay": 0.013, "damping": 0.5},
    "slope": {"slope": 0.4},
    "start": {"start": 0.123},
    "end": {"end": 0.777},
    "damping": {"damping": 0.5},
    "standby": {"standby": 0.2, "end": 0.777},
    "fade": {"knee": 0.5, "fade": 0.9},
    "knee of braking": {"knee": 0.5, "damping": 0.5},
    "droop": {"droop": 0.8, "offset": 0.1},
    "dead zone": {"dead_zone": 0.15, "offset": 0.05, "limit": 0.7},
    "force limit": {"force_limit": 0.6, "slope": 0.4},
    "damping that rises": {"damping_rise": -0.4, "damping": 0.5, "limit": 0.7, "delay": 0.013},
    "all that do not lag": {
        "gain": 2.5, "offset": 0.25, "limit": 0.7, "delay": 0.02, "slope": 0.4, "start": 0.12, "end": 0.78,
        "damping": 0.5, "standby": 0.2, "knee": 0.5, "fade": 0.9, "droop": 0.3, "force_limit": 1.4, "damping_rise": 0.2,
    },
}  # fmt: skip
LAGGING = {
    "lag": {"lag": 0.03},
    "late lag": {"lag": 0.03, "delay": 0.02, "offset": 0.2},
    "relaxation": {"relaxation": 0.05, "damping": 0.5, "standby": 0.2, "gain": 0.0},
}
# the speed changes by F DT/M within a sample, which slope and braking multiply; differences of speeds lose 2e-16 M V/DT
TOLERANCE = 1.5 * 3.0 * DT / M + 4e-16 * M * V / DT


@cache
def kernel_of(relaxes):
    """A simulator in which nothing of the drive is left out, but for the relaxation of its braking."""
    values = {**PLANT(m_1=M, k_1=0.0, c_1=0.0).parameters(), **IDLE}
    derived = PLANT.derived_for(values)
    free = [name for name in ACTUATOR if relaxes or name != "actuator.relaxation"]
    return values, Simulator(derived=derived, flavour=choose(derived, values, free=free), dt=DT, substeps=3)


def both(numbers):
    """Mean force over each sample by the kernel, from the momentum it gives to a heavy body, and that by numpy."""
    values, simulator = kernel_of("relaxation" in numbers)
    values = {**values, **{f"actuator.{name}": value for name, value in numbers.items()}}
    start = np.array([[0.0], [V]])
    v = simulator.run(simulator.table(values, 1), start, COMMAND[:, None], samples=COMMAND.size + 1)[:, 1, 0]
    return M * np.diff(v) / DT, drive_force(PLANT, values, COMMAND[None], v[None, :-1], DT)[0]


@pytest.mark.parametrize("name", NUMBERS)
def test_the_force_by_numpy_is_that_of_the_kernel(name):
    kernel, numpy = both(NUMBERS[name])
    assert np.ptp(kernel) > 0.1
    np.testing.assert_allclose(numpy, kernel, rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize("name", LAGGING)
def test_what_lags_lies_over_each_sample_between_the_forces_at_its_ends(name):
    """By numpy it is given where samples begin; between them it goes one way, since commands are held."""
    kernel, numpy = both(LAGGING[name])
    assert np.abs(kernel - both(LAGGING[name] | {"lag": 0.0, "relaxation": 0.0})[0]).max() > 0.05  # it does lag
    low, high = np.sort([numpy[:-1], numpy[1:]], axis=0)
    assert np.all((kernel[:-1] >= low - TOLERANCE) & (kernel[:-1] <= high + TOLERANCE))


@pytest.mark.parametrize("samples", [1, 2, 129, 1000])
def test_a_lag_is_the_filter_of_scipy_that_begins_settled(samples):
    u = np.random.default_rng(samples).normal(size=samples)
    lag = {**IDLE, "actuator.lag": -DT / np.log(0.93)}
    expected = lfilter([0.0, 0.07], [1.0, -0.93], u, zi=[u[0]])[0]
    assert drive_force(PLANT, lag, u[None], np.zeros((1, samples)), DT)[0] == pytest.approx(expected, abs=1e-12)


def test_no_number_of_the_actuator_is_left_out():
    compared = {f"actuator.{name}" for numbers in (*NUMBERS.values(), *LAGGING.values()) for name in numbers}
    assert compared == ACTUATOR.keys()
