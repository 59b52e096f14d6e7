"""Are the statements of a law its equations, term by term, and does its program say what a reader has to know?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.errors import BadInput
from upright.exports.arithmetic import Language, output_lines, statements
from upright.exports.controller import SampledController, harmless, identifiers, of_design, of_law, of_swing_up
from upright.exports.targets import TARGETS
from upright.exports.vector import self_test
from upright.laws import Law, Rule, as_values

TOY = Language(
    number=lambda x: f"{x:g}", reading=lambda i: f"y{i}", reference=lambda i: f"r{i}", memory=lambda i: f"z{i}",
    command=lambda i: f"u{i}", let="let ", end=";", remark=lambda text: f"# {text}", floor="floor", absolute="abs",
    limited=lambda x, most: f"clip({x}, {most})", first=lambda lines: ["first:", *lines, ":first"],
    hold=lambda line: [f"unless beyond: {line}"], stopped="stopped", not_finite=lambda x: f"bad({x})",
    stop=lambda condition: [f"stop if {condition}"], either="or",
)  # fmt: skip

LAW = Law(
    [[1.0, 0.0], [0.0, 0.25]], [[0.5, 0.0, -0.5], [0.0, 3.0, 0.0]], [[2.0, 1.0]], [[-4.0, 0.0, 5.0]],
    target=[0.0, 1.5], initial=[0.0, 7.0], begin=np.array([[0.0, 0.0], [0.0, -2.0]]), windup="hold", limit=6.0,
    command_resolution=0.5, period=0.01, references=np.zeros((1, 1)), measured=("x", "theta"),
    reference_names=("goal",),
)  # fmt: skip
MADE = SampledController(
    law=LAW, readings=("x", "theta"), commands=("u",), references=("goal",), reading_units=("m", ""), command_unit="V",
    signs=(1.0, 1.0),
)  # fmt: skip


def test_one_sample_is_the_equations_of_the_law_in_their_order():
    assert statements(MADE, TOY) == [
        "stop if stopped or bad(y0) or bad(y1) or bad(r0)",
        "let w0 = y0;  # x less its reading at rest [m]",
        "let w1 = y1 - 1.5;  # theta less its reading at rest",
        "first:", "z0 = 0;", "z1 = 7 + -2 * w1;", ":first",
        "let c0 = 0;  # u [V]",
        "c0 = c0 + 2 * z0;  # of memory 0", "c0 = c0 + z1;  # of memory 1",
        "c0 = c0 + -4 * w0;  # of x [m]", "c0 = c0 + 5 * r0;  # of goal",
        "stop if bad(c0 * 2)",
        "c0 = floor(c0 * 2 + 0.5) * 0.5;  # to the converter's steps",
        "let beyond = abs(c0) > 6;  # sums then stand still",
        "u0 = clip(c0, 6);",
        "let n0 = z0 + 0.5 * w0 + -0.5 * r0;  # what is remembered until the next sample",
        "let n1 = 0.25 * z1 + 3 * w1;",
        "unless beyond: z0 = n0;",  # a sum, which stands still while the command is beyond its limit
        "z1 = n1;",
    ]  # fmt: skip


def test_without_limit_steps_or_memory_little_is_left():
    law = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((2, 0)), [[-3.0], [0.0]], period=0.1)
    made = SampledController(law=law, readings=("x",), commands=("a", "b"), reading_units=("",), signs=(1.0,))
    assert statements(made, TOY) == [
        "stop if stopped or bad(y0)", "let w0 = y0;  # x less its reading at rest", "let c0 = 0;  # a",
        "c0 = c0 + -3 * w0;  # of x", "let c1 = 0;  # b", "stop if bad(c0) or bad(c1)", "u0 = c0;", "u1 = c1;",
    ]  # fmt: skip
    free = statements(replace(MADE, law=replace(LAW, windup="free")), TOY)
    assert not any("beyond" in line for line in free)
    assert not any("beyond" in line for line in statements(replace(MADE, law=replace(LAW, limit=math.inf)), TOY))


def test_commands_of_a_rule_are_rounded_and_limited():
    two = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((2, 0)), [[1.0], [1.0]], period=0.1, limit=3.0,
              command_resolution=[0.0, 0.25])  # fmt: skip
    made = SampledController(law=two, readings=("x",), commands=("a", "b"))
    assert output_lines(made, TOY) == [
        "stop if bad(c0) or bad(c1 * 4)", "c1 = floor(c1 * 4 + 0.5) * 0.25;", "u0 = clip(c0, 3);", "u1 = clip(c1, 3);",
    ]  # fmt: skip


def test_a_program_says_what_its_reader_has_to_know():
    assert replace(MADE, states_from="differences", delay=1.0).facts == [
        *filter(None, [harmless(MADE.basis.first_line())]),
        "Call it every 0.01 s, with readings taken just before, and put the command out at once.",
        "Readings: x [m], theta; at rest 0.0, 1.5.",
        "Commands: u [V]; limited to 6.0 either way, in steps of 0.5.",
        "References: goal, as deviations from rest.",
        "States from readings: differences.",
        "Designed for commands that act 1 sample late in all.",
    ]
    bare = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), [[-3.0]], period=0.1)
    told = SampledController(law=bare, readings=("x",), commands=("u",), reading_units=("",), delay=1.5).facts
    assert told[-2] == "Commands: u; NO LIMIT SPECIFIED, not rounded."
    assert told[-1] == "Designed for commands that act 1.5 samples late in all."
    assert replace(MADE, delay=0.0).facts[-1] == "Designed for commands that act 0 samples late in all."
    assert not any("late in all" in line for line in MADE.facts)


def test_steps_and_memories_are_counted_for_each_signal():
    assert (MADE.converter.tolist(), MADE.encoder.tolist(), MADE.memories) == ([0.5], [0.0, 0.0], 2)


@pytest.mark.parametrize(
    ("text", "kept"),
    [("a\nb\tc", "a b c"), ('*/ "x"', "* / 'x'"), ("/* a", "/ * a"), ("a\\b", "a/b"), ("psi [rad]", "psi [rad]")],
)
def test_a_name_can_stand_in_a_comment_of_any_language(text, kept):
    assert harmless(text) == kept


def test_names_are_spelled_as_programs_can_each_another():
    assert identifiers(["psi", "2nd", "a b", "a-b", "_x_", "θ", "psi"]) == [
        "psi", "y_2nd", "a_b", "a_b_3", "x", "y5", "psi_6",
    ]  # fmt: skip


def test_a_law_of_python_keeps_its_names_and_loses_what_nothing_depends_on():
    law = replace(LAW, B=[[0.5, 0.0, 0.0, -0.5], [0.0, 3.0, 0.0, 0.0]], D=[[-4.0, 0.0, 0.0, 5.0]],
                  references=np.zeros((1, 2)), reference_names=("idle", "goal"), delay=2.0)  # fmt: skip
    made = of_law(law)
    assert (made.readings, made.references, made.commands) == (("x", "theta"), ("goal",), ("u",))
    assert made.law.B.tolist() == LAW.B.tolist()
    assert made.law.D.tolist() == LAW.D.tolist()
    assert (made.delay, made.signs) == (2.0, (1.0, 1.0))
    nameless = of_law(replace(LAW, measured=(), reference_names=()))
    assert (nameless.readings, nameless.references, nameless.delay) == (("y0", "y1"), ("r0",), None)
    two = of_law(Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((2, 0)), [[1.0], [2.0]], period=0.1))
    assert two.commands == ("u0", "u1")


DESIGN = {
    "K": [[1.0, 2.0]], "period": 0.02, "at": "inverted", "plant": "furuta", "command": "motor", "command_unit": "V",
    "readings": [{"name": "psi", "unit": "rad", "step": 0.001},
                 {"name": "theta", "unit": "deg", "step": 0.002}],
    # signals: two readings, a reference
    "law": {"kind": "linear", "A": [[0.5]], "B": [[1.0, 2.0, 3.0]], "C": [[4.0]], "D": [[5.0, 6.0, 7.0]],
            "begin": [[0.25, 0.75]], "target": [0.0, 3.0], "reference_names": ["reference"], "period": 0.02},
    "converter": 0.125, "limit": 10.0, "margins": {}, "delay_samples": 1.5,
    "states_from": "differences", "described": {"entries": {"sign.theta": {"value": -1.0}}},
}  # fmt: skip


def test_a_design_is_read_signal_by_signal():
    made = of_design(DESIGN, "design.json")
    law = made.law
    assert (law.A.tolist(), law.B.tolist(), law.C.tolist(), law.D.tolist()) == (
        [[0.5]], [[1.0, 2.0, 3.0]], [[4.0]], [[5.0, 6.0, 7.0]],
    )  # fmt: skip
    assert (law.begin.tolist(), law.period, law.limit) == ([[0.25, 0.75]], 0.02, 10.0)
    assert (made.encoder.tolist(), made.converter.tolist()) == ([0.001, 0.002], [0.125])
    assert np.asarray(law.target).tolist() == [0.0, 3.0]
    assert (made.readings, made.reading_units, made.signs) == (("psi", "theta"), ("rad", "deg"), (1.0, -1.0))
    assert (made.commands, made.command_unit, made.references) == (("motor",), "V", ("reference",))
    assert (made.title, made.delay, made.states_from) == ("furuta at 'inverted'", 1.5, "differences")
    open_ended = of_design(DESIGN | {"limit": None, "at": "", "described": None, "command_unit": None}, "x")
    assert (open_ended.law.limit, open_ended.title, open_ended.signs) == (math.inf, "furuta", (1.0, 1.0))
    assert open_ended.command_unit == ""


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ([], "not a design.json; it needs the keys law, K and period"),
        ({"law": {}, "K": []}, "not a design.json; it needs the keys law, K and period"),
        ({k: v for k, v in DESIGN.items() if k not in ("readings", "margins")}, "x lacks readings, margins; an older"),
        (
            DESIGN | {"margins": None, "verdict": "It falls."},
            "the loop of x is unstable, so its law is not exported: It falls",
        ),
        (DESIGN | {"law": {"A": [[0.5]]}}, "x lacks the law's kind; an older"),
        (DESIGN | {"law": {"kind": "linear", "A": [[0.5]]}}, "the values are no law's"),
        (DESIGN | {"readings": DESIGN["readings"][:1]}, "needs matrices for 1 readings"),
    ],
)
def test_what_is_no_design_is_refused_with_what_is_missing(content, said):
    with pytest.raises(BadInput, match=said):
        of_design(content, "x")


def pushing(t, y, r, z, p):
    """A rule of two readings."""
    return (p[0] * y[1],), z


SWING = {
    "rule": as_values(Rule(function=pushing, parameters=[2.0], initial=[], measured=("psi", "theta"))),
    "readings": DESIGN["readings"], "period": 0.01, "limit": 6.0, "rig": "bench 3", "command_unit": "V",
    "swing_up": {"held": True}, "described": {"entries": {"sign.theta": {"value": -1.0}}},
}  # fmt: skip


def test_a_swing_up_is_read_with_its_own_limit_period_and_signs():
    made = of_swing_up(SWING, "swing_up.json")
    assert (made.law.limit, made.law.period, made.readings, made.signs) == (6.0, 0.01, ("psi", "theta"), (1.0, -1.0))
    assert (made.commands, made.command_unit, made.title) == (("u",), "V", "bench 3, swing-up and catch")
    assert made.law.function(0.0, (1.0, 3.0), (), (), (2.0,)) == ((6.0,), ())
    bare = of_swing_up({k: v for k, v in SWING.items() if k not in ("rig", "command_unit", "described")}, "x")
    assert (bare.title, bare.command_unit, bare.signs) == ("a rig, swing-up and catch", "", (1.0, 1.0))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ([], "x is not a swing_up.json with a law; write it again with"),
        ({k: v for k, v in SWING.items() if k != "limit"}, "x is not a swing_up.json with a law"),
        (SWING | {"swing_up": None, "verdict": "It fell."}, "of x did not end upright, so it is not exported: It fell"),
        (SWING | {"swing_up": {"held": False}}, "did not end upright"),
        (SWING | {"readings": DESIGN["readings"][:1]}, r"x does not hold a law \(it needs a rule of 1 readings\)"),
        (SWING | {"rule": DESIGN["law"]}, r"does not hold a law \(it needs a rule of 2 readings\)"),
        (SWING | {"rule": {"kind": "rule"}}, "does not hold a law"),
    ],
)
def test_what_is_no_swing_up_is_refused_with_what_is_missing(content, said):
    with pytest.raises(BadInput, match=said):
        of_swing_up(content, "x")


def test_a_replay_swings_about_rest_on_the_encoders_steps_while_its_reference_steps_half_way():
    """Unlimited and unrounded its largest command is one and a half limits, so that some are limited and most not."""
    made = replace(MADE, law=replace(LAW, resolution=[0.01, 0.0], windup="free"))
    test = self_test(made)
    steps = test.readings[:, 0] / 0.01
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    half = len(test.readings) // 2
    assert not test.references[:half].any()
    assert len(set(test.references[half:].ravel())) == 1
    assert test.references[-1, 0] > 0
    free = replace(made.law, references=test.references, limit=math.inf, command_resolution=0.0)
    assert np.abs(free.follow(test.readings)[0]).max() == pytest.approx(1.5 * 6.0, rel=0.02)  # but for the steps
    off = test.readings - [0.0, 1.5]
    assert np.abs(off).max() == pytest.approx(2 * test.references[-1, 0], rel=0.02)
    crossings = np.flatnonzero(np.diff(np.sign(off[:, 1])))
    assert (np.diff(crossings) <= np.diff(crossings)[0]).all()  # faster and faster
    assert len(crossings) >= 3
    np.testing.assert_array_equal(np.round(test.commands / 0.5), test.commands / 0.5)
    assert np.abs(test.commands).max() == 6.0


def test_single_precision_misses_a_sum_of_products_by_a_few_roundings_of_their_sizes():
    """u = -3.3 y of one reading: at least half a unit in the last place of it, and not ten of them."""
    law = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), [[-3.3]], period=0.1)
    test = self_test(of_law(law))
    exact = test.readings @ law.D.T
    rounded = np.float32(test.readings) * np.float32(-3.3)
    missed = np.abs(rounded.astype(float) - exact).max()
    assert missed <= test.single
    assert test.single < 10 * 2.0**-24 * np.abs(exact).max()


@pytest.mark.parametrize(
    ("hold", "step", "begun"), [(False, 0.0, -0.4), (True, 0.25, -0.4), (True, 1e-7, -0.4), (True, 1.0, None)]
)
def test_single_precision_is_bounded_by_errors_that_are_handed_on_from_sample_to_sample(hold, step, begun):
    """A memory of one number, z' = a z + b w, u = c z + d w, with its errors followed one by one.

    Sums of three terms (memory, reading, reference) err by five roundings of their sizes, inputs by one more. What is
    asked within a converter step of the limit may hold a sum or not, so that all that is added to it may be missing.
    """
    eps = 2.0**-24
    a, b, c, d = (1.0 if hold else 0.5), np.array([2.0, -0.75]), 3.0, np.array([1.5, 0.3])
    law = Law([[a]], [b], [[c]], [d], target=[0.7], initial=[0.9], references=np.zeros((1, 1)), period=0.1,
              windup="hold" if hold else "free", limit=2.0 if hold else math.inf,
              command_resolution=step, begin=None if begun is None else np.array([[begun]]))  # fmt: skip
    made = of_law(law)
    test = self_test(made)
    memory = replace(law, references=test.references).follow(test.readings)[1][:, 0]
    w = np.column_stack([test.readings[:, 0] - 0.7, test.references[:, 0]])
    y = np.column_stack([test.readings[:, 0], test.references[:, 0]])
    rounded = np.float32(y).astype(float) - y - [float(np.float32(0.7)) - 0.7, 0.0]
    moved_memory, first = (begun or 0.0) * rounded[0, 0], abs(begun or 0.0) * abs(w[0, 0])
    error, worst, asked, held = 5 * eps * (first + abs(memory[0])), 0.0, c * memory + w @ d, 0
    for k in range(len(w)):
        moved = abs(c * moved_memory + rounded[k] @ d)
        moved_memory = a * moved_memory + rounded[k] @ b
        size = np.abs(w[k])
        now = moved + 5 * eps * (c * abs(memory[k]) + size @ np.abs(d)) + eps * (size @ np.abs(d)) + c * error
        worst = max(worst, now)
        near = hold and abs(abs(asked[k]) - 2.0) <= now + step
        error = a * error + 5 * eps * (a * abs(memory[k]) + size @ np.abs(b)) + eps * (size @ np.abs(b))
        error += abs(a * memory[k] + w[k] @ b - memory[k]) if near else 0.0
        held += near
    assert (held > 0) == (step == 1.0) or step == 0.25
    worst = step * math.ceil(worst / step) if hold else worst
    assert test.single == pytest.approx(worst + 4 * eps * min(law.limit, np.abs(asked).max()), rel=1e-6)


def in_c(made, single=False):
    return TARGETS["c"].write(made, self_test(made), single)


def test_a_header_names_every_signal_and_the_step_of_each_encoder_that_has_one():
    """A reversed encoder counts the other way: its step has the sign of its wiring."""
    made = replace(MADE, law=replace(LAW, resolution=[0.001, 0.0]), signs=(-1.0, 1.0), reading_units=("m", "rad"))
    text = in_c(made)["law.h"]
    assert "#define LAW_STEP_X -0.001 /* reading per count of the encoder [m] */\n" in text
    assert "LAW_STEP_THETA" not in text
    for line in ("typedef double law_real;", "#define LAW_PERIOD 0.01 ", "#define LAW_READINGS 2\n",
                 "#define LAW_REFERENCES 1\n", "#define LAW_COMMANDS 1\n", "law_real z[2];", "int running;",
                 "One sample: y[0] is x [m]; y[1] is theta [rad]; r[0] is goal; u[0] is u [V]."):  # fmt: skip
        assert line in text, line
    bare = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), [[-3.0]], period=0.1)
    assert "law_real z[1];" in in_c(of_law(bare))["law.h"]  # C has no arrays of nothing


@pytest.mark.parametrize("single", [False, True])
def test_a_law_in_double_precision_calls_nothing_in_single(single):
    texts = in_c(MADE, single)
    assert ("floorf(" in texts["law.c"]) == ("fabsf(" in texts["law.c"]) == single
    assert ("floor(" in texts["law.c"]) == ("fabs(" in texts["law.c"]) == (not single)
    assert ("FLT_MANT_DIG" in texts["law.c"], "DBL_MANT_DIG" in texts["law.c"]) == (single, not single)
    assert ("-4.0f * w0" in texts["law.c"]) == single
    assert f"typedef {'float' if single else 'double'} law_real;" in texts["law.h"]
    assert f"allowed = ({'0' if single else 'LAW_EXACT'}) ? 0 : LAW_SINGLE_MISSES;" in texts["law_selftest.h"]
    assert "static const law_real given[48][2]" in texts["law_selftest.h"]
    assert "static const law_real expected[48][1]" in texts["law_selftest.h"]


def test_numbers_of_a_rule_are_kept_in_double_precision():
    def push(t, y, r, z, p):
        return (p[0] * y[0],), (y[0],)

    made = of_law(Rule(function=push, initial=[0.1], parameters=[0.3], measured=("x",), period=0.01))
    text = in_c(made)["law.c"]
    assert "static double parameters[] = {0.3};" in text
    assert "static const double initial[] = {0.1};" in text
    assert "found[2];" in text
    assert "s->z[i] = found[1 + i];" in text
