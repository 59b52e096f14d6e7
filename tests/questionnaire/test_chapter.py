"""Does the survey's page say of each question what was counted, under the heading that names it?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from upright.questionnaire.chapter import (
    agreement_figure,
    bounds_figure,
    chapter,
    fitting_figure,
    gain_figure,
)
from upright.questionnaire.sheet import Item, Likert, Means, Ratings, Shares
from upright.questionnaire.statistics import Bound, Fits, compare_ratings
from upright.report.drawing import BLACK, BLUE, GREY, ORANGE, SKY, VERMILLION
from upright.report.page import Chapter, Picture, Points, Step, Table


def told(sheet, answers=None, **more) -> Chapter:
    return chapter(sheet, title="Survey", source="answers.csv", answers=answers, **more)


def table(page: Chapter, caption: str) -> Table:
    return next(b for p in page.parts for b in p.content if isinstance(b, Table) and b.caption.startswith(caption))


def picture(page: Chapter, name: str) -> Picture:
    return next(b for p in page.parts for b in p.content if isinstance(b, Picture) and b.name == name)


def ratings(*items: Item, likert=(), people=8, notes=()) -> Ratings:
    return Ratings(items=items, likert=likert, people=people, notes=notes)


PRE = np.array([1.0, 2, 1, 2, 2, 1, 3, np.nan])
POST = np.array([3.0, 4, 2, 4, 3, 3, 3, 4])
UP = Item(name="loops", pre=PRE, post=POST)
DOWN = Item(name="bode", pre=POST, post=PRE)
EVEN = Item(name="same", pre=np.array([1.0, 2, 3, 3, 2, 2, 2, 2]), post=np.array([1.0, 3, 2, 3, 2, 2, 2, 2]))
ALIKE = Item(name="alike", pre=np.full(8, 2.0), post=np.full(8, 3.0))


def test_each_number_of_a_question_stands_under_its_heading():
    page = told(ratings(UP))
    t = table(page, "Ratings of 8 people before and after")
    (row,) = t.rows
    cell = dict(zip([f"{h}{t.headings[:i].count(h) or ''}" for i, h in enumerate(t.headings)], row, strict=True))
    gains = (POST - PRE)[:7]
    ttest = stats.ttest_1samp(gains, 0)
    interval = ttest.confidence_interval()
    assert cell["question"] == "loops"
    assert cell["n"] == "7"
    assert [float(cell[h]) for h in ("before", "after", "gain")] == pytest.approx([12 / 7, 22 / 7, 10 / 7], abs=0.005)
    assert cell["95 %"] == f"{interval.low:.3g} to {interval.high:.3g}"
    assert float(cell["t"]) == pytest.approx(ttest.statistic, abs=0.005)
    assert cell["p"] == cell["p, Holm"] == f"{ttest.pvalue:.2g}"
    # six of seven gains are up and none is down: both of 2^6 signs that are as extreme
    assert (cell["Wilcoxon"], cell["p1"], cell["rank effect"]) == ("0", "0.031", "1.0")
    assert float(cell["d"]) == pytest.approx(gains.mean() / gains.std(ddof=1), abs=0.05)
    low, _, high = cell["95 %1"].partition(" to ")
    assert float(low) < float(cell["d"]) < float(high)
    assert float(cell["normalized gain"]) == pytest.approx((10 / 7) / (4 - 12 / 7), abs=0.0051)
    wider = table(told(ratings(UP), scale=(1, 5)), "Ratings of 8")
    assert float(wider.rows[0][-1]) == pytest.approx((10 / 7) / (5 - 12 / 7), abs=0.0051)
    assert t.numbers == tuple(range(1, 15))


def test_a_question_is_said_to_be_raised_lowered_or_unchanged():
    page = told(ratings(UP, DOWN, EVEN, ALIKE))
    interval = stats.ttest_1samp((POST - PRE)[:7], 0).confidence_interval()
    span, back = (f"{a:.3g} to {b:.3g}" for a, b in ((interval.low, interval.high), (-interval.high, -interval.low)))
    back = back.replace("-", "−")
    said = page.numbers["sentences"]
    assert said[0] == page.verdict == f"loops: raised by 1.4 ({span}), more than chance explains."
    assert said[1] == f"bode: lowered by 1.4 ({back}), more than chance explains."
    assert said[2].startswith("same: unchanged on average (")
    assert said[2].endswith("not distinguishable from chance once all questions are counted.")
    assert (
        said[3] == "alike: raised by 1.0 (1.00 to 1.00), the same for everybody, so there is no spread to test against."
    )
    assert said[4] == "2 comparisons miss one of their two answers and are left out, each for its question only."
    assert len(said) == 5
    (points,) = (b for b in page.parts[0].content if isinstance(b, Points))
    assert points.sentences == said[1:]
    assert page.parts[0].content[0] == "From answers.csv."
    assert page.numbers["found"]["alike"]["p_holm"] != page.numbers["found"]["alike"]["p_holm"]  # NaN
    row = table(page, "Ratings").rows[3]
    assert (row[7], row[8]) == ("–", "–")


ROSE = np.array([1, 1, 1, 0, 0, 1, 0, 0])


def test_a_gain_that_chance_explains_once_all_are_counted_is_not_claimed():
    """p = 0.03 alone; asked three times over, Holm's is 0.09."""
    base = np.array([1.0, 2, 1, 2, 2, 1, 3, 2])
    items = [Item(name=f"q{i}", pre=base, post=base + ROSE) for i in range(3)]
    p = stats.ttest_1samp(ROSE, 0).pvalue
    assert 0.025 < p < 0.05
    assert "more than chance" in told(ratings(items[0])).verdict
    page = told(ratings(*items))
    assert "not distinguishable from chance" in page.verdict
    assert table(page, "Ratings").rows[0][7:9] == (f"{p:.2g}", f"{3 * p:.2g}")


