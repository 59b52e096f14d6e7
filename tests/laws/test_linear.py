"""Is a law in other units, on other columns, of some lanes or a little late the same law?"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from upright.errors import BadInput
from upright.laws import Law, Rule, as_values, of_values, state_feedback
from upright.laws.linear import differences, rounded
from upright.laws.rule import line_in, text_of

RNG = np.random.default_rng(3)


def some(**more):
    """A law of two memories, two readings and a reference, with numbers without anything in common."""
    rng = np.random.default_rng(4)
    given = {"target": [0.3, -0.2], "initial": [0.1, 0.2], "begin": rng.normal(size=(2, 2)), "period": 0.01,
             "references": np.sin(np.arange(30.0)), "measured": ("a", "b"), "reference_names": ("r",)}  # fmt: skip
    return Law(
        0.5 * rng.normal(size=(2, 2)), rng.normal(size=(2, 3)), rng.normal(size=(1, 2)), rng.normal(size=(1, 3)),
        **(given | more),
    )  # fmt: skip


Y = RNG.normal(size=(40, 2))


def by_hand(law, y, fed=0.0):
    """Commands and memories of a law, sum by sum."""
    r = np.asarray(law.references, dtype=float).ravel()
    z, u, kept = np.array(law.initial) + law.begin @ (y[0] - law.target), [], []
    for k, now in enumerate(y):
        w = np.append(now - law.target, r[min(k, r.size - 1)])
        kept.append(z)
        u.append(float(law.C[0] @ z + law.D[0] @ w) + fed)
        z = law.A @ z + law.B @ w
    return np.array(u), np.array(kept)


def test_a_law_follows_its_matrices():
    u, z = some().follow(Y)
    expected, memory = by_hand(some(), Y)
    assert u[:, 0] == pytest.approx(expected)
    assert z == pytest.approx(memory)
    assert some().follow(Y, 2.5)[0][:, 0] == pytest.approx(expected + 2.5)
    step = some(command_resolution=0.25, limit=1.1).follow(Y)[0][:, 0]
    assert step == pytest.approx(np.clip(np.floor(expected / 0.25 + 0.5) * 0.25, -1.1, 1.1))


def test_a_command_arrives_its_delay_late_and_between_samples_as_their_mean():
    expected = by_hand(some(), Y)[0]
    late = some(delay=2.0).follow(Y)[0][:, 0]
    assert late[2:] == pytest.approx(expected[:-2])
    assert late[:2].tolist() == [0.0, 0.0]
    between = some(delay=1.25).follow(Y)[0][:, 0]
    assert between[2:] == pytest.approx(0.75 * expected[1:-1] + 0.25 * expected[:-2])


def test_sums_stand_still_beyond_the_limit_and_filters_go_on():
    law = Law(np.diag([1.0, 0.5]), [[1.0], [1.0]], [[1.0, 1.0]], [[0.0]], limit=2.0, windup="hold", initial=[0.0, 0.0])
    u, z = law.follow([1.0, 1.0, 1.0, 1.0])
    # commands asked for: 0, 2, 3.5, 3.75; at the limit itself the sum goes on
    assert z.tolist() == [[0.0, 0.0], [1.0, 1.0], [2.0, 1.5], [2.0, 1.75]]
    assert u[:, 0].tolist() == [0.0, 2.0, 2.0, 2.0]
    free = replace(law, windup="free").follow([1.0, 1.0, 1.0, 1.0])[1]
    assert free[:, 0].tolist() == [0.0, 1.0, 2.0, 3.0]


def test_a_law_between_other_units_commands_the_same():
    law = some(limit=1.5, command_resolution=0.1)
    scale, offset = np.array([2.0, -0.5]), np.array([0.3, 0.7])
    other = law.in_units(scale, offset, -3.0)
    assert other.follow((Y - offset) / scale)[0] == pytest.approx(-3.0 * law.follow(Y)[0], abs=0.31)
    smooth = some()
    assert smooth.in_units(scale, offset, -3.0).follow((Y - offset) / scale)[0] == pytest.approx(
        -3.0 * smooth.follow(Y)[0]
    )
    assert other.limit == pytest.approx(4.5)
    assert np.asarray(other.command_resolution) == pytest.approx(0.3)


def test_a_law_on_more_columns_reads_its_own_and_feeds_the_first_input():
    law = some()
    wide = law.over(("b", "c", "a"), 2)
    three = np.column_stack([Y[:, 1], RNG.normal(size=40), Y[:, 0]])
    u = wide.follow(three)[0]
    assert u[:, 0] == pytest.approx(law.follow(Y)[0][:, 0])
    assert np.all(u[:, 1] == 0.0)
    assert wide.measured == ("b", "c", "a")
    bare = replace(law, begin=None).over(("a", "b"), 1)
    assert bare.begin is None


def test_numbers_of_lanes_are_taken_lane_by_lane():
    wide = some(initial=RNG.normal(size=(2, 5)), begin=None)
    wide = replace(wide, A=RNG.normal(size=(2, 2, 5)))
    assert wide.widths() == {"A": 5, "B": 1, "C": 1, "D": 1, "initial": 5, "target": 1}
    part = wide.of_lanes(slice(1, 3))
    assert pytest.approx(wide.A[..., 1:3]) == part.A
    assert pytest.approx(wide.B) == part.B
    assert part.compiled_in == wide.compiled_in
    rows = wide.by_lane(5)
    assert rows["A"][1] == pytest.approx(wide.A[0, 1])
    assert rows["target"].tolist() == [[0.3] * 5, [-0.2] * 5]
    with pytest.raises(BadInput, match="A of the law is given for 5 lanes, where there are 4"):
        wide.by_lane(4)


def test_what_all_lanes_share_stands_in_its_order():
    law = some(resolution=[0.1, 0.2], delay=1.5, command_resolution=0.3)
    assert law.scalars(2, 1).tolist() == [0.1, 0.2, 1.5, 0.0, 0.3]
    assert replace(law, resolution=0.4).scalars(2, 1).tolist() == [0.4, 0.4, 1.5, 0.0, 0.3]
    with pytest.raises(BadInput, match="resolution needs one value or 3"):
        law.scalars(3, 1)


def test_a_kernel_s_numbers_leave_out_what_is_compiled_in_and_begin_with_the_first_reading():
    law = Law(
        [[1.0, 0.0], [0.5, 0.0]], [[1.0, 0.25], [0.0, 1.0]], [[2.0, 3.0]], [[4.0, 5.0]], target=[0.1, 0.2],
        initial=[7.0, 8.0], begin=np.array([[1.0, 0.0], [2.0, 3.0]]), resolution=0.5,
    )  # fmt: skip
    assert law.compiled_in.A == ((1.0, 0.0), (None, 0.0))
    assert law.compiled_in.B == ((1.0, None), (0.0, 1.0))
    q = np.array([[0.74, 0.76], [1.0, 1.3]])
    rows = law.rows(1, 2, q)
    w = np.array([[0.4, 0.9], [0.8, 1.3]])  # in whole steps of 0.5, less the targets
    initial = np.array([7.0 + w[0], 8.0 + 2 * w[0] + 3 * w[1]])
    assert rows == pytest.approx(np.vstack([
        [[0.5, 0.5]], [[0.25, 0.25]], [[2.0, 2.0]], [[3.0, 3.0]], [[4.0, 4.0]], [[5.0, 5.0]], initial,
        [[0.1, 0.1]], [[0.2, 0.2]],
    ]))  # fmt: skip
    with pytest.raises(BadInput, match=r"needs shape \(1, 3\), got \(1, 2\)"):
        law.rows(1, 2, np.zeros((3, 2)))


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"delay": -0.1}, "delay must be at least 0 samples"), ({"delay": 1e4}, "delay must be at least 0 samples"),
        ({"limit": 0.0}, "limit above zero"), ({"resolution": -1.0}, "resolution must be at least 0"),
        ({"command_resolution": [-1.0]}, "resolution must be at least 0"),
        ({"references": np.zeros((0, 1))}, "references need finite values"),
        ({"references": [math.nan]}, "references need finite values"),
        ({"references": np.zeros((1, 1, 1)), "measured": ()}, "references need finite values"),
        ({"A": np.zeros(2)}, "A of a law needs two axes"), ({"A": np.eye(3)}, "A of a law with 2 memories, 1 inputs"),
        ({"B": np.zeros((2, 2))}, "and 3 signals in needs shape"), ({"D": np.zeros((2, 3))}, "D of a law"),
        ({"initial": [1.0]}, r"initial state of the law needs shape \(2,\), got \(1,\)"),
        ({"initial": np.zeros((2, 1, 1))}, "initial state of the law needs shape"),
        ({"C": np.array([[math.inf, 0.0]])}, "C of a law needs finite numbers"),
        ({"initial": [math.nan, 0.0]}, "initial of a law needs finite numbers"),
        ({"windup": "stop"}, 'windup is "free" or "hold"'), ({"period": -1.0}, "needs its sample period"),
        ({"period": math.inf}, "needs its sample period"),
    ],
)  # fmt: skip
def test_a_law_that_cannot_be_is_refused(changed, words):
    with pytest.raises(BadInput, match=words):
        replace(some(), **changed)


def test_what_is_at_a_bound_is_a_law():
    assert some(delay=0.0, resolution=0.0, period=None).period is None
    assert some(references=None).signal().shape == (1, 1)
    assert some(references=None).readings == 2
    assert some(references=[1.0, 2.0]).signal().tolist() == [[1.0], [2.0]]


def test_a_difference_is_low_passed_with_its_memory():
    assert [M.shape for M in differences(3, 0.1)] == [(3, 3), (3, 3), (6, 3), (6, 3)]
    A, B, C, D = differences(1, 0.1, 0.25)
    x, v, last = np.zeros(2), 0.0, 0.0
    for y in (1.0, -2.0, 0.5):
        v, last = 0.25 * v + 0.75 * (y - last) / 0.1, y
        assert C @ x + D @ [y] == pytest.approx([y, v])
        x = A @ x + B @ [y]
        assert x == pytest.approx([y, v])
    for memory, period, words in ((1.0, 0.1, "below 1, got 1"), (-0.1, 0.1, "at least 0"), (0.0, 0.0, "above zero"),
                                  (0.0, math.inf, "above zero")):  # fmt: skip
        with pytest.raises(BadInput, match=words):
            differences(1, period, memory)


def test_gains_of_lanes_and_of_references_make_each_lane_its_own_law():
    K, k_pf = RNG.normal(size=(1, 4, 3)), np.array([1.0, 2.0, 3.0])
    wide = state_feedback(K, 0.01, memory=0.5, k_pf=k_pf)
    for i in range(3):
        one = state_feedback(K[..., i], 0.01, memory=0.5, k_pf=k_pf[i])
        assert wide.C[..., i] == pytest.approx(one.C)
        assert wide.D[..., i] == pytest.approx(one.D)
        assert one.D[0, -1] == k_pf[i]
        assert np.all(one.B[:, -1] == 0.0)
    assert wide.reference_names == ("reference",)
    first = state_feedback(K[..., 0], 0.01, memory=0.5).follow(Y)[0]
    assert first[0, 0] == pytest.approx(-(K[0, 0, 0] * Y[0, 0] + K[0, 2, 0] * Y[0, 1]))  # the first speed is zero
    shared = state_feedback(K[..., 0], 0.01, k_pf=k_pf)
    assert shared.D[0, 2].tolist() == [1.0, 2.0, 3.0]
    assert shared.D[0, 0, 0] == shared.D[0, 0, 2]


def test_rounding_goes_to_the_nearest_step_and_a_tie_up():
    assert rounded(np.array([0.24, 0.25, -0.25, -0.26, 0.76]), 0.5).tolist() == [0.0, 0.5, 0.0, -0.5, 1.0]
    assert rounded(np.array([0.24, -0.3]), [0.0, 0.5]).tolist() == [0.24, -0.5]


def kick(t, y, r, z, p):
    """Pushes by its first number where the reading is below the second."""
    push = p[0] if y[0] < p[1] else 0.0
    later = push / z[0]
    return (push + r[0], later), (z[0] + t,)


def test_a_rule_is_called_with_what_it_is_given():
    rule = Rule(function=kick, initial=[2.0], parameters=[3.0, 0.5], references=[10.0, 20.0])
    u, z = rule.follow([0.0, 1.0, 0.0], 0.1)
    assert u.tolist() == [[13.0, 1.5], [20.0, 0.0], [23.0, pytest.approx(3 / 2.1)]]
    assert z[:, 0] == pytest.approx([2.0, 2.0, 2.1])
    assert rule.commands(1) == 2
    with pytest.raises(BadInput, match="stops at readings of zero: IndexError"):
        rule.commands(0)
    made = rule.compiled_in
    assert (made.states, made.references, made.parameters) == (1, 1, 2)
    assert made.numbers == ("rp0", "rp1", "z0")
    assert rule.rows(2, 3, np.zeros((1, 3))).tolist() == [[3.0] * 3, [0.5] * 3, [2.0] * 3]
    with pytest.raises(BadInput, match="must return 1 commands, and this one returns 2"):
        rule.rows(1, 1, np.zeros((1, 1)))
    with pytest.raises(BadInput, match="needs one axis"):
        replace(rule, initial=3.0)
    with pytest.raises(BadInput, match="needs one axis"):
        replace(rule, parameters=np.zeros((1, 1, 1)))


def test_a_line_of_a_rule_s_text_is_found_in_its_file():
    text = text_of(kick).splitlines()
    assert text[0].startswith("def rule(t, y, r, z, p)")
    place = next(i for i, line in enumerate(text, start=1) if "later =" in line)
    lines = Path(__file__).read_text(encoding="utf-8").splitlines()
    where = next(i for i, line in enumerate(lines, start=1) if line.startswith("    later = push"))
    assert line_in(kick, place) == f"line {where} of test_linear.py"
    assert line_in(kick, 99) == "the rule 'kick'"


def test_what_is_as_it_would_be_is_not_said_and_comes_back():
    law = some(limit=2.0)
    told = as_values(law)
    assert told["kind"] == "linear"
    assert told["limit"] == 2.0
    assert not {"delay", "resolution", "command_resolution", "windup"} & told.keys()
    again = of_values(told)
    assert again.follow(Y)[0].tolist() == law.follow(Y)[0].tolist()
    plain = as_values(Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), [[2.0, -1.0]]))
    assert plain.keys() == {"kind", "A", "B", "C", "D"}
    assert of_values(plain).B.shape == (0, 2)


@pytest.mark.parametrize(("former", "now"), [("quantum", "resolution"), ("command_quantum", "command_resolution")])
def test_a_former_name_of_a_resolution_means_the_same_and_warns(former, now):
    with pytest.warns(DeprecationWarning, match=f"{now}="):
        law = some(**{former: 0.25})
    assert getattr(law, now) == 0.25
    with pytest.warns(DeprecationWarning, match=f"read .{now}"):
        assert getattr(law, former) == 0.25
    values = as_values(law)
    assert getattr(of_values({former: values.pop(now), **values}), now) == 0.25  # as a log of before says it


def following(t, y, r, z, p):
    """A rule that sees how many references it has."""
    return (float(len(r)),), z


@pytest.mark.parametrize(
    ("references", "rows"),
    [(None, [[]]), ([1.0, 2.0], [[1.0], [2.0]]), ([[1.0, 3.0], [2.0, 4.0]], [[1.0, 3.0], [2.0, 4.0]])],
)
def test_a_rule_sees_as_many_references_as_its_signal_has_columns(references, rows):
    rule = Rule(function=following, parameters=[], initial=[], references=references, period=0.1)
    assert rule.signal().tolist() == rows
    assert rule.follow(np.zeros((3, 1)), 0.1)[0].ravel().tolist() == [float(len(rows[0]))] * 3
