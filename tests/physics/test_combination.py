"""Is a combination of coordinates read as it is written, and nothing else?"""

import pytest

from upright.errors import BadInput
from upright.physics.combination import combination, spelled

NAMES = ("x", "theta_1", "theta_2")


@pytest.mark.parametrize(
    ("text", "factors"),
    [
        ("x", {"x": 1.0}),
        ("theta_2 - theta_1", {"theta_1": -1.0, "theta_2": 1.0}),
        ("-(x - 3*theta_1)/2", {"x": -0.5, "theta_1": 1.5}),
        ("x*2 + 0.3*theta_2 - x", {"x": 1.0, "theta_2": 0.3}),
        ("0*x + theta_1 + 2 - 2", {"theta_1": 1.0}),
        ("+x - +theta_1", {"x": 1.0, "theta_1": -1.0}),
    ],
)
def test_factors_are_those_of_the_sum(text, factors):
    assert combination(text, NAMES) == pytest.approx(factors)


@pytest.mark.parametrize(
    "text", ["", "x*theta_1", "x + 1", "sin(x)", "x/0", "2", "x - x", "1/x", "x if x else x", "True*x", "(" * 300]
)
def test_what_is_no_sum_is_refused(text):
    with pytest.raises(BadInput, match="is no sum of coordinates times numbers"):
        combination(text, NAMES)


def test_an_unknown_name_meets_its_neighbour():
    with pytest.raises(BadInput, match="'theta_3' is no coordinate; did you mean"):
        combination("theta_3 - theta_1", NAMES)


@pytest.mark.parametrize("text", ["x", "(-theta_1 + theta_2)", "(-x)", "(0.5 * x - 2.0 * theta_1 + theta_2)"])
def test_a_combination_is_written_as_it_was_read(text):
    factors = combination(text, NAMES)
    assert spelled([factors.get(n, 0.0) for n in NAMES], NAMES) == text
