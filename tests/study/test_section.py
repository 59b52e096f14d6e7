"""Does a table of a study hand out its values in the form asked for, and refuse others by key and line?"""

from __future__ import annotations

from pathlib import Path

import pytest

from upright.errors import BadInput
from upright.quantities import with_unit
from upright.study.text import Section, StudyText, TomlTable, as_written, counted_sensor, in_si, source_of, toml

TEXT = """title = "x"
[a]
word = "blue"
blank = " "
two = ["x", "y", "x"]
one = "y"
mm = "2 mm"
plain = 3
flag = true
zero = 0
whole = 5
stated = { value = "2 mm", assumed = true }
[a.inner]
k = 1
[b]
word = "red"
"""
TEXT_OF = StudyText(Path("s.toml"), TEXT)
A: Section = TEXT_OF.root().section("a")


def test_values_come_in_the_form_asked_for():
    assert A.text_of("word", "red") == "blue"
    assert A.names("two", "xyz") == ("x", "y")
    assert A.names("one", "xyz") == ("y",)
    assert A.names("none", "xyz", ("z",)) == ("z",)
    assert A.entries("two") == ["x", "y", "x"]
    assert A.entries("one") == ["y"]
    assert A.entries("none") == []
    assert A.number("mm", "m") == 0.002
    assert A.number("plain", "m") == 3
    assert A.number("none", "m", 7.0) == 7
    assert A.positive("mm", "m", 1.0) == 0.002
    assert A.positive("none", "m", 1.0) == 1
    assert A.stated("stated", "m") == (0.002, "assumed")
    assert A.stated("mm", "m") == (0.002, "known")
    assert A.flag("flag") is True
    assert A.flag("none") is False
    assert A.choice("word", ("red", "blue"), "red") == "blue"
    assert A.choice("none", ("red", "blue"), "red") == "red"
    assert A.whole("whole", 1, 5) == 5
    assert A.whole("none", 2, 5) == 2
    assert "word" in A
    assert "none" not in A
    assert A.section("inner").values == {"k": 1}
    assert A.section("none").values == {}
    assert (A.name, A.section("inner").name, TEXT_OF.root().name) == ("a", "a.inner", "the study")


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: A.text_of("plain", "red"), 's.toml, line 8: [a] needs plain as text, such as plain = "red", got 3'),
        (lambda: A.text_of("blank", "red"), 'line 4: [a] needs blank as text, such as blank = "red", got " "'),
        (lambda: A.text_of("none", "red"), "line 2: [a] needs none as text, such as none = \"red\", got nothing"),
        (lambda: A.names("two", "xz"), 'line 5: two lists "y"'),
        (lambda: A.names("plain", "xz"), 'line 8: plain must be a list of names, such as plain = ["x"], got 3'),
        (lambda: A.number("none", "m"), "[a] needs none, a number in m"),
        (lambda: A.number("word", "m"), "line 3: "),
        (lambda: A.positive("zero", "m", 1.0), "line 10: zero must be above zero, got 0"),
        (lambda: A.stated("zero", "m"), "zero must be above zero, got 0; leave it out where there is none"),
        (lambda: A.flag("plain"), "plain must be true or false, got 3"),
        (lambda: A.choice("word", ("red", "green"), "red"), 'word must be "red" or "green", got "blue"'),
        (lambda: A.whole("whole", 1, 4), "whole must be a whole number from 1 to 4, got 5"),
        (lambda: A.whole("zero", 1, 4), "from 1 to 4, got 0"),
        (lambda: A.whole("flag", 1, 4), "from 1 to 4, got true"),
        (lambda: A.check(("word",)), "line 4: [a] has no key 'blank'"),
        (lambda: TEXT_OF.root().check(("a",)), "line 1: there is no key 'title'"),
        (lambda: A.section("plain"), "must be a table of keys, got 3"),
    ],
)  # fmt: skip
def test_another_form_is_refused_by_key_and_line(ask, sentence):
    with pytest.raises(BadInput) as caught:
        ask()
    assert sentence in str(caught.value)


def test_a_table_over_another_keeps_the_line_of_each_key():
    both = TEXT_OF.root().section("b").over(A)
    assert both.values["word"] == "red"
    assert both.values["plain"] == 3
    assert str(both.error("word", "no")) == "s.toml, line 16: no"
    assert str(both.error("plain", "no")) == "s.toml, line 8: no"
    assert TEXT_OF.root().section("none").over(A).name == "a"