def test_a_chance_below_one_in_ten_thousand_is_said_to_be_below():
    pre = np.tile([1.0, 1, 2, 2], 10)
    page = told(ratings(Item(name="q", pre=pre, post=pre + np.tile([2, 2, 2, 1], 10)), people=40))
    assert table(page, "Ratings").rows[0][7] == "< 0.0001"
    assert "–" not in table(page, "Ratings").rows[0]
    gains = np.array([1, 0, 2, 1, 1, 1, 2, 0, 1, 1, 2, 1, 1, 1, -1, 0, 0, 1, 0, 1.0])  # by SciPy 1.7 in 10,000
    above = told(ratings(Item(name="q", pre=2 + 0 * gains, post=2 + gains), people=20))
    assert table(above, "Ratings").rows[0][7] == f"{stats.ttest_1samp(gains, 0).pvalue:.2g}" == "0.00017"


@pytest.mark.parametrize(("answered", "who"), [(0, "nobody"), (1, "1 person")])
def test_a_question_that_too_few_answered_twice_is_left_out(answered, who):
    post = np.where(np.arange(8) < answered, 3.0, np.nan)
    page = told(ratings(Item(name="rare", pre=EVEN.pre, post=post)))
    assert page.verdict == (
        f"rare: {who} answered before and after, and a comparison needs at least 2; this question is left out."
    )
    assert page.numbers["found"] == {"rare": {"n": answered, "missing": 8 - answered}}
    assert not any(isinstance(b, Table) for p in page.parts for b in p.content)


def test_two_answers_are_compared():
    post = np.where(np.arange(8) < 2, 3.0, np.nan)
    assert table(told(ratings(Item(name="rare", pre=EVEN.pre, post=post))), "Ratings").rows[0][1] == "2"


def test_a_page_has_its_notes_and_what_comes_next():
    page = told(ratings(notes=("left out",)), steps=(Step("Ask again."),))
    assert page.verdict == "Nothing was compared."
    assert [p.key for p in page.parts] == ["said", "notes", "how"]
    assert page.parts[1].content == (Points(("left out",)),)
    assert page.parts[0].content == ("From answers.csv.",)
    assert page.steps == (Step("Ask again."),)
    assert [p.key for p in told(ratings()).parts] == ["said", "how"]


AGREE = Likert(
    name="it helped",
    options=("strongly agree", "agree", "neutral", "disagree", "strongly disagree"),
    counts=(1, 6, 2, 1, 0),
)


