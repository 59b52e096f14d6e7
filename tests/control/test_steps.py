"""Do the figures of a step agree with closed forms and python-control, and survive encoders and dry friction?"""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

from upright.control.score import step_figures
from upright.errors import BadInput
from upright.physics import chain
from upright.simulation import simulate

T = np.linspace(0.0, 12.0, 6001)


def test_a_first_order_lag_rises_and_settles_by_its_logarithms():
    tau = 0.7
    found = step_figures(T, 1 - np.exp(-T / tau), before=0.0, reference=1.0)
    assert found.rise == pytest.approx(tau * math.log(9), rel=1e-4)
    assert found.settling_2 == pytest.approx(tau * math.log(50), rel=1e-4)
    assert found.settling_5 == pytest.approx(tau * math.log(20), rel=1e-4)
    assert found.overshoot < 1e-6
    assert abs(found.error) < 1e-6


@pytest.mark.parametrize("zeta", [0.2, 0.4, 0.7])
def test_a_second_order_system_overshoots_by_the_closed_form(zeta):
    omega = 5.0
    damped = omega * math.sqrt(1 - zeta**2)
    phase = math.acos(zeta)
    y = -2 * (1 - np.exp(-zeta * omega * T) * np.sin(damped * T + phase) / math.sin(phase))  # a step down, of two
    found = step_figures(T, y, before=0.0, reference=-2.0)
    assert found.overshoot == pytest.approx(math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2)), rel=1e-4)
    assert found.peak_time == pytest.approx(math.pi / damped, abs=T[1])


@pytest.mark.parametrize("poles", [(-1.0, -3.0, -9.0), (-1.0 + 4.0j, -1.0 - 4.0j, -2.0), (-3.0 + 1.0j, -3.0 - 1.0j)])
def test_python_control_says_the_same(poles):
    """To a sample: it does not interpolate."""
    y = control.step_response(control.tf([1.0], np.poly(poles).real), T).outputs
    final = 1 / np.poly(poles).real[-1]
    found = step_figures(T, y, before=0.0, reference=final)
    for band, ours in ((0.02, found.settling_2), (0.05, found.settling_5)):
        told = control.step_info(y, T, SettlingTimeThreshold=band, yfinal=final)
        assert ours == pytest.approx(told["SettlingTime"], abs=2 * T[1])
    assert found.rise == pytest.approx(told["RiseTime"], abs=2 * T[1])
    assert 100 * found.overshoot == pytest.approx(told["Overshoot"], abs=1e-3)
    if told["Overshoot"] > 0.1:
        assert found.peak_time == pytest.approx(told["PeakTime"], abs=2 * T[1])


def test_an_encoder_moves_the_figures_by_no_more_than_its_step():
    zeta, omega, resolution = 0.3, 6.0, 0.02  # fifty steps in all, as wide as the narrow band
    damped, phase = omega * math.sqrt(1 - zeta**2), math.acos(zeta)
    y = 1 - np.exp(-zeta * omega * T) * np.sin(damped * T + phase) / math.sin(phase)
    smooth = step_figures(T, y, before=0.0, reference=1.0)
    shown = step_figures(
        T, np.floor(y / resolution + 0.5) * resolution, before=0.0, reference=1.0, resolution=resolution
    )
    assert shown.overshoot == pytest.approx(smooth.overshoot, abs=resolution)
    # the envelope falls from 5 to 4 or 6 % within log(6/4)/(zeta omega)
    assert shown.settling_5 == pytest.approx(smooth.settling_5, abs=math.log(6 / 4) / (zeta * omega))
    assert shown.rise == pytest.approx(smooth.rise, rel=0.1)
    assert shown.resolution == pytest.approx(resolution)


def test_dry_friction_leaves_an_error_and_no_endless_settling():
    """A body on a spring stops where friction holds it: within f/k of the spring's rest, and stays."""
    body = chain(1, "rectilinear")(m_1=1.0, k_1=400.0, c_1=4.0, f_1c=0.5)
    dt = 1e-3
    x = simulate(body, {}, body.state(), np.full(3001, 4.0), dt, samples=3001)[:, 0, 0]
    found = step_figures(np.arange(3001) * dt, x, before=0.0, reference=4.0 / 400.0)
    assert 0 < abs(found.error) <= 0.5 / 400.0 * (1 + 1e-9)
    assert found.error == pytest.approx(4.0 / 400.0 - x[-1])
    assert found.settling_2 < 2.0


def test_what_has_not_settled_is_said_to_take_for_ever():
    found = step_figures(T, 1 - np.cos(5 * T), before=0.0, reference=1.0)
    assert found.settling_5 == math.inf


def test_what_did_not_move_is_refused():
    with pytest.raises(BadInput, match="nothing stepped"):
        step_figures(T, np.zeros_like(T), before=0.0, reference=1.0, resolution=1e-3)


