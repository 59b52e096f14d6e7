"""Do columns become coordinates and commands as the study says? Logs come from closed forms: cos(w t), sin(w t)."""

import math

import numpy as np
import pytest

from tests.study.crane_log import RIG, RUN, SENSORS, THETA, T, X, one
from upright.physics.oscillators import Rectilinear1
from upright.simulation import simulate


@pytest.mark.parametrize(
    ("sensor", "reading"),
    [
        ("", THETA),
        ('unit = "deg"', np.degrees(THETA)),
        ('unit = "mrad"', 1e3 * THETA),
        ('unit = "rev"', THETA / (2 * math.pi)),
        ("sign = -1", -THETA),
        ("scale = 2.0", THETA / 2),
        ("offset = 0.25", THETA + 0.25),
        ('offset = "180 deg"', THETA + math.pi),
        ('offset = "180 deg"\nsign = -1', math.pi - THETA),
        ('unit = "deg"\noffset = 180', np.degrees(THETA) + 180),
        ('unit = "V"\nscale = "35 deg/V"\noffset = "2.5 V"', np.degrees(THETA) / 35 + 2.5),
        ('unit = "V"\nscale = 0.5', THETA / 0.5),
        ('unit = "mV"\nscale = "35 deg/V"', 1e3 * np.degrees(THETA) / 35),
        ('unit = "counts"\nscale = 0.001', THETA / 0.001),
        ('unit = "counts"\ncounts_per_rev = 16000', THETA * 16000 / (2 * math.pi)),
        ('unit = "counts"\ncounts_per_rev = 16000\noffset = 120', THETA * 16000 / (2 * math.pi) + 120),
        ('unit = "counts"\ncounts_per_rev = 16000\noffset = "180 deg"', THETA * 16000 / (2 * math.pi) + 8000),
    ],
)
def test_a_sensor_turns_readings_into_the_coordinate(study, sensor, reading):
    run = one(study(RIG + f"[sensors.theta]\n{sensor}\n" + RUN, theta=reading, x=X))
    np.testing.assert_allclose(run.y[:, 0], THETA, rtol=0, atol=1e-12)


def test_whole_numbers_are_counts_when_counts_per_turn_are_given(study):
    counts = np.round(THETA * 4096 / (2 * math.pi))
    run = one(study(RIG + "[sensors.theta]\ncounts_per_rev = 4096\n" + RUN, theta=counts, x=X))
    assert run.resolution == pytest.approx((2 * math.pi / 4096,))
    assert np.abs(run.y[:, 0] - THETA).max() <= math.pi / 4096 + 1e-12  # half a count


def test_radians_stay_radians_and_counts_per_turn_set_their_resolution(study):
    run = one(study(RIG + "[sensors.theta]\ncounts_per_rev = 14400\nsign = -1\n" + RUN))
    np.testing.assert_array_equal(run.y[:, 0], -THETA)
    assert run.resolution == pytest.approx((2 * math.pi / 14400,))


def test_a_position_in_counts_needs_counts_per_metre(study):
    run = one(study(RIG + '[sensors.x]\nunit = "counts"\ncounts_per_m = 226629\n' + RUN, x=X * 226629))
    np.testing.assert_allclose(run.y[:, 0], X, atol=1e-12)
    assert run.resolution == pytest.approx((1 / 226629,))


def test_an_angle_that_jumps_by_a_turn_is_unwrapped(study):
    spinning = 5 * T
    wrapped = np.angle(np.exp(1j * spinning))
    run = one(study(RIG + "[sensors.theta]\n" + RUN, theta=wrapped, x=X))
    np.testing.assert_allclose(run.y[:, 0], spinning, atol=1e-9)
    assert "'theta' began again after a turn" in run.source


def test_a_drive_may_be_arithmetic_on_columns(study):
    run = one(study(RIG + SENSORS + '[drive]\nexpression = "2.5*(0.2 - x)"\nunit = "V"\n' + RUN))
    np.testing.assert_allclose(run.u[:, 0], 2.5 * (0.2 - X), atol=1e-15)


