"""Do frames survive any wire, and does nothing else pass for one?"""

from __future__ import annotations

import re
import struct
import tracemalloc
import zlib
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from upright.errors import BadInput
from upright.rigs import Fault, Mode
from upright.rigs.protocol import LONGEST_PULSE
from upright.rigs.wire import (
    LONGEST,
    PROTOCOL,
    Kind,
    LimitsOnWire,
    Packet,
    Parser,
    Result,
    cobs,
    exchange,
    from_cobs,
    hello,
    limits,
    pack,
    sample,
    self_test_body,
    snapshot,
    status,
    unpack,
)

BODIES = st.binary(max_size=LONGEST - 4)
BYTE, SESSION = st.integers(0, 255), st.integers(0, 2**16 - 1)


@pytest.mark.parametrize(
    ("data", "stuffed"),
    [  # the examples of S. Cheshire, M. Baker: Consistent Overhead Byte Stuffing, as every description has them
        (b"\x00", "0101"),
        (b"\x00\x00", "010101"),
        (b"\x00\x11\x00", "01021101"),
        (b"\x11\x22\x00\x33", "0311220233"),
        (b"\x11\x22\x33\x44", "0511223344"),
        (b"\x11\x00\x00\x00", "0211010101"),
        (bytes(range(1, 254)), "fe" + bytes(range(1, 254)).hex()),
    ],
)
def test_zeros_are_stuffed_as_published(data, stuffed):
    assert cobs(data).hex() == stuffed
    assert from_cobs(bytes.fromhex(stuffed)) == data


def test_the_crc_is_the_one_whose_check_value_is_published():
    # CRC-32/ISO-HDLC of "123456789" is cbf43926 in every catalogue
    frame = pack(ord("1"), ord("2"), int.from_bytes(b"34", "little"), b"56789")
    assert from_cobs(frame[1:-1]) == b"123456789" + bytes.fromhex("2639f4cb")


@given(kind=BYTE, sequence=BYTE, session=SESSION, body=BODIES)
def test_a_frame_comes_back_as_it_went(kind, sequence, session, body):
    frame = pack(kind, sequence, session, body)
    assert frame[0] == frame[-1] == 0
    assert 0 not in frame[1:-1]
    assert len(frame) == 1 + (1 + 4 + len(body) + 4) + 1
    assert Parser().feed(frame) == [(kind, sequence, session, body)]


@given(noise=st.binary(min_size=1, max_size=3), body=BODIES)
def test_noise_between_two_frames_costs_neither(noise, body):
    """What stood between them until version 1 took the next frame with it, an ESTOP too."""
    first, second = pack(7, 1, 5, body), pack(Kind.ESTOP, 2)
    assert Parser().feed(first + noise + second) == [(7, 1, 5, body), (Kind.ESTOP, 2, 0, b"")]


@given(
    bodies=st.lists(BODIES, max_size=4), noise=st.lists(st.binary(max_size=600), max_size=5), chunk=st.integers(1, 70)
)
@settings(max_examples=150)
def test_garbage_costs_no_frame_after_it_and_never_raises(bodies, noise, chunk):
    stream, expected = b"", []
    for k, body in enumerate(bodies):
        garbage = noise[k] if k < len(noise) else b""
        stream += garbage + pack(7, k, 1, body)
        # garbage may hold sound frames of its own, by chance or by hypothesis
        expected += [f for part in garbage.split(b"\0") if (f := unpack(part)) is not None] + [(7, k, 1, body)]
    whole, parser = Parser(), Parser()
    at_once = whole.feed(stream)
    assert at_once == expected
    assert [f for k in range(0, len(stream), chunk) for f in parser.feed(stream[k : k + chunk])] == at_once
    assert parser.dropped == whole.dropped


@given(st.binary(max_size=400))
def test_no_bytes_are_refused_but_as_no_frame(data):
    frame = unpack(data)
    assert frame is None or pack(*frame) == b"\0" + data + b"\0"
    assert from_cobs(data) is None or isinstance(from_cobs(data), bytes)


