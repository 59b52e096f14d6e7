"""The walk downhill ends where other solvers and closed forms say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification.inference.scoring import fit_percent
from upright.identification.problem.normal_equations import Normal, products
from upright.identification.problem.residuals import Problem, formulate
from upright.identification.search.descent import Descent, SearchLog, descend, descend_progressively
from upright.identification.search.strategy import settle_weights, simplex
from upright.physics import Pendulum


def linear(A: np.ndarray, b: np.ndarray):
    def evaluate(x: np.ndarray) -> Normal:
        r = A @ x - b
        return Normal(float(r @ r), A.T @ A, A.T @ r)

    return evaluate


def test_linear_least_squares_is_the_normal_equations() -> None:
    generator = np.random.default_rng(0)
    A, b = generator.normal(size=(50, 4)) * [1, 1e3, 1e-3, 1], generator.normal(size=50)
    free = np.full(4, np.inf)
    found = descend(linear(A, b), np.zeros(4), -free, free, tolerance=1e-14)
    assert found.converged
    # damping leaves a thousandth of the last step, itself a square root of the tolerance
    assert found.x == pytest.approx(np.linalg.lstsq(A, b, rcond=None)[0], rel=1e-4)


def test_bounds_are_those_of_scipy() -> None:
    from scipy.optimize import lsq_linear

    generator = np.random.default_rng(1)
    for _ in range(20):
        A, b = generator.normal(size=(12, 5)), generator.normal(size=12)
        lower, upper = np.full(5, -0.1), np.full(5, 0.15)
        found = descend(linear(A, b), np.zeros(5), lower, upper, tolerance=1e-14, limit=200)
        expected = lsq_linear(A, b, (lower, upper), tol=1e-14)
        assert found.normal.cost == pytest.approx(2 * expected.cost, rel=1e-6)


def test_rosenbrock_valley_is_followed_to_its_end() -> None:
    def evaluate(x: np.ndarray) -> Normal:
        r = np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])
        J = np.array([[-20 * x[0], 10.0], [-1.0, 0.0]])
        return Normal(float(r @ r), J.T @ J, J.T @ r)

    free = np.full(2, np.inf)
    found = descend(evaluate, np.array([-1.2, 1.0]), -free, free, tolerance=1e-12, limit=200)
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-6)


def test_scipy_finds_the_same_optimum() -> None:
    """Oracle: trust-region least squares on the same residuals, its own differences, from the same start."""
    from scipy.optimize import least_squares

    problem = formulate(
        rig(Pendulum, PENDULUM, {"J_p": 2.4e-3, "b_2": 1.8e-3, "b_2c": 2.2e-3}), [noisy(swing(), 2e-3, 5)]
    )
    found = descend_progressively(problem, problem.start, tolerance=1e-12)
    scale = np.array([u.scale for u in problem.unknowns])

    def residual(z: np.ndarray) -> np.ndarray:
        rows = problem.rows(0, z * scale)
        assert rows is not None
        return np.concatenate([rows[0].ravel(), problem.prior_rows(z * scale)[0]])

    oracle = least_squares(residual, problem.start / scale, xtol=1e-12, ftol=1e-12, gtol=1e-12, diff_step=1e-6)
    assert found.normal.cost == pytest.approx(2 * oracle.cost, rel=1e-6)
    spread = np.sqrt(np.diag(np.linalg.inv(found.normal.matrix)) * found.normal.cost / problem.tracks[0].y.size)
    assert np.all(np.abs(found.x - oracle.x * scale) < 0.02 * spread)


def test_simplex_ends_near_the_same_optimum() -> None:
    problem = formulate(rig(Pendulum, PENDULUM, {"b_2": 1.5e-3, "b_2c": 2.4e-3}), [noisy(swing(seconds=4.0), 2e-3, 6)])
    x, cost = simplex(problem, problem.start, limit=1500)
    assert cost == pytest.approx(descend_progressively(problem, x).normal.cost, rel=1e-3)


def test_products_in_blocks_are_the_plain_products() -> None:
    generator = np.random.default_rng(2)
    J, r = generator.normal(size=(7001, 5)), generator.normal(size=7001)
    A, g, cost = products(J, r)
    assert pytest.approx(J.T @ J) == A
    assert g == pytest.approx(J.T @ r)
    assert cost == pytest.approx(r @ r)


def test_fit_percent_by_hand() -> None:
    """y = (0, 2, 4): mean 2, |y - mean| = sqrt 8; an error of 1 in one sample leaves 100 (1 - 1/sqrt 8)."""
    y = np.array([0.0, 2.0, 4.0])
    assert fit_percent(y, y) == 100.0
    assert fit_percent(y, [1.0, 2.0, 4.0]) == pytest.approx(100 * (1 - 1 / math.sqrt(8)))
    assert fit_percent(y, [2.0, 2.0, 2.0]) == pytest.approx(0.0)
    assert fit_percent(y - 2, 2 - y) == pytest.approx(-100.0)
    assert fit_percent(y, [math.nan] * 3) == -1000.0
    assert fit_percent([1.0, 1.0], [1.0, 1.0]) == 100.0
    assert fit_percent([1.0, 1.0], [1.0, 2.0]) == 0.0


def test_squares_of_lanes_are_those_of_the_residuals_laid_out() -> None:
    """The fast sum of a free run against the plain product of residuals and Jacobian of `rows`."""
    asked = rig(Pendulum, PENDULUM, {"J_p": 2.4e-3, "b_2": 1.8e-3, "b_2c": 2.2e-3})
    problem = formulate(asked, [noisy(swing(unknown=("initial", "offset")), 2e-3, 5)])
    rows = problem.rows(0, problem.start)
    assert rows is not None
    r, J = rows[0].reshape(-1), rows[1].reshape(-1, problem.start.size)
    prior, slope = problem.prior_rows(problem.start)
    found = problem.normal(problem.start)
    assert found.cost == pytest.approx(r @ r + prior @ prior, rel=1e-12)
    assert found.gradient == pytest.approx(J.T @ r + slope.T @ prior, rel=1e-9)
    assert found.matrix == pytest.approx(J.T @ J + slope.T @ slope, rel=1e-9)


def test_a_lower_cost_is_kept_for_the_problem_in_which_it_was_met() -> None:
    # a richer model's profile meets lower costs too, in coordinates that the poorer one does not have
    asked = rig(Pendulum, PENDULUM, {"J_p": 2.4e-3, "b_2": 1.8e-3})
    poorer, richer = (formulate(asked, [swing(unknown=unknown)]) for unknown in (("initial",), ("initial", "offset")))
    log = SearchLog()
    for problem in (poorer, richer):
        here = Descent(x=problem.start, normal=problem.normal(problem.start), converged=True)
        log.met(problem, here, here.normal.cost)
        assert log.lower is None or log.lower[0] is not problem  # no lower than it was
        log.met(problem, here, 2 * here.normal.cost)
        assert log.lower is not None
        assert log.lower[0] is problem
        assert log.lower[2].size == problem.start.size


def settled() -> tuple[Problem, Descent]:
    """A swing whose first state is known, explained."""
    run = swing(unknown=(), initial={"theta": 1.5, "theta_dot": 0.0})
    problem = formulate(rig(Pendulum, PENDULUM, {"J_p": 2.4e-3, "b_2": 1.8e-3}), [noisy(run, 2e-3, 5)])
    return problem, descend_progressively(problem, problem.start)


def test_weights_of_components_are_settled_twice_and_no_more(monkeypatch) -> None:
    """What is missed most would count ever less: 79, 79 and 74 percent were explained after one, two, three times."""
    problem, found = settled()
    weighed: list[np.ndarray] = []
    monkeypatch.setattr(problem, "weigh_components", lambda x: not weighed.append(x))
    end = settle_weights(problem, found)
    assert len(weighed) == 2
    assert end.normal.cost == pytest.approx(found.normal.cost, rel=1e-6)


def test_weights_that_do_not_change_bring_no_further_descent(monkeypatch) -> None:
    problem, found = settled()
    monkeypatch.setattr(problem, "weigh_components", lambda x: False)
    assert settle_weights(problem, found) is found


def test_an_interrupted_search_weighs_nothing_anew(monkeypatch) -> None:
    problem, found = settled()
    monkeypatch.setattr(problem, "weigh_components", lambda x: pytest.fail("it ran on"))
    assert settle_weights(problem, replace(found, interrupted=True)).interrupted


def test_prior_knowledge_is_weighed_by_the_noise_of_the_residuals() -> None:
    """White noise of 2 mrad in a signal of standard deviation s leaves weighted residuals of 2 mrad / s."""
    run = noisy(swing(), 2e-3, 5)
    problem = formulate(rig(Pendulum, PENDULUM, {"J_p": 2.4e-3, "b_2": 1.8e-3}), [run])
    settle_weights(problem, descend_progressively(problem, problem.start))
    # of 1000 residuals, to the fifth of a logarithm that counts as no change
    assert problem.noise == pytest.approx(2e-3 / np.std(run.y), rel=0.25)


def test_a_horizon_doubles_and_the_last_third_of_a_run_is_no_stage_of_its_own() -> None:
    """Where the run turns into its mirror image at 4.2 s, no model follows further: 2, 4, then 8 of 10 s, so all of it.

    More than seven tenths are no stage of their own. A run that is followed to its end is taken whole at once.
    """
    run = noisy(swing(), 2e-3, 5)
    turned = replace(run, y=np.where(run.t[:, None] < 4.2, run.y, -run.y))
    for data, expected in (
        (turned, ["first 2 s", "first 4 s", "whole runs"]),
        (run, ["first 2 s", "whole runs"]),
    ):
        problem = formulate(rig(Pendulum, PENDULUM, {"J_p": 2.1e-3, "b_2": 1.8e-3}), [data])
        log = SearchLog()
        descend_progressively(problem, problem.start, log, horizon=2.0)
        stages = [name for name, *_ in log.history]
        assert stages[0] == "first 2 s"
        assert [float(name.split()[1]) > 7 for name in stages[:-1]] == [False] * (len(stages) - 1)
        assert stages[-1] == expected[-1]
        assert len(stages) == len(expected)


def test_the_path_of_a_search_falls_from_step_to_step_and_ends_at_the_optimum() -> None:
    """The mean square at the end is that of 2 mrad of noise in a signal of its own standard deviation."""
    run = noisy(swing(), 2e-3, 5)
    problem = formulate(rig(Pendulum, PENDULUM, {"J_p": 2.1e-3, "b_2": 1.8e-3}), [run])
    log = SearchLog()
    end = descend_progressively(problem, problem.start, log, horizon=math.inf)
    costs = [cost for cost, _ in log.path]
    assert len(costs) > 2
    assert costs == sorted(costs, reverse=True)
    assert log.path[-1][1] == problem.shared_at(end.x)
    # of 1000 residuals the mean square scatters by 4.5 %
    assert costs[-1] == pytest.approx((2e-3 / np.std(run.y)) ** 2, rel=0.2)


def test_a_step_that_gains_less_than_is_asked_ends_the_walk_as_settled() -> None:
    """Of 1 + x^6 at 1/2 the linear model of x^3 promises 1/65 = 1.54 %, and its step to x = 1/3 gains 1.40 %."""

    def evaluate(x: np.ndarray) -> Normal:
        r, slope = np.array([1.0, x[0] ** 3]), np.array([[0.0], [3 * x[0] ** 2]])
        return Normal(float(r @ r), slope.T @ slope, slope.T @ r)

    found = descend(evaluate, np.array([0.5]), -np.ones(1), np.ones(1), tolerance=0.0147)
    assert found.converged
    assert found.x == pytest.approx([1 / 3], rel=0.01)  # damped a little
