"""Are the survey's numbers those of a hand with four people, its whole-number checks those of trying every total?"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy import stats

from upright.errors import BadInput
from upright.questionnaire.statistics import (
    Fits,
    bound,
    compare_ratings,
    counts,
    fitting,
    holm,
    signed_ranks,
    squares_of_gains,
    whole_row,
)


def test_four_people_by_hand():
    """Gains 2, 0, -1, 1: sizes 2, 1, 1 have ranks 3, 1.5, 1.5; of the eight signs three leave 1.5 or less down."""
    found = compare_ratings([1, 2, 2, 3, np.nan], [3, 2, 1, 4, 2])
    assert (found.n, found.missing, found.pre, found.post, found.gain) == (4, 1, 2.0, 2.5, 0.5)
    assert found.spread == pytest.approx(math.sqrt((1.5**2 + 0.5**2 + 1.5**2 + 0.5**2) / 3))
    assert found.t == pytest.approx(0.5 * 2 / found.spread)
    assert found.effect == pytest.approx(0.5 / found.spread)
    assert (found.signed_rank, found.ranks_effect, found.p_ranks) == (1.5, 0.5, 0.75)
    assert found.normalized == 0.25  # half a point of the two that were left up to 4
    assert compare_ratings([1, 2, 2, 3], [3, 2, 1, 4], top=5).normalized == pytest.approx(0.5 / 3)
    back = compare_ratings([3, 2, 1, 4], [1, 2, 2, 3])
    assert (back.signed_rank, back.ranks_effect, back.t) == (1.5, -0.5, pytest.approx(-found.t))
    assert back.p == pytest.approx(found.p)


def test_without_a_gain_or_room_for_one_there_is_none():
    still = compare_ratings([2, 3], [2, 3])
    assert (still.p_ranks, still.signed_rank, still.ranks_effect, still.spread) == (1.0, 0.0, 0.0, 0.0)
    assert math.isnan(still.p)
    assert math.isnan(still.effect)
    assert all(map(math.isnan, still.effect_interval))
    assert still.interval == (0.0, 0.0)
    assert math.isnan(compare_ratings([4, 4], [4, 3]).normalized)
    assert compare_ratings([4, 4], [4, 3], top=5).normalized == -0.5


def test_two_people_are_enough_and_one_is_not():
    assert compare_ratings([1, 2], [2, 2]).n == 2
    with pytest.raises(BadInput, match=r"got 1\."):
        compare_ratings([1, np.nan, 2], [1, 2, np.nan])


def test_ranks_are_exact_up_to_two_hundred_gains_and_normal_beyond():
    sizes = np.arange(1.0, 202) * np.where(np.random.default_rng(4).random(201) < 0.55, 1, -1)
    for n, method in ((200, "exact"), (201, "approx")):
        up, down, p = signed_ranks(sizes[:n])
        theirs = stats.wilcoxon(sizes[:n], method=method, correction=False)
        assert min(up, down) == theirs.statistic
        assert up + down == n * (n + 1) / 2
        assert p == pytest.approx(theirs.pvalue, rel=1e-9)


@pytest.mark.parametrize(
    ("d", "expected"),
    [
        ([0, 0], (0, 0, 1)),
        ([1, -1], (1.5, 1.5, 1)),
        ([0, 3], (1, 0, 1)),
        ([-2, -1], (0, 3, 0.5)),
        ([1, 2, 3], (6, 0, 0.25)),
    ],
)
def test_rank_sums_of_few_gains_are_those_of_counting_signs(d, expected):
    assert signed_ranks(np.array(d, dtype=float)) == pytest.approx(expected)


def test_holm_leaves_out_what_has_no_probability_and_ends_at_one():
    told = holm([math.nan, 0.01, 0.6, 0.7])
    assert math.isnan(told[0])
    assert told[1:] == pytest.approx((0.03, 1.0, 1.0))
    assert holm([]) == ()


@pytest.mark.parametrize(
    ("printed", "answers", "of"),
    [
        ("3.10", 53, 1), ("3.1", 53, 1), ("3", 53, 1), ("46", 53, 100), ("12.5", 40, 100), ("2.5", 3, 1), ("0", 7, 100),
        ("2.345", 400, 1),
    ],
)  # fmt: skip
def test_totals_are_those_whose_quotient_rounds_as_printed(printed, answers, of):
    half = Fraction(1, 2 * 10 ** len(printed.partition(".")[2]))
    tried = [s for s in range(6 * answers) if abs(Fraction(of * s, answers) - Fraction(printed)) <= half]
    assert list(counts(printed, answers, of=of)) == tried


@pytest.mark.parametrize(
    ("printed", "answers", "sentence"),
    [("x", 5, "got 'x'"), ("1/0", 5, "got '1/0'"), ("2", 0, "at least one answer, got 0")],
)
def test_a_number_that_is_none_is_refused(printed, answers, sentence):
    with pytest.raises(BadInput, match=sentence):
        counts(printed, answers)


@pytest.mark.parametrize(
    ("shares", "n", "whole"),
    [
        (["50", "50"], 1, False),
        (["50", "50"], 2, True),
        (["33", "67"], 3, True),
        (["33", "33", "33"], 3, True),
        (["33", "33", "34"], 3, False),
        (["14", "43", "43"], 7, True),
        (["14", "43", "57"], 7, False),
        (["14", "43"], 7, False),
        (["12", "88"], 8, True),  # 12.5 rounds either way
        (["13", "88"], 8, True),
    ],
)
def test_a_row_is_whole_when_counts_of_all_answers_print_it(shares, n, whole):
    assert whole_row(shares, n) is whole


def test_fits_count_means_and_shares():
    """1.5 is 3/2, 33 % is 1/3, and neither is a number of one answer."""
    assert fitting(["1.5"], ["33"], 3) == tuple(
        Fits(answers=n, possible=k, printed=2) for n, k in ((1, 0), (2, 1), (3, 1))
    )


LEAST = stats.ttest_rel([4, 4, 1, 4, 1], [1, 1, 4, 1, 3]).statistic


@pytest.mark.parametrize(
    ("pre", "post", "n", "t", "verdict"),
    [
        ("1.0", "4.0", 5, (math.inf, math.inf), "significant"),
        ("4.0", "1.0", 5, (-math.inf, -math.inf), "significant"),
        ("2.0", "2.0", 5, (0.0, 0.0), "not significant"),
        ("2.0", "2.8", 5, (LEAST, 4.0), "open"),
        ("2.8", "2.0", 5, (-4.0, -LEAST), "open"),
    ],
)
def test_bounds_of_t_have_a_verdict_either_way(pre, post, n, t, verdict):
    """From 10 points to 14 of five: at most by gains 1, 1, 1, 1, 0, at least by 1, 1, 4, 1, 3 to 4, 4, 1, 4, 1."""
    found = bound(pre, post, n)
    assert (found.verdict, found.exact, found.answers) == (verdict, True, n)
    assert found.critical == pytest.approx(stats.t.ppf(0.975, n - 1))
    assert found.gain == (pytest.approx(float(post) - float(pre)),) * 2
    assert found.t == pytest.approx(t)


def test_totals_beyond_the_ends_of_the_scale_are_none():
    """4.00 of 200 rounds from 799, 800 and 801, of which nobody can rate 801; 1.00 from 200 and 201."""
    assert bound("4.00", "4.00", 200).gain == pytest.approx((-0.005, 0.005))
    assert bound("1.00", "1.00", 200).gain == pytest.approx((-0.005, 0.005))
    assert bound("1.00", "1.00", 200, scale=(0, 4)).gain == pytest.approx((-0.01, 0.01))


def test_of_an_impossible_mean_the_totals_beside_it_are_taken():
    """Of 7 people 2.50 would be 17.5 points."""
    found = bound("2.50", "3.00", 7)
    assert not found.exact
    assert found.gain == pytest.approx((3 / 7, 4 / 7))


@pytest.mark.parametrize(
    ("pre", "post", "n", "scale", "sentence"),
    [
        ("2.0", "2.0", 1, (1, 4), "at least 2 answers, got 1"),
        ("0.9", "2.0", 10, (1, 4), "from 1 to 4 lies between them, got 0.9"),
        ("2.0", "4.1", 10, (1, 4), "got 4.1"),
        ("2.0", "4.1", 10, (1, 5), ""),
        ("2.0", "2.0", 2, (1, 4), ""),
    ],
)
def test_a_bound_takes_two_people_and_means_on_the_scale(pre, post, n, scale, sentence):
    if sentence:
        with pytest.raises(BadInput, match=sentence):
            bound(pre, post, n, scale=scale)
    else:
        assert bound(pre, post, n, scale=scale).answers == n


def test_gains_of_equal_size_are_tied_whatever_their_decimals():
    """Ratings of 3.3 and 2.3, both 0.2 lower before: two equal gains, whose ranks share 1.5."""
    found = compare_ratings([3.1, 2.1, 2.0], [3.3, 2.3, 1.0])
    up, down, _ = signed_ranks(np.array([0.2, 0.2, -1.0]))
    assert found.signed_rank == min(up, down) == 3.0
    assert found.ranks_effect == 0.0


def test_the_extremes_on_a_scale_of_a_hundred_are_those_of_people_at_its_ends():
    """20 people from 60 to 75 each, or 12 of 20 at 100 before and 15 after, of whom as many as can change sides."""
    least, most = squares_of_gains(1200, 1500, 20, (0, 100))
    assert least == 20 * 15**2
    assert most == (5 + 8) * 100**2  # 12 at the top and 8 below; 15 and 5: 5 fall and 8 rise
