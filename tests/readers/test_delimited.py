"""Is a table of numbers told from its names, its delimiter and its time, whoever wrote it?"""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.formats.delimited import begins_with_number, layout
from upright.readers.source import Source, TextTable
from upright.records import Record


def source(text: str) -> Source:
    return Source(file="log.csv", data=text.encode())


def table(text: str) -> TextTable:
    return layout(source(text))


def record(text: str) -> Record:
    return read_source(source(text), reader="table")


def refusal(text: str) -> str:
    with pytest.raises(BadInput) as caught:
        record(text)
    return str(caught.value)


@pytest.mark.parametrize(
    ("line", "number"),
    [
        ("1", True), ("-1.5e-3,x", True), (".5;", True), ("1d0 2", True), ("nan,1", True), (" +inf 2", True),
        ("1x", False), ("x,1", False), ("", False), ("-", False), ("1.2.3", False), ("Infinity,2", True),
    ],
)  # fmt: skip
def test_a_row_begins_with_a_number(line, number):
    assert begins_with_number(line) is number


@pytest.mark.parametrize(
    ("text", "names", "delimiter", "first_line", "rows"),
    [
        ("t,x\n0,1\n", ("t", "x"), ",", 2, [[0, 1]]),
        ("by hand\n\n t , x\n0,1\n1,2\n", ("t", "x"), ",", 4, [[0, 1], [1, 2]]),
        ("0;1\n1;2\n", ("c0", "c1"), ";", 1, [[0, 1], [1, 2]]),
        ("t;x\n0,5;1\n1,5;2\n", ("t", "x"), ";", 2, [[0.5, 1], [1.5, 2]]),
        ("t;x\n0.5;1\n", ("t", "x"), ";", 2, [[0.5, 1]]),
        ("# t,,x\n0,1,2\n", ("t", "c1", "x"), ",", 2, [[0, 1, 2]]),
        ("#% t x\n0 1\n", ("t", "x"), None, 2, [[0, 1]]),
        ("my time  my angle\n0  1\n", ("my time", "my angle"), None, 2, [[0, 1]]),
        ('"t" "x"\n0 1\n', ("t", "x"), None, 2, [[0, 1]]),
        ("t,x\n0,1,\n", ("t", "x"), ",", 2, [[0, 1]]),
        ("t;x; \n0;1;\n", ("t", "x"), ";", 2, [[0, 1]]),
        ("t x\n0,5 1,5\n", ("t", "x"), None, 2, [[0.5, 1.5]]),
        ("0,5 1,5\n", ("c0", "c1"), None, 1, [[0.5, 1.5]]),
        ("3,5\n4,5\n", ("c0", "c1"), ",", 1, [[3, 5], [4, 5]]),  # one comma: two columns
    ],
)
def test_names_and_rows_are_told_apart(text, names, delimiter, first_line, rows):
    found = table(text)
    assert (found.names, found.delimiter, found.first_line) == (names, delimiter, first_line)
    np.testing.assert_array_equal(found.numbers(), rows)


TORN = "line 5, column 2 (x): expected 2 decimals and a line end, got '4.0'"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a\nb\n", "line 1: there are no rows of numbers, with at most one line of names above them; formats"),
        ("t,x,y\n0,1\n", "line 1: expected a name for each of the 2 columns below, got 3"),
        ("# by hand\nt,x,y\n0,1\n", "line 2: expected a name for each of the 2 columns"),
        ("\nt,x,t\n0,1,2\n", "line 2, column 3 (t): expected a different name for each column"),
        ("n,x\n0,1\n1,2\n", "line 1: expected a time column named 't' or 'time', got only the sample index 'n'"),
        ("a,x\n1,1\n0,2\n", "line 1: expected a time column named 't' or 'time', got: a, x; name the time column"),
        ("x\n" * 200 + "0,1\n", "there are no rows of numbers"),
        ("x,t\n0,1\n\n0,1\n", "line 4, column 2 (t): time must increase from row to row, got 1 s after 1 s"),
        ("t,x\n0,1\n1,2,3\n2,3\n", "line 3: expected 2 numbers, got 3; mend or delete the row"),
        ("t,x\n0,1\n1,2\n2\n", "line 4: expected 2 numbers, got 1; the last row is torn"),
        ("t,x\n0,1\n1,y\n2,3\n", "line 3, column 2 (x): expected a finite number, got something else: 'y'"),
        ("t,x\n0,1\n1,1e31\n2,3\n", "line 3, column 2 (x): expected a finite number, got a number too large"),
        ("t,x\n0.0,1.00\n1.0,2.00\n2.0,3.00\n3.0,4.0", TORN),
    ],
)  # fmt: skip
def test_what_is_no_table_is_refused_with_its_place(text, sentence):
    assert sentence in refusal(text)


def test_the_200th_line_may_be_the_first_of_numbers():
    assert table("t,x\n" * 199 + "0,1\n").first_line == 200


UNNAMED = "The log names no columns; they are called c0, c1, ... and c0 increases, so it is the time."
EPOCH = "Time is counted from the first sample, epoch 1700000000.250000 s."
CUT = "The last row has no line end; if the log was cut short, its last number may be cut as well."


