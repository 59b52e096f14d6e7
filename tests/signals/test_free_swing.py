"""Do the peaks of a swing tell what made it, with viscous and dry friction, rounding and an offset?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.signals.swings import swing
from upright.errors import NotIdentifiable
from upright.signals.free_swing import decay, recursion
from upright.signals.stretches import turning_points


def test_the_recursion_gives_the_extremes_that_scipy_integrates():
    m, k, c, f, centre = 0.8, 390.0, 1.2, 1.5, 0.03
    _, _, extremes = swing(m, k, c, f, x0=0.1, centre=centre)
    sigma = c / (2 * m)
    rho = math.exp(-math.pi * sigma / math.sqrt(k / m - sigma**2))
    x = extremes[:, 1]
    up = np.arange(x.size) % 2 == 0
    assert x.size > 6
    assert np.allclose(recursion(np.array([x[0], rho, centre, f / k]), up), x, rtol=0, atol=1e-8)


@pytest.mark.parametrize("f", [0.0, 0.2, 0.8])
@pytest.mark.parametrize("resolution", [0.0, 1e-4])
def test_frequency_and_both_frictions_are_recovered(f, resolution):
    m, k, c, centre = 0.8, 390.0, 1.2, 0.0123
    t, y, extremes = swing(m, k, c, f, x0=0.05, centre=centre, resolution=resolution)
    found = decay(t, y, resolution=resolution)
    assert 4 <= found.t.size < extremes.shape[0]  # the first and the last rest are no turns
    n = found.t.size
    # a few errors of least squares on n heights; a rounding of 1e-4 in 0.05 leaves 0.1 % of frequency at most
    assert found.omega_n == pytest.approx(math.sqrt(k / m), rel=1e-5 if resolution == 0 else 1e-3)
    assert abs(found.sigma - c / (2 * m)) < max(5 * found.sigma_error, 2e-3)
    assert abs(found.delta - f / k) < max(5 * found.delta_error, 1e-6)
    assert abs(found.centre - centre) < max(resolution, 1e-6)
    assert np.allclose(found.t, extremes[1 : n + 1, 0], rtol=0, atol=2e-5 if resolution == 0 else 2e-3)


def test_dry_friction_alone_takes_four_delta_off_the_amplitude_every_period():
    """The textbook's linear envelope."""
    m, k, f = 0.5, 200.0, 0.4
    t, y, _ = swing(m, k, 0.0, f, x0=0.05)
    found = decay(t, y)
    assert np.allclose(np.abs(found.x[:-2]) - np.abs(found.x[2:]), 4 * f / k, rtol=1e-6)
    assert found.decrement == pytest.approx(0.0, abs=1e-4)


def test_viscous_friction_alone_shows_the_textbook_decrement():
    m, k, c = 0.5, 200.0, 1.0
    t, y, _ = swing(m, k, c, 0.0, x0=0.05)
    found = decay(t, y)
    zeta = c / (2 * math.sqrt(k * m))
    assert found.zeta == pytest.approx(zeta, rel=1e-4)
    assert found.decrement == pytest.approx(2 * math.pi * zeta / math.sqrt(1 - zeta**2), rel=1e-4)
    assert found.decrement == pytest.approx(math.log(found.x[0] / found.x[2]), rel=1e-4)


def test_reading_the_decrement_as_viscous_would_be_wrong_where_friction_is_dry():
    t, y, _ = swing(0.8, 390.0, 1.2, 0.8, x0=0.05)
    found = decay(t, y)
    naive = math.log(abs((found.x[0] - found.centre) / (found.x[2] - found.centre)))
    assert naive > 1.3 * found.decrement


@pytest.mark.slow
@pytest.mark.thorough
def test_stated_errors_are_those_seen_over_repetitions():
    m, k, c, f, noise = 0.8, 390.0, 1.2, 0.2, 2e-4
    rows = []
    for seed in range(60):
        t, y, _ = swing(m, k, c, f, x0=0.05, noise=noise, seed=seed)
        found = decay(t, y, resolution=noise * 2)
        rows.append(((found.omega_n - math.sqrt(k / m)) / found.omega_error, (found.delta - f / k) / found.delta_error))
    scatter = np.std(rows, axis=0)
    # 60 draws know a standard deviation to 9 %; scatter accounts take the larger of two, so errors may be too large
    assert (scatter < 1.3).all()
    assert (scatter > 0.4).all()


def test_errors_are_those_that_noise_makes():
    """Viscous friction alone has a closed form; twenty draws know a scatter to 16 %, and errors may be too large."""
    omega, sigma, noise = 20.0, 0.6, 2e-4
    t = np.arange(0, 1.5, 4e-3)
    damped = math.sqrt(omega**2 - sigma**2)
    x = 0.05 * np.exp(-sigma * t) * (np.cos(damped * t) + sigma / damped * np.sin(damped * t))
    rng = np.random.default_rng(2)
    off = []
    for _ in range(20):
        found = decay(t, x + noise * rng.normal(size=t.size), resolution=noise)
        off.append(
            [
                (found.omega_n - omega) / found.omega_error,
                (found.sigma - sigma) / found.sigma_error,
                found.delta / found.delta_error,
            ]
        )
    scatter = np.std(off, axis=0)
    assert (scatter < 1.5).all()
    assert (scatter > 0.5).all()


