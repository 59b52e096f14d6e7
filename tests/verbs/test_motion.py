"""Does `simulate` move a plant as its closed form does, from where and with what it was asked?"""

from __future__ import annotations

import math

import numpy as np
import pytest

import upright as up
from upright.laws import Law
from upright.physics import chain

FREE = chain(1)(m_1=2.0, k_1=0.0)
SPRING = chain(1)(m_1=2.0, k_1=50.0)  # 5 rad/s
PENDULUM = up.Pendulum(m_p=0.2, l_cg=0.25, J_p=2e-3, g=9.81)
W = math.sqrt(0.2 * 9.81 * 0.25 / (2e-3 + 0.2 * 0.25**2))
FORCE = FREE.inputs[0].name
X, V = "x_1", "x_1_dot"


def test_a_constant_force_moves_a_mass_by_half_its_acceleration_times_the_time_squared():
    run = up.simulate(FREE, u=3.0, seconds="2 s", dt="10 ms")
    assert (len(run), run.period, run.t[0], run.t[-1]) == (201, pytest.approx(0.01), 0.0, pytest.approx(2.0))
    np.testing.assert_allclose(run[X], 0.5 * 1.5 * run.t**2, atol=1e-12)
    np.testing.assert_allclose(run[V], 1.5 * run.t, atol=1e-12)
    np.testing.assert_array_equal(run[FORCE], 3.0)
    assert run.units == {X: "m", V: "m/s", FORCE: "N"}
    assert (run.inputs, run.outputs) == ((FORCE,), (X,))
    assert run.provenance.notes == ("This log was simulated; no rig was touched.",)


def test_five_seconds_every_millisecond_is_what_nobody_has_to_ask_for():
    run = up.simulate(FREE)
    assert (len(run), run.period) == (5001, pytest.approx(1e-3))
    assert not run[X].any()


def test_a_command_is_a_function_of_time_or_samples_of_which_the_last_is_held():
    ramp = up.simulate(FREE, u=lambda t: 2.0 * t, seconds=1.0, dt=1e-3)
    np.testing.assert_allclose(ramp[FORCE], 2.0 * ramp.t)
    assert ramp[X][-1] == pytest.approx(1 / 6, rel=2e-3)  # t^3/6, each sample held
    held = up.simulate(FREE, u=[4.0, -2.0], seconds=0.4, dt=0.1)
    assert held[FORCE].tolist() == [4.0, -2.0, -2.0, -2.0, -2.0]
    np.testing.assert_allclose(held[V], [0.0, 0.2, 0.1, 0.0, -0.1], atol=1e-12)
    assert up.simulate(FREE, u=np.full((5, 1), 1.0), seconds=0.4, dt=0.1)[FORCE].tolist() == [1.0] * 5


@pytest.mark.parametrize(
    ("u", "said"),
    [
        (np.ones(6), r"at most 5 samples of 1 commands, got shape \(6, 1\)"), (np.ones((5, 2)), "got shape"),
        (np.zeros((0, 1)), "got shape"), ("push", "a function of time that gives one, or an array of them, got 'push'"),
    ],
)  # fmt: skip
def test_a_command_that_is_none_is_refused(u, said):
    with pytest.raises(up.BadInput, match=said):
        up.simulate(FREE, u=u, seconds=0.4, dt=0.1)


def test_a_command_is_cut_at_its_limit_and_the_drive_turns_it_into_force():
    run = up.simulate(FREE, u=[5.0, -5.0], limit=2.0, seconds=0.2, dt=0.1)
    assert run[FORCE].tolist() == [2.0, -2.0, -2.0]
    np.testing.assert_allclose(run[V], [0.0, 0.1, 0.0], atol=1e-12)
    geared = up.simulate(FREE, u=4.0, actuator={"gain": 0.5}, seconds=1.0, dt=0.1)
    assert geared[V][-1] == pytest.approx(1.0)
    late = up.simulate(FREE, u=[0.0] * 4 + [4.0], actuator={"delay": 0.25, "gain": 0.5}, seconds=1.0, dt=0.125)
    assert late[V][-1] == pytest.approx(0.25)  # commanded for half a second, of which half was late


