"""Residuals of a run: which samples make them, their sum of squares, and what one of them is worth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification.problem.residuals import Problem, formulate, noise_level
from upright.identification.problem.tracks import prepare
from upright.physics import Pendulum

DT, SIGMA = 5e-3, 0.01


def missed(errors: np.ndarray, horizon: float | None) -> tuple[Problem, float]:
    """A problem whose residuals are given errors [rad], and the spread that they are weighted by."""
    run = swing(seconds=(errors.size - 1) * DT, dt=DT, unknown=(), initial={"theta": 1.5, "theta_dot": 0.0},
                horizon=horizon)  # fmt: skip
    problem = formulate(rig(Pendulum, PENDULUM, {"b_2": PENDULUM["b_2"]}), [run], thin=False)
    track = problem.tracks[0]
    problem.tracks = [replace(track, y=track.y + errors[:, None])]
    return problem, float(np.std(run.y))


@pytest.mark.parametrize("horizon", [None, 1.0, 2.5])
@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_the_level_is_the_deviation_times_the_root_of_the_memory(horizon: float | None, rho: float) -> None:
    """The autocorrelation rho^k of a first-order process is below 1/e from the k-th sample on, k = ceil(-1/ln rho).

    One sample in 2 k - 1 is then news.
    """
    e = np.random.default_rng(1).normal(size=8500)
    e = SIGMA * lfilter([math.sqrt(1 - rho**2)], [1.0, -rho], e)[500:]
    problem, spread = missed(e, horizon)
    k = 1 if rho == 0 else math.ceil(-1 / math.log(rho))
    expected = SIGMA / spread * math.sqrt(2 * k - 1)
    # 8000 samples, of which every 19th is news: 3.4 % standard error, and a sample more or less of memory 5 %
    assert noise_level(problem, problem.start) == pytest.approx(expected, rel=0.15)
    if horizon is not None:
        assert problem.tracks[0].restarts.size > 10


def test_samples_that_a_fit_left_out_do_not_count() -> None:
    e = np.where(np.arange(4000) % 20 < 10, 0.0, SIGMA) * np.random.default_rng(2).normal(size=4000)
    problem, spread = missed(e, None)
    kept = np.arange(4000) % 20 >= 10
    problem.tracks = [replace(problem.tracks[0], retained=kept)]
    assert noise_level(problem, problem.start) == pytest.approx(SIGMA / spread, rel=0.1)


@pytest.mark.parametrize("horizon", [None, 1.0])
@pytest.mark.parametrize("known", [True, False])
def test_the_cost_alone_is_that_of_its_model(horizon: float | None, known: bool) -> None:
    """Both are the sum of squares, of the same restarts, with and without derivatives."""
    more = {"unknown": (), "initial": {"theta": 1.5, "theta_dot": 0.0}} if known else {}
    run = noisy(swing(horizon=horizon, **more), 2e-3, 5)
    problem = formulate(rig(Pendulum, PENDULUM, {"J_p": 2.4e-3, "b_2": 1.8e-3}), [run])
    assert problem.cost(problem.start) == pytest.approx(problem.normal(problem.start).cost, rel=1e-9)


def test_only_a_free_run_without_a_command_is_thinned() -> None:
    """A small swing of 2 pi sqrt(J/(m g l)) = 1.158 s takes 120 steps a period: every ninth sample of a millisecond."""
    run = swing(PENDULUM | {"b_2c": 0.0, "b_2q": 0.0}, angle=0.1, dt=1e-3)
    question = rig(Pendulum, PENDULUM, {"J_p": 2.4e-3})
    track = prepare(question, run, thin=True)
    assert (track.dt, track.length, len(track.y)) == (pytest.approx(9e-3), 1112, 1112)  # 10000 // 9 + 1
    assert prepare(question, run, thin=False).dt == pytest.approx(1e-3)
    assert prepare(question, replace(run, horizon=1.0), thin=True).dt == pytest.approx(1e-3)
    driven = replace(run, u=np.sin(run.t)[:, None])
    assert prepare(question, driven, thin=True).dt == pytest.approx(1e-3)
    # a constant command is none that changes, and 200 samples stay
    assert prepare(question, replace(run, u=run.u + 1.0), thin=True).dt == pytest.approx(9e-3)
    assert prepare(question, run.samples(slice(1000)), thin=True).dt == pytest.approx(5e-3)
