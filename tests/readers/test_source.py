"""Is content read as text whoever encoded it, and is a place in it named as an editor counts?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers.source import Source, TextTable, cell, load


def source(data: bytes) -> Source:
    return Source(file="a.csv", data=data)


@pytest.mark.parametrize(
    "data",
    [
        "90°\nx\n".encode(), "90°\nx\n".encode("utf-8-sig"), "90°\nx\n".encode("latin-1"),
        "\ufeff90°\nx\n".encode("utf-16-le"), "\ufeff90°\nx\n".encode("utf-16-be"), b"90\xc2\xb0\r\nx\r\n",
        b"90\xc2\xb0\rx\r",
    ],
)  # fmt: skip
def test_text_of_any_encoding_and_line_end_is_the_same(data):
    assert source(data).text == "90°\nx\n"


@pytest.mark.parametrize(
    ("data", "place"),
    [(b"\x00ab", "line 1, column 1"), (b"ab\ncd\x01", "line 2, column 3"), (b"ab\x7f", "line 1, column 3")],
)
def test_a_byte_of_no_text_is_named_by_line_and_column(data, place):
    with pytest.raises(BadInput) as caught:
        _ = source(data).text
    assert f"'a.csv', {place}: expected text or a MATLAB file, got the byte 0x" in str(caught.value)
    assert source(b"a\tb\x0c\n").text == "a\tb\x0c\n"


def test_a_sentence_names_only_the_places_that_are_known():
    bad = source(b"").bad
    assert str(bad("no")) == "'a.csv': no."
    assert str(bad("no", line=2)) == "'a.csv', line 2: no."
    assert str(bad("no", line=2, column=3, name="x")) == "'a.csv', line 2, column 3 (x): no."
    assert str(bad("no", sample=4, name="x")) == "'a.csv', sample 4: no."


def test_times_may_repeat_where_they_need_not_increase():
    place = {"line": 7}
    for t, strictly, refused in (([0, 1, 1], True, True), ([0, 1, 1], False, False), ([0, 1, 0.5], False, True)):
        check = lambda t=t, strictly=strictly: source(b"").must_increase(  # noqa: E731
            np.array(t, dtype=float), lambda row: place | {"column": row}, strictly=strictly
        )
        if refused:
            with pytest.raises(
                BadInput, match=r"line 7, column 2: time must increase from row to row, got .* s after 1 s"
            ):
                check()
        else:
            check()


@pytest.mark.parametrize(
    ("text", "value"),
    [(" 1.5 ", 1.5), ("-2d3", -2000.0), ("+.5E-1", 0.05), ("3.", 3.0), ("1e30", 1e30), ("-1e30", -1e30)],
)
def test_a_cell_is_a_number_as_programs_write_it(text, value):
    assert cell(source(b""), text, line=1, column=1, name="x") == value


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("1.1e30", "a number too large for any instrument: '1.1e30'"), ("1e999", "a number too large"),
        ("x", "something else: 'x'"), ("nan", "something else"), ("1_0", "something else"), ("", "got an empty cell"),
        ("y" * 50, f"something else: '{'y' * 40}'; mend"),
    ],
)  # fmt: skip
def test_a_cell_that_is_no_usable_number_is_said(text, sentence):
    with pytest.raises(BadInput) as caught:
        cell(source(b""), text, line=3, column=2, name="x")
    assert sentence in str(caught.value)
    assert str(caught.value).startswith("'a.csv', line 3, column 2 (x): expected a")


def test_rows_are_counted_with_blank_lines_and_a_decimal_comma():
    table = TextTable(
        source=source(b""), text="head\n\n1,5;2\n\n2,5;3\n", names=("a", "b"), delimiter=";", first_line=2, start=5,
        decimal_comma=True,
    )  # fmt: skip
    np.testing.assert_array_equal(table.numbers(), [[1.5, 2], [2.5, 3]])
    assert (table.line(0), table.line(1), table.line(2)) == (3, 5, 2)
    assert not table.numbers().flags.writeable
    empty = TextTable(source=source(b""), text="head\n\n", names=("a",), delimiter=None, first_line=2, start=5)
    with pytest.raises(BadInput, match="line 2: the file holds no rows of numbers"):
        empty.numbers()


def test_a_file_that_is_not_there_is_answered_with_its_nearest_neighbour(tmp_path):
    (tmp_path / "swing.csv").write_text("t,x\n0,1\n", encoding="utf-8")
    assert load(tmp_path / "swing.csv").data == b"t,x\n0,1\n"
    for name, said in (
        ("swing2.csv", "did you mean 'swing.csv'?"),
        ("zzz", "check the path."),
        ("no/x", "there is no folder"),
    ):
        with pytest.raises(BadInput) as caught:
            load(tmp_path / name)
        assert said in str(caught.value)
    (tmp_path / "blank.csv").write_bytes(b" \n\n")
    with pytest.raises(BadInput, match="the file is empty"):
        load(tmp_path / "blank.csv")
