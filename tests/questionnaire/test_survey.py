"""Do the survey's tests agree with scipy, its bounds with brute force, and its readers with what spreadsheets write?"""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tests.paper import printed
from upright.errors import BadInput
from upright.questionnaire.chapter import chapter
from upright.questionnaire.sheet import Item, Likert, Means, Ratings, Shares, read_sheet
from upright.questionnaire.statistics import (
    bound,
    can_be_printed,
    compare_ratings,
    counts,
    fitting,
    holm,
    signed_ranks,
    squares_of_gains,
    whole_row,
)
from upright.report.page import Table

EXAMPLES = Path(__file__).parents[2] / "examples" / "survey"


def ratings(seed: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    pre = rng.integers(1, 5, n)
    return pre.astype(float), np.clip(pre + rng.integers(-1, 3, n), 1, 4).astype(float)


@pytest.mark.parametrize(("seed", "n"), [(1, 5), (2, 12), (3, 53), (4, 300)])
def test_paired_t_is_scipys(seed, n):
    pre, post = ratings(seed, n)
    ours, theirs = compare_ratings(pre, post), stats.ttest_rel(post, pre)
    assert ours.t == pytest.approx(theirs.statistic, rel=1e-12)
    assert ours.p == pytest.approx(theirs.pvalue, rel=1e-9)
    interval = theirs.confidence_interval(0.95)
    assert ours.interval == pytest.approx((interval.low, interval.high), rel=1e-9)


@pytest.mark.parametrize(("seed", "n"), [(1, 6), (2, 9), (3, 11)])
def test_wilcoxon_with_ties_is_scipys_over_every_sign(seed, n):
    pre, post = ratings(seed, n)
    d = (post - pre)[post != pre]
    theirs = stats.wilcoxon(d, method=stats.PermutationMethod(n_resamples=np.inf))
    up, down, p = signed_ranks(post - pre)
    assert min(up, down) == theirs.statistic
    assert p == pytest.approx(theirs.pvalue, rel=1e-12)


def test_wilcoxon_of_many_is_scipys_normal_one():
    pre, post = ratings(5, 600)
    theirs = stats.wilcoxon(post - pre, method="asymptotic", correction=False)
    assert compare_ratings(pre, post).p_ranks == pytest.approx(theirs.pvalue, rel=1e-9)


def test_the_interval_of_an_effect_holds_its_ends():
    """At the ends of the interval, the noncentral t leaves 2.5 % beyond what was seen."""
    pre, post = ratings(2, 20)
    found = compare_ratings(pre, post)
    low, high = (e * math.sqrt(found.n) for e in found.effect_interval)
    assert stats.nct.sf(found.t, found.n - 1, low) == pytest.approx(0.025, rel=1e-6)
    assert stats.nct.cdf(found.t, found.n - 1, high) == pytest.approx(0.025, rel=1e-6)


def test_missing_answers_leave_their_pair_out_only():
    pre, post = ratings(3, 20)
    pre[4] = post[7] = np.nan
    both = np.isfinite(pre) & np.isfinite(post)
    found = compare_ratings(pre, post)
    assert (found.n, found.missing) == (18, 2)
    assert found.t == pytest.approx(stats.ttest_rel(post[both], pre[both]).statistic, rel=1e-12)


def test_equal_gains_have_no_t():
    found = compare_ratings([1, 2, 3], [2, 3, 4])
    assert math.isnan(found.t)
    assert found.ranks_effect == 1.0
    with pytest.raises(BadInput, match="at least 2 people"):
        compare_ratings([1, np.nan], [2, 3])


def test_holm_is_the_textbooks_example():
    """Holm 1979: the least p times 3, the next times 2, never falling."""
    assert holm([0.01, 0.04, 0.03]) == pytest.approx((0.03, 0.06, 0.06))


@pytest.mark.parametrize(("n", "top"), [(2, 4), (3, 4), (4, 4), (4, 3)])
def test_bounds_are_those_of_every_possible_set_of_answers(n, top):
    pairs = list(itertools.product(range(1, top + 1), repeat=2))
    seen: dict[tuple[int, int], list[int]] = {}
    for people in itertools.combinations_with_replacement(pairs, n):
        key = (sum(a for a, _ in people), sum(b for _, b in people))
        seen.setdefault(key, []).append(sum((b - a) ** 2 for a, b in people))
    assert len(seen) == ((top - 1) * n + 1) ** 2
    for (before, after), squares in seen.items():
        assert squares_of_gains(before, after, n, (1, top)) == (min(squares), max(squares))


def test_bounds_of_t_hold_for_random_answers_and_scipy():
    rng = np.random.default_rng(6)
    for _ in range(200):
        pre = rng.integers(1, 5, 53)
        post = rng.permutation(np.clip(pre + rng.integers(-1, 3, 53), 1, 4))
        found = bound(f"{pre.mean():.2f}", f"{post.mean():.2f}", 53)
        t = stats.ttest_rel(post, pre).statistic
        assert found.exact
        assert found.t[0] - 1e-9 <= t <= found.t[1] + 1e-9


def extreme_squares(before: int, after: int, n: int) -> tuple[int, int]:
    """Least and most sum of squared gains, by integer programming over how many people gave which two ratings."""
    from scipy.optimize import LinearConstraint, milp

    pairs = np.array(list(itertools.product(range(1, 5), repeat=2)))
    square = (pairs[:, 1] - pairs[:, 0]) ** 2.0
    totals = np.array([n, before, after], dtype=float)
    rows = LinearConstraint(np.vstack([np.ones(16), *pairs.T]), totals, totals)
    return tuple(round(sign * milp(sign * square, constraints=rows, integrality=np.ones(16)).fun) for sign in (1, -1))


def test_the_papers_gains_are_significant_however_they_were_paired():
    """Every total that rounds as printed, by integer programming; nearest totals where a mean is impossible."""
    critical = stats.t.ppf(0.975, 52)
    for row in printed.TABLE_4:
        for pre, post in zip(row[:2], row[2:], strict=True):
            found = bound(pre, post, 53)
            assert found.verdict == "significant"
            assert found.critical == pytest.approx(critical, rel=1e-12)
            totals = [list(counts(m, 53)) or [math.floor(float(m) * 53), math.ceil(float(m) * 53)] for m in (pre, post)]
            t = []
            for before, after in itertools.product(*totals):
                for squares in extreme_squares(before, after, 53):
                    gain = (after - before) / 53
                    t.append(gain / math.sqrt((squares / 53 - gain**2) / 52))
            assert found.t == pytest.approx((min(t), max(t)), rel=1e-9)
            assert found.t[0] > critical


def test_what_means_leave_open_is_said_to_be_open():
    assert bound("2.0", "2.1", 20).verdict == "open"
    # at most two of twenty gain a point: 0.1 over 0.308/sqrt(20)
    assert bound("2.0", "2.0", 20).t[1] == pytest.approx(0.1 / np.std([1] * 2 + [0] * 18, ddof=1) * math.sqrt(20))
    assert bound("2.0", "2.0", 20).verdict == "not significant"
    with pytest.raises(BadInput, match="lies between"):
        bound("4.2", "3.0", 20)


@pytest.mark.parametrize("n", [1, 7, 48, 53])
def test_possible_means_are_those_of_all_totals(n):
    reachable = {f"{s / n:.2f}" for s in range(n, 4 * n + 1)}
    for hundredths in range(100, 401):
        text = f"{hundredths / 100:.2f}"
        if text in reachable:
            assert can_be_printed(text, n)
        elif can_be_printed(text, n):  # an exact half that Python's formatting sent the other way
            assert any((200 * s) % n == 0 and (200 * s // n) % 2 == 1 for s in counts(text, n))


def test_table_3_and_4_of_the_paper_fit_other_numbers_of_answers():
    """Erratum 6."""
    means = read_sheet(EXAMPLES / "table_4.csv")
    assert isinstance(means, Means)
    numbers = [m for row in means.rows for m in row[2:]]
    assert sorted(numbers) == sorted(m for row in printed.TABLE_4 for m in row)
    by_answers = {f.answers: f.possible for f in fitting(numbers, [], 53)}
    assert by_answers[53] == 24 - 8
    assert sorted(n for n, k in by_answers.items() if k == max(by_answers.values())) == [48, 52]
    shares = read_sheet(EXAMPLES / "table_3.csv")
    assert isinstance(shares, Shares)
    assert [s for s in shares.rows[0][1] if not can_be_printed(s, 53, of=100)] == ["46", "54"]
    assert whole_row(shares.rows[0][1], 52)  # 24 and 28
    assert not whole_row(["50", "52"], 200)  # at least 99 and 103


def test_wide_and_long_tables_say_the_same(tmp_path):
    wide = tmp_path / "wide.csv"
    wide.write_bytes("\ufeffid;feedback pre;feedback post\r\na;1;3\r\nb;2;\r\n;;\r\nc;2;4\r\n".encode())
    long = tmp_path / "long.csv"
    long.write_text(
        "id,item,time,rating\na,feedback,pre,1\na,feedback,post,3\nb,feedback,pre,2\nc,feedback,Post,4\nc,feedback,pre,2\n"
    )
    for path in (wide, long):
        sheet = read_sheet(path)
        assert isinstance(sheet, Ratings)
        (item,) = sheet.items
        assert item.name == "feedback"
        assert np.array_equal(item.pre, [1, 2, 2])
        assert np.array_equal(item.post, [3, np.nan, 4], equal_nan=True)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings_and_declared_delimiters_of_excel_are_read(tmp_path, encoding):
    path = tmp_path / "answers.csv"
    path.write_bytes("sep=;\r\nname;Größe pre;Größe post;helped\r\nx;1;2;Agree\r\ny;2;2;Disagree\r\n".encode(encoding))
    sheet = read_sheet(path)
    assert isinstance(sheet, Ratings)
    assert sheet.items[0].name == "Größe"
    assert dict(zip(sheet.likert[0].options, sheet.likert[0].counts, strict=True))["agree"] == 1


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("id,a pre,a post\n1,2,5\n2,3,3\n", "line 2, 'a post': a rating from 1 to 4 was needed, got 5"),
        ("id,a pre,a post\n1,2,4.5\n", "a rating from 1 to 4"),
        ("id,a pre,a post\n1,2,often\n", "got 'often'"),
        ("id,a pre,a post\n1,2,3\n1,2,3\n", "line 2 and again in line 3"),
        ("id,a pre\n1,2\n", "none for the other time"),
        ("id,a pre,a pre,a post\n1,2,2,3\n", "two columns 'pre'"),
        ("id,a,b\n1,2,3\n", "needs columns such as"),
        ("id,a pre,a post\n", "headings and"),
        ("id,a pre,a post\n1,2,3,4\n", "4 cells under 3 headings"),
        ("id,item,time,rating\n1,a,later,3\n", "pre or post was needed"),
        ("item,time,rating\na,pre,3\n", "names the person"),
        ("concept,pre,post\nx,2.3,high\n", "a printed mean was needed"),
    ],
)
def test_what_cannot_be_read_is_said_with_its_line(tmp_path, text, sentence):
    path = tmp_path / "answers.csv"
    path.write_text(text)
    with pytest.raises(BadInput, match=sentence):
        read_sheet(path)


@pytest.mark.parametrize(
    ("agree", "of", "interval"), [(81, 263, (25.53, 36.62)), (15, 148, (6.24, 16.05)), (0, 20, (0.0, 16.11))]
)
def test_agreement_has_the_interval_that_newcombe_prints(agree, of, interval):
    """R. G. Newcombe, Statistics in Medicine 17 (1998) 857, table I, method 3: Wilson's score without correction."""
    answers = Likert(name="it helped", options=("agree", "disagree"), counts=(agree, of - agree))
    told = chapter(Ratings(items=(), likert=(answers,), people=of, notes=()), title="Survey", source="answers.csv")
    table = next(b for part in told.parts for b in part.content if isinstance(b, Table))
    low, _, high = table.rows[0][-1].removesuffix(" %").partition(" to ")
    assert (float(low), float(high)) == pytest.approx(interval, abs=0.051)  # printed to three figures


def test_a_question_with_one_pair_is_told_and_the_others_are_evaluated():
    pre, post = ratings(2, 12)
    one = np.where(np.arange(12) == 3, post, np.nan)
    items = (Item(name="alone", pre=pre, post=one), Item(name="all", pre=pre, post=post))
    told = chapter(Ratings(items=items, likert=(), people=12, notes=()), title="Survey", source="answers.csv")
    assert any(s.startswith("alone: 1 person answered before and after") for s in told.numbers["sentences"])
    assert any(s.startswith("11 comparisons miss one") for s in told.numbers["sentences"])
    found = told.numbers["found"]
    assert found["alone"] == {"n": 1, "missing": 11}
    assert found["all"]["t"] == pytest.approx(stats.ttest_rel(post, pre).statistic, rel=1e-12)
    assert found["all"]["p_holm"] == pytest.approx(stats.ttest_rel(post, pre).pvalue, rel=1e-9)


def test_no_gain_is_not_a_loss():
    pre, post = np.array([1.0, 2, 3, 4]), np.array([2.0, 1, 4, 3])
    told = chapter(Ratings(items=(Item(name="even", pre=pre, post=post),), likert=(), people=4, notes=()),
                   title="Survey", source="answers.csv")  # fmt: skip
    assert told.verdict.startswith("even: unchanged on average")


def test_each_printed_change_has_one_verdict_and_its_gain(tmp_path):
    """Five people, critical t 2.78: four up by one point each make t = 0.8 sqrt(5)/0.447 = 4, other pairings less."""
    path = tmp_path / "means.csv"
    path.write_text("concept,pre,post\nsame,4.0,4.0\nmore,2.0,2.8\nall,1.0,4.0\n")
    told = chapter(read_sheet(path), title="Survey", source=path.name, answers=5)
    found = told.numbers["found"]["bounds"]
    assert [b["verdict"] for b in found.values()] == ["not significant", "open", "significant"]
    assert [b["gain"] for b in found.values()] == [0.0, 0.8, 3.0]
    assert found["more"]["gain_between"] == pytest.approx((0.8, 0.8), rel=1e-12)
    assert found["more"]["t"][1] == pytest.approx(4.0, rel=1e-12)
    assert told.verdict == (
        "1 of 3 changes are significant at 5 % however the single answers were paired and spread; 1 is not significant,"
        " however they were; 1 are not decided by the means alone."
    )