def test_agreement_is_that_of_the_two_first_answers():
    page = told(ratings(likert=(AGREE,)))
    (row,) = table(page, "Agreement").rows
    low, high = stats.binomtest(7, 10).proportion_ci(method="wilson")
    assert row == (
        "it helped", "10", "1 strongly agree, 6 agree, 2 neutral, 1 disagree", "70 %",
        f"{100 * low:.3g} to {100 * high:.3g} %",
    )  # fmt: skip
    assert table(page, "Agreement").numbers == (1, 3, 4)
    assert picture(page, "agreement").description == (
        "it helped: 10 % strongly agree, 60 % agree, 20 % neutral, 10 % disagree, 0 % strongly disagree"
    )
    bars = picture(page, "agreement").draw().axes[0].patches
    assert [b.get_x() for b in bars] == pytest.approx([0, 10, 70, 90, 100])
    assert [b.get_width() for b in bars] == pytest.approx([10, 60, 20, 10, 0])


def test_one_answer_alone_is_a_hundred_percent():
    page = told(ratings(likert=(replace(AGREE, counts=(0, 1, 0, 0, 0)),)))
    assert picture(page, "agreement").description == (
        "it helped: 0 % strongly agree, 100 % agree, 0 % neutral, 0 % disagree, 0 % strongly disagree"
    )


def test_bars_of_agreement_lie_end_to_end_and_shares_from_seven_percent_are_written_in():
    rows = [
        ("first", ("Agree", "disagree", "I don’t know"), (7.0, 86.1, 6.9)),
        ("second $", ("agree", "neutral"), (60.0, 40.0)),
    ]
    axes = agreement_figure(rows).axes[0]
    found = [(b.get_x(), b.get_width(), b.get_y() + b.get_height() / 2) for b in axes.patches]
    assert found == [pytest.approx(b) for b in [(0, 7, 0), (7, 86.1, 0), (93.1, 6.9, 0), (0, 60, 1), (60, 40, 1)]]
    texts = [(t.get_text(), *t.get_position(), t.get_color()) for t in axes.texts]
    assert [t[0] for t in texts] == ["7", "86", "60", "40"]
    assert [t[1:3] for t in texts] == [pytest.approx(p) for p in [(3.5, 0), (50.05, 0), (30, 1), (80, 1)]]
    assert [t[3] for t in texts] == ["black", "black", "black", "black"]
    assert [t.get_text() for t in axes.get_legend().get_texts()] == ["agree", "disagree", "i don’t know", "neutral"]
    assert [t.get_text() for t in axes.get_yticklabels()] == ["first", r"second \$"]
    assert axes.get_xlabel() == "share of the answers [%]"
    assert axes.get_ylim() == (1.5, -0.5)
    dark = agreement_figure([("x", ("strongly agree", "strongly disagree", "i don't know"), (30.0, 30.0, 40.0))]).axes[
        0
    ]
    assert [t.get_color() for t in dark.texts] == ["white"] * 3


def test_gains_are_drawn_from_before_to_after_with_their_interval():
    found = [
        ("loops", compare_ratings(PRE, POST)),
        ("a question of more than thirty letters", compare_ratings(EVEN.pre, EVEN.post)),
    ]
    drawing = gain_figure(found, (1, 4))
    left, right = drawing.axes
    assert [tuple(line.get_xdata()) for line in left.lines[:3]] == [
        pytest.approx((12 / 7, 22 / 7)), pytest.approx((12 / 7,)), pytest.approx((22 / 7,)),
    ]  # fmt: skip
    assert [line.get_color() for line in left.lines[:3]] == [GREY, ORANGE, BLUE]
    assert [set(line.get_ydata()) for line in left.lines] == [{0}] * 3 + [{1}] * 3
    assert [t.get_text() for t in left.get_legend().get_texts()] == ["before", "after"]
    assert [t.get_text() for t in left.get_yticklabels()] == ["loops", "a question of more than thirt…"]
    assert (left.get_xlabel(), right.get_xlabel()) == ("mean rating", "mean gain, 95 % interval")
    assert left.get_xlim() == pytest.approx((0.9, 4.1))
    assert left.get_ylim() == (1.5, -0.5)
    interval = stats.ttest_1samp((POST - PRE)[:7], 0).confidence_interval()
    (segment,) = right.containers[0][2][0].get_segments()
    assert segment == pytest.approx(np.array([[interval.low, 0], [interval.high, 0]]))
    assert right.containers[0][0].get_xdata() == pytest.approx([10 / 7])
    assert right.containers[0][0].get_color() == BLACK


def of(low: float, high: float, verdict: str) -> Bound:
    return Bound(answers=20, gain=(0, 1), t=(low, high), critical=2.09, exact=True, verdict=verdict)