def test_a_ramp_passes_its_levels_by_straight_lines_and_settles_where_it_enters_the_band():
    """Sampled coarsely, from 10 to 30 mm in 10 s, from t = 5 s on: levels between samples, by hand."""
    t = 5.0 + np.arange(40.0)
    y = 10.0 + np.minimum(2.0 * np.arange(40.0), 20.0)
    found = step_figures(t, y, before=10.0, reference=30.0)
    assert found.change == 20.0
    assert found.rise == pytest.approx(8.0)
    assert found.peak_time == 10.0
    assert found.overshoot == 0.0
    assert (found.settling_2, found.settling_5) == pytest.approx((9.8, 9.5))
    assert found.arrival == pytest.approx(9.5)
    assert (found.error, found.resolution) == (0.0, 0.0)
    # asked to go to 29 mm: it rests 1 mm above, 5.3 % of the step, and so never arrives
    off = step_figures(t, y, before=10.0, reference=29.0)
    assert (off.error, off.arrival) == (-1.0, math.inf)
    within = step_figures(t, y, before=10.0, reference=29.1)
    assert within.error == pytest.approx(-0.9)
    assert 9.0 < within.arrival < 10.0  # 4.7 % of it above: it came within 5 % between two samples


def test_a_rest_is_the_median_of_the_last_tenth_and_must_be_seen_that_long():
    y = np.ones(40)
    y[:10] = 0.0
    y[36] = 7.0  # a bump in the last tenth: four samples
    assert step_figures(T[:40], y, before=0.0, reference=1.0).change == 1.0
    late = np.zeros(40)
    late[36:] = 1.0  # the last tenth alone is rest
    assert step_figures(np.arange(40.0), late, before=0.0, reference=1.0).settling_5 == pytest.approx(35.95)
    later = np.ones(40)
    later[:36], later[36] = 0.0, 0.5
    assert step_figures(np.arange(40.0), later, before=0.0, reference=1.0).settling_5 == math.inf


def test_what_the_encoder_does_not_resolve_is_no_overshoot_and_no_settling():
    y = np.ones(100)
    y[:10], y[20:30], y[40] = 0.0, 1.04, 1.03
    t = np.arange(100.0)
    fine = step_figures(t, y, before=0.0, reference=1.0, resolution=0.03)
    assert fine.overshoot == pytest.approx(0.04)
    assert fine.settling_2 == pytest.approx(29 + 1 / 4)  # a band of 3 %, left at 1.04 for 1.0
    coarse = step_figures(t, y, before=0.0, reference=1.0, resolution=0.041)
    assert coarse.overshoot == 0.0
    assert coarse.settling_2 == pytest.approx(9.959)
    assert step_figures(t, y, before=0.0, reference=1.0, resolution=0.1).settling_5 == pytest.approx(9.9)


def test_a_record_that_begins_at_its_rest_has_settled_and_risen_at_once():
    found = step_figures(np.arange(30.0), np.full(30, 2.0), before=0.0, reference=2.0)
    assert (found.rise, found.settling_2, found.settling_5, found.arrival, found.peak_time) == (0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("t", "y", "before", "reference", "words"),
    [
        (np.arange(19.0), np.ones(19), 0.0, 1.0, "20 or more"),
        (np.arange(21.0), np.ones(20), 0.0, 1.0, "20 or more"),
        (np.ones((20, 1)), np.ones((20, 1)), 0.0, 1.0, "20 or more"),
        (np.arange(20.0), np.ones(20), 1.0, 1.0, "goes somewhere else"),
    ],
)
def test_a_step_of_too_few_samples_or_to_nowhere_is_refused(t, y, before, reference, words):
    with pytest.raises(BadInput, match=words):
        step_figures(t, y, before=before, reference=reference)


def test_a_change_of_one_encoder_step_is_none():
    with pytest.raises(BadInput, match="nothing stepped"):
        step_figures(np.arange(20.0), np.full(20, -0.5), before=0.0, reference=1.0, resolution=0.5)
    assert step_figures(np.arange(20.0), np.full(20, -0.5), before=0.0, reference=-1.0, resolution=0.49).change == -0.5


def test_an_error_that_passes_through_zero_settles_where_its_line_enters_the_band():
    """From 0.2 above at 0.1 s to 0.02 below at 0.2 s: 5 % is reached after (0.2 - 0.05)/0.22 of that sample."""
    t = 0.1 * np.arange(20)
    y = np.ones(20)
    y[:3] = 0.0, 1.2, 0.98
    found = step_figures(t, y, before=0.0, reference=1.0)
    assert found.settling_5 == pytest.approx(0.1 + 0.1 * 0.15 / 0.22)
    assert found.settling_2 == pytest.approx(0.1 + 0.1 * 0.18 / 0.22)
    y[2] = 1.02  # from the same side, as before: to the band's edge after 0.15 of 0.18
    assert step_figures(t, y, before=0.0, reference=1.0).settling_5 == pytest.approx(0.1 + 0.1 * 0.15 / 0.18)
