"""Is each topic of a bag read on its own clock, and is damage named by its line and its column?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.formats.rosbag import READER
from upright.readers.source import Source
from upright.records import Record


def source(*lines: str) -> Source:
    return Source(file="bag.csv", data=("\n".join(lines) + "\n").encode())


def record(*lines: str) -> Record:
    return read_source(source(*lines), reader="ros-bag")


def refusal(*lines: str) -> str:
    with pytest.raises(BadInput) as caught:
        record(*lines)
    return str(caught.value)


@pytest.mark.parametrize(
    ("line", "bag"),
    [
        ("__time,/a/x", True), ("/a/header/stamp, /a/x", True), ("/a/x,/b/header/stamp", True), ("t,x", False),
        ("/a/header/stamps,x", False), ("1,__time", False),
    ],
)  # fmt: skip
def test_a_bag_has_a_receive_time_or_a_stamp(line, bag):
    assert READER.recognises(source(line, "1,2")) is bag


HEAD = "__time,/j/header/stamp,/j/a,/cmd/u,/mode/m"
ROWS = ("100.5,100.0,1,,", "100.6,,,7,", "101.5,101.0,2,,", "101.6,,,,4", "102.5,102.0,3,,", "102.7,,,9,")


def test_topics_are_held_from_message_to_message_on_the_stamps_of_the_busiest():
    found = record(HEAD, *ROWS)
    np.testing.assert_allclose(found.t, [0, 1, 2], atol=1e-9)
    assert found.names == ("__time", "/j/a", "/cmd/u", "/mode/m")
    np.testing.assert_allclose(found["__time"], [0.5, 1.5, 2.5], atol=1e-9)
    assert found.units["__time"] == "s"
    np.testing.assert_array_equal(found["/j/a"], [1, 2, 3])
    # received 0.6 s after the first stamp, so not before its second
    np.testing.assert_array_equal(found["/cmd/u"], [0, 7, 7])
    np.testing.assert_array_equal(found["/mode/m"], [0, 0, 4])
    notes = found.provenance.notes
    assert "Time is '/j/header/stamp' counted from its first message, epoch 100.000000 s." in notes
    assert "Held from message to message, 0 before the first: /cmd/u, /mode/m." in notes


def test_a_stamp_goes_before_more_rows_without_one():
    found = record("__time,/j/header/stamp,/j/a,/c/u", "1,1.0,5,", "2,,,6", "3,,,7", "4,,,8", "5,5.0,6,")
    np.testing.assert_allclose(found.t, [0, 4], atol=1e-9)


def test_without_any_stamp_the_busiest_topic_has_the_time_it_was_received_at():
    found = record("__time,/a/x,/b/y,/c/z", "10,1,,", "12,,5,", "13,2,,", "14,3,,")
    np.testing.assert_allclose(found.t, [0, 3, 4], atol=1e-9)
    assert found.names == ("/a/x", "/b/y")
    np.testing.assert_array_equal(found["/b/y"], [0, 5, 5])
    assert "Empty column '/c/z' left out." in found.provenance.notes


@pytest.mark.parametrize(
    ("moves", "said"),
    [
        ([0, 0, 1, 2, 3, 4], "The rig moves at 0.04 s, before the first command of '/c/u' at 0.1 s: an earlier"),
        ([0, 0, 0.07, 2, 3, 4], ""),  # by 1.75 % of its range is none; 0.04 s before is no sign
        ([0, 0, 0.09, 2, 3, 4], "The rig moves at 0.04 s"),
        ([5, 5, 6, 7, 8, 9], "The rig moves at 0.04 s"),  # wherever it began
        ([0, 0, 0, 0, 0, 0], ""),
    ],
)  # fmt: skip
def test_motion_more_than_50_ms_before_the_first_command_is_told(moves, said):
    lines = ["__time,/j/header/stamp,/j/a,/c/u"]
    for k, x in enumerate(moves):
        lines.append(f"{0.02 * k + 0.001:.6f},{0.02 * k:.6f},{x},")
        if k == 4:
            lines.append(f"{0.02 * k + 0.002:.6f},,,3")
    notes = record(*lines).provenance.notes
    assert any(note.startswith(said) for note in notes if note.startswith("The rig")) is bool(said)


A = "line 4, column 3 (/j/a): expected a finite number, got "
STAMP = "line 4, column 2 (/j/header/stamp): "


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        ((HEAD, *ROWS[:2], "101.5,101.0,x,,", *ROWS[3:]), A + "something else: 'x'"),
        ((HEAD, *ROWS[:2], "101.5,101.0,1e31,,", *ROWS[3:]), A + "a number too large"),
        ((HEAD, *ROWS[:2], "101.5,,2,,", *ROWS[3:]), STAMP + "expected a value, the message has others"),
        ((HEAD, *ROWS[:2], "101.5,101.0,,,", *ROWS[3:]), "line 4, column 3 (/j/a): expected a value"),
        ((HEAD, *ROWS[:2], ",101.0,2,,", *ROWS[3:]), "line 4, column 1 (__time): expected a receive time on every row"),
        ((HEAD, *ROWS[:2], "101.5,99.0,2,,", *ROWS[3:]), STAMP + "time must increase from message to message"),
        ((HEAD, *ROWS[:2], "101.5,100.0,2,,", *ROWS[3:]), STAMP + "time must increase"),
        ((HEAD, *ROWS[:5], "100.55,,,9,"), "line 7, column 1 (__time): time must increase"),
        ((HEAD, *ROWS[:2], "101.5,101.0,2,", *ROWS[3:]), "line 4: expected 5 cells, got 4; mend the row"),
        ((HEAD, *ROWS[:5], "102.7,,,9"), "line 7: expected 5 cells, got 4; the last row is torn"),
        (("__time,/a/x,/a/x", "1,2,3", "2,3,4"), "line 1, column 3 (/a/x): expected a different name for each column"),
        (("__time,,/a/x", "1,2,3", "2,3,4"), "line 1, column 2: expected a different name"),
        ((HEAD, ROWS[0]), "line 2: expected at least 2 messages under the line of names"),
        ((HEAD, ROWS[0], ROWS[1]), "line 2: expected at least 2 messages of one topic"),
        (("__time,/a/x", "1,", "2,"), "line 1: expected columns beside the time, got none with a value"),
    ],
)  # fmt: skip
def test_damage_is_named_by_line_and_column(lines, sentence):
    assert sentence in refusal(*lines)