def test_bounds_are_drawn_as_far_as_the_largest_that_is_finite():
    rows = [
        ("a", of(2.5, 8.0, "significant")),
        ("b", of(1.0, math.inf, "open")),
        ("c" * 41, of(-math.inf, 2.0, "open")),
    ]
    axes = bounds_figure(rows).axes[0]
    bars = [line for line in axes.lines if line.get_linewidth() == 5]
    assert [tuple(line.get_xdata()) for line in bars] == [
        pytest.approx(p) for p in [(2.5, 8.0), (1.0, 8.4), (-8.4, 2.0)]
    ]  # fmt: skip
    assert [tuple(line.get_ydata()) for line in bars] == [(0, 0), (1, 1), (2, 2)]
    assert [line.get_color() for line in bars] == [BLUE, ORANGE, ORANGE]
    marks = [line for line in axes.lines if line.get_marker() == "|"]
    assert [tuple(line.get_xdata()) for line in marks] == [pytest.approx(p) for p in [(2.5,), (1.0,), (-8.4,)]]
    dashed = [line.get_xdata()[0] for line in axes.lines if line.get_linestyle() == "--"]
    assert dashed == [2.09, -2.09]
    assert [t.get_text() for t in axes.get_legend().get_texts()] == ["5 % level, 2.09"]
    assert axes.get_xlabel() == "paired t that the means allow"
    assert [t.get_text() for t in axes.get_yticklabels()] == ["a", "b", "c" * 39 + "…"]
    assert axes.get_ylim() == (2.5, -0.5)


@pytest.mark.parametrize(
    ("low", "high", "drawn"),
    [(-8.0, -2.5, (-8.0, -2.5)), (math.inf, math.inf, (4.389, 4.389)), (-math.inf, -math.inf, (-4.389, -4.389))],
)
def test_bounds_are_drawn_on_their_side_of_zero(low, high, drawn):
    """Infinite ones at 1.05 times twice the critical value, where no finite one is larger."""
    bar, mark, *_ = bounds_figure([("a", of(low, high, "significant"))]).axes[0].lines
    assert tuple(bar.get_xdata()) == pytest.approx(drawn)
    assert tuple(mark.get_xdata()) == pytest.approx(drawn[:1])


def test_the_claimed_number_of_answers_stands_out_among_those_that_fit():
    fits = [Fits(answers=n, possible=k, printed=4) for n, k in ((1, 0), (2, 3), (3, 1), (4, 4))]
    axes = fitting_figure(fits, 3).axes[0]
    lines = axes.collections[0]
    assert [tuple(map(tuple, s)) for s in lines.get_segments()] == [
        ((f.answers, 0), (f.answers, f.possible)) for f in fits
    ]
    from matplotlib.colors import to_hex

    assert [to_hex(c).lower() for c in lines.get_colors()] == [c.lower() for c in (SKY, SKY, VERMILLION, SKY)]
    assert list(axes.lines[0].get_ydata()) == [0, 3, 1, 4]
    assert list(axes.lines[1].get_ydata()) == [4, 4]
    assert axes.texts[0].get_text() == "claimed: 3"
    x, y = axes.texts[0].xy
    assert x == 3
    assert 4 < y < axes.get_ylim()[1]  # above every column, and inside the picture
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("answers", "possible, of 4 numbers")


def test_printed_means_are_marked_where_they_cannot_be():
    """Of 7 people 1.57 is 11 points, 2.86 is 20 and 1.60 would be 11.2."""
    sheet = Means(rows=(("loops", "Use", "1.57", "2.86"), ("bode", "", "1.60", "2.0"), ("pid", "", "1.0", "4.0")))
    page = told(sheet, 7)
    t = table(page, "Printed means of 7 answers; * cannot come from 7 whole ratings")
    assert t.headings == ("question", "before", "after", "gain", "t between", "at 5 %")
    assert [row[:4] for row in t.rows] == [
        ("loops, use", "1.57", "2.86", "1.29"), ("bode", "1.60 *", "2.0", "0.400"), ("pid", "1.0", "4.0", "3.00"),
    ]  # fmt: skip
    bounds = page.numbers["found"]["bounds"]
    assert [row[5] for row in t.rows] == [bounds[name]["verdict"] for name in ("loops, use", "bode", "pid")]
    low, high = bounds["loops, use"]["t"]
    assert t.rows[0][4] == f"{low:.2f} to {high:.2f}"
    assert page.numbers["found"]["impossible"] == ["1.60"]
    assert page.numbers["found"]["printed"] == 6
    fits = page.numbers["found"]["fits"]
    assert list(fits) == list(range(1, 21))
    assert fits[7] == 5
    said = page.numbers["sentences"]
    assert ", nearest totals taken where a mean is impossible; " in said[0]
    assert said[2] == (
        "1 of 6 means cannot come from 7 answers: 1.60. Either they were misprinted, or fewer people answered."
    )
    assert said[3].startswith("Of up to 7 answers, ")
    assert said[3].endswith(" most: 5 of 6.")
    more = told(sheet, 11)
    assert list(more.numbers["found"]["fits"]) == list(range(1, 23))


