"""The scatter over repetitions is what the standard errors say, with and without a memory in the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification.estimate import identify
from upright.identification.inference.covariance import assess, between_blocks, cuts
from upright.identification.model.runs import Run
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import descend_progressively
from upright.physics import Pendulum
from upright.signals.memory import automatic_span, long_run
from upright.simulation import simulate

SEEDS = 80


@pytest.mark.slow
@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_scatter_matches_the_reported_errors(memory: float) -> None:
    """95 % intervals hold the truth in 90 to 99 % of 80 repetitions; memory 0.9 hides 19 of 20 samples' worth."""
    clean = swing(seconds=6.0, dt=0.01)
    names = ("J_p", "b_2", "b_2c")
    held = np.zeros(len(names))
    found, claimed = [], []
    for seed in range(SEEDS):
        asked = rig(Pendulum, PENDULUM, {n: PENDULUM[n] for n in names})
        fit = identify(asked, [noisy(clean, 5e-3, seed, memory)], method="least-squares")
        held += [fit.estimates[n].interval[0] <= PENDULUM[n] <= fit.estimates[n].interval[1] for n in names]
        found.append([fit.estimates[n].value for n in names])
        claimed.append([fit.estimates[n].stderr for n in names])
    share = held / SEEDS
    # 80 draws at 95 %: three sigma of the binomial is 7 %
    assert np.all(share >= 0.88), share
    # the spread of a standard deviation from 80 draws is 8 %; Bartlett's window loses some of a long memory
    # 1.5 times as wide may they become by the spread between blocks, and a tenth is the scatter of this ratio
    ratio = np.median(claimed, axis=0) / np.std(found, axis=0, ddof=1)
    assert np.all((ratio > 0.75) & (ratio < 1.65)), ratio


@pytest.mark.slow
@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_intervals_of_short_records_hold_the_truth_too(memory: float) -> None:
    """100 samples, four numbers sought: what the fit takes from the residuals must be given back."""
    clean = swing({**PENDULUM, "b_2c": 0.0, "b_2q": 0.0}, angle=0.4, seconds=2.0, dt=0.02)
    asked = rig(Pendulum, {**PENDULUM, "b_2c": 0.0, "b_2q": 0.0}, {"J_p": 3e-3, "b_2": 1.5e-3})
    held = []
    for seed in range(150):
        e = identify(asked, [noisy(clean, 0.02, seed, memory)], method="least-squares").estimates
        held.append([e[n].interval[0] <= PENDULUM[n] <= e[n].interval[1] for n in ("J_p", "b_2")])
    # 150 draws at 95 %: three sigma of the binomial is 5.3 %
    assert np.all(np.mean(held, axis=0) >= 0.897), np.mean(held, axis=0)


def test_white_errors_would_be_too_small() -> None:
    """First-order memory rho makes errors of slow sensitivities sqrt((1 + rho)/(1 - rho)) = 4.4 times larger."""
    clean = swing(seconds=20.0, dt=0.005)
    ratios = []
    for seed in range(12):
        problem = formulate(rig(Pendulum, PENDULUM, {"b_2": 2e-3, "b_2c": 2e-3}), [noisy(clean, 5e-3, seed, 0.9)])
        spread = assess(problem, descend_progressively(problem, problem.start).x)
        ratios.append(np.sqrt(np.diag(spread.covariance) / spread.white)[:2])
    expected = np.sqrt((1 + 0.9) / (1 - 0.9))
    # the sandwich scatters by 30 % here, and the spread between blocks may make clean intervals 1.5 times as wide
    assert 0.7 * expected < np.median(ratios) < 1.5 * expected


def test_numbers_that_differ_from_block_to_block_scatter_as_random_effects() -> None:
    """The mean of m blocks of 50 readings each: variance of the blocks' own means, found by one-way analysis."""
    generator = np.random.default_rng(4)
    blocks, each = 8, 50
    own = generator.normal(size=blocks)
    y = own[:, None] + 0.1 * generator.normal(size=(blocks, each))
    y -= y.mean()  # the estimate
    known = np.array([0.01 / (blocks * each)])
    parts = {blocks: [(np.array([row.sum()]), np.array([[float(each)]])) for row in y]}
    added = between_blocks(parts, np.array([[float(blocks * each)]]), np.array([True]), known, 1e6)
    between = np.var(y.mean(axis=1), ddof=1) - 0.01 / each  # analysis of variance, Fisher 1925
    quantiles = (stats.t.ppf(0.975, blocks - 1) / stats.t.ppf(0.975, 1e6)) ** 2
    assert added[0, 0] == pytest.approx((1 + 1 / blocks) * between * quantiles, rel=1e-6)


def test_what_is_known_beforehand_does_not_spread_with_blocks_that_hardly_tell_it() -> None:
    """A weighed mass, of which each block says something wild, but with a thousandth of the balance's weight."""
    parts = {4: [(np.array([g]), np.eye(1)) for g in (30.0, -10.0, 40.0, -60.0)]}
    known = 1 / 4004.0
    added = between_blocks(parts, np.array([[4004.0]]), np.array([True]), np.array([known]), 100.0)
    # all four may err by a block's spread alike, (4 w)^2, and each by its own, 4 w^2; each moved the mean by w of it
    quantiles = (stats.t.ppf(0.975, 3) / stats.t.ppf(0.975, 100)) ** 2
    expected = (16 + 4) / 4 * np.sum((np.array([30.0, -10.0, 40.0, -60.0]) / 4003.0) ** 2) * quantiles
    assert added[0, 0] == pytest.approx(expected, rel=0.01)


