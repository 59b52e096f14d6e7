"""Reversed signs, zeros that stand upright, frictions that are not there: the verdict says so."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, shaken, swing
from upright.identification.estimate import identify, predict
from upright.physics import Furuta, Pendulum


def test_a_reversed_sensor_is_named() -> None:
    run = noisy(shaken(seconds=3.0), 1e-4, seed=1)
    reversed_ = replace(run, y=run.y * [1.0, -1.0])
    fit = identify(rig(Furuta, FURUTA, {"J_d": 0.01, "b_1": 4e-3}), [reversed_])
    assert not fit.trusted
    assert "sign = -1 for theta" in fit.verdict or "sign = -1 for psi" in fit.verdict


def test_a_zero_that_stands_upright_is_named() -> None:
    run = noisy(swing(seconds=6.0), 1e-3, seed=2)
    upright = replace(run, y=run.y + math.pi)
    fit = identify(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3}), [upright])
    assert not fit.trusted
    assert "offset of pi to theta" in fit.verdict


def test_a_friction_that_is_not_there_is_left_out_or_zero() -> None:
    viscous = {**PENDULUM, "b_2": 4e-3, "b_2c": 0.0, "b_2q": 0.0}
    run = noisy(swing(viscous), 2e-3, seed=3)
    fit = identify(rig(Pendulum, viscous, {"b_2": 1e-3, "b_2c": 1e-3, "b_2q": 1e-3, "J_p": 3e-3}), [run])
    assert fit.estimates["b_2"].value == pytest.approx(4e-3, rel=0.05)
    for name, unit in (("b_2c", 4e-3 * 3.0), ("b_2q", 4e-3 / 3.0)):
        e = fit.estimates[name]
        assert e.status in ("left out", "at bound", "weak")
        assert e.value < 0.05 * unit


def test_coulomb_friction_that_is_there_is_kept() -> None:
    dry = {**PENDULUM, "b_2": 1e-3, "b_2c": 5e-3, "b_2q": 0.0}
    fit = identify(rig(Pendulum, dry, {"b_2": 2e-3, "b_2c": 1e-3, "J_p": 3e-3}), [noisy(swing(dry), 1e-3, seed=4)])
    assert fit.estimates["b_2c"].value == pytest.approx(5e-3, rel=0.02)
    assert fit.estimates["b_2c"].status == "firm"


def test_a_run_that_no_parameter_explains_is_not_trusted() -> None:
    generator = np.random.default_rng(5)
    run = swing(seconds=4.0)
    noise = replace(run, y=generator.normal(size=run.y.shape))
    fit = identify(rig(Pendulum, PENDULUM, {"b_2": 1e-3, "b_2c": 1e-3}), [noise])
    assert not fit.trusted
    assert "not explained" in fit.verdict


def test_no_answer_is_nan_or_none() -> None:
    fit = identify(rig(Pendulum, PENDULUM, {"m_p": 0.3, "J_p": 3e-3, "b_2": 1e-3}, b_2c=0.0, b_2q=0.0),
                   [swing({**PENDULUM, "b_2c": 0.0, "b_2q": 0.0})])  # fmt: skip
    for e in fit.estimates.values():
        assert not any(math.isnan(v) for v in (e.value, e.stderr, *e.interval))
    assert np.all(np.isfinite(fit.correlation))
    assert np.all(np.isfinite(fit.singular_values))
    assert math.isfinite(fit.cost)


def test_a_fifth_of_a_swing_tells_no_friction_and_is_not_trusted() -> None:
    run = noisy(swing(seconds=0.3, dt=0.005), 3e-3, seed=8)
    guesses = {n: PENDULUM[n] for n in ("J_p", "b_2", "b_2c", "b_2q")}
    fit = identify(rig(Pendulum, PENDULUM, guesses), [run])
    assert min(fit.runs["swing"].fit_percent.values()) > 95
    assert not fit.trusted
    assert "none of the numbers asked is seen well" in fit.verdict or "cannot see" in fit.verdict


def test_a_bound_that_excludes_the_truth_is_not_trusted() -> None:
    question = rig(Pendulum, PENDULUM, {"J_p": 8e-3, "b_2": 1e-3, "b_2c": 1e-3, "b_2q": 1e-3})
    bounded = {**question.parameters, "J_p": replace(question.parameters["J_p"], lower=4e-3)}  # twice the truth
    fit = identify(replace(question, parameters=bounded), [noisy(swing(), 1e-3, seed=9)])
    assert fit.estimates["J_p"].value == pytest.approx(4e-3)
    assert not fit.trusted
    assert "push J_p past a bound" in fit.verdict


def test_a_column_that_stands_still_has_no_doubtful_convention() -> None:
    run = replace(swing(), y=np.full((1001, 1), 3.1))
    fit = identify(rig(Pendulum, PENDULUM, {"b_2": 1e-3, "J_p": 3e-3}), [run])
    assert not fit.trusted
    assert "conventions" not in fit.verdict


def test_a_speed_that_is_held_scores_what_the_closed_form_says() -> None:
    """A swing A sin(wt): held from its zero crossings for h, it misses A (wt - sin wt)."""
    w, dt = 2 * math.pi, 1e-3
    t = np.arange(1001) * dt
    run = replace(swing(seconds=1.0, dt=dt), t=t, u=np.zeros((t.size, 1)), y=0.01 * np.sin(w * t)[:, None], horizon=0.5)
    ahead = np.tile(dt * np.arange(1, 501), 2)
    y = np.sin(w * np.arange(1, 1001) * dt)
    missed = np.linalg.norm(w * ahead - np.sin(w * ahead)) / np.linalg.norm(y - y.mean())
    score = predict({}, rig(Pendulum, PENDULUM, {}), [run])["swing"]
    # the restart's speed is smoothed over a polynomial of order 4
    assert score.naive["theta"] == pytest.approx(100 * (1 - missed), abs=0.02 * 100 * missed)
    free = predict({}, rig(Pendulum, PENDULUM, {}), [replace(run, horizon=None)])["swing"]
    assert free.naive == {}


@pytest.mark.parametrize(("horizon", "blank"), [(0.03, True), (1.0, False)])
def test_a_horizon_that_a_held_speed_masters_is_said_to_tell_nothing(horizon: float, blank: bool) -> None:
    run = replace(noisy(swing(), 1e-4, seed=6), horizon=horizon)
    fit = identify(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3}), [run])
    assert ("holding the measured speed" in fit.verdict) is blank
    assert not (blank and fit.trusted)