def test_no_frame_with_a_flipped_bit_or_a_burst_passes():
    frame = pack(0x87, 12, 0x1234, bytes(range(0, 250, 11)))
    spoiled = [
        frame[:at] + bytes([frame[at] ^ mask]) + frame[at + 1 :]
        for at in range(1, len(frame))
        for mask in range(1, 256)
    ]
    spoiled += [frame[:at] + b"\0\0\0" + frame[at + 3 :] for at in range(1, len(frame) - 3)]
    spoiled += [frame[:at] + frame[at + 1 :] for at in range(1, len(frame) - 1)]
    for stream in spoiled:
        parser = Parser()
        assert parser.feed(stream + b"\0") == []
        assert parser.dropped >= 1
        assert parser.feed(frame) == [(0x87, 12, 0x1234, frame_body(frame))]


def frame_body(frame: bytes) -> bytes:
    payload = from_cobs(frame[1:-1])
    assert payload is not None
    assert zlib.crc32(payload[:-4]).to_bytes(4, "little") == payload[-4:]
    return payload[4:-4]


def test_a_stream_without_an_end_takes_no_room():
    """Of 4 MB without a zero nothing is kept: there is room for what is fed at once and copies of it, and no more."""
    parser, part = Parser(), b"x" * 4096
    tracemalloc.start()
    try:
        for _ in range(1000):
            assert parser.feed(part) == []
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 10 * len(part)
    assert parser.feed(pack(1, 2, 0, b"on")) == [(1, 2, 0, b"on")]
    assert parser.dropped == 1


@pytest.mark.parametrize("chunk", [1, 100, 1000])
def test_the_longest_frame_passes_and_one_byte_more_does_not(chunk):
    """With its head 246 bytes make `LONGEST`; one byte more is stuffed and summed without a flaw, and too long."""

    def fed(payload):
        frame = cobs(payload + zlib.crc32(payload).to_bytes(4, "little")) + b"\0"
        parser = Parser()
        frames = [f for k in range(0, len(frame), chunk) for f in parser.feed(frame[k : k + chunk])]
        return frames, parser.dropped

    longest = bytes([7, 1, 5, 0]) + bytes(range(1, 247))
    assert len(longest) == LONGEST
    assert fed(longest) == ([(7, 1, 5, longest[4:])], 0)
    # zeros within, so that the blocks of COBS stay short of the 254 bytes that they can have
    assert fed(longest[:100] + b"\0" + longest[100:]) == ([], 1)


def test_a_frame_after_an_endless_one_is_not_taken_for_its_end():
    parser = Parser()
    assert parser.feed(b"x" * 300) == []
    assert parser.feed(pack(1, 3, 0, b"on")) == [(1, 3, 0, b"on")]  # the zero in front of it ends the endless one
    assert parser.dropped == 1


def status_bytes(result, mode, faults, tick):
    return bytes([result, mode, *faults.to_bytes(2, "little"), *tick.to_bytes(4, "little")])


def test_a_status_is_read_as_docs_firmware_md_has_it():
    read = status(status_bytes(4, 2, 1 + 64, 70_000) + b"more")
    assert read == ((Result.NOT_CONFIGURED, Mode.HOST, Fault.WATCHDOG | Fault.ENCODER, 70_000), b"more")


@pytest.mark.parametrize(
    "body",
    [b"", b"\0" * 7, status_bytes(9, 0, 0, 0), status_bytes(0, 5, 0, 0)],
    ids=["none", "short", "result", "mode"],
)
def test_a_status_of_another_program_is_none(body):
    assert status(body) is None


def test_numbers_go_with_the_least_byte_first_and_ticks_run_over():
    assert exchange(1.5, 0x12345).hex() == "0000c03f" + "45230100"  # 1.5 is 3fc00000
    assert self_test_body(-300, 150).hex() == "d4fe" + "9600"
    assert sample(bytes.fromhex("0a00" + "01000000" + "ffffffff" + "feff")) == (10, (1, -1), -2)


