"""Is a parameter called different as often as it should be, and at the difference that statistics says?"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from upright.identification.inference.agreement import agreements, together
from upright.identification.model.fit import Estimate


def known(value, stderr, status="well determined"):
    return Estimate(value=value, stderr=stderr, interval=(value - 1.96 * stderr, value + 1.96 * stderr), status=status)


def test_the_probability_is_that_of_a_normal_difference():
    a, b = known(2.0, 0.3), known(3.0, 0.4)
    found = agreements({"x": a}, {"x": b})["x"]
    assert found.stderr == pytest.approx(0.5, rel=1e-4)
    assert found.p == pytest.approx(2 * stats.norm.sf(2.0), rel=1e-3)
    assert (found.word, found.relative) == ("differ", 0.5)


def test_only_the_side_that_faces_the_other_counts():
    lopsided = Estimate(value=1.0, stderr=0.1, interval=(0.8, 9.0))
    below, above = known(0.0, 0.0), known(2.0, 0.0)
    assert agreements({"x": lopsided}, {"x": below})["x"].word == "differ"
    assert agreements({"x": lopsided}, {"x": above})["x"].word == "agree"


@pytest.mark.parametrize(
    ("a", "b", "word"),
    [
        (known(1.0, 0.0, "known"), known(1.0, 0.0, "known"), "given alike"),
        (known(1.0, 0.0, "known"), known(1.1, 0.0, "known"), "given differently"),
        (known(1.0, 0.1), Estimate(value=9.0, stderr=math.inf, interval=(-math.inf, math.inf)), "not comparable"),
        (known(1.0, 0.1), known(2.0, 0.1, "unseen"), "not comparable"),
        (known(0.0, 0.0, "at bound"), known(2.0, 0.1), "not comparable"),
    ],
)
def test_what_no_test_can_tell_is_not_called_different(a, b, word):
    assert agreements({"x": a}, {"x": b})["x"].word == word


def test_holm_steps_down_until_the_first_that_agrees():
    """0.01 <= 0.05 / 3 differs, 0.03 > 0.05 / 2 stops, so that 0.04 <= 0.05 does not differ either."""
    ps = {"a": 0.04, "b": 0.01, "c": 0.03}
    other = {n: known(stats.norm.isf(p / 2) * math.sqrt(2), 1.0) for n, p in ps.items()}
    found = agreements({n: known(0.0, 1.0) for n in ps}, other)
    assert {n: a.p for n, a in found.items()} == pytest.approx(ps, rel=1e-3)
    assert {n: a.word for n, a in found.items()} == {"a": "agree", "b": "differ", "c": "agree"}


def test_of_ten_parameters_that_are_the_same_one_is_called_different_in_one_of_twenty_tables():
    rng = np.random.default_rng(4)
    tables = 1000
    wrong = 0
    for _ in range(tables):
        one, other = ({f"x{i}": known(v, 1.0) for i, v in enumerate(rng.normal(size=10))} for _ in range(2))
        wrong += any(a.word == "differ" for a in agreements(one, other).values())
    # a binomial share of 5 % of 1000 has a standard error of 0.7 %; Holm is at most 5 %, and 4.9 % for independent ones
    assert abs(wrong / tables - 0.05) < 3 * 0.007


def test_all_at_once_is_chi_square_whatever_the_units_and_sees_along_a_correlation():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(3, 3))
    C, d = root @ root.T, np.array([0.3, -0.2, 0.5])
    statistic, freedom, p = together(d, C / 2, C / 2)
    assert statistic == pytest.approx(d @ np.linalg.solve(C, d))
    assert (freedom, p) == (3, pytest.approx(stats.chi2.sf(statistic, 3)))
    S = np.diag([1e6, 1e-6, 3.0])
    assert together(S @ d, S @ C @ S / 2, S @ C @ S / 2)[0] == pytest.approx(statistic, rel=1e-6)
    tight = np.array([[1.0, 0.999], [0.999, 1.0]])
    assert together(np.array([1.0, -1.0]), tight, 0 * tight)[2] < 1e-9  # each by itself is one standard error away
    assert together(np.array([1.0]), np.zeros((1, 1)), np.zeros((1, 1))) is None