def test_a_swing_without_noise_has_the_errors_that_its_resolution_makes():
    """Rounding to steps of r scatters by r/sqrt(12); from there on by derivatives of the closed form, by hand.

    Least squares about each extreme for time, height and a size of either side; then of the times for their period, and
    of the heights for what a half swing leaves, centre and dry friction.
    """
    A, omega, sigma, r = 0.05, 20.0, 0.6, 1e-4
    damped = math.sqrt(omega**2 - sigma**2)

    def swings(tau):
        return np.exp(-sigma * tau) * (np.cos(damped * tau) + sigma / damped * np.sin(damped * tau))

    def scatter(of, at, by):
        """Covariance of what is fitted to values that scatter by that, each derivative by a central difference."""
        steps = 1e-6 * np.eye(len(at))
        J = np.column_stack([(of(at + h) - of(at - h)) / 2e-6 for h in steps]) / np.reshape(by, (-1, 1))
        return np.linalg.inv(J.T @ J)

    t = np.arange(0.0, 1.5, 4e-3) + 1e-3
    found = decay(t, A * swings(t), resolution=r)
    n = found.t.size
    times, heights = math.pi / damped * np.arange(1, n + 1), []
    np.testing.assert_allclose(found.t, times, rtol=0, atol=1e-6)
    errors = []
    for at in times:
        near = t[np.abs(t - at) <= 0.35 * math.pi / damped]
        size = float(A * swings(at))
        heights.append(size)

        def about(p, near=near, size=size):
            tau = near - p[0]
            return p[1] + np.where(near < p[0], p[2], p[3]) * (swings(tau) - 1) * size

        errors.append(np.sqrt(np.diag(scatter(about, np.array([at, size, 1.0, 1.0]), r / math.sqrt(12)))[:2]))
    errors = np.array(errors)
    period = scatter(lambda p: p[0] + p[1] * np.arange(n), np.array([times[0], math.pi / damped]), errors[:, 0])[1, 1]
    fitted = np.array([heights[0], math.exp(-math.pi * sigma / damped), 0.0, 0.0])
    covariance = scatter(lambda p: recursion(p, found.maximum), fitted, errors[:, 1])
    sigma_error = math.sqrt(covariance[1, 1]) / fitted[1] * damped / math.pi
    omega_error = damped / omega * damped**2 / math.pi * math.sqrt(period)
    assert found.delta_error == pytest.approx(math.sqrt(covariance[3, 3]), rel=1e-3)
    assert found.sigma_error == pytest.approx(sigma_error, rel=1e-3)
    assert found.omega_error == pytest.approx(math.hypot(omega_error, sigma / omega * sigma_error), rel=1e-3)


def test_two_modes_are_not_taken_for_one_swing():
    t = np.arange(0, 3, 2e-3)
    y = np.exp(-0.3 * t) * (np.cos(20 * t) + 0.9 * np.cos(47 * t))
    with pytest.raises(NotIdentifiable, match="not one decaying swing"):
        decay(t, y)


def test_four_turns_are_enough_and_three_are_not():
    t = np.arange(0, 2, 2e-3)
    x = np.exp(-0.5 * t) * np.cos(10 * t - 1)  # it turns each pi/10 s from near 0.1 s on
    four = t < 0.1 + 3.6 * math.pi / 10
    assert decay(t[four], x[four]).omega_d == pytest.approx(10.0, rel=1e-4)
    three = t < 0.1 + 2.6 * math.pi / 10
    with pytest.raises(NotIdentifiable, match="at least 4 extremes, and this swing shows 3"):
        decay(t[three], x[three])


def test_too_few_turns_are_said():
    t, y, _ = swing(0.8, 390.0, 12.0, 0.5, x0=0.05)
    with pytest.raises(NotIdentifiable, match="at least 4 extremes"):
        decay(t, y)


def test_a_slow_log_is_said_to_be_slow():
    t, y, _ = swing(0.8, 390.0, 1.2, 0.2, x0=0.05, rate=40)
    with pytest.raises(NotIdentifiable, match="log at least"):
        decay(t, y)


def test_turns_ignore_what_is_smaller_than_asked():
    t = np.linspace(0, 4 * math.pi, 2001)
    ripple = np.sin(t) + 0.01 * np.sin(40 * t)
    found = t[turning_points(ripple, 0.1)]
    assert np.allclose(found, (np.arange(4) + 0.5) * math.pi, rtol=0, atol=0.1)  # the ripple's own period is 0.16