def test_means_that_fit_fewer_answers_are_asked_again_of_these():
    """Halves come from 2, 4 and 6 answers, never from 5 or 7."""
    page = told(Means(rows=(("a", "", "1.5", "3.5"), ("b", "", "2.5", "2.5"))), 7)
    said = page.numbers["sentences"]
    assert said[3] == "Of up to 7 answers, 2, 4 or 6 fit most: 4 of 4."
    assert said[4].startswith("Significant whatever the pairing if fewer answered: ")
    assert [part.split()[-2] for part in said[4].removesuffix(".").split(", ")] == ["2", "4", "6"]
    whole = told(Means(rows=(("a", "", "1.5", "3.5"),)), 6)
    assert len(whole.numbers["sentences"]) == 4
    assert whole.numbers["sentences"][2] == "All 2 means can come from 6 answers."
    assert "nearest totals" not in whole.verdict


@pytest.mark.parametrize(
    ("rows", "sure", "rest"),
    [
        ([("1.0", "4.0")], "1 of 1", "0 are not decided by the means alone."),
        ([("2.0", "2.0")], "0 of 1", "1 is not significant, however they were."),
        (
            [("2.0", "2.0"), ("3.0", "3.0"), ("2.0", "2.8")],
            "0 of 3",
            "2 are not significant, however they were; 1 are not decided by the means alone.",
        ),
    ],
)
def test_changes_are_counted_by_their_verdicts(rows, sure, rest):
    sheet = Means(rows=tuple((f"q{i}", "", *row) for i, row in enumerate(rows)))
    assert told(sheet, 5).verdict == (
        f"{sure} changes are significant at 5 % however the single answers were paired and spread; {rest}"
    )


def test_printed_percentages_are_marked_and_added_up():
    """Of 3 people 33 % is one and 67 % two; 50 % is none of these."""
    sheet = Shares(options=("agree", "neutral", "disagree"), rows=(("a", ("33", "67", "0")), ("b", ("50", "50", "0"))))
    page = told(sheet, 3)
    t = table(page, "Printed percentages of 3 answers; * cannot come from 3 whole answers")
    assert t.headings == ("statement", "agree", "neutral", "disagree", "adds up to 3")
    assert t.rows == (("a", "33", "67", "0", "yes"), ("b", "50 *", "50 *", "0", "no"))
    found = page.numbers["found"]
    assert (found["impossible"], found["printed"], found["whole"]) == (["50", "50"], 6, [6, 12, 18])
    said = page.numbers["sentences"]
    assert said[0].startswith("2 of 6 percentages cannot come from 3 answers: 50 %. ")
    assert said[1] == "Of up to 3 answers, 2 or 3 fit most: 4 of 6."
    assert said[2] == (
        "All statements together come out as printed, each adding up to all answers, for 6, 12 or 18 answers."
    )
    bars = picture(page, "agreement").draw().axes[0].patches
    assert [b.get_width() for b in bars] == [33, 67, 0, 50, 50, 0]
    assert picture(page, "fitting").description == said[1]
    never = told(Shares(options=sheet.options, rows=(("a", ("40", "40", "40")),)), 11)
    assert never.numbers["sentences"][2] == (
        "No number of answers up to 22 gives all statements as printed with every answer counted."
    )


def test_of_many_numbers_of_answers_eight_are_named():
    sheet = Shares(options=("agree", "neutral", "disagree"), rows=(("a", ("100", "0", "0")),))
    assert told(sheet, 8).numbers["sentences"][1] == "Of up to 8 answers, 1, 2, 3, 4, 5, 6, 7 or 8 fit most: 3 of 3."
    assert told(sheet, 9).numbers["sentences"][1] == "Of up to 9 answers, 1, 2, 3, 4, 5, 6, 7 or 8 … fit most: 3 of 3."
