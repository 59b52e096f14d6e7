"""Held-out errors compared by hand: what counts, what rounding and a runaway are worth, and the sentence about it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import swing
from upright.identification import RunScore
from upright.identification.ladder.decision import RungComparison, compare_rungs, reason
from upright.identification.ladder.repeats import Repeats, at_ceiling, log_error, same

N, DT = 1200, 0.01
SQUARE = np.where(np.arange(N) % 2, 1.0, -1.0)
"""A signal of mean 0 and deviation 1, over any even number of samples."""


def scored(missed: np.ndarray, *, score_from: float = 0.0, **percent: float) -> RunScore:
    """A run whose signals all are `SQUARE`, missed by as much as the columns say; a held one has no percent."""
    missed = np.atleast_2d(missed.T).T
    names = tuple(f"q_{k}" for k in range(missed.shape[1]))
    y = np.repeat(SQUARE[:, None], len(names), axis=1)
    return RunScore(role="predict", fit_percent=percent or dict.fromkeys(names, 0.0), horizon=None, y=y,
                 t=5.0 + np.arange(N) * DT, simulated=y - missed, measured=names, score_from=score_from)  # fmt: skip


def gain(
    poorer: np.ndarray, richer: np.ndarray, resolution: float = 0.0, runs: int = 3, **more: float
) -> RungComparison:
    return compare_rungs(*([scored(m, **more)] * runs for m in (poorer, richer)), [np.full(2, resolution)] * runs)


@pytest.mark.parametrize("runs", [1, 2, 3])
def test_no_error_counts_as_less_than_rounding_leaves(runs: int) -> None:
    """In steps of the root of 12 rounding has variance 1: an error of 1 besides makes it 2, none leaves 1."""
    found = gain(SQUARE, np.zeros(N), resolution=math.sqrt(12), runs=runs)
    assert found.gain == pytest.approx(0.5 * math.log(2))
    assert (found.pairs, found.between) == ((3, "runs") if runs == 3 else (12 * runs, "stretches"))


def test_a_simulation_that_ran_away_missed_eleven_times_the_spread() -> None:
    for far in (math.inf, math.nan, 1e200, 50.0):
        assert gain(np.full(N, far), np.full(N, 0.5)).gain == pytest.approx(math.log(11 / 0.5))


def test_samples_before_the_score_do_not_count() -> None:
    early = np.where(np.arange(N) < 400, 10.0, 0.5)  # 4 s
    late = np.full(N, 0.25)
    for runs in (1, 3):
        assert gain(early, late, runs=runs, score_from=4.0).gain == pytest.approx(math.log(2))
    assert gain(early, late, score_from=3.9).gain > math.log(2) + 0.1


def test_signals_count_alike_and_held_ones_do_not() -> None:
    poorer, richer = np.tile([1.0, 1.0], (N, 1)), np.tile([0.5, 0.25], (N, 1))
    for runs in (1, 3):
        assert gain(poorer, richer, runs=runs).gain == pytest.approx(1.5 * math.log(2))
        assert gain(poorer, richer, runs=runs, q_1=0.0).gain == pytest.approx(2 * math.log(2))
    still = replace(scored(np.ones(N)), y=np.zeros((N, 1)))
    assert compare_rungs([still] * 3, [scored(np.ones(N))] * 3, [np.zeros(1)] * 3).gain == 0.0


@pytest.mark.parametrize(("period", "pieces"), [(0.1, 12), (2.0, 7), (12.0, 4)])
def test_stretches_are_four_memories_long_and_four_to_twelve(period: float, pieces: int) -> None:
    """A sine resembles itself by cos(2 pi t/P): below 1/e from 0.19 P on, so 12 s are 12/(4 0.19 2) = 7.9 stretches."""
    missed = np.sin(2 * np.pi * np.arange(N) * DT / period)
    assert gain(missed, 0.5 * missed, runs=1).pairs == pieces


def test_a_gain_of_one_standard_error_is_not_enough() -> None:
    about = RungComparison(gain=0.1, scatter=0.1, pairs=3, between="runs")
    assert not about.better
    assert replace(about, gain=0.1001).better


def test_the_sentence_gives_the_change_and_its_scatter_in_percent() -> None:
    """exp(-ln 2) - 1 = -50 %; exp(-ln 2 - 0.1) - 1 = -54.8 %; exp(-ln 2 + 0.1) - 1 = -44.7 %."""
    half = RungComparison(gain=math.log(2), scatter=0.1, pairs=7, between="runs")
    assert "by −50.0 % (−54.8 to −44.7 % within one standard error over 7 runs)" in half.sentence()
    worse = replace(half, gain=-math.log(2), scatter=0.0)
    assert "by +100.0 % (+100.0 to +100.0 %" in worse.sentence()
    assert replace(half, gain=2e-4, scatter=2e-4).sentence() == "the held-out error stays as it is"
    assert replace(half, gain=2e-4, scatter=4e-4).sentence() != "the held-out error stays as it is"


def test_the_reason_says_what_was_decided_and_why() -> None:
    worse = RungComparison(gain=-0.1, scatter=0.1, pairs=7, between="runs")
    better = replace(worse, gain=0.3)
    assert reason(None, 1.0, math.inf).startswith("The first rung")
    assert reason(better, 0.5, 1.0).startswith("Kept: ")
    assert "no closer than chance" in reason(better, 0.99, 1.0, lucky=True)
    # a quarter of the cost is half the error
    assert "although the fit is 50 % closer" in reason(worse, 0.25, 1.0)
    for refused in (reason(worse, 0.95, 1.0), reason(worse, 0.0, 0.0), reason(replace(worse, gain=0.05), 0.25, 1.0)):
        assert refused.startswith("Refused: ")
        assert "although" not in refused


def test_nothing_is_left_where_the_model_predicts_as_repeats_do() -> None:
    """Repeats miss a tenth of one another, so a model that misses a tenth is at the ceiling, one that misses half not.

    With 10 and 25 percent missed the mean gain of ln 2.5/2 = 0.46 is within 1.84 standard errors of 0.46, Student's
    one sigma for two.
    """
    group = Repeats(labels=("a", "b"), percents={}, errors=dict.fromkeys("ab", log_error(90.0)))

    def scores(*percents: float) -> dict[str, RunScore]:
        return {label: scored(np.zeros(N), q_0=p) for label, p in zip("ab", percents, strict=False)}

    assert log_error(90.0) == pytest.approx(math.log(0.1))
    assert log_error(100.0) == pytest.approx(math.log(1e-9))
    assert at_ceiling([group], scores(90.0, 90.0))
    assert at_ceiling([group], scores(90.0, 75.0))
    assert at_ceiling([group], scores(95.0, 95.0))
    assert not at_ceiling([group], scores(50.0, 50.0))
    assert not at_ceiling([group], {})
    assert not at_ceiling([], scores(90.0, 90.0))


def test_runs_said_to_repeat_one_another_measure_the_same_at_the_same_pace() -> None:
    one = swing(seconds=4.0, repeats="by hand")
    assert same(one, swing(seconds=3.0, angle=1.0, repeats="by hand"))
    assert not same(one, replace(one, measured=("psi",)))
    # after 400 samples a clock that is 1 % fast is four samples ahead
    assert not same(one, replace(one, t=1.01 * one.t))
    assert same(one, replace(one, t=1.002 * one.t))