def test_whatever_a_block_complains_about_is_told_with_its_line_once():
    for message in ("it is wrong", "s.toml, line 3: it is wrong"):
        with pytest.raises(BadInput) as caught, A.at("word"):
            raise BadInput(message)
        assert str(caught.value) == "s.toml, line 3: it is wrong"
    with pytest.raises(BadInput, match=r"s\.toml, line 3: the file x\.csv does not exist"), A.at("word"):
        raise FileNotFoundError(2, "gone", "x.csv")


@pytest.mark.parametrize(
    ("value", "word"),
    [
        (3, "known"), ({"value": 3}, "known"), ({"value": 3, "assumed": True}, "assumed"),
        ({"value": 3, "measured": True}, "measured"), ({"value": 3, "assumed": False}, "known"),
        ({"value": 3, "uncertainty": 1}, "measured"), ({"value": 3, "uncertainty": 1, "assumed": True}, "assumed"),
    ],
)  # fmt: skip
def test_a_number_rests_on_what_the_study_says(value, word):
    assert source_of(value) == word


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        ("abc", '"abc"'), ("a" * 39, f'"{"a" * 39}"'), ("a" * 40, f'"{"a" * 37}..."'), (True, "true"), (3.5, "3.5"),
        ({"a": 1, "b": 2, "c": 3, "d": 4, "e": 5}, "a table {a, b, c, d}"), ([1] * 13, str([1] * 13)),
        ([1] * 14, str([1] * 14)[:37] + "..."),
    ],
)  # fmt: skip
def test_a_value_is_shown_short(value, shown):
    assert as_written(value) == shown


@pytest.mark.parametrize("value", [1e-60, 1e60, -1e60, 0, "3 m", "2 mm"])
def test_a_number_of_any_sensible_size_is_one(value):
    assert isinstance(in_si(value, "m", "length"), float | int)


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        (0.9e-60, "length must be 0 or from 1e-60 to 1e+60 in size"), (1.1e60, "must be 0 or from"),
        (-1.1e60, "must be 0 or from"), (1e300, "length must be a finite number"), (float("nan"), "finite number"),
        (True, 'length must be a number or text with a unit, such as "1.5 m", got true'), ([1], "got [1]"),
    ],
)  # fmt: skip
def test_a_number_beyond_is_refused(value, sentence):
    with pytest.raises(BadInput) as caught:
        in_si(value, "m", "length")
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a = 1\nb = \n", "s.toml, line 2: this is not TOML ("),
        ("a = [1,\n", "this is not TOML ("),
        ("a = " + "[" * 3000, "brackets nested hundreds deep"),
    ],
)
def test_what_is_no_toml_is_told_with_its_line(text, sentence):
    with pytest.raises(BadInput) as caught:
        StudyText(Path("s.toml"), text)
    assert sentence in str(caught.value)


def test_a_sensor_in_counts_counts_by_the_turn_or_the_metre():
    import math

    turned, moved = str(counted_sensor("theta", "rad", 1000 / (2 * math.pi))), str(counted_sensor("x", "m", 500.0))
    assert turned == '[sensors.theta]\ncolumn = "theta"\nunit = "counts"\ncounts_per_rev = 1000\n'
    assert moved == '[sensors.x]\ncolumn = "x"\nunit = "counts"\ncounts_per_m = 500\n'


def test_a_line_of_a_table_has_its_comment_behind_it_and_no_strange_characters():
    table = TomlTable("[a]", "why")
    table.key("k", 0.123456789, "so")
    table.key("off", True, off=True, digits=2)
    table.line("x\x07y")
    assert str(table) == "[a]   # why\nk = 0.123457   # so\n# off = true\nx y\n"
    assert toml([1, 0.5, "a\x7f", {"b": (2,)}], 3) == '[1, 0.5, "a\\u007f", { b = [2] }]'
    assert (with_unit(0.12345, "m"), with_unit(2.0, "1"), with_unit(2.0), with_unit(0.12345, "m", 1)) == (
        "0.123 m", "2", "2", "0.1 m",
    )  # fmt: skip
