"""Are speeds and accelerations exact where a polynomial moves, at both ends too, and as noisy as theory says?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.signals.smoothing import (
    ROUGH,
    acceleration_width,
    dominant_period,
    end_errors,
    gaussian_noise_gain,
    middle,
    noise_gain,
    savitzky_golay,
    scatter,
    smoothed,
    smoothing_width,
)

DT = 0.01


def polynomial(order, t):
    """Values, speeds and accelerations of 0.4 + t - t^2/2 + ... up to an order."""
    p = np.polynomial.Polynomial([0.4, 1.0, -0.5, 2.0, -3.0][: order + 1])
    return p(t), p.deriv()(t), p.deriv(2)(t)


@pytest.mark.parametrize("order", [2, 3, 4])
@pytest.mark.parametrize(("n", "width"), [(60, 21), (60, 20), (60, 3), (21, 21), (7, 99), (6, 6), (5, 5), (5, 21)])
def test_a_polynomial_is_followed_from_the_first_sample_to_the_last(order, n, width):
    t = DT * np.arange(n)
    q, v, a = polynomial(order, t)
    motion = savitzky_golay(q, DT, width, order=order)
    assert motion.q == pytest.approx(q, abs=1e-12)
    assert motion.v == pytest.approx(v, abs=1e-9)
    assert motion.a == pytest.approx(a, abs=1e-6)


@pytest.mark.parametrize("order", [2, 3, 4])
@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_what_is_shorter_than_a_window_still_has_a_straight_line(order, n):
    """Four samples and fewer, of which no fourth order can be had; a single one does not move."""
    t = DT * np.arange(n)
    motion = savitzky_golay(0.4 + 2.0 * t, DT, 21, order=order)
    assert motion.q == pytest.approx(0.4 + 2.0 * t, abs=1e-12)
    assert motion.v == pytest.approx(np.full(n, 2.0 if n > 1 else 0.0), abs=1e-10)
    assert motion.a == pytest.approx(np.zeros(n), abs=1e-7)


def test_a_window_reaches_half_its_width_to_either_side_and_no_further():
    """Only the first and last `edge` samples come from one-sided fits; a spike is felt by half a window around it."""
    y = np.zeros(60)
    y[30] = 1.0
    motion = savitzky_golay(y, DT, 11)
    assert motion.edge == 5
    assert np.flatnonzero(np.abs(motion.q) > 1e-12).tolist() == list(range(25, 36))
    first, last = (savitzky_golay(np.eye(60)[k], DT, 11).q for k in (0, 59))
    assert np.flatnonzero(np.abs(first) > 1e-12).tolist() == list(range(6))
    assert last == pytest.approx(first[::-1], abs=1e-12)


def test_speeds_alone_are_those_that_come_with_accelerations():
    y = np.random.default_rng(3).normal(size=40)
    alone, both = (savitzky_golay(y, DT, 9, derivatives=d) for d in (1, 2))
    assert (alone.q.tolist(), alone.v.tolist()) == (both.q.tolist(), both.v.tolist())
    assert not alone.a.any()
    assert both.a.any()


def test_weights_are_those_that_savitzky_and_golay_print():
    """Analytical Chemistry 36 (1964), table I: quadratic and cubic, 5 and 7 points."""
    assert middle(5, order=3) == pytest.approx(np.array([-3, 12, 17, 12, -3]) / 35)
    assert middle(7, order=2) == pytest.approx(np.array([-2, 3, 6, 7, 6, 3, -2]) / 21)
    assert middle(7) == pytest.approx(np.array([5, -30, 75, 131, 75, -30, 5]) / 231)


def test_a_window_of_seven_has_the_weights_of_a_quartic():
    """Tables I, III and V of the same: what a single sample does to its neighbours, earlier ones seeing it ahead."""
    motion = savitzky_golay(np.eye(40)[20], 1.0, 7)
    assert motion.q[17:24] == pytest.approx(np.array([5, -30, 75, 131, 75, -30, 5]) / 231, abs=1e-12)
    assert motion.v[17:24] == pytest.approx(np.array([-22, 67, 58, 0, -58, -67, 22]) / 252, abs=1e-12)
    assert motion.a[17:24] == pytest.approx(np.array([-13, 67, -19, -70, -19, 67, -13]) / 132, abs=1e-12)


@pytest.mark.parametrize(("order", "edge"), [(2, 1), (3, 2), (4, 2)])
def test_a_window_is_no_narrower_than_its_polynomial_needs(order, edge):
    assert savitzky_golay(np.zeros(40), 1.0, 1, order=order).edge == edge


@pytest.mark.parametrize("width", [5, 9, 33])
def test_noise_of_an_acceleration_is_that_of_a_parabola(width):
    """The coefficient of s^2 has the variance 180/(n (n^2 - 1)(n^2 - 4)), and the acceleration is twice it."""
    n = width
    expected = 2 * math.sqrt(180 / (n * (n**2 - 1) * (n**2 - 4)))
    assert noise_gain(width, order=3) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("sigma", [2.0, 5.0, 20.0])
def test_noise_behind_a_gaussian_is_the_size_of_its_impulse_response(sigma):
    from scipy.ndimage import gaussian_filter1d

    impulse = np.zeros(401)
    impulse[200] = 1.0
    size = np.linalg.norm(gaussian_filter1d(impulse, sigma, order=2, truncate=8.0))
    assert gaussian_noise_gain(sigma) == pytest.approx(size, rel=1e-3)


def test_errors_at_an_end_are_those_of_polyfit():
    width, order = 15, 3
    y = np.random.default_rng(1).normal(size=80)
    q = np.zeros(80)
    s = -DT * np.arange(width)[::-1]
    _, covariance = np.polyfit(s, np.zeros(width), order, cov="unscaled")
    noise = np.std(y) * math.sqrt(width / (width - order - 1))
    expected = noise * np.sqrt(np.diag(covariance)[::-1][:2])
    assert end_errors(y, q, DT, width, order=order) == pytest.approx(expected, rel=1e-6)


def test_an_acceleration_is_smoothed_until_its_noise_is_a_tenth_and_hardly_more():
    t = 2e-3 * np.arange(4000)
    noise = 2e-4
    y = np.sin(6 * t) + noise * np.random.default_rng(4).normal(size=t.size)
    width = acceleration_width(y, 2e-3, 0.0)
    true = 36 / math.sqrt(2)

    def share(n):
        return noise * 2 * math.sqrt(180 / (n * (n**2 - 1) * (n**2 - 4))) / 2e-3**2 / true

    assert width % 2 == 1
    # the noise is known to some percent from second differences, and windows grow by 30 %
    assert share(width) < 1.1 * ROUGH < 1.3 * share(width / 1.3)
    counted = acceleration_width(np.round(np.sin(6 * t) / 1e-2) * 1e-2, 2e-3, 1e-2)
    assert counted > acceleration_width(np.sin(6 * t), 2e-3, 0.0) == 9


@pytest.mark.parametrize(
    ("period", "resolution", "width"),
    [
        (1.0, 0.0, 12),  # an eighth of 100 samples
        (0.4, 0.0, 7),  # no less than 7
        (1.0, 0.04, 12),  # 15 steps last 0.6 s/2 pi = 9.5 samples
        (1.0, 0.08, 19),  # 1.2 s/2 pi
        (1.0, 0.2, 24),  # 48 samples, and twice an eighth at most
    ],
)
def test_a_window_is_an_eighth_of_a_period_or_fifteen_steps_of_motion(period, resolution, width):
    """A sine of standard deviation 1 moves at 2 pi/period, root mean square."""
    y = math.sqrt(2) * np.sin(2 * np.pi * np.arange(1000) / 100)
    assert smoothing_width(y, DT, period, resolution) == width


def test_a_body_at_rest_has_no_steps_to_wait_for():
    assert smoothing_width(np.zeros(100), DT, 1.0, 0.1) == 12
    assert scatter(np.zeros(5)) == 1.0
    assert scatter(np.array([-2.0, 2.0])) == 2.0


def test_a_period_is_that_of_the_motion_not_of_drift_nor_of_fast_noise():
    """What drifts evenly is taken out; a hundredth of the power may be anywhere."""
    t = DT * np.arange(2000)
    motion = np.sin(2 * np.pi * t)
    assert dominant_period(motion + 5 * t, DT) == pytest.approx(1.0, rel=0.02)
    assert dominant_period(motion + 0.09 * np.sin(2 * np.pi * 40 * t), DT) == pytest.approx(1.0, rel=0.02)
    # powers 1 and 1/4 at 1 and 3 Hz: root mean square frequency sqrt((1 + 9/4)/(5/4)) Hz, in whatever unit
    two = motion + np.sin(2 * np.pi * 3 * t) / 2
    assert dominant_period(two, DT) == pytest.approx(1 / math.sqrt(2.6), rel=0.02)
    assert dominant_period(np.sin(2 * np.pi * t / 4), DT) == pytest.approx(4.0, rel=0.05)
    assert dominant_period(1e-9 * two, DT) == pytest.approx(dominant_period(two, DT), rel=1e-6)


@pytest.mark.parametrize("still", [np.zeros(200), np.full(200, 3.0), np.linspace(0, 1, 200)])
def test_what_does_not_swing_has_the_whole_record_as_its_period(still):
    assert dominant_period(still, DT) == pytest.approx(2.0)


def test_coordinates_smoothed_together_move_as_each_alone_and_a_constant_not_at_all() -> None:
    t = np.arange(400) * 0.01
    signals = [np.sin(3 * t), np.full(t.size, 0.4), np.cos(7 * t)]
    both = smoothed(signals, 0.01, 21)
    for i, y in ((0, signals[0]), (2, signals[2])):
        alone = savitzky_golay(y, 0.01, 21)
        assert all(np.array_equal(getattr(both, name)[i], getattr(alone, name)) for name in ("q", "v", "a"))
    assert np.array_equal(both.q[1], signals[1])
    assert not both.v[1].any()
    assert not both.a[1].any()
    # a fiftieth of the deviation of 3 cos(3 t) and -7 sin(7 t), an amplitude over the square root of 2
    assert both.fades == pytest.approx([0.06 / np.sqrt(2), 0.0, 0.14 / np.sqrt(2)], rel=0.05)
    assert both.edge == 10
    cubic = smoothed(signals, 0.01, 21, order=3)
    assert np.array_equal(cubic.a[0], savitzky_golay(signals[0], 0.01, 21, order=3).a)
