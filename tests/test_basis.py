"""Is no verdict better than that of the model it rests on?"""

from __future__ import annotations

import itertools

import pytest

from upright.basis import DESCRIBED, LEVELS, NOT_SUPPORTED, REFUSAL, SIMULATED, Basis, in_percent, of_plain
from upright.report.page import Chapter, resting_on

EACH = [Basis(level=level, sentence=f"Model {i} is {level}.") for i, level in enumerate(LEVELS)]


@pytest.mark.parametrize(("one", "other"), list(itertools.product(EACH, EACH)))
def test_two_models_together_are_worth_as_much_as_the_worse(one, other):
    both = one & other
    assert LEVELS.index(both.level) == min(LEVELS.index(one.level), LEVELS.index(other.level))
    for part in (one, other):  # whatever speaks against either is said, once
        if part.level != "trusted":
            assert both.first_line().count(part.sentence) == 1


@pytest.mark.parametrize("own", [True, False])
@pytest.mark.parametrize("basis", EACH)
def test_a_chapter_is_sound_only_where_it_and_its_model_are(own, basis):
    chapter = resting_on(Chapter(title="t", verdict="It stands.", sound=own), basis)
    assert chapter.sound == (own and basis.level == "trusted")
    assert chapter.verdict.startswith(REFUSAL) == (basis.level == "not trusted")
    assert chapter.verdict.endswith("It stands.")
    assert bool(chapter.first_line) == (basis.level != "trusted")


def test_a_result_that_is_told_twice_says_it_once():
    once = resting_on(Chapter(title="t", verdict="It stands.", numbers={"verdict": "It stands.", "K": 1}), EACH[0])
    twice = resting_on(once, EACH[0], SIMULATED)
    assert twice.verdict == once.verdict == twice.numbers["verdict"]
    assert list(twice.numbers)[0] == "first_line"
    assert twice.numbers["first_line"] == twice.first_line == f"{SIMULATED} {REFUSAL} {EACH[0].sentence}"


def test_a_file_gives_back_its_basis_and_one_without_is_not_trusted():
    for basis in (*EACH, DESCRIBED):
        assert of_plain(basis.plain(), "this design") == basis
    for content in (None, "trusted", {"level": "very good", "sentence": "."}, {"level": "trusted", "sentence": 3}):
        silent = of_plain(content, "this design")
        assert silent.level == "not trusted"
        assert silent.sentence == "This design does not say whether it can be trusted."


@pytest.mark.parametrize(
    ("share", "said"),
    [(1.0, "100 %"), (0.995, "99.5 %"), (0.9999, "above 99.9 %"), (0.5, "50 %"), (0.005, "0.5 %"), (0.0, "0 %"),
     (2e-4, "below 0.1 %")],
)  # fmt: skip
def test_only_what_is_whole_is_called_a_hundred_percent(share, said):
    assert in_percent(share) == said


@pytest.mark.parametrize("basis", EACH)
def test_a_probability_is_supported_unless_its_model_is_not_trusted(basis):
    assert basis.supported(0.5) == (NOT_SUPPORTED if basis.level == "not trusted" else 0.5)
