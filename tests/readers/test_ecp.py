"""Is an ECP export told from other texts, and is its damage named by its line?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers.formats.ecp import READER, read
from upright.readers.source import Source

HEAD = " Sample   Time     Commanded Pos   Encoder 1 Pos   Control Effort"


def source(text: str) -> Source:
    return Source(file="log.txt", data=text.encode())


@pytest.mark.parametrize(
    ("text", "ecp"),
    [
        (HEAD, True), ("Sample  Time", True), ("Sample Time", False), ("\n\nSample  Time\n", True),
        ("Sample  Timer", False),
        ("a\n [0 1;", True), ("a\n" * 11 + "[0", True), ("a\n" * 12 + "[0", False), ("x" * 4000 + "\n[", False),
        ("", False),
    ],
)  # fmt: skip
def test_an_export_is_known_by_its_names_or_its_bracket(text, ecp):
    assert READER.recognises(source(text)) is ecp


ROWS = ["[ 0 0.000 0 5 0.5000;", "  1 0.009 3 6 0.2500;", "  2 0.018 6 7 0.1250]"]


def export(*rows: str, head: str = HEAD) -> str:
    return "\n".join([head, "", *rows]) + "\n"


def test_columns_go_by_their_names_and_positions_are_counts():
    found = read(source(export(*ROWS)))
    assert found.names == ("Sample", "Commanded Pos", "Encoder 1 Pos", "Control Effort")
    assert found.units == {
        "Sample": "1", "Commanded Pos": "counts", "Encoder 1 Pos": "counts", "Control Effort": "V",
    }  # fmt: skip
    np.testing.assert_allclose(found.t, [0, 0.009, 0.018])
    np.testing.assert_array_equal(found["Encoder 1 Pos"], [5, 6, 7])
    np.testing.assert_array_equal(found["Control Effort"], [0.5, 0.25, 0.125])
    tabs = read(source(export(*ROWS, head=HEAD.strip().replace("   ", "\t"))))
    assert tabs.names == found.names
    blank = read(source("\n" + export(ROWS[0], "", *ROWS[1:], "", "")))
    np.testing.assert_array_equal(blank["Sample"], [0, 1, 2])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("\n".join(ROWS), "line 1: expected a line of column names before the '['"),
        (
            export(*ROWS, head="Sample  Clock  a  b  c"),
            "line 1: expected the column names of an ECP export with 'Time'",
        ),
        (export(*ROWS, head="No  Time  a  b  c"), "with 'Sample', got 'No  Time  a  b  c'"),
        (
            export(*ROWS, head="Sample  Time  a  b  a"),
            "line 1: expected a different name for each column, got one twice",
        ),
        (HEAD + "\n", "line 2: expected the matrix to begin with '['"),
        (export(ROWS[1], ROWS[2]), "line 3: expected the matrix to begin with '['"),
        (export(ROWS[0], ROWS[1][:-1], ROWS[2]), "line 4, column 20: expected ';' at the end of the row"),
        (export(ROWS[0], ROWS[1]), "line 4, column 21: expected ']' at the end of the last row; the file is cut short"),
        (
            export(ROWS[0], "  1 0.000 3 6 0.25;", ROWS[2]),
            "line 4: Time must increase from row to row, got 0 s after 0 s",
        ),
        (
            export(ROWS[0], "  0 0.009 3 6 0.25;", ROWS[2]),
            "line 4: Sample must increase from row to row, got 0 after 0",
        ),
        (export(ROWS[0], "  1 0.009 x 6 0.25;", ROWS[2]), "line 4, column 3 (Commanded Pos): expected a finite number"),
    ],
)
def test_damage_is_named_by_its_line(text, sentence):
    with pytest.raises(BadInput) as caught:
        read(source(text))
    assert sentence in str(caught.value)
