"""Known numbers come back from the twin, at several noise levels, from bad guesses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, shaken, swing
from upright.errors import BadInput
from upright.identification.estimate import identify, predict
from upright.physics import Furuta, Pendulum

FRICTION = ("b_2", "b_2c", "b_2q")


@pytest.mark.parametrize("off", [0.5, 1.5])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 1e-2])
def test_pendulum_with_three_frictions_comes_back(noise: float, off: float) -> None:
    guesses = {n: off * PENDULUM[n] for n in ("J_p", *FRICTION)}
    fit = identify(rig(Pendulum, PENDULUM, guesses), [noisy(swing(), noise, seed=1)])
    for name in guesses:
        e = fit.estimates[name]
        # four standard errors: one miss in 16,000; plus 1e-3 for half the step size without noise
        assert abs(e.value - PENDULUM[name]) < 4 * e.stderr + 1e-3 * PENDULUM[name]
    assert fit.trusted


@pytest.mark.slow
@pytest.mark.parametrize("signs", [(1, 1, 1, 1, 1, 1, 1), (1, -1, 1, -1, 1, -1, 1), (-1, -1, -1, -1, -1, -1, -1)])
def test_furuta_comes_back_from_guesses_half_off(signs: tuple[int, ...]) -> None:
    names = ("J_d", "l_cg", "J_p", "b_1", "b_2", "b_1c", "b_2c")
    guesses = {n: FURUTA[n] * (1 + 0.5 * s) for n, s in zip(names, signs, strict=True)}
    fit = identify(rig(Furuta, FURUTA, guesses), [noisy(shaken(), 1e-4, seed=2)])
    for name in names:
        e = fit.estimates[name]
        assert abs(e.value - FURUTA[name]) < 5 * e.stderr + 1e-3 * FURUTA[name], name
    assert min(fit.runs["shaken"].fit_percent.values()) > 99


@pytest.mark.parametrize("method", ["least-squares", "simplex"])
def test_every_method_ends_at_the_same_optimum(method: str) -> None:
    run = noisy(swing(seconds=5.0), 1e-3, seed=3)
    asked = rig(Pendulum, PENDULUM, {"J_p": 2.6e-3, "b_2": 1.5e-3, "b_2c": 2.5e-3})
    reference, other = identify(asked, [run], method="auto"), identify(asked, [run], method=method)
    assert other.cost == pytest.approx(reference.cost, rel=1e-5)
    for name, e in reference.estimates.items():
        assert abs(other.estimates[name].value - e.value) < 0.05 * e.stderr


def test_several_runs_share_parameters_but_not_their_starts() -> None:
    runs = [noisy(swing(angle=a, label=f"from {a}"), 1e-3, seed=k) for k, a in enumerate((0.4, 1.5, 2.8))]
    fit = identify(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3, "b_2c": 1e-3, "b_2q": 2e-3}), runs)
    assert fit.estimates["J_p"].value == pytest.approx(PENDULUM["J_p"], rel=0.01)
    for a in (0.4, 1.5, 2.8):
        assert fit.per_run[f"from {a}"]["initial.theta"].value == pytest.approx(a, abs=2e-3)


def test_sensor_offset_of_one_run_is_found() -> None:
    run = swing(unknown=("initial", "offset"))
    from dataclasses import replace

    shifted = noisy(replace(run, y=run.y + 0.05), 1e-3, seed=4)
    fit = identify(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3, "b_2c": 1e-3}), [shifted])
    assert fit.per_run["swing"]["offset.theta"].value == pytest.approx(0.05, abs=1e-3)


def test_a_turn_of_the_encoder_changes_nothing() -> None:
    from dataclasses import replace

    run = noisy(swing(), 1e-3, seed=5)
    asked = rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3, "b_2c": 1e-3, "b_2q": 2e-3})
    turned = replace(run, y=run.y + 2 * math.pi)
    a, b = identify(asked, [run]), identify(asked, [turned])
    for name, e in a.estimates.items():
        assert b.estimates[name].value == pytest.approx(e.value, abs=0.02 * e.stderr)


def test_tail_is_predicted_from_the_beginning_alone() -> None:
    from dataclasses import replace

    run = noisy(swing(seconds=12.0), 1e-3, seed=6)
    first = replace(run, t=run.t[:600], y=run.y[:600], u=run.u[:600], label="first")
    tail = replace(run, label="tail", role="predict", score_from=6.0)
    fit = identify(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3, "b_2c": 1e-3, "b_2q": 2e-3}), [first, tail])
    # the noise itself limits the score: 100 (1 - sigma / spread of the tail)
    limit = 100 * (1 - 1e-3 / float(np.std(run.y[600:])))
    assert fit.runs["tail"].fit_percent["theta"] > limit - 2
    again = predict(fit, fit.model, [tail])["tail"].fit_percent["theta"]
    assert again == pytest.approx(fit.runs["tail"].fit_percent["theta"], abs=1e-6)


@pytest.mark.slow
def test_windows_restarted_from_measured_states_recover_as_well() -> None:
    run = noisy(shaken(horizon=0.5, unknown=()), 1e-4, seed=7)
    fit = identify(rig(Furuta, FURUTA, {"J_d": 0.01, "b_1": 4e-3, "b_1c": 1.5e-3}), [run])
    # restarts carry the error of the smoothed states, about 1e-2 of the speeds
    assert fit.estimates["J_d"].value == pytest.approx(FURUTA["J_d"], rel=0.02)
    assert fit.runs["shaken"].horizon == 0.5
    assert fit.runs["shaken"].fit_percent["theta"] > 97


def test_interrupt_keeps_the_best_so_far() -> None:
    def stop(stage: str, share: float) -> None:
        if int(stage.split()[-2]) > 4:  # "..., 5 evaluations"
            raise KeyboardInterrupt

    asked = rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3, "b_2c": 1e-3})
    fit = identify(asked, [noisy(swing(), 1e-3, seed=8)], method="least-squares", progress=stop)
    assert fit.interrupted
    assert not fit.trusted
    assert "interrupted" in fit.verdict
    assert set(fit.estimates) == {"J_p", "b_2", "b_2c"}


def test_nothing_to_fit_is_said_in_a_sentence() -> None:
    with pytest.raises(BadInput, match="role 'fit'"):
        identify(rig(Pendulum, PENDULUM, {"b_2": 1e-3}), [swing(role="predict")])
    with pytest.raises(BadInput, match="no parameter is to be estimated"):
        identify(rig(Pendulum, PENDULUM, {}), [swing()])
    with pytest.raises(BadInput, match="least-squares"):
        identify(rig(Pendulum, PENDULUM, {"b_2": 1e-3}), [swing()], method="least-square")
    with pytest.raises(BadInput, match="run 'swing' has 9 samples, at least 10 are needed"):
        identify(rig(Pendulum, PENDULUM, {"b_2": 1e-3}), [swing(), swing(seconds=0.08)])
    ten = identify(rig(Pendulum, PENDULUM, {"b_2": 1e-3}), [swing(seconds=0.09)], method="least-squares", watch=False)
    assert len(ten.runs["swing"].t) == 10
