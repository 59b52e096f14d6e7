"""Does the host's end of the wire ask once, believe nothing unread, and turn commands into steps? No compiler needed.

The board is a line in Python that answers frame by frame, by a clock of its own: it goes on when nothing comes.
"""

from __future__ import annotations

import math
import struct
from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from upright.errors import BadInput, RigStopped
from upright.laws import Law
from upright.rigs import Fault, Limits, Mode
from upright.rigs.serial import SerialRig
from upright.rigs.wire import PROTOCOL, Kind, Parser, Result, pack

COUNTS, STEPS = 1000.0, 20_000
"""Counts per rad, and steps of the converter up to 10 V: 2000 steps are 1 V."""
LIMITS = Limits(travel=(2.0, 3.0), speed=(10.0, 10.0), start=(0.5, 0.5), command=5.0, watchdog=0.02)


class FakeBoard:
    """A `Line` to a board that ticks every ms; lists of what is to go wrong are used up request by request."""

    name = "nowhere"

    def __init__(self, protocol=PROTOCOL, virtual=False, period=1000):
        self.now, self.tick, self.mode, self.faults, self.late = 0.0, 100, Mode.FAULT, Fault.RESET, 0
        self.counts, self.applied = [0, 0], 0
        self.hello = struct.pack("<BBBBBHH", protocol, virtual, 2, 8, 0, period, STEPS)
        self.asked: list[tuple[Kind, int, bytes, float]] = []
        self.session, self.sessions = 0x0102, list[int]()
        self.lost: deque[bool] = deque()  # replies that do not come
        self.results: dict[Kind, Result] = {}
        self.alter = lambda kind, body: body
        self.before: list[bytes] = []  # comes before the next reply
        self.closed = 0
        self._parser, self._replies = Parser(), b""

    def write(self, data):
        for kind, sequence, session, body in self._parser.feed(data):
            self.asked.append((Kind(kind), sequence, body, self.now))
            self.sessions.append(session)
            reply = self._does(Kind(kind), body)
            if self.lost and self.lost.popleft():
                continue
            result = self.results.get(Kind(kind), Result.DONE)
            head = struct.pack("<BBHI", result, self.mode, self.faults, self.tick)
            self._replies += b"".join(self.before) + pack(kind | 0x80, sequence, self.session, head + reply)
            self.before = []

    def _does(self, kind, body):
        modes = {Kind.CLEAR: Mode.IDLE, Kind.ARM: Mode.ARMED, Kind.STOP: Mode.IDLE, Kind.ESTOP: Mode.FAULT}
        self.mode = Mode(body[0]) if kind == Kind.START else modes.get(kind, self.mode)
        self.faults = {Kind.CLEAR: Fault(0), Kind.ESTOP: self.faults | Fault.STOP}.get(kind, self.faults)
        if kind == Kind.HELLO:
            return self.hello + body[1:] + b"fake"
        if kind in (Kind.CONFIGURE, Kind.LAW):
            return self.alter(kind, body)
        if kind == Kind.EXCHANGE:
            self.tick += 1
            self.moves()
            return struct.pack("<Hiih", self.late, *self.counts, self.applied)
        return b""

    def moves(self):
        """At every tick."""

    def read(self, patience):
        data, self._replies = self._replies, b""
        if not data:
            self.now += patience
        return data

    def close(self):
        self.closed += 1

    def sent(self, kind):
        """Bodies of all requests of a kind."""
        return [body for k, _, body, _ in self.asked if k == kind]


def opened(board, **how):
    rig = SerialRig(
        board, coordinates=("psi", "theta"), counts=(COUNTS, -COUNTS), command_unit="V", full_scale=10.0,
        clock=lambda: board.now, **how,
    )  # fmt: skip
    rig.open()
    return rig


def running(board, mode=Mode.HOST, **how):
    rig = opened(board, **how)
    rig.clear_fault()
    rig.configure(LIMITS)
    rig.arm()
    if mode != Mode.ARMED:
        board.mode = mode
        rig.exchange(0.0)
    return rig


def test_the_rig_is_what_the_firmware_says():
    about = opened(FakeBoard(period=884)).open()
    assert about.name == "fake on nowhere"
    assert about.period == pytest.approx(0.884e-3)
    assert about.steps == STEPS
    assert (about.hardware, about.virtual, about.paced) == (True, False, True)
    simulated = opened(FakeBoard(virtual=True)).open()
    assert (simulated.hardware, simulated.virtual, simulated.paced) == (False, True, False)


def test_firmware_of_another_version_is_refused_with_both_versions():
    with pytest.raises(RigStopped, match=rf"version {PROTOCOL + 1} .* version {PROTOCOL};"):
        opened(FakeBoard(protocol=PROTOCOL + 1))