@pytest.mark.parametrize(
    ("text", "t", "names", "notes"),
    [
        ("x,time [ms]\n5,0\n6,2000\n", [0, 2], ("x",), ()),
        ("a,x\n1,5\n3,6\n", [1, 3], ("x",), ("No column is named like a time; 'a' is the first and increases.",)),
        ("1,5\n3,6\n", [1, 3], ("c1",), (UNNAMED,)),
        ("t,x\n1700000000.25,5\n1700000000.75,6\n", [0, 0.5], ("x",), (EPOCH,)),
        ("x,t\n5,1700000000.25\n6,1700000000.75\n", [0, 0.5], ("x",), (EPOCH,)),
        ("t,x\n0,1\n1,2\n2,3", [0, 1, 2], ("x",), (CUT,)),
    ],
)  # fmt: skip
def test_the_time_is_named_so_or_the_first_that_increases(text, t, names, notes):
    found = record(text)
    np.testing.assert_allclose(found.t, t)
    assert found.names == names
    assert found.provenance.notes == notes


@pytest.mark.parametrize(
    ("cells", "torn"),
    [
        ("1.00 2.00 3.00 4.0", True),
        ("1.00 2.00 3.00 4", True),
        ("1.00 2.00 3.00 4.00", False),
        ("1.00 2.00 3.0 4.0", False),  # the last whole row is shorter already: no fixed format
        ("1.0 2.00 3.00 4.0", False),
        ("1.00 2.00 3.0", False),  # two rows are no format
        ("9.0 1.00 2.00 3.00 4.00 5.00 6.00 7.00 8.0", True),  # the last eight rows tell it
    ],
)
def test_a_last_row_is_torn_where_all_before_it_have_other_decimals(cells, torn):
    text = "t,x\n" + "\n".join(f"{k},{cell}" for k, cell in enumerate(cells.split()))
    if torn:
        assert "the last row is torn" in refusal(text)
    else:
        assert record(text).provenance.notes == (CUT,)


def test_a_rounded_clock_is_rebuilt_from_the_index_beside_it():
    rows = "".join(f"{i},{round(1.1275 * i)},7\n" for i in range(200) if i != 90)
    found = record(f"Sample,t_ms,x\n{rows}")
    steps = np.diff(found.t)
    assert int(np.argmax(steps)) == 89
    assert steps[89] == pytest.approx(2 * np.median(steps))
    assert found.provenance.notes[0].startswith("Time was rounded to 1 ms")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("# upright record\n# {}\nt,x\n", "line 1: expected '# upright record', a line of units"),
        ("# upright record\n{}\nt,x\n0,1\n", "line 1: expected '# upright record'"),
        ("# upright record\n# {}\nx,t\n0,1\n", "line 3: expected names that differ, the first of them 't'"),
        ("# upright record\n# {}\nt,x,x\n0,1,2\n", "line 3: expected names that differ"),
        ('# upright record\n# {}\nt,"x\n0,1\n', "line 3: expected a line of names, got a broken quotation"),
        ("# upright record\n# {}\nt,x\n0,1\n1,y\n", "line 5, column 2 (x)"),
    ],
)
def test_a_record_of_ours_with_damage_is_refused_by_line(text, sentence):
    if text.count("\n") == 3:
        text = text.rstrip("\n")
    with pytest.raises(BadInput) as caught:
        read_source(source(text), reader="upright")
    assert sentence in str(caught.value)


def test_a_record_of_ours_comes_back():
    text = '# upright record\n# {"units": {"x": "V"}}\nt,x\n0,1\n2,5\n'
    found = read_source(source(text))
    np.testing.assert_array_equal(found.t, [0, 2])
    np.testing.assert_array_equal(found["x"], [1, 5])
    assert found.units == {"x": "V"}


def test_decimal_commas_are_seen_below_rows_of_whole_numbers():
    found = record("t [ms];theta [deg]\n" + "".join(f"{5 * i};0\n" for i in range(300)) + "1500;1,25\n1505,5;-3\n")
    assert found["theta [deg]"][-2:].tolist() == [1.25, -3.0]
    assert found.t[-1] == pytest.approx(1.5055)


def test_a_title_above_names_with_units_is_no_line_of_names() -> None:
    log = read_source(Source(file="a.csv", data=b"Run 3,,\nTime (s),Angle (deg),Voltage (V)\n0,20,0\n0.01,19,0\n"))
    assert log.names == ("Angle (deg)", "Voltage (V)")


def test_a_first_column_of_another_name_counts_in_the_unit_that_it_states() -> None:
    seen = record("Stempel [ms],x\n0,1\n5,2\n10,3\n")
    np.testing.assert_allclose(seen.t, [0, 5e-3, 10e-3])
    assert not any("named like a time" in note for note in seen.provenance.notes)


@pytest.mark.parametrize(("delimiter", "mark"), [(",", "."), (";", ","), (",", ","), ("\t", ".")])
def test_numbers_in_quotation_marks_are_those_that_were_written(delimiter, mark):
    rows = [(k / 64, -1.5 * k / 1024, 17.25 + k) for k in range(30)]
    written = io.StringIO()
    out = csv.writer(written, delimiter=delimiter, quoting=csv.QUOTE_ALL)
    out.writerows([("t", "theta", "x"), *((f"{v:.12g}".replace(".", mark) for v in row) for row in rows)])
    seen = record(written.getvalue())
    assert np.array_equal(np.c_[seen.t, seen["theta"], seen["x"]], rows)


def test_a_comma_in_quotation_marks_that_may_part_thousands_is_refused():
    assert "3 columns below, got 2" in refusal('t,x\n0,"1,234"\n1,"1,235"\n2,"1,236"\n')