def test_limits_come_back_as_they_went():
    numbers = list(range(1, 11))
    body = (
        b"".join(n.to_bytes(4, "little") for n in numbers) + (20).to_bytes(2, "little") + (32767).to_bytes(2, "little")
    )
    held = limits(body)
    assert (held.travel, held.speed, held.start, held.frozen) == ((1, 2), (3, 4), (5, 6), (7, 8))
    assert (held.twist, held.saturation, held.watchdog, held.command) == (9, 10, 20, 32767)
    assert held.body() == body


@pytest.mark.parametrize(
    ("field", "changed"), [("travel", (1, 1)), ("speed", (3, 3)), ("command", 9), ("frozen", (6, 8))]
)
def test_limits_are_within_others_when_none_is_wider(field, changed):
    given = LimitsOnWire(travel=(1, 2), speed=(3, 4), start=(5, 6), frozen=(7, 8), twist=9, saturation=10, watchdog=20,
                         command=10)  # fmt: skip
    narrower = replace(given, **{field: changed})
    assert given.within(given)
    assert narrower.within(given)
    assert not given.within(narrower)
    assert not replace(given, frozen=(0, 8)).within(given)  # 0 looks at nothing


def test_what_no_frame_can_hold_is_refused():
    with pytest.raises(BadInput, match="246 bytes"):
        pack(1, 1, 0, bytes(LONGEST - 3))


HEADER = (Path(__file__).parents[2] / "firmware" / "rig.h").read_text(encoding="utf-8")


def enumerated(name):
    """Numbers of an enum of the firmware's header, as a compiler gives them."""
    text = re.search(rf"enum {name} \{{(.*?)\}};", HEADER, re.DOTALL)[1]
    out, following = {}, 0
    for entry in filter(None, (part.strip() for part in text.split(","))):
        word, _, value = entry.partition("=")
        out[word.strip()] = following = int(value, 0) if value else following
        following += 1
    return out


def test_modes_faults_requests_and_results_have_the_numbers_of_the_firmware():
    assert enumerated("mode") == {m.name: m.value for m in Mode}
    assert enumerated("result") == {r.name: r.value for r in Result}
    assert enumerated("request") == {k.name: k.value for k in Kind} | {"REPLY": 0x80}
    faults = {word.removeprefix("F_"): number for word, number in enumerated("fault").items()}
    ours = {f.name: f.value for f in Fault}
    assert faults == {name: ours[name] for name in faults}
    # one bit each, those of the host alone too
    assert sorted(ours.values()) == [1 << k for k in range(len(ours))]
    assert Packet(Kind.ARM + 0x80, 0, 0, b"").answers(Kind.ARM)
    assert not Packet(Kind.ARM, 0, 0, b"").answers(Kind.ARM)
    assert f"#define PROTOCOL {PROTOCOL}\n" in HEADER
    assert f"#define LONGEST_PULSE {round(1e6 * LONGEST_PULSE)} " in HEADER


def test_a_greeting_and_a_snapshot_are_read_field_by_field():
    greeting = hello(
        bytes([1, 1, 2, 8, 3]) + (1000).to_bytes(2, "little") + (32767).to_bytes(2, "little") + b"\4\3\2\1bench"
    )
    assert greeting == (1, True, 2, 8, 3, 1000, 32767, 0x01020304, "bench")
    body = struct.pack("<BHI", 2, 64, 70_000) + struct.pack("<Hiih", 10, 1, -2, -3) + struct.pack(
        "<iihHH", 4, -5, -6, 7, 8
    )  # fmt: skip
    assert snapshot(body) == (Mode.HOST, Fault.ENCODER, 70_000, (10, (1, -2), -3), (4, -5), -6, 7, 8)