def test_a_request_without_an_answer_is_repeated_under_its_number():
    board = FakeBoard()
    rig = opened(board)
    board.asked.clear()
    board.lost.extend([True, True])
    rig.clear_fault()
    kinds, sequences, _, times = zip(*board.asked, strict=True)
    assert kinds == (Kind.CLEAR,) * 3
    assert len(set(sequences)) == 1
    assert np.diff(times) == pytest.approx([0.02, 0.02])
    rig.zero()
    assert board.asked[-1][1] == (sequences[0] + 1) % 256  # the next one has the next


def test_with_limits_a_quarter_of_the_watchdogs_time_is_waited():
    board = FakeBoard()
    rig = running(board)
    board.asked.clear()
    board.lost.extend([True] * 3)  # three may be lost in a row
    rig.exchange(0.0)
    assert [t - board.asked[0][3] for *_, t in board.asked] == pytest.approx([0.0, 0.005, 0.010, 0.015])


def test_a_board_in_lockstep_is_asked_once_for_its_time_passes_by_it():
    board = FakeBoard(virtual=True)
    rig = opened(board, patience=0.5)
    board.asked.clear()
    board.lost.append(True)
    with pytest.raises(RigStopped, match=r"did not answer for 0\.5 s"):
        rig.exchange(0.0)
    assert len(board.asked) == 1


def test_nobody_there_is_told_in_time():
    board = FakeBoard()
    rig = opened(board, patience=0.3)
    board.lost.extend([True] * 1000)
    begun = board.now
    with pytest.raises(RigStopped, match=r"did not answer for 0\.3 s \(0 damaged frames came\).*watchdog stops it"):
        rig.zero()
    assert board.now - begun == pytest.approx(0.3)
    rig.estop()  # says nothing, and leaves it to the watchdog
    rig.close()
    rig.close()
    assert board.closed == 1


@pytest.mark.parametrize(("boots", "patience", "there"), [(3.7, 0.5, True), (4.1, 0.5, False), (5.9, 6.0, True)])
def test_a_board_that_restarts_when_its_port_is_opened_has_the_time_of_its_boot_loader(boots, patience, there):
    class Booting(FakeBoard):
        def write(self, data):
            if self.now >= boots:
                super().write(data)

    board = Booting()
    if there:
        assert opened(board, patience=patience).open().name == "fake on nowhere"
    else:
        with pytest.raises(RigStopped, match="did not answer for 4 s"):
            opened(board, patience=patience)


def test_what_answers_something_else_is_no_answer():
    board = FakeBoard()
    rig = opened(board)
    board.counts = [7, 8]
    sequence = (board.asked[-1][1] + 1) % 256
    sample = struct.pack("<Hiih", 0, 1, 2, 3)
    good = struct.pack("<BBHI", 0, 0, 0, 1) + sample
    board.before = [
        pack(Kind.EXCHANGE | 0x80, sequence - 1, 0, good),  # a late one
        pack(Kind.STOP | 0x80, sequence, 0, good),
        pack(Kind.EXCHANGE, sequence, 0, good),  # an echo
        pack(Kind.EXCHANGE | 0x80, sequence, 0, b"\x63" + good[1:]),  # of no result that there is
        b"noise\0",
    ]
    assert rig.exchange(0.0).counts == (7, 8)
    assert rig.dropped == 1


@pytest.mark.parametrize(
    ("command", "steps"),
    [
        (1.0, 2000),
        (-1.0, -2000),
        (0.00026, 1),
        (0.00024, 0),
        (-0.00026, -1),
        (9.0, 18_000),
        (1e3, 32767),
        (-1e3, -32767),
    ],
)
def test_a_command_goes_as_the_nearest_step_that_the_wire_has(command, steps):
    board = FakeBoard()
    rig = running(board)
    rig.exchange(command)
    assert struct.unpack("<fI", board.sent(Kind.EXCHANGE)[-1])[0] == steps


@pytest.mark.parametrize("mode", [Mode.IDLE, Mode.ARMED, Mode.FAULT])
def test_nothing_is_commanded_but_by_the_hosts_loop(mode):
    board = FakeBoard()
    rig = running(board, mode)
    rig.exchange(3.0)
    assert struct.unpack("<fI", board.sent(Kind.EXCHANGE)[-1])[0] == 0.0


def test_the_boards_own_loop_gets_a_reference():
    board = FakeBoard()
    rig = running(board, Mode.MCU)
    rig.exchange(0.75)
    assert struct.unpack("<fI", board.sent(Kind.EXCHANGE)[-1])[0] == 0.75