def test_drive_sign_and_scale_apply_and_a_run_may_replace_the_drive(study):
    drive = '[drive]\ncolumn = "v"\nsign = -1\nscale = 10\n'
    more = '[[runs]]\nlabel = "free"\nfile = "log.csv"\ndrive = 0\n'
    more += '[[runs]]\nlabel = "other"\nfile = "log.csv"\ndrive = { expression = "3*v", sign = 1 }\n'
    first, free, other = study(RIG + SENSORS + drive + RUN + more).runs
    np.testing.assert_allclose(first.u[:, 0], -20 * T)
    np.testing.assert_array_equal(free.u, 0)
    np.testing.assert_allclose(other.u[:, 0], 60 * T)


def test_a_plant_without_drive_runs_free(study):
    np.testing.assert_array_equal(one(study(RIG + SENSORS + RUN)).u, np.zeros((T.size, 1)))


def test_jittering_samples_are_brought_onto_the_period_they_jitter_about(study):
    rng = np.random.default_rng(1)
    t = T + rng.uniform(-1e-3, 1e-3, T.size)
    run = one(study(RIG + SENSORS + RUN, t=t, theta=0.3 * np.cos(6 * t), x=np.zeros_like(t)))
    assert run.period == pytest.approx(0.005, rel=1e-4)
    # straight lines between samples h apart: error below h^2/8 max |theta''|
    bound = (7e-3) ** 2 / 8 * 0.3 * 36
    assert np.abs(run.y[:, 1] - 0.3 * np.cos(6 * run.t)).max() < bound
    assert "resampled" in run.source


def test_commands_are_held_not_interpolated(study):
    step = np.where(T < 3.0, 0.0, 1.0)
    run = one(study(RIG + SENSORS + '[drive]\ncolumn = "v"\n' + RUN + 'period = "2 ms"\n', theta=THETA, x=X, v=step))
    np.testing.assert_array_equal(run.u[:, 0], np.where(run.t < 3.0 - 1e-9, 0.0, 1.0))
    assert run.period == pytest.approx(0.002)


@pytest.mark.parametrize("period", [0.02, 0.0073])
def test_pulses_shorter_than_the_grid_move_a_free_mass_as_they_did(study, period):
    t = 1e-3 * np.arange(2001)
    pulses = np.where(np.arange(t.size) % 50 // 3 == 4, 5.0, 0.0) - np.where(np.arange(t.size) % 170 == 33, 7.0, 0.0)
    run = one(study(
        RIG + SENSORS + '[drive]\ncolumn = "v"\n' + RUN + f"period = {period}\n",
        t=t, theta=np.cos(t), x=np.sin(t), v=pulses,
    ))  # fmt: skip
    mass = 2.0
    x = simulate(Rectilinear1(m_1=mass, k_1=0.0), {}, [0.0, 0.1], run.u, run.period, samples=run.t.size)[:, :, 0]
    impulse = np.interp(run.t, t, np.concatenate([[0.0], 1e-3 * np.cumsum(pulses[:-1])]))
    np.testing.assert_allclose(x[:, 1], 0.1 + impulse / mass, rtol=0, atol=1e-12)


def test_a_law_reads_its_reference_at_its_samples(study):
    ramp = np.round(3 * T, 1)
    loop = '[runs.loop]\ngains = { x = "2 V/m" }\nreference = "r"\n'
    unit = '[actuator]\ngain = "2 N/V"\n[drive]\ncolumn = "v"\nunit = "V"\n'
    run = one(study(RIG + unit + SENSORS + RUN + 'period = "20 ms"\n' + loop, theta=THETA, x=X, v=0 * T, r=ramp))
    np.testing.assert_array_equal(run.loop.law.references[:, 0], ramp[::4])


def test_a_whole_multiple_of_the_period_picks_samples(study):
    run = one(study(RIG.replace('"cart-pendulum"', '"cart-pendulum"\nperiod = "20 ms"') + SENSORS + RUN))
    np.testing.assert_allclose(run.y[:, 1], THETA[::4], atol=1e-12)


def test_lost_samples_are_told(study):
    keep = np.ones(T.size, bool)
    keep[700:710] = False
    run = one(study(RIG + SENSORS + RUN, t=T[keep], theta=THETA[keep], x=X[keep]))
    assert "1 gap(s)" in run.source
    assert run.t.size == T.size
