"""Is a law that is called sample by sample the law that `follow` has for a whole log, and one from a file the same?"""

from __future__ import annotations

import json
from fractions import Fraction

import numpy as np
import pytest
from scipy.signal import dlsim

from upright.errors import BadInput
from upright.laws import Law, Rule, as_values, at_work, of_values, state_feedback


def hop(t, y, r, z, p):
    push = p[0] if y[0] < z[0] else -p[0]
    return (push + 0.1 * t,), (y[0],)


READINGS = np.random.default_rng(0).normal(size=(300, 2)).cumsum(axis=0) * 1e-3
LAWS = {
    "filtered differences": state_feedback([-1.2, -0.3, 9.1, 1.1], 1e-3, memory=0.5),
    "plain differences, limited, rounded, with a target": state_feedback(
        [-1.2, -0.3, 9.1, 1.1], 1e-3, limit=0.05, command_resolution=0.01, target=[0.0, 0.1]
    ),
    "a sum that holds at the limit, with a reference": Law(
        [[1.0]], [[1e-3, 0.0, -1e-3]], [[-40.0]], [[-3.0, 0.5, 3.0]], limit=0.02, windup="hold", initial=[1e-4],
        references=np.sin(0.05 * np.arange(100))[:, None] * 0.01,
    ),
    "no memory": Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), [[2.0, -1.0]]),
}  # fmt: skip


@pytest.mark.parametrize("name", LAWS)
def test_a_linear_law_gives_what_follow_gives(name):
    law = LAWS[name]
    step = at_work(law)
    u = [step(1e-3 * k, tuple(y)) for k, y in enumerate(READINGS.tolist())]
    # some dozen products of at most 6e5 x 0.05, summed in another order; rounding to 0.01 hides all but ties
    np.testing.assert_allclose(u, law.follow(READINGS)[0], atol=1e-9)
    if np.isfinite(law.limit):
        assert np.abs(u).max() == law.limit


@pytest.mark.parametrize("name", LAWS)
def test_a_law_that_is_given_what_it_has_had_goes_on_with_the_same_bits(name):
    rows = [(1e-3 * k, tuple(y)) for k, y in enumerate(READINGS.tolist())]
    once, later = at_work(LAWS[name]), at_work(LAWS[name], rows[:64])
    u = [once(*row) for row in rows]
    assert [later(*row) for row in rows[64:]] == u[64:]


def test_a_linear_law_gives_what_scipy_gives():
    law = LAWS["filtered differences"]
    step = at_work(law)
    u = np.array([step(0.0, tuple(y)) for y in READINGS.tolist()])
    _, there, _ = dlsim((law.A, law.B, law.C, law.D, 1.0), READINGS, x0=law.begin @ READINGS[0])
    np.testing.assert_allclose(u, there, atol=1e-9)


LONG = np.random.default_rng(1).normal(size=(2, 5000)).tolist()


@pytest.mark.parametrize(("d", "y"), [([0.1, 0.2, 0.3, -0.6, 1e-17], [3.0, 7.0, 11.0, 0.5, 1.0]), LONG])
def test_the_sum_goes_from_left_to_right_in_rounded_products(d, y):
    """In exact arithmetic with each product and sum rounded once; a sum that is compensated or fused differs."""
    total = Fraction(0)
    for a, b in zip(d, y, strict=True):
        product = float(Fraction(a) * Fraction(b))
        total = Fraction(float(total + Fraction(product)))
    law = Law(np.zeros((0, 0)), np.zeros((0, len(d))), np.zeros((1, 0)), [d])
    assert at_work(law)(0.0, y) == (float(total),)


def test_a_rule_is_called_with_time_and_its_own_memory():
    rule = Rule(function=hop, initial=[0.0], parameters=[2.0])
    step = at_work(rule)
    u = [step(1e-3 * k, (y,)) for k, y in enumerate(READINGS[:, 0].tolist())]
    np.testing.assert_array_equal(u, rule.follow(READINGS[:, 0], 1e-3)[0])


def follower(t, y, r, z, p):
    return (r[0] - y[0],), ()


def test_references_begin_with_the_first_sample_and_the_last_is_held():
    """Of a rule and of a linear law alike: r = 1, 2, 4 and 4 from then on."""
    r = [[1.0], [2.0], [4.0]]
    linear = Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), [[-1.0, 1.0]], references=r)
    for law in (Rule(function=follower, references=r), linear):
        step = at_work(law)
        assert [step(1e-3 * k, (0.5,))[0] for k in range(5)] == [0.5, 1.5, 3.5, 3.5, 3.5]


