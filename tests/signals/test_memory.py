"""Is the memory of residuals as long as it is, and do sums of autocovariances count the outer samples too?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.signals.memory import automatic_span, long_run, lost_share, memory

HALF = np.tile([1.0, 1.0, 0.0, 0.0], 101)[:401, None]
"""Neighbours' products are half the squares: first-order autocorrelation 1/2."""


@pytest.mark.parametrize("place", [0, 1, 25, 48, 49])
@pytest.mark.parametrize("span", [1, 4, 11])
def test_a_single_score_counts_once_wherever_it_is(place, span):
    scores = np.zeros((50, 1))
    scores[place] = 3.0
    assert long_run(scores, span) == pytest.approx(np.array([[9.0]]))


@pytest.mark.parametrize(("apart", "weight"), [(1, 0.75), (2, 0.5), (3, 0.25), (4, 0.0), (7, 0.0)])
@pytest.mark.parametrize("first", [0, 20])
def test_two_scores_count_by_bartletts_weight_of_their_distance(first, apart, weight):
    """3^2 + 5^2 + 2 (1 - d/4) 3 5; in two columns, each alone and the product beside the diagonal."""
    scores = np.zeros((28, 1))
    scores[first], scores[first + apart] = 3.0, 5.0
    assert long_run(scores, 4) == pytest.approx(np.array([[34 + 30 * weight]]))
    both = np.zeros((28, 2))
    both[first, 0], both[first + apart, 1] = 3.0, 5.0
    assert long_run(both, 4) == pytest.approx(np.array([[9.0, 15 * weight], [15 * weight, 25.0]]))


def test_the_span_is_that_of_andrews():
    """1.1447 (alpha n)^(1/3) with alpha = 4 rho^2/((1 - rho)^2 (1 + rho)^2): rho = 1/2 gives 16/9, 401 rows 10.2."""
    assert automatic_span(HALF) == 11
    alternating = np.resize([1.0, -1.0], (401, 1))  # what turns back is no memory
    assert automatic_span(alternating) == 1
    assert automatic_span(np.hstack([alternating, HALF])) == 11
    assert automatic_span(np.ones((401, 1))) == 100  # a quarter of the rows at most
    assert automatic_span(np.zeros((401, 1))) == 1


def test_what_bartletts_weights_lose_is_a_share_of_one_half_at_most():
    """sum of |k|/span rho^|k| by sum of rho^|k|: 2 rho/((1 - rho^2) span), so 4/3 over the span."""
    assert lost_share(HALF, 8) == pytest.approx(1 / 6)
    assert lost_share(HALF, 2) == 0.5
    k = np.arange(1, 200)
    assert lost_share(HALF, 8) == pytest.approx(2 * np.sum(k / 8 * 0.5**k) / (1 + 2 * np.sum(0.5**k)))


def test_memory_is_where_the_autocorrelation_falls_below_one_over_e():
    """Of a pulse of 100 samples it is a triangle, below 1/e from sample 64 on, 100 (1 - 1/e) = 63.2."""
    pulse, other, still = np.zeros((3, 500))
    pulse[200:300], other[490:] = 2.0, -1.0
    assert memory(pulse[:, None], 0.01) == pytest.approx(0.64)
    assert memory(other[:, None], 0.01) == pytest.approx(0.07)
    assert memory(np.column_stack([other, pulse, still]), 0.01) == pytest.approx(0.64)
    assert memory(still[:, None], 0.01) == 0.0
    assert memory(np.ones((2, 1)), 0.01) == pytest.approx(0.02)  # never below: the whole record


def test_memory_does_not_reach_around_the_ends():
    """Two pulses at both ends of a record are far apart, not neighbours."""
    ends = np.zeros(512)
    ends[:4], ends[-4:] = 1.0, 1.0
    assert memory(ends[:, None], 1.0) == pytest.approx(3.0)  # 8, 6, 4, 2: below 8/e = 2.94 at the third
