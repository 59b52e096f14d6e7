"""Numbers that cannot be separated are named as a pair, with the sum that is known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import noisy, rig, swing
from upright.identification.estimate import identify
from upright.identification.inference.covariance import Optimum, assess
from upright.identification.inference.intervals import shared_estimates
from upright.identification.inference.ties import TIED, ties, with_ties
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import SearchLog, descend_progressively
from upright.physics import Pendulum

AMPLITUDE = 0.3
TRUE = {"m_p": 0.2, "l_cg": 0.3, "J_p": 2e-3, "b_2": 4e-4, "b_2c": 3e-4}


@pytest.fixture(scope="module")
def best() -> Optimum:
    """A few swings that hardly die down, by viscous and dry friction together."""
    asked = rig(Pendulum, TRUE, {"b_2": 6e-4, "b_2c": 2e-4})
    run = noisy(swing(TRUE, angle=AMPLITUDE, seconds=4.0, initial={"theta": AMPLITUDE, "theta_dot": 0.0}), 2e-3, seed=3)
    problem = formulate(asked, [run])
    return assess(problem, descend_progressively(problem, problem.start).x)


def test_of_swings_equally_wide_viscous_and_dry_friction_are_known_as_their_equivalent_sum(best: Optimum) -> None:
    """Over one swing of amplitude A dry friction f takes as much energy as a viscous one of 4 f/(pi w A)."""
    estimates = shared_estimates(best, (), SearchLog(), profiles=False)
    (tie,) = ties(best, estimates)
    assert {tie.first, tie.second} == {"b_2", "b_2c"}
    assert tie.correlation < -TIED
    inertia = TRUE["J_p"] + TRUE["m_p"] * TRUE["l_cg"] ** 2
    w = math.sqrt(TRUE["m_p"] * 9.81 * TRUE["l_cg"] / inertia)
    y = np.abs(best.problem.tracks[0].y[:, 0])
    last = float(np.max(y[-y.size // 4 :]))
    # between the widest and the narrowest swing, the small-angle frequency being off by A^2/16 at most
    assert 4 / (math.pi * w * AMPLITUDE) * 0.99 < tie.factor < 4 / (math.pi * w * last) * 1.01
    truth = TRUE["b_2"] + tie.factor * TRUE["b_2c"]
    low, high = tie.together.interval
    assert low <= truth <= high
    assert tie.together.half < 0.5 * min(estimates[n].half for n in ("b_2", "b_2c"))


def test_a_sum_is_as_sure_as_the_correlation_of_its_parts_says(best: Optimum) -> None:
    """With k = -sign(rho) sa/sb the variance of a + k b is 2 sa^2 (1 - |rho|)."""
    places = [i for i, u in enumerate(best.problem.unknowns) if u.shared]
    for rho in (-0.99, 0.97):
        C = np.zeros_like(best.covariance)
        sizes = np.array([3e-5, 2e-5])
        C[np.ix_(places, places)] = np.outer(sizes, sizes) * np.array([[1.0, rho], [rho, 1.0]])
        made = replace(best, covariance=C)
        (tie,) = ties(made, shared_estimates(made, (), SearchLog(), profiles=False))
        assert tie.together.stderr == pytest.approx(math.sqrt(2 * (1 - abs(rho))) * sizes[0])
        direct = np.array([1.0, tie.factor]) @ C[np.ix_(places, places)] @ np.array([1.0, tie.factor])
        assert tie.together.stderr**2 == pytest.approx(float(direct))
    C[np.ix_(places, places)] = np.outer(sizes, sizes) * np.array([[1.0, -0.94], [-0.94, 1.0]])
    assert not ties(replace(best, covariance=C), shared_estimates(best, (), SearchLog(), profiles=False))


@pytest.mark.parametrize(("kept_with", "tied"), [(False, True), (True, False)])
def test_of_one_at_its_bound_the_correlation_is_that_off_the_bound_with_the_first_states_as_free(
    kept_with: bool, tied: bool
) -> None:
    """Gauss-Newton's matrix is an inverse covariance P, in which both numbers share what the first state leaves open.

    With that state held at a bound of its own, they are correlated by their Schur complement, here -0.9.
    """
    asked = rig(Pendulum, TRUE, {"b_2": 6e-4, "b_2c": 2e-4})
    problem = formulate(asked, [noisy(swing(TRUE, angle=AMPLITUDE, seconds=1.0), 2e-3, seed=3)])
    size = len(problem.unknowns)
    assert [u.shared for u in problem.unknowns] == [True, True, *[False] * (size - 2)]
    alone = np.array([[1.0, -0.9], [-0.9, 1.0]])
    common = np.array([3.0, -3.0])  # how far a first state off by its own deviation throws either number
    P = np.eye(size)
    P[:2, :2] = alone + np.outer(common, common)
    P[:2, 2], P[2, :2] = common, common
    scale = np.array([3e-5, 2e-5, *[1e-3] * (size - 2)])
    P *= np.outer(scale, scale)
    pinned = np.array([False, True, kept_with, *[False] * (size - 3)])
    sure = np.diag(np.where(pinned, 0.0, np.diag(P)))
    made = replace(assess(problem, problem.start), matrix=np.linalg.inv(P), pinned=pinned, covariance=sure)
    found = ties(made, shared_estimates(made, (), SearchLog(), profiles=False))
    assert len(found) == tied
    for tie in found:
        rho = -9.9 / 10  # (-0.9 - 9)/(1 + 9)
        assert tie.correlation == pytest.approx(rho)
        assert tie.factor == pytest.approx(scale[0] / scale[1])
        assert tie.together.stderr == pytest.approx(math.sqrt(P[0, 0]))  # of the one at its bound nothing scatters


def test_a_tie_matters_only_where_the_numbers_are_not_narrow(best: Optimum) -> None:
    estimates = shared_estimates(best, (), SearchLog(), profiles=False)
    wide = {
        n: replace(e, status="well determined", interval=(0.8 * e.value, 1.2 * e.value)) for n, e in estimates.items()
    }
    tied = with_ties(wide, ties(best, estimates))
    assert {n: e.status for n, e in tied.items()} == {"b_2": "tied to b_2c", "b_2c": "tied to b_2"}
    narrow = {n: replace(e, interval=(0.91 * e.value, 1.09 * e.value)) for n, e in wide.items()}
    assert {e.status for e in with_ties(narrow, ties(best, estimates)).values()} == {"well determined"}


def test_the_verdict_lists_no_number_that_is_tied_and_says_the_sum() -> None:
    begin = {"theta": AMPLITUDE, "theta_dot": 0.0}
    run = noisy(swing(TRUE, angle=AMPLITUDE, seconds=4.0, initial=begin), 2e-3, seed=4)
    fit = identify(rig(Pendulum, TRUE, {"J_p": 3e-3, "b_2": 6e-4, "b_2c": 2e-4}), [run], method="least-squares")
    usable = fit.answers[1]
    for name in ("b_2", "b_2c"):
        assert fit.estimates[name].status != "well determined"
        assert name not in usable.headline
    assert any("b_2 and b_2c cannot be separated" in reason for reason in usable.reasons)