def test_a_rule_is_limited_and_rounded():
    step = at_work(Rule(function=hop, initial=[0.0], parameters=[2.03], limit=2.0, command_resolution=0.25))
    assert step(0.0, (1.0,)) == (-2.0,)
    assert step(1.0, (0.5,)) == (2.0,)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(
    "law", [*LAWS.values(), Rule(function=hop, initial=[0.0], parameters=[2.0])], ids=[*LAWS, "a rule"]
)
def test_a_reading_that_is_no_number_leaves_no_command_until_the_law_begins_anew(law, bad):
    """NaN is what a rig is stopped upon; the rule alone would push the one way, since NaN is not below anything."""
    good = READINGS[0].tolist()
    before = at_work(law)(0.0, good)
    step = at_work(law)
    assert step(0.0, good) == before
    assert np.isnan(step(1e-3, [good[0] if isinstance(law, Law) else bad, bad])).all()
    assert np.isnan([step(1e-3 * k, good) for k in range(2, 6)]).all()
    assert at_work(law)(0.0, good) == before


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [0, 1])
def test_one_reading_of_several_that_is_no_number_stops_a_rule(place, bad):
    """The rule computes with the first reading alone and would give a finite command all the same."""
    step = at_work(Rule(function=hop, initial=[0.0], parameters=[2.0]))
    assert step(0.0, (1.0, 0.5)) == (-2.0,)
    readings = [1.0, 0.5]
    readings[place] = bad
    assert np.isnan(step(1e-3, readings)).all()
    assert np.isnan(step(2e-3, (1.0, 0.5))).all()


def test_a_command_that_overflows_is_none_and_raises_nothing():
    """5e307 is a double, and so many steps of 0.01 are not."""
    law = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), [[1.0]], limit=2.0, command_resolution=0.01)
    step = at_work(law)
    assert step(0.0, (1.0,)) == (1.0,)
    assert np.isnan(step(0.0, (5e307,))).all()


def test_a_law_of_several_lanes_has_no_one_command():
    with pytest.raises(BadInput, match="one lane"):
        at_work(state_feedback(np.ones((1, 2, 3)), 1e-3))


@pytest.mark.parametrize("name", LAWS)
def test_a_law_comes_back_from_json_to_the_last_bit(name):
    law = of_values(json.loads(json.dumps(as_values(LAWS[name]))))
    assert isinstance(law, Law)
    for of in "ABCD":
        assert getattr(law, of).tobytes() == getattr(LAWS[name], of).tobytes()
    for of in ("limit", "windup", "period", "delay"):
        assert getattr(law, of) == getattr(LAWS[name], of)
    before, after = at_work(LAWS[name]), at_work(law)
    assert [before(0.0, tuple(y)) for y in READINGS] == [after(0.0, tuple(y)) for y in READINGS]


def test_a_rule_comes_back_from_json_with_its_function():
    rule = Rule(function=hop, initial=[0.0], parameters=[2.0], limit=1.5)
    again = of_values(json.loads(json.dumps(as_values(rule))))
    before, after = at_work(rule), at_work(again)
    u = [(before(1e-3 * k, (y,)), after(1e-3 * k, (y,))) for k, y in enumerate(READINGS[:, 0].tolist())]
    assert all(a == b for a, b in u)
    assert as_values(of_values(as_values(again))) == as_values(rule)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("def f(t, y, r, z, p):\n    return (().__class__,), z", "Attribute"),
        ("import os\ndef f(t, y, r, z, p):\n    return y, z", "not one plain function"),
        ("def f(t, y, r, z, p):\n    import os\n    return y, z", "Import"),
        ("def f(t, y, r, z, p):\n    return (open(y),), z", "a call of open"),
        ("def f(t, y, r, z, p):\n    return (y[0](),), z", "a call of y"),
        ("def f(t, y, r, z, p):\n    return (__import__,), z", "names with __"),
        ("def f(t, y, r, z, p):\n    return (f'{y}',), z", "JoinedStr"),
        ("def f(t, y, r, z, p=print()):\n    return y, z", "not one plain function"),
        ("@print\ndef f(t, y, r, z, p):\n    return y, z", "not one plain function"),
        ("def f(t, y, r, z, p):\n    return (lambda: 1)(), z", "Lambda"),
        ("def f(t, y, r, z, p) -> print(1):\n    return y, z", "annotations"),
        ("def f(t, y: print(1), r, z, p):\n    return y, z", "annotations"),
        ("def (", "no Python"),
    ],
)
def test_a_text_that_is_more_than_arithmetic_is_not_run(text, sentence):
    with pytest.raises(BadInput, match=sentence):
        of_values({"kind": "rule", "text": text})


@pytest.mark.parametrize(
    "values",
    [{}, {"kind": "pid"}, {"kind": "linear"}, {"kind": "linear", "A": 1, "B": 2, "C": 3, "D": 4}, {"kind": "rule"},
     {"kind": "linear", "A": [], "B": [], "C": [[]], "D": [["x"]]}, {"kind": "rule", "text": "x", "more": 1},
     {"kind": "linear", "A": [], "B": [], "C": [[]], "D": [[1.0]], "surprise": 3}],
)  # fmt: skip
def test_values_of_no_law_get_a_sentence(values):
    with pytest.raises(BadInput):
        of_values(values)