def test_a_rig_takes_no_more_than_its_limit_unless_it_is_told_another():
    rig = up.Rig.known(FREE, gain="0.5 N/V", limit="3 V", period="100 ms", counts=1e6)
    for options, most in (({}, 3.0), ({"limit": 2.0}, 2.0)):
        run = up.simulate(rig, u=[5.0, -5.0], seconds=0.2, **options)
        assert run[FORCE].tolist() == [most, -most, -most]  # a period each, the last is held
        np.testing.assert_allclose(run[V], [0.0, most * 0.5 * 0.1 / 2.0, 0.0], atol=1e-12)
        assert run.units[FORCE] == "V"


def test_a_start_is_a_deviation_from_the_equilibrium_asked_for():
    run = up.simulate(PENDULUM, at="inverted", start={"theta": "0.5 deg", "theta_dot": 0.25}, seconds=0.01)
    assert run["theta"][0] == pytest.approx(math.pi + math.radians(0.5))
    assert run["theta_dot"][0] == 0.25
    hanging = up.simulate(PENDULUM, start=[0.01, -0.02], seconds=1.0)
    np.testing.assert_allclose(
        hanging["theta"], 0.01 * np.cos(W * hanging.t) - 0.02 / W * np.sin(W * hanging.t), atol=1e-6
    )
    # above it grows by e^(w t)
    up_there = up.simulate(PENDULUM, at="inverted", start=[1e-7, 1e-7 * W], seconds=1.0)
    np.testing.assert_allclose(up_there["theta"] - math.pi, 1e-7 * np.exp(W * up_there.t), rtol=1e-4)


def test_gains_place_the_motion_about_the_point_that_they_are_for():
    """50 + 2 k: poles -3 and -4 of 2 x'' = -50 x + F, so that x = 4 e^-3t - 3 e^-4t; the differences err by dt/2."""
    model = SPRING.linear()
    gains = up.place(model, [-3, -4])
    run = up.simulate(SPRING, gains, start=[1e-3, 0.0], seconds=2.0, dt=1e-4)
    np.testing.assert_allclose(run[X], 1e-3 * (4 * np.exp(-3 * run.t) - 3 * np.exp(-4 * run.t)), atol=2e-6)
    bare = up.simulate(SPRING, gains.K, start=[1e-3, 0.0], seconds=2.0, dt=1e-4)
    np.testing.assert_array_equal(bare[X], run[X])
    upright = PENDULUM.linear("inverted")
    stands = up.simulate(PENDULUM, up.place(upright, [-8, -9]), start={"theta": 0.01}, seconds=2.0)
    assert stands["theta"][-1] == pytest.approx(math.pi, abs=1e-5)
    with pytest.raises(up.BadInput, match=r"loop of these gains regulates about theta = 3\.142, which is inverted"):
        up.simulate(PENDULUM, up.place(upright, [-8, -9]), at="hanging", seconds=1.0)
    assert up.simulate(PENDULUM, up.place(upright, [-8, -9]), at="inverted", seconds=0.1)["theta"][0] == math.pi


def test_a_command_is_added_to_that_of_a_law_and_both_are_limited_together():
    law = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), [[-10.0]], period=0.1)
    run = up.simulate(FREE, law, start=[0.5, 0.0], seconds=0.2)
    assert run.period == pytest.approx(0.1)
    assert run[FORCE][0] == pytest.approx(-5.0)
    assert up.simulate(FREE, law, start=[0.5, 0.0], seconds=0.2, limit=2.0)[FORCE][0] == -2.0


@pytest.mark.parametrize(("counts", "step"), [(100.0, 0.01), ({X: 50.0}, 0.02), (None, 0.0)])
def test_gains_act_on_what_the_encoder_shows(counts, step):
    """F = -10 x of the nearest count: at 0.4267 m that is 0.43 or 0.42; counts are per metre."""
    run = up.simulate(FREE, [10.0, 0.0], start=[0.4267, 0.0], seconds=0.01, counts=counts)
    seen = round(0.4267 / step) * step if step else 0.4267
    assert run[FORCE][0] == pytest.approx(-10 * seen)


