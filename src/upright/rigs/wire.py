"""Frames between a host and the firmware: packed, checked, and taken apart again from whatever comes over a wire.

``0x00 COBS(kind u8 | sequence u8 | session u16 | body | CRC32) 0x00``, least byte first, with the CRC32 of `zlib`: a
zero byte stands before and behind a frame and nowhere else, so that a reader finds its place again after any garbage,
and noise between two frames costs neither. A request is answered by a frame of its kind plus 0x80 and its sequence
number. Every reply begins with a `Status`.

The session is the board's: its answer to `Kind.HELLO` begins one with a number that no earlier frame names, and every
request that it does, and every fault, counts it on. A request has to name it, but for those that stop (STOP, ESTOP),
look (SNAPSHOT) or greet: what was asked once and is heard again, out of a buffer or from somebody who recorded it, is
not done again.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from upright.errors import BadInput
from upright.rigs.protocol import Fault, Mode

PROTOCOL = 2
"""Version that both ends must speak."""
LONGEST = 250
"""Bytes of kind, sequence, session and body together; with the CRC that is one block of COBS."""
NO_LIMIT = 0x7FFFFFFF
"""Of a coordinate that may do what it likes."""
FOREVER = 0xFFFFFFFF
CHANNELS = 2
"""Encoders of the firmware."""
MOST = 32767
"""Largest command [steps]; of a converter of 16 bits one less than it has to either side."""
_CRC = struct.Struct("<I")
_HEAD = struct.Struct("<BBH")
_REPLY = 0x80


class Kind(IntEnum):
    """What a host asks for."""

    HELLO = 1
    CONFIGURE = 2
    ZERO = 3
    SELF_TEST = 4
    ARM = 5
    START = 6
    EXCHANGE = 7
    STOP = 8
    ESTOP = 9
    CLEAR = 10
    LAW = 11
    SNAPSHOT = 12


class Result(IntEnum):
    """How the firmware answers."""

    DONE = 0
    WRONG_LENGTH = 1
    WRONG_MODE = 2
    WRONG_VALUE = 3
    NOT_CONFIGURED = 4
    FAULTED = 5
    OFF_START = 6
    UNKNOWN = 7
    WRONG_SESSION = 8


class Packet(NamedTuple):
    """One sound frame."""

    kind: int
    sequence: int
    session: int
    body: bytes

    def answers(self, kind: Kind) -> bool:
        """Whether it is the reply to a request of that kind."""
        return self.kind == kind | _REPLY


def cobs(data: bytes) -> bytes:
    """Bytes free of zeros, fewer than 254 of them taken apart at theirs; one byte longer."""
    return b"".join(bytes([len(block) + 1]) + block for block in data.split(b"\0"))


def from_cobs(data: bytes) -> bytes | None:
    """What was made free of zeros, or None when that cannot have been it."""
    out, at = bytearray(), 0
    while at < len(data):
        code = data[at]
        if code == 0 or at + code > len(data):
            return None
        out += data[at + 1 : at + code]
        at += code
        if code < 0xFF and at < len(data):
            out.append(0)
    return bytes(out)


def pack(kind: int, sequence: int, session: int = 0, body: bytes = b"") -> bytes:
    """Frame as it goes over the wire."""
    payload = _HEAD.pack(kind, sequence & 0xFF, session) + body
    if len(payload) > LONGEST:
        raise BadInput(f"a frame holds up to {LONGEST - _HEAD.size} bytes, got {len(body)}.")
    return b"\0" + cobs(payload + _CRC.pack(zlib.crc32(payload))) + b"\0"


def unpack(stuffed: bytes) -> Packet | None:
    """What stands between two zeros, or None when it is no sound frame."""
    data = from_cobs(stuffed)
    if data is None or len(data) < _HEAD.size + _CRC.size:
        return None
    payload = data[: -_CRC.size]
    if _CRC.unpack_from(data, len(payload))[0] != zlib.crc32(payload):
        return None
    kind, sequence, session = _HEAD.unpack_from(payload)
    return Packet(kind, sequence, session, payload[_HEAD.size :])


class Parser:
    """Sound frames out of a stream of bytes, which may begin anywhere and hold anything.

    Attributes
    ----------
    dropped : int
        Stretches between zeros that were no sound frame.
    """

    def __init__(self) -> None:
        self.dropped = 0
        self._begun = bytearray()
        self._overlong = False

    def feed(self, data: bytes) -> list[Packet]:
        """Frames that these bytes complete, in their order."""
        frames: list[Packet] = []
        *ended, begun = data.split(b"\0")
        for part in ended:
            self._take(part)
            stuffed, overlong = bytes(self._begun), self._overlong
            self._begun.clear()
            self._overlong = False
            frame = None if overlong else unpack(stuffed)
            if frame is not None:
                frames.append(frame)
            elif stuffed or overlong:
                self.dropped += 1
        self._take(begun)
        return frames

    def _take(self, part: bytes) -> None:
        """More of a frame; of one that is too long nothing is kept."""
        self._begun += part
        if len(self._begun) > LONGEST + _CRC.size + 1:
            self._overlong = True
            self._begun.clear()


class Status(NamedTuple):
    """What every reply begins with."""

    result: Result
    mode: Mode
    faults: Fault
    tick: int


class Readout(NamedTuple):
    """What a tick saw and did: how late it began [us], counts since they were zeroed, command put out [steps]."""

    late: int
    counts: tuple[int, int]
    applied: int


class Hello(NamedTuple):
    """What the firmware says of itself; its tick's period in us, its converter's steps from zero to full scale, and the
    number that it was greeted with.
    """

    protocol: int
    virtual: bool
    channels: int
    speed_window: int
    reset_cause: int
    period: int
    steps: int
    nonce: int
    name: str


@dataclass(frozen=True, kw_only=True)
class LimitsOnWire:
    """Limits in counts, steps and ticks; speeds in counts per window of `Hello.speed_window` ticks."""

    travel: tuple[int, int]
    speed: tuple[int, int]
    start: tuple[int, int]
    frozen: tuple[int, int]
    twist: int
    saturation: int
    watchdog: int
    command: int

    def within(self, other: LimitsOnWire) -> bool:
        """Whether nothing is wider than in other limits."""
        mine, its = (_LIMITS.unpack(limits.body()) for limits in (self, other))
        frozen = all(0 < a <= b or a == b for a, b in zip(self.frozen, other.frozen, strict=True))  # 0 looks at nothing
        return frozen and all(a <= b for k, (a, b) in enumerate(zip(mine, its, strict=True)) if k not in (6, 7))

    def body(self) -> bytes:
        """As the firmware reads it."""
        return _LIMITS.pack(
            *self.travel, *self.speed, *self.start, *self.frozen, self.twist, self.saturation, self.watchdog,
            self.command,
        )  # fmt: skip


class Snapshot(NamedTuple):
    """How it was when the first fault since the last clearing came.

    `moved` are counts in the last speed window, `command` is the command before its limit [steps]; `lost` counts ticks
    that never came and `dropped` frames that the firmware threw away, since its reset.
    """

    mode: Mode
    faults: Fault
    tick: int
    sample: Readout
    moved: tuple[int, int]
    command: int
    lost: int
    dropped: int


_STATUS = struct.Struct("<BBHI")
_SAMPLE = struct.Struct("<Hiih")
_HELLO = struct.Struct("<BBBBBHHI")
_LIMITS = struct.Struct("<10IHh")
_EXCHANGE = struct.Struct("<fI")
_GREETING = struct.Struct("<BI")
_SELF_TEST = struct.Struct("<hH")
_SNAPSHOT_HEAD = struct.Struct("<BHI")
_SNAPSHOT_TAIL = struct.Struct("<iihHH")


def status(body: bytes) -> tuple[Status, bytes] | None:
    """Status of a reply and what follows it; None when another program must have written it."""
    try:
        result, mode, faults, tick = _STATUS.unpack_from(body)
        return Status(Result(result), Mode(mode), Fault(faults), tick), body[_STATUS.size :]
    except (struct.error, ValueError):
        return None


def sample(body: bytes) -> Readout:
    """Of a reply to `Kind.EXCHANGE`, after its status."""
    late, first, second, applied = _SAMPLE.unpack(body)
    return Readout(late, (first, second), applied)


def hello(body: bytes) -> Hello:
    """Of a reply to `Kind.HELLO`, after its status."""
    protocol, virtual, *numbers = _HELLO.unpack_from(body)
    return Hello(protocol, bool(virtual), *numbers, name=body[_HELLO.size :].decode("ascii", "replace"))


def limits(body: bytes) -> LimitsOnWire:
    """Of a reply to `Kind.CONFIGURE`, after its status."""
    n = _LIMITS.unpack(body)
    return LimitsOnWire(
        travel=n[0:2], speed=n[2:4], start=n[4:6], frozen=n[6:8], twist=n[8], saturation=n[9], watchdog=n[10],
        command=n[11],
    )  # fmt: skip


def snapshot(body: bytes) -> Snapshot:
    """Of a reply to `Kind.SNAPSHOT`, after its status."""
    mode, faults, tick = _SNAPSHOT_HEAD.unpack_from(body)
    at, end = _SNAPSHOT_HEAD.size, _SNAPSHOT_HEAD.size + _SAMPLE.size
    first, second, command, lost, dropped = _SNAPSHOT_TAIL.unpack_from(body, end)
    return Snapshot(Mode(mode), Fault(faults), tick, sample(body[at:end]), (first, second), command, lost, dropped)


def exchange(value: float, answers: int) -> bytes:
    """Body of `Kind.EXCHANGE`: command [steps], or reference [rad or m] of the board's own loop, and the tick of the
    sample that it answers.
    """
    return _EXCHANGE.pack(value, answers)


def greeting(every: int, nonce: int) -> bytes:
    """Body of `Kind.HELLO`: ticks from one answer to the next, and a number that the answer repeats."""
    return _GREETING.pack(every, nonce)


def self_test_body(pulse: int, ticks: int) -> bytes:
    """Body of `Kind.SELF_TEST`: command [steps] for some ticks."""
    return _SELF_TEST.pack(pulse, ticks)