@pytest.mark.parametrize("mode", [Mode.HOST, Mode.MCU])
@pytest.mark.parametrize("command", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_goes_as_none_so_that_the_board_stops(mode, command):
    board = FakeBoard()
    rig = running(board, mode)
    rig.exchange(command)
    assert math.isnan(struct.unpack("<fI", board.sent(Kind.EXCHANGE)[-1])[0])


def test_a_command_names_the_sample_that_it_answers_and_a_sample_its_time():
    board = FakeBoard()
    rig = running(board)
    board.tick, board.late, board.counts, board.applied = 0x2FFFE, 250, [1500, -300], -500
    tick = rig.exchange(0.0)
    assert (tick.tick, tick.counts, tick.applied) == (0x2FFFF, (1500, -300), pytest.approx(-0.25))
    assert tick.time == pytest.approx(0x2FFFF * 1e-3 + 250e-6)
    rig.exchange(0.0)
    assert struct.unpack("<fI", board.sent(Kind.EXCHANGE)[-1])[1] == 0x2FFFF


def test_a_host_that_takes_four_ticks_counts_in_fours():
    board = FakeBoard()
    rig = running(board, period=4e-3)
    assert [body[0] for body in board.sent(Kind.HELLO)] == [1, 4]
    board.tick = 407
    tick = rig.exchange(0.0)
    assert tick.tick == 102  # 408/4
    assert tick.time == pytest.approx(0.408)


def test_limits_go_in_counts_steps_and_ticks_rounded_to_the_safe_side():
    board = FakeBoard()
    rig = opened(board)
    rig.clear_fault()
    held = rig.configure(
        Limits(travel=(1.2349, math.inf), speed=(10.1, 9.9), start=(0.5, 0.25), command=4.99999, watchdog=0.0129,
               saturation=0.5)
    )  # fmt: skip
    # speeds in 8 ticks of 1 ms: 10.1 * 1000 * 0.008 = 80.8 counts
    numbers = struct.unpack("<10IHh", board.sent(Kind.CONFIGURE)[0])
    assert numbers == (1234, 0x7FFFFFFF, 80, 79, 500, 250, 0, 0, 0x7FFFFFFF, 500, 12, 9999)
    assert held.travel == (pytest.approx(1.234), math.inf)
    assert held.speed == pytest.approx((10.0, 9.875))
    assert (held.command, held.watchdog) == (pytest.approx(4.9995), pytest.approx(0.012))


@pytest.mark.parametrize("kind", [Kind.CONFIGURE, Kind.LAW])
def test_a_board_that_holds_something_else_than_it_was_given_is_stopped(kind):
    board = FakeBoard()
    board.alter = lambda k, body: bytes([body[0] ^ 1]) + body[1:] if k == kind else body
    rig = opened(board)
    rig.clear_fault()
    law = Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), np.array([[1.0, 0.0]]))

    def started():
        rig.configure(LIMITS)
        rig.arm()
        rig.start(Mode.MCU, law)

    with pytest.raises(RigStopped, match=r"holds another (limits|law) than it was given"):
        started()
    assert board.asked[-1][0] == Kind.ESTOP
    assert Kind.START not in [k for k, *_ in board.asked]


@pytest.mark.parametrize(
    ("result", "said"),
    [
        (Result.WRONG_LENGTH, "is its firmware as old as this program"),
        (Result.WRONG_MODE, "wrong mode"),
        (Result.NOT_CONFIGURED, "configure them first"),
        (Result.FAULTED, "must be cleared first"),
        (Result.OFF_START, "bring it nearer to its zero"),
    ],
)
def test_a_refusal_is_told_as_a_sentence_with_the_mode(result, said):
    board = FakeBoard()
    rig = opened(board)
    board.results[Kind.ARM] = result
    with pytest.raises(RigStopped, match=rf"^Fake on nowhere refused: .*{said}.* It is in ARMED") as stopped:
        rig.arm()
    assert str(stopped.value).endswith(".")


@pytest.mark.parametrize(("pulse", "steps"), [(0.5, 1000), (-0.5, -1000)])
def test_a_self_test_exchanges_every_tick_of_the_pulse_and_of_as_long_after_it(pulse, steps):
    """The board's watchdog acts during a pulse, and hears of its host by exchanges alone."""
    board = FakeBoard()
    rig = running(board, Mode.ARMED)
    begun = board.tick + 1

    def moves():
        way = board.tick - begun
        board.counts = [5 + min(way, 300), -way if way < 200 else way - 400]  # to 300, and to -200 and back

    board.moves = moves
    found = rig.self_test(pulse, 0.15)
    assert board.sent(Kind.SELF_TEST) == [struct.pack("<hH", steps, 150)]
    assert board.tick - begun >= 300
    assert len(board.sent(Kind.EXCHANGE)) == board.tick - begun + 1
    # psi by 1000 counts per rad, theta by as many to the other side
    assert found.moved == {"psi": pytest.approx(0.3), "theta": pytest.approx(0.2)}
    assert found.complaint == ""