def test_counts_of_an_angle_are_per_turn():
    run = up.simulate(PENDULUM, [1.0, 0.0], at="hanging", start=[0.26, 0.0], seconds=0.01, counts=100)
    assert run["T"][0] == pytest.approx(-4 * 2 * math.pi / 100)  # 0.2513 is the nearest


def test_bare_gains_hold_about_the_equilibrium_that_is_named_and_about_none_that_is_not():
    """Eq. (3): gains for the inverted pendulum closed about hanging regulate nothing, and it stays there unnoticed."""
    gains = up.place(PENDULUM.linear("inverted"), [-8.0, -9.0])
    with pytest.raises(up.BadInput, match=r'about which equilibrium they hold; say at="hanging" or at="inverted"'):
        up.simulate(PENDULUM, gains.K, start=[0.05, 0.0])
    run = up.simulate(PENDULUM, gains.K, at="inverted", start=[0.05, 0.0], seconds=3.0)
    assert run["theta"][-1] == pytest.approx(math.pi, abs=1e-3)
    assert up.simulate(PENDULUM, gains, start=[0.05, 0.0], seconds=3.0)["theta"] == pytest.approx(run["theta"])


def test_the_low_pass_on_differences_remembers_its_share():
    """x = t/2 exactly: the first difference is taken as zero, then (1 - m) x' of the first, in closed form."""
    law = [0.0, 1.0]
    run = up.simulate(chain(1)(m_1=1e9, k_1=0.0), law, start=[0.0, 0.5], seconds=0.05, dt=0.01, memory=0.6)
    np.testing.assert_allclose(run[FORCE], -0.5 * (1 - 0.6 ** np.arange(6)), rtol=1e-6)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"seconds": 0.0}, "above 0, got seconds=0 and dt=0.001"), ({"dt": -1.0}, "got seconds=5 and dt=-1"),
        ({"seconds": 1e5, "dt": 1e-3}, "seconds and dt"),
        ({"counts": {"y": 10}}, "counts names coordinates, got 'y'"),
        ({"counts": 0}, "numbers above 0, got 0 for 'x_1'"),
        ({"start": {X: float("nan")}}, "a finite number was needed"), ({"start": {X: []}}, "a number was needed"),
        ({"actuator": {"gian": 2.0}}, r"no number 'gian'; did you mean 'gain'\? \(it has gain, "),
        ({"law": object()}, "closes the loop by gains, a Law or a Rule, got object"),
        ({"law": [[1.0, 2.0], [3.0, 4.0]]}, r"gains for Rectilinear1 need shape \(1, 2\), got \(2, 2\)"),
    ],
)  # fmt: skip
def test_what_cannot_be_simulated_is_refused(options, said):
    with pytest.raises(up.BadInput, match=said):
        up.simulate(FREE, **options)


def test_a_motion_without_bound_is_refused_with_its_time():
    """x'' = +100 x grows by e^(10 t) from 1 m: to 1e15 m after 3.5 s, where its speed is ten times larger."""
    with pytest.raises(up.BadInput, match=r"x_1_dot is beyond 1e15 at 3\.[234]\d* s"):
        up.simulate(FREE, [-200.0, 0.0], start=[1.0, 10.0], seconds=5.0, dt=0.001)


def test_dt_may_repeat_the_period_that_a_law_is_for():
    law = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), [[-10.0]], period=0.1)
    assert up.simulate(FREE, law, dt=0.1 * (1 + 5e-7), seconds=0.2).period == pytest.approx(0.1)
    with pytest.raises(up.BadInput, match=r"for a period of 100 ms, and dt is 100\.001 ms"):
        up.simulate(FREE, law, dt=0.1 * (1 + 1e-5), seconds=0.2)
