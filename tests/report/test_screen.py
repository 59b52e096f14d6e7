"""Does a screen show what a reader asks first, and no wider, longer or brighter than it may?"""

from __future__ import annotations

import math

import pytest

from upright.report.html import breadth, brief, evidence, shared_scale, split_sentences, tone
from upright.report.page import Assessment, Chapter, KeyNumber, Live, Part, Picture, Points, Table


@pytest.mark.parametrize(
    ("letters", "needed"),
    [(60, "narrow"), (61, "medium"), (82, "medium"), (83, "broad"), (110, "broad"), (111, "vast")],
)
def test_a_table_needs_a_screen_by_its_letters(letters, needed):
    """62, 84 and 112 of them with two of room beside every column; words may wrap, numbers may not."""
    number = Table(caption="", headings=("n",), rows=(("1" * (letters - 9) + " 12345678",),), numbers=(0,))
    assert breadth(number) == needed
    words = Table(caption="", headings=("heading " * 9, "n"), rows=((f"a {'b' * (letters - 3)} c", "1"),), numbers=(1,))
    assert breadth(words) == needed
    assert breadth(Table(caption="", headings=("", ""), rows=())) == "narrow"


@pytest.mark.parametrize(
    ("state", "mark"),
    [
        ("supported", "ok"), ("well determined", "ok"), ("kept (of 3)", "ok"), ("stabilised, with reservations", "ok"),
        ("no", "no"), ("not supported", "no"), ("refused", "no"), ("not run", "none"), ("–", "none"),
        ("with reservations", "care"), ("in part", "care"), ("nobody knows", "care"),
    ],
)  # fmt: skip
def test_a_badge_is_marked_by_its_word_and_with_care_where_that_is_none_of_them(state, mark):
    assert tone(state) == mark


def test_a_sentence_ends_before_a_capital_or_a_digit_and_not_within_a_number():
    assert split_sentences("It holds at 2.5 V. 3 of 4 did: None fell! Θ rests? yes.") == [
        "It holds at 2.5 V.", "3 of 4 did:", "None fell!", "Θ rests? yes.",
    ]  # fmt: skip
    assert split_sentences("") == []


def sentence(number, words):
    return f"X{number} {'word ' * (words - 2)}end."


def test_a_chapter_shows_120_words_before_anything_is_opened():
    """Title, question, verdict and what is assessed count; of the detail whole sentences, as long as there is room."""
    details = [sentence(i, 10) for i in range(20)]
    made = Chapter(title="Ti tle", question="Why so?", verdict="It stands. Rely on it.", detail=" ".join(details))
    headline, rest, shown, folded = brief(made)
    assert (headline, rest) == ("It stands.", "Rely on it.")
    assert shown == " ".join(details[:11])  # 9 words and 110 are 119
    assert folded == " ".join(details[11:])
    full = Chapter(title="Ti tle", question="Why so now?", verdict="It stands. Rely on it.", detail=" ".join(details))
    assert brief(full)[2] == " ".join(details[:11])  # 120
    over = Chapter(title="Ti tle", question="Why so just now?", verdict="It stands. Rely on it.",
                   detail=" ".join(details))  # fmt: skip
    assert brief(over)[2] == " ".join(details[:10])
    judged = Chapter(title="Ti tle", verdict="It stands.", detail=" ".join(details),
                     assessments=(Assessment(question="Q?", state="yes", why=details[0]),))  # fmt: skip
    assert brief(judged)[2] == " ".join(details[1:11])  # what is assessed is not said twice: 4 words, 12 and 100
    assert brief(Chapter(title="Title", verdict="")) == ("Title", "", "", "")


@pytest.mark.parametrize(
    ("percents", "scale"),
    [((), 1), ((0.5, 0.9), 1), ((1.1,), 5), ((4.0, 5.0), 5), ((4.0, 5.1), 20), ((1.0, 2.0, 3.0, 99.0), 100),
     ((1.0, 2.0, 3.0, 4.0, 99.0), 5), ((300.0,), 100), ((2.0, math.inf), 5)],
)  # fmt: skip
def test_intervals_share_the_least_scale_that_holds_four_fifths_of_them(percents, scale):
    numbers = [KeyNumber(what="w", value="1", half=p / 100) for p in percents] + [KeyNumber(what="w", value="1")]
    assert shared_scale(numbers) == scale


def test_evidence_is_folded_where_a_chapter_says_so_and_what_stands_above_is_not_shown_again():
    best = Picture(name="best", draw=lambda: None, caption="", description="")
    alone, with_more = Part("a", (best,)), Part("b", (best, Points(("x",))))
    plain, folded, aside = Part("c", ()), Part(title="d", content=(), folded=True), Part("e", (Points(()),), aside=True)
    moving = Part("f", (Live(markup="", description=""),), aside=True)
    parts = (alone, with_more, plain, folded, aside, moving)
    shown, hidden = evidence(Chapter(title="t", verdict="", best="best", parts=parts))
    assert shown == [(2, with_more), (3, plain), (6, moving)]
    assert hidden == [(4, folded), (5, aside)]