def test_a_pulse_of_more_than_300_ms_is_not_asked_for():
    board = FakeBoard()
    rig = running(board, Mode.ARMED)
    for seconds in (0.301, 5.0, math.inf, math.nan, 0.0, -0.1):
        with pytest.raises(RigStopped, match=r"up to 0\.3 s"):
            rig.self_test(0.5, seconds)
    assert not board.sent(Kind.SELF_TEST)
    slow = FakeBoard(period=7000)  # 0.3 s are 42.9 of its ticks
    running(slow, Mode.ARMED, patience=0.1).self_test(0.5, 0.3)
    assert slow.sent(Kind.SELF_TEST) == [struct.pack("<hH", 1000, 42)]


def test_a_board_that_stops_in_a_pulse_ends_the_test():
    board = FakeBoard()
    rig = running(board, Mode.ARMED)

    def moves():
        if board.sent(Kind.SELF_TEST):
            board.mode, board.faults = Mode.FAULT, Fault.WATCHDOG

    board.moves = moves
    with pytest.raises(RigStopped, match="no command came within the watchdog's time"):
        rig.self_test(0.5, 0.15)


def test_closing_stops_it_and_lets_go_once():
    board = FakeBoard()
    rig = running(board)
    rig.close()
    assert (board.asked[-1][0], board.closed) == (Kind.STOP, 1)
    rig.close()
    assert board.closed == 1
    with pytest.raises(RigStopped, match="open it first"):
        rig.exchange(0.0)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"coordinates": ("a", "b", "c"), "counts": (1.0, 1.0, 1.0)}, "1 or 2 encoders"),
        ({"counts": (1.0,)}, "each with its counts"),
        ({"counts": (1.0, 0.0)}, "must not be zero"),
        ({"counts": (1.0, math.nan)}, "must not be zero"),
        ({"full_scale": 0.0}, "full scale above it"),
    ],
)
def test_a_rig_that_cannot_be_is_refused(changed, said):
    given = {"coordinates": ("a", "b"), "counts": (1.0, 1.0), "command_unit": "V", "full_scale": 10.0} | changed
    with pytest.raises(BadInput, match=said):
        SerialRig(FakeBoard(), **given)


@pytest.mark.parametrize(("period", "least"), [(None, 0.001), (4e-3, 0.004)])
def test_a_watchdog_takes_a_tick_of_the_host_to_five_seconds(period, least):
    """Up to 5000 of its ticks, CEILING_WATCHDOG of firmware/ceilings.h, and no fewer than the host lets pass."""
    rig = opened(FakeBoard(), **({} if period is None else {"period": period}))
    rig.clear_fault()
    for taken in (least, 5.0):
        assert rig.configure(replace(LIMITS, watchdog=taken)).watchdog == pytest.approx(taken)
    for refused in (0.9 * least, 5.001):
        with pytest.raises(RigStopped, match=rf"the watchdog takes {least:g} to 5 s, got {refused:g} s"):
            rig.configure(replace(LIMITS, watchdog=refused))


def test_the_first_firmware_is_refused_by_the_length_of_its_answer():
    class First(FakeBoard):
        """Version 1 answers a greeting that it does not know by four bytes."""

        def write(self, data):
            for kind, sequence, session, _ in self._parser.feed(data):
                self._replies += pack(kind | 0x80, sequence, session, bytes(4))

    with pytest.raises(RigStopped, match=rf"speaks version 1 of the protocol and this program version {PROTOCOL}; fl"):
        opened(First())


def test_a_line_that_was_closed_is_not_opened_again():
    rig = opened(FakeBoard())
    rig.close()
    with pytest.raises(RigStopped, match="Its line was closed; open the rig again on another line"):
        rig.open()


@pytest.mark.parametrize(("command", "coordinates", "said"), [
    (10.01, 2, "the limit on the command is 10.01 V, beyond the converter's 10 V"),
    (0.9 * 10 / STEPS, 2, "the limit on the command is less than a step of 0.0005 V"),
    (5.0, 1, "limits are for 1 coordinates, and it has 2"),
])  # fmt: skip
def test_limits_that_the_board_cannot_hold_are_refused(command, coordinates, said):
    board = FakeBoard()
    rig = opened(board)
    rig.clear_fault()
    each = {name: getattr(LIMITS, name)[:coordinates] for name in ("travel", "speed", "start")}
    with pytest.raises(RigStopped, match=said):
        rig.configure(replace(LIMITS, command=command, **each))
    assert not board.sent(Kind.CONFIGURE)
