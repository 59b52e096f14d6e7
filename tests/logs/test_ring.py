"""Does memory that two processes share hand over every row and event once, in order, and nothing that is torn?"""

from __future__ import annotations

import mmap

import pytest

from upright.logs.header import LogColumn
from upright.logs.ring import EVENTS_LOST, FULL, HEAD, NUMBER, TAIL, UNFIT, Ring

COLUMNS = (LogColumn("t", "s"), LogColumn("tick", "1", True))


@pytest.fixture
def pair():
    """A ring of four rows as its writer and as its reader see it, and their memory."""
    memory = mmap.mmap(-1, Ring.size(len(COLUMNS), 4))
    return Ring(memory, COLUMNS, 4), Ring(memory, COLUMNS, 4), memory


def put(ring, *numbers):
    return [ring.put((0.5 * n, -n)) for n in numbers]


def test_four_rows_find_a_place_and_come_back_in_order(pair):
    writer, reader, _ = pair
    assert put(writer, 1, 2, 3, 4, 5) == ["", "", "", "", FULL]
    assert list(reader.take(10)) == [(0, 0.5, -1), (1, 1.0, -2), (2, 1.5, -3), (3, 2.0, -4)]
    assert list(reader.take(10)) == []
    # the row that was dropped has a number, which is missing afterwards
    assert put(writer, 6) == [""]
    assert list(reader.take(10)) == [(5, 3.0, -6)]
    assert [writer.marks[n] for n in (HEAD, TAIL, NUMBER)] == [5, 5, 6]


def test_places_are_used_again_round_after_round(pair):
    writer, reader, _ = pair
    seen = []
    for n in range(30):
        assert put(writer, 2 * n, 2 * n + 1) == ["", ""]
        seen += [row[2] for row in reader.take(10)]
    assert seen == [-n for n in range(60)]


def test_no_more_rows_are_taken_than_asked_for_and_the_last_is_kept_until_the_next_is(pair):
    writer, reader, _ = pair
    put(writer, 1, 2, 3)
    assert [row[0] for row in reader.take(2)] == [0, 1]
    rows = reader.take(5)
    assert next(rows)[0] == 2
    assert reader.marks[TAIL] == 2  # whoever writes it to the file may still fail
    assert next(rows, None) is None
    assert reader.marks[TAIL] == 3


@pytest.mark.parametrize("row", [(1.0,), (1.0, 2, 3), (1.0, 2.5), ("a", 2), (1.0, 2**63), (None, 1)])
def test_a_row_that_does_not_fit_the_columns_is_told_and_takes_no_place(pair, row):
    writer, reader, _ = pair
    assert writer.put(row) == UNFIT
    assert (writer.marks[HEAD], writer.marks[NUMBER]) == (0, 1)
    assert put(writer, 7) == [""]
    assert [r[0] for r in reader.take(9)] == [1]


def test_a_row_is_not_given_before_all_of_it_can_be_seen(pair):
    """Each byte of a row, its number and its checksum: 8 for the number, 8 for each column, 4 for the check."""
    writer, reader, memory = pair
    before = bytes(memory)
    put(writer, 3)
    after = bytes(memory)
    changed = [i for i, (a, b) in enumerate(zip(before, after, strict=True)) if a != b and i >= 1024]
    for at in changed:
        memory[at] = before[at]
        assert list(reader.take(1)) == []
        memory[at] = after[at]
    assert list(reader.take(1)) == [(0, 1.5, -3)]


def test_sixty_four_events_find_a_place_and_the_next_ones_are_counted(pair):
    writer, reader, _ = pair
    told = [writer.put_event(b"event %d" % n) for n in range(66)]
    assert told == [True] * 64 + [False] * 2
    assert writer.marks[EVENTS_LOST] == 2
    assert list(reader.take_events()) == [b"event %d" % n for n in range(64)]
    for n in range(200):
        assert writer.put_event(b"%d" % n * 3)
        assert list(reader.take_events()) == [b"%d" % n * 3]


def test_a_long_event_is_cut_to_its_place_and_spoils_no_other(pair):
    writer, reader, _ = pair
    put(writer, 1)
    for letter in b"abc":
        assert writer.put_event(bytes([letter]) * 5000)
    cut = list(reader.take_events())
    assert cut == [bytes([letter]) * 1016 for letter in b"abc"]  # 1024 less length and checksum
    assert list(reader.take(1)) == [(0, 0.5, -1)]


def test_an_event_is_not_given_before_all_of_it_can_be_seen(pair):
    writer, reader, memory = pair
    writer.put_event(b"fault")
    at = bytes(memory).rindex(b"fault")
    memory[at] = 0
    assert list(reader.take_events()) == []
    memory[at] = ord("f")
    assert list(reader.take_events()) == [b"fault"]


def test_a_sentence_reaches_the_other_side_cut_to_its_place(pair):
    writer, reader, memory = pair
    assert reader.message() == ""
    writer.say("The disk is full: ä.")
    assert reader.message() == "The disk is full: ä."
    put(writer, 1)
    writer.say("x" * 2000)
    assert reader.message() == "x" * 888  # up to the first row: 1024 less 128 and 8
    assert list(reader.take(1)) == [(0, 0.5, -1)]
    memory[200] = 0
    assert reader.message() == ""


def test_the_last_event_s_place_lies_within_the_memory():
    memory = mmap.mmap(-1, Ring.size(2, 1))
    ring = Ring(memory, COLUMNS, 1)
    for _ in range(64):
        ring.put_event(b"e" * 2000)
    assert [len(e) for e in ring.take_events()] == [1016] * 64
    assert len(memory) == Ring.size(2, 1)
