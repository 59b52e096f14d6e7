"""Friction that is really there is kept when the model is right, and not denied firmly when it is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import PENDULUM, noisy, rig
from upright.identification import Fit, Run
from upright.identification.estimate import identify
from upright.identification.ladder.rungs import friction_rungs
from upright.physics import Furuta, Pendulum, find
from upright.simulation import simulate

# the paper's pendulum on a spring, a quarter of a degree out of level
TRUTH = {
    "m_p": 0.1356, "r": 0.1485, "l_cg": 0.1832, "J_p": 6.02e-4, "J_a": 2e-5, "J_d": 7.2e-3, "k_psi": 0.04,
    "b_1": 5.4e-4, "b_2": 2.25e-5, "b_1c": 1.4e-3, "b_2c": 2.4e-4, "tilt_y": 4.4e-3,
}  # fmt: skip
FRICTION = ("b_1", "b_2", "b_1c", "b_2c")


def fitted(**known: float) -> Fit:
    n, dt = 1700, 0.007
    x = simulate(Furuta(**TRUTH), {}, [0.0, 0.0, np.pi / 2, 0.0], None, dt, samples=n, substeps=2)
    run = Run(
        label="release", role="fit", t=np.arange(n) * dt, u=np.zeros((n, 1)), y=x[:, [0, 2], 0],
        measured=("psi", "theta"), unknown=("initial", "offset"), initial={"psi_dot": 0.0, "theta_dot": 0.0},
    )  # fmt: skip
    guesses = {name: 0.7 * TRUTH[name] for name in ("m_p", "J_p", *FRICTION)}
    return identify(rig(Furuta, TRUTH | known, guesses), [noisy(run, 1e-4, seed=1)])


@pytest.mark.slow
def test_the_right_model_keeps_both_frictions() -> None:
    fit = fitted()
    for name in FRICTION:
        assert fit.estimates[name].status == "well determined"
        assert fit.estimates[name].value == pytest.approx(TRUTH[name], rel=0.05)


def test_a_wrong_model_says_nothing_false_about_friction() -> None:
    fit = fitted(tilt_y=0.0)
    for name in FRICTION:
        low, high = fit.estimates[name].interval
        assert low <= TRUTH[name] <= high
    assert fit.estimates["b_1"].status == "poorly determined"  # the lean takes its part


@pytest.mark.slow
def test_intervals_hold_the_truth_whatever_was_left_out():
    # Coulomb friction hard to tell from viscous in 8 s of noise: often left out or at its bound, and b_2 takes its part
    from benchmarks.rigs import MAKES, outcome

    held = [outcome(MAKES[0], seed).held for seed in range(20)]
    for name in ("J_p", "b_2", "b_2c"):
        # fewer than 16 of 20 honest 95 % intervals: one chance in 390 (binomial)
        assert sum(h[name] for h in held) >= 16


def test_a_term_that_must_not_be_zero_is_part_of_every_model():
    guessed = rig(Pendulum, PENDULUM, {"J_p": 2e-3, "b_2c": 2e-3, "b_2q": 1e-3})
    coulomb = replace(guessed.parameters["b_2c"], lower=1e-4)
    certain = replace(guessed, parameters={**guessed.parameters, "b_2c": coulomb})
    assert [rung.adds for rung in friction_rungs(guessed)] == [(), ("b_2c",), ("b_2q",)]
    assert [rung.adds for rung in friction_rungs(certain)] == [(), ("b_2q",)]


def test_friction_that_shows_once_the_drive_is_off_is_not_left_out():
    # the drive gives less than was asked after a second and goes off where the last third begins: judged there alone,
    # friction that the first two thirds ask for would be refused
    truth = {"J_1": 2.4e-3, "J_2": 1.9e-3, "k_12": 1.1, "c_1": 5e-4, "c_2": 3e-4, "c_12": 4e-4}
    truth |= {"f_1c": 8e-3, "f_2c": 2e-3}
    plant, dt, resolution = find("torsional-2"), 1e-3, 2 * np.pi / 16000
    t = np.arange(5001) * dt
    u = np.where((t > 0.3) & (t < 3.3), 0.06, 0.0)[:, None]
    given = u * np.where(t < 1.0, 1.15, 1.035)[:, None]
    x = simulate(plant(**truth), {}, [0.0] * 4, given, dt, samples=t.size, substeps=2)
    run = Run(
        label="spin-up", role="fit", t=t, u=u, y=resolution * np.round(x[:, ::2, 0] / resolution), unknown=(),
        measured=("theta_1", "theta_2"), resolution=(resolution,) * 2, initial=dict.fromkeys(plant.state_names(), 0.0),
    )  # fmt: skip
    guesses = {n: 1.3 * truth[n] for n in ("J_1", "J_2", "k_12", "c_1", "c_12", "f_1c", "f_2c")}
    fit = identify(rig(plant, truth, guesses), [run])
    assert not [n for n in ("f_1c", "f_2c") if fit.estimates[n].status == "left out"]
