"""Is a file of MCAP read as far as it is right, and no byte farther?"""

from __future__ import annotations

import struct
import zlib

import pytest

from tests.logs.runs import written
from upright.logs.container import Container, Cursor, Damaged, summary_fault

WHOLE = written(250)
FRAME = 9  # opcode and length before each record


def records(data):
    """Where each record begins, its kind and its length, as the format says: 8 bytes of magic, then one by one."""
    at, found = 8, []
    while at + FRAME <= len(data) - 8:
        kind, length = struct.unpack_from("<BQ", data, at)
        found.append((at, kind, length))
        at += FRAME + length
    return found


RECORDS = records(WHOLE)
END = next(at for at, kind, _ in RECORDS if kind == 0x0F)  # the end of the data
SUMMARY = END + FRAME + 4


def test_fields_are_little_endian_and_never_run_past_their_record():
    cursor = Cursor(b"\x01\x02\x00\x03\x00\x00\x00abc\x01")
    assert cursor.number("B") == 1
    assert cursor.number("H") == 2
    assert cursor.text() == "abc"
    assert cursor.at == 10
    assert cursor.bytes(1) == b"\x01"
    with pytest.raises(ValueError, match="past the end"):
        cursor.bytes(1)
    assert Cursor(b"").bytes(0) == b""


def test_pairs_of_texts_end_where_their_length_says():
    def text(word):
        return struct.pack("<I", len(word)) + word

    pairs = text(b"a") + text(b"one") + text(b"b") + text(b"two")
    cursor = Cursor(struct.pack("<I", len(pairs)) + pairs + text(b"more"))
    assert cursor.texts() == {"a": "one", "b": "two"}
    assert cursor.text() == "more"


def test_every_message_is_read_once_in_order_whether_the_file_grows_or_not():
    container = Container()
    rows = [m for chunk in container.read(WHOLE) for m in chunk]
    samples = [m.number for m in rows if m.topic == "/samples"]
    assert samples == list(range(250))
    assert container.ended
    assert container.at == SUMMARY
    assert container.count() == len(rows) == 251
    assert not container.lost
    assert {"rig", "law", "log"} <= set(container.texts)
    # the same, a few bytes at a time: what is not whole yet is waited for
    growing, found = Container(), []
    for end in range(0, len(WHOLE), 97):
        found += [m for chunk in growing.read(WHOLE[growing.at : end]) for m in chunk]
    found += [m for chunk in growing.read(WHOLE[growing.at :]) for m in chunk]
    assert [(m.topic, m.number, m.content) for m in found] == [(m.topic, m.number, m.content) for m in rows]
    assert (growing.at, growing.ended) == (SUMMARY, True)


@pytest.mark.parametrize("n", [0, 3, 7, 8])
def test_the_first_bytes_alone_are_no_damage(n):
    container = Container()
    assert list(container.read(WHOLE[:n])) == []
    assert container.at == (8 if n == 8 else 0)


def test_a_record_is_judged_as_soon_as_its_kind_and_length_are_there():
    wrong = WHOLE[:8] + struct.pack("<BQ", 0x0C, 40)  # metadata before the header
    assert list(Container().read(wrong[:-1])) == []
    with pytest.raises(Damaged, match="0x0c and 40 bytes") as found:
        list(Container().read(wrong))
    assert found.value.at == 8


def test_another_beginning_is_a_damage_at_the_first_byte():
    with pytest.raises(Damaged, match="no MCAP file begins like this") as found:
        list(Container().read(b"\x89MCAP1\r\n"))
    assert found.value.at == 0


def test_the_end_of_the_data_is_the_last_that_is_read():
    container = Container()
    list(container.read(WHOLE[:SUMMARY] + b"\xff" * 100))
    assert (container.at, container.ended) == (SUMMARY, True)


@pytest.mark.parametrize(
    ("which", "kind", "length", "said"),
    [
        (0, 0x0C, None, "record of kind 0x0c and"),  # metadata before the header
        (1, 0x01, None, "record of kind 0x01 and"),  # a second header
        (1, 0x02, None, "record of kind 0x02 and"),  # the footer
        (-1, 0x0F, 5, "kind 0x0f and 5 bytes"),  # the end of the data is a checksum
    ],
)
def test_a_record_out_of_its_place_ends_the_reading_there(which, kind, length, said):
    at = END if which == -1 else RECORDS[which][0]
    data = bytearray(WHOLE)
    data[at] = kind
    if length is not None:
        data[at + 1 : at + FRAME] = struct.pack("<Q", length)
    container = Container()
    with pytest.raises(Damaged, match=said) as found:
        list(container.read(bytes(data)))
    assert found.value.at == container.at == at


def test_an_end_that_is_cut_is_waited_for():
    container = Container()
    list(container.read(WHOLE[: SUMMARY - 1]))
    assert (container.at, container.ended) == (END, False)


def test_the_summary_of_a_whole_file_has_no_fault():
    assert summary_fault(WHOLE, SUMMARY, 251) == ""


def test_a_summary_that_counts_others_says_both():
    assert summary_fault(WHOLE, SUMMARY, 250) == "its summary counts 251 messages, and 250 are there"


@pytest.mark.parametrize("cut", [1, 8, 30])
def test_a_summary_that_ends_early_is_torn(cut):
    assert summary_fault(WHOLE[:-cut], SUMMARY, 251) == "its summary is torn"
    assert summary_fault(WHOLE[:-1] + b"x", SUMMARY, 251) == "its summary is torn"
    assert summary_fault(WHOLE[:SUMMARY], SUMMARY, 251) == "its summary is torn"


@pytest.mark.parametrize(
    "at", [SUMMARY, SUMMARY + 20, len(WHOLE) - 37, len(WHOLE) - 36, len(WHOLE) - 28, len(WHOLE) - 9]
)
def test_a_changed_byte_of_the_summary_or_its_footer_is_a_damage(at):
    data = bytearray(WHOLE)
    data[at] ^= 1
    assert summary_fault(bytes(data), SUMMARY, 251) == "its summary is damaged"
    assert summary_fault(WHOLE, SUMMARY - 1, 251) == "its summary is damaged"


def footed(summary: bytes, start: int) -> bytes:
    """A file of nothing but a summary and its footer, as the format has them."""
    footer = struct.pack("<BQQQ", 0x02, 20, start, 0)
    return summary + footer + struct.pack("<I", zlib.crc32(summary + footer)) + b"\x89MCAP0\r\n"


def test_a_count_is_found_behind_other_records_and_missed_where_there_is_none():
    other = struct.pack("<BQ", 0x03, 5) + b"hello"
    counted = struct.pack("<BQQ", 0x0B, 8, 7)
    assert summary_fault(footed(other + counted, 0), 0, 7) == ""
    assert summary_fault(footed(other, 0), 0, 7) == "its summary counts no messages, and 7 are there"
    assert summary_fault(footed(b"", 0), 0, 7) == "its summary counts no messages, and 7 are there"
