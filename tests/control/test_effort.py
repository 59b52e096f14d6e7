"""Do the figures of a command agree with closed forms, describing functions and scipy?"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from upright.control.effort import QUIET_PEAK, QUIET_RMS, cycle, effort, quiet, rest_effort
from upright.errors import BadInput

T = np.arange(12_000) * 1e-3


def test_commands_within_half_a_step_of_the_limit_count_as_saturated():
    given = effort(np.array([1.0, -5.0, 4.9999, 2.0]), limit=5.0, step=1e-3)
    assert given.peak == 5.0
    assert given.share == 1.0
    assert given.saturated == 0.5


@pytest.mark.parametrize(("u", "limit"), [([], 1.0), ([1.0], 0.0)])
def test_an_effort_without_commands_or_limit_is_refused(u, limit):
    with pytest.raises(BadInput, match="limit above 0"):
        effort(u, limit)


def test_a_command_half_a_step_below_the_limit_is_at_it():
    assert effort([1.0, 0.0, 0.0, 0.0], limit=1.25, step=0.5).saturated == 0.25
    assert effort([1.0, 0.0, 0.0, 0.0], limit=1.25, step=0.4).saturated == 0.0
    assert effort([1.0], limit=1.25).share == 0.8


def test_a_sine_at_rest_has_its_amplitude_over_root_two_and_its_period():
    """4 s of whole periods of 0.4 s; the mean is no noise, and counts for the peak."""
    found = rest_effort(T, 0.5 + 0.3 * np.sin(2 * np.pi * T / 0.4), limit=2.0)
    assert found.rms == pytest.approx(0.3 / math.sqrt(2) / 2.0, rel=1e-6)
    assert found.peak == pytest.approx(0.8 / 2.0, rel=1e-6)
    assert found.command.size == pytest.approx(0.3, rel=1e-6)
    assert found.command.period == pytest.approx(0.4, rel=1e-6)


def test_only_the_last_third_is_rest():
    u = np.where(T < 8.0, 9.0, 0.0)
    assert rest_effort(T, u, limit=10.0).peak == 0
    assert rest_effort(T, u[::-1], limit=10.0).peak == pytest.approx(0.9)


def test_a_difference_of_rounded_readings_has_the_variance_of_two_roundings():
    """k (e_i - e_i-1) with e uniform over a count q: k q/sqrt(6), to five standard errors."""
    q, k, n = 0.01, 30.0, 60_000
    y = np.random.default_rng(4).uniform(0, 1, n)
    u = k * np.diff(np.floor(y / q + 0.5) * q - y)
    found = rest_effort(np.arange(u.size) * 1e-3, u, limit=1.0)
    # correlated by -1/2 with their neighbours: 1.5 times the variance of a variance of independent ones; 5 sigma
    assert found.rms == pytest.approx(k * q / math.sqrt(6), rel=5 * math.sqrt(1.5 / 2 / (n / 3)))
    assert found.peak <= k * q
    assert found.command is None  # noise repeats nothing


def test_a_relay_about_three_lags_cycles_as_the_exact_solution_and_its_describing_function_say():
    """u = -d sign(y) about 1/(s (s+1) (s+2)), by exponentials; half a period h leads from x to -x, with y = 0."""
    d = 2.0
    A, B = np.array([[0.0, 1, 0], [0, 0, 1], [0, -2, -3]]), np.array([[0.0], [0], [1]])

    def after(h, x):
        """State after a time h of u = -d."""
        step = expm(np.block([[A, -d * B], [np.zeros((1, 4))]]) * h)
        return step[:3, :3] @ x + step[:3, 3]

    def begin(h):
        return np.linalg.solve(np.eye(3) + expm(A * h), -after(h, np.zeros(3)))

    half = brentq(lambda h: begin(h)[0], 1.0, 5.0)
    dt = half / 2000
    arch = [begin(half)]
    for _ in range(1999):
        arch.append(after(dt, arch[-1]))
    y = np.tile(np.concatenate([np.array(arch)[:, 0], -np.array(arch)[:, 0]]), 6)
    t = np.arange(y.size) * dt
    found = cycle(t, y)
    assert found.period == pytest.approx(2 * half, rel=1e-9)
    assert found.size == pytest.approx(np.abs(np.array(arch)[:, 0]).max(), rel=1e-9)
    # the describing function: phase -180 degrees at sqrt(2) rad/s, where the gain is 1/6. It leaves out the third
    # harmonic, |G(3jw)|/3|G(jw)| = 2.3 %, which may turn the phase by as much: d(phase)/d(ln w) is -0.943 there, and
    # d ln|G|/d ln w is -2.
    left_out = 0.0231
    assert found.period == pytest.approx(2 * math.pi / math.sqrt(2), rel=left_out / 0.943)
    assert found.size == pytest.approx(4 * d / (6 * math.pi), rel=left_out * (1 + 2 / 0.943))
    bang = rest_effort(t, -d * np.sign(y), limit=d)
    assert (bang.peak, bang.quiet) == (1.0, False)
    assert bang.rms == pytest.approx(1.0, abs=1e-3)  # two whole periods of a square wave, less a sample at 0


def test_what_stays_within_a_count_or_wanders_is_no_cycle():
    flicker = 0.01 * (np.arange(T.size) % 2)
    assert cycle(T, flicker, 0.01) is None
    assert cycle(T, flicker, 0.009).period == pytest.approx(2e-3)
    assert cycle(T, T) is None
    assert cycle(T, np.full(T.size, 3.0)) is None
    assert cycle(T, np.random.default_rng(1).normal(size=T.size)) is None


@pytest.mark.parametrize(("rms", "peak", "leaves"), [(0.1, 0.5, True), (0.11, 0.3, False), (0.02, 0.51, False)])
def test_a_command_is_quiet_within_both_thresholds(rms, peak, leaves):
    assert bool(quiet(rms, peak)) is leaves


def test_the_thresholds_leave_three_deviations_of_a_gaussian_and_half_of_what_the_drive_recovers():
    assert 3 * QUIET_RMS < QUIET_PEAK <= 0.5


def test_without_a_limit_nothing_is_loud():
    assert rest_effort(T, 1e3 * np.sin(T), limit=math.inf).quiet


@pytest.mark.parametrize(("u", "limit"), [(np.zeros(1), 1.0), (np.zeros(5), 1.0), (np.zeros(T.size), 0.0)])
def test_a_rest_without_commands_times_or_limit_is_refused(u, limit):
    with pytest.raises(BadInput, match="limit above 0"):
        rest_effort(T[:1] if u.size == 1 else T, u, limit)


@pytest.mark.parametrize(("times", "repeats"), [(3, True), (2, False)])
def test_what_turns_three_times_repeats_and_what_turns_twice_does_not(times, repeats):
    t = np.linspace(0.0, times, 200 * times, endpoint=False)
    found = cycle(t, -np.cos(2 * math.pi * t))
    assert (found is not None) is repeats
    assert found is None or found.period == pytest.approx(1.0, rel=0.01)  # two samples of 200