def test_a_ratio_that_every_block_agrees_on_stays_known() -> None:
    """Of (1 + d, 2 + 2 d) with a d for every block the sum is not known; twice the one less the other is."""
    each = np.array([0.3, -0.1, 0.4, -0.6])
    own = np.array([[2.0, 0.5], [0.5, 1.0]])
    parts = {4: [(own @ np.array([d, 2 * d]), own) for d in each]}
    added = between_blocks(parts, 4 * own, np.array([True, True]), np.full(2, 1e-9), 100.0)
    assert np.linalg.eigvalsh(added).min() > -1e-12
    assert np.array([1.0, 2.0]) @ added @ np.array([1.0, 2.0]) > 0.1
    assert np.array([2.0, -1.0]) @ added @ np.array([2.0, -1.0]) == pytest.approx(0.0, abs=1e-7)


def test_blocks_that_agree_leave_the_sandwich_as_it_is() -> None:
    parts = {4: [(np.zeros(1), np.eye(1))] * 4}
    assert between_blocks(parts, 4 * np.eye(1), np.array([True]), np.array([0.1]), 100.0) == 0.0


def doubled(first: float, rest: float, **values: float) -> Run:
    """A swing whose viscous friction doubles after `first` seconds, and that is logged for the `rest`."""
    early = {**PENDULUM, "b_2c": 0.0, "b_2q": 0.0, **values}
    swung = swing(early, angle=1.5, seconds=first)
    late = {**early, "b_2": 2 * early["b_2"]}
    last = [swung.y[-1, 0], (swung.y[-1, 0] - swung.y[-2, 0]) / swung.period]
    samples = round(rest / swung.period) + 1
    other = simulate(Pendulum(**late), {}, last, None, swung.period, samples=samples)[:, 0, 0]
    y = np.concatenate([swung.y[:, 0], other[1:]])[:, None]
    return noisy(replace(swung, t=np.arange(len(y)) * swung.period, u=np.zeros((len(y), 1)), y=y), 1e-3, 0)


@pytest.mark.parametrize(("first", "rest", "b_2"), [(10.0, 10.0, PENDULUM["b_2"]), (3.0, 57.0, 1e-2)])
def test_an_interval_holds_what_either_part_of_a_run_says_of_its_friction(
    first: float, rest: float, b_2: float
) -> None:
    """No constant is true, and those of both parts are within the interval, also where most of the log is rest."""
    asked = rig(Pendulum, {**PENDULUM, "b_2c": 0.0, "b_2q": 0.0}, {"J_p": 3e-3, "b_2": 0.75 * b_2})
    fit = identify(asked, [doubled(first, rest, b_2=b_2)], method="least-squares", watch=False)
    low, high = fit.estimates["b_2"].interval
    assert low <= b_2 < 2 * b_2 <= high


def test_blocks_are_of_one_length_unless_one_would_tell_most() -> None:
    """The first 101 rows tell all, each as much: 40 of 160 are no more than half, 75 of 301 are."""
    J = np.zeros((200, 2, 3))
    J[:101] = [[1.0, 0.0, 3.0], [0.0, 2.0, 4.0]]
    assert cuts(J[:160], 4).tolist() == [40, 80, 120]
    assert cuts(np.concatenate([J[:101], 0 * J]), 4).tolist() == [25, 50, 75]
    assert cuts(J, 1).tolist() == []


def test_linear_problem_has_the_textbook_covariance() -> None:
    """With the memory switched off the long-run sum is the sum of squares, White's (1980) sandwich."""
    generator = np.random.default_rng(0)
    scores = generator.normal(size=(4000, 2)) * [1.0, 3.0]
    assert long_run(scores, 1) == pytest.approx(scores.T @ scores)
    assert automatic_span(scores) <= 8


def test_long_run_sum_is_newey_and_west() -> None:
    """Bartlett's weights 1 - |k|/b on the sample autocovariances, summed term by term."""
    generator = np.random.default_rng(1)
    s = generator.normal(size=(60, 2)).cumsum(axis=0)
    b = 7
    expected = s.T @ s
    for k in range(1, b):
        lag = s[k:].T @ s[:-k]
        expected = expected + (1 - k / b) * (lag + lag.T)
    assert long_run(s, b) == pytest.approx(expected)


def test_run_to_run_spread_counts_when_it_is_larger() -> None:
    """Three runs whose friction differs by 20 % must not claim the error of one long run."""
    runs = [
        noisy(swing({**PENDULUM, "b_2c": PENDULUM["b_2c"] * f}, label=f"{f}"), 1e-3, seed=k)
        for k, f in enumerate((0.8, 1.0, 1.2))
    ]
    fit = identify(rig(Pendulum, PENDULUM, {"b_2c": 2e-3}), runs, method="least-squares")
    # the standard error of a mean of three values spread by 20 %: 0.2/sqrt(3) = 11 %
    relative = fit.estimates["b_2c"].stderr / fit.estimates["b_2c"].value
    assert 0.05 < relative < 0.25


def test_what_is_known_about_is_weighed_against_the_data() -> None:
    """A free swing sees only ratios: every number takes over the 5 % to which m_p is known."""
    from dataclasses import replace

    asked = rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3, "b_2c": 1e-3}, b_2q=0.0)
    parameters = {**asked.parameters, "m_p": replace(asked.parameters["m_p"], uncertainty=0.01)}
    fit = identify(replace(asked, parameters=parameters), [noisy(swing({**PENDULUM, "b_2q": 0.0}), 1e-3, seed=3)])
    assert fit.estimates["m_p"].value == pytest.approx(0.2, abs=0.01)
    assert fit.estimates["m_p"].stderr == pytest.approx(0.01, rel=0.1)
    # every other number scales with m_p, so all share its 5 %
    assert fit.estimates["b_2c"].stderr / PENDULUM["b_2c"] == pytest.approx(0.05, rel=0.5)
    assert not fit.unseen
