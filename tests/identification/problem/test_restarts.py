"""Runs restarted from measured states tell the same friction as free runs, however touchy the restarts are."""

from __future__ import annotations

import numpy as np
import pytest

from tests.identification.twins import PENDULUM, rig, shaken, swing
from upright.identification import Run
from upright.identification.estimate import identify
from upright.identification.problem.residuals import formulate
from upright.identification.problem.restarts import Restart, settle, smoothed_variance
from upright.physics import Pendulum


def counted(run: Run, per_rev: int) -> Run:
    from dataclasses import replace

    step = 2 * np.pi / per_rev
    return replace(run, y=np.round(run.y / step) * step, resolution=(step,) * run.y.shape[1])


def test_a_fall_from_near_upright_keeps_its_dry_friction() -> None:
    # its first windows turn close to upright, where the error of a restart grows tenfold every third of a second;
    # taken at their word they made the ladder drop Coulomb friction and drag
    run = counted(swing(angle=3.05, seconds=24.0, horizon=2.0), 2000)
    guesses = {"J_p": 3e-3, "b_2": 1e-3, "b_2c": 1e-3, "b_2q": 5e-4}
    fit = identify(rig(Pendulum, PENDULUM, guesses), [run])
    for name in guesses:
        e = fit.estimates[name]
        assert e.status != "left out"
        assert abs(e.value - PENDULUM[name]) < 4 * e.stderr + 1e-3 * PENDULUM[name], name
    assert fit.estimates["b_2c"].value == pytest.approx(PENDULUM["b_2c"], rel=0.15)


def test_restarts_find_the_states_that_were_true() -> None:
    run = swing(angle=2.0, horizon=1.0)
    noisy = counted(run, 500)
    truth = rig(Pendulum, PENDULUM, {"b_2": PENDULUM["b_2"]})
    problem = formulate(truth, [noisy])
    found = problem.restart(0, problem.start)
    track = problem.tracks[0]
    exact = run.y[track.restarts, 0]
    before = np.abs(track.x0[:, 0] - exact)
    after = np.abs(track.x0[:, 0] + found.change[:, 0] - exact)
    assert np.median(after) < 0.5 * np.median(before)


def test_settling_solves_a_linear_problem_exactly() -> None:
    generator = np.random.default_rng(5)
    A, r = generator.normal(size=(3, 40, 2)), generator.normal(size=(3, 40))
    variance = np.array([[2.0, 0.3], [1.0, 1.0], [0.5, 0.0]])
    d, _, _ = settle(lambda d: (r + np.einsum("wrs,ws->wr", A, d), A), variance)
    for w in range(3):
        known = variance[w] > 0
        price = np.diag(1 / variance[w][known])
        expected = -np.linalg.solve(A[w][:, known].T @ A[w][:, known] + price, A[w][:, known].T @ r[w])
        np.testing.assert_allclose(d[w][known], expected, rtol=1e-9)
        assert np.all(d[w][~known] == 0)


def test_settling_takes_two_states_that_act_alike_however_strongly() -> None:
    """``|r + a (d_1 + d_2)|^2 + d_1^2 + d_2^2`` is least at ``d_1 = d_2 = -r/(2 a)`` where a is large."""
    a = 1e12
    d, residual, _ = settle(lambda d: (1 + a * d.sum(axis=1, keepdims=True), np.full((1, 1, 2), a)), np.ones((1, 2)))
    np.testing.assert_allclose(d, [[-0.5 / a, -0.5 / a]], rtol=1e-6)
    assert abs(residual[0, 0]) < 1e-6


def test_a_window_whose_motion_runs_away_stays_where_it_was_measured() -> None:
    """Slopes of 1e200 have no squares; the window beside it settles at ``-a r/(a^2 + 1)`` as if alone."""
    slope = np.array([1e200, 2.0])[:, None, None]
    d, _, _ = settle(lambda d: (1 + slope[:, 0] * d, slope), np.ones((2, 1)))
    np.testing.assert_allclose(d, [[0.0], [-2 / 5]], rtol=1e-9)


def test_projected_jacobian_is_the_derivative_of_the_projected_residual() -> None:
    generator = np.random.default_rng(6)
    A, B, r = generator.normal(size=(2, 30, 2)), generator.normal(size=(2, 30, 3)), generator.normal(size=(2, 30))
    variance = np.array([[1.0, 2.0], [0.5, 0.1]])

    def projected(p: np.ndarray) -> Restart:
        now = r + B @ p
        d, residual, slope = settle(lambda d: (now + np.einsum("wrs,ws->wr", A, d), A), variance)
        return Restart(shift=np.zeros((2, 2, 1)), residual=residual, slope=slope, change=d, variance=variance)

    here = projected(np.zeros(3))
    rows, jacobian = here.rows(here.residual, B)
    for k in range(3):
        there = projected(np.eye(3)[k])
        np.testing.assert_allclose(there.rows(there.residual, B)[0] - rows, jacobian[:, :, k], atol=1e-9)


@pytest.mark.parametrize("at", [0, 30, 60])
def test_worth_of_a_smoothed_state_is_its_variance(at: int) -> None:
    # four thousand noisy records, smoothed by the polynomials that the runs are smoothed with
    from upright.signals.smoothing import savitzky_golay

    generator = np.random.default_rng(7)
    motions = [savitzky_golay(generator.normal(size=61), 0.01, 15) for _ in range(4000)]
    measured = [np.var([m.q[at] for m in motions]), np.var([m.v[at] for m in motions])]
    claimed = smoothed_variance(61, 15, 0.01, np.array([at]))[0] / 4.0  # without the allowance for what smoothing bends
    np.testing.assert_allclose(claimed, measured, rtol=0.15)


def test_two_outputs_restart_together() -> None:
    from tests.identification.twins import FURUTA
    from upright.physics import Furuta

    run = counted(shaken(horizon=0.5), 8192)
    guesses = {"J_d": 1.5 * FURUTA["J_d"], "b_1": 0.5 * FURUTA["b_1"], "b_2": 2 * FURUTA["b_2"]}
    fit = identify(rig(Furuta, FURUTA, guesses), [run])
    for name in guesses:
        assert fit.estimates[name].value == pytest.approx(FURUTA[name], rel=0.02), name
