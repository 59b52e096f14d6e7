"""Does the firmware do what the protocol says, and stop, with its command at zero first, whenever a limit is passed?"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.boards import COUNTS, STEP, rig_on
from tests.rigs.test_law import PATHS
from upright.errors import RigStopped
from upright.laws import Law
from upright.rigs.line import TerminalLine
from upright.rigs.protocol import Fault, Limits, Mode
from upright.rigs.wire import Kind, Parser, Result, exchange, pack, self_test_body, status

WIDE = Limits(travel=(3.0, 4.0), speed=(20.0, 20.0), start=(0.5, 0.5), command=5.0, watchdog=0.02, saturation=0.1)
PULL = Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), np.array([[1.0, 0.0]]))
"""One volt for each radian of the first coordinate."""


def running(host, mode=Mode.HOST, limits=WIDE, law=PULL, **how):
    board = host()
    rig = board.rig(**how)
    rig.open()
    rig.clear_fault()
    rig.configure(limits)
    rig.arm()
    rig.start(mode, law if mode == Mode.MCU else None)
    return board, rig


def dead(board):
    """Converter at zero and power stage off, read on the board's side."""
    return board.state()[5:7] == [0.0, 0.0]


def test_a_reset_ends_in_a_fault_that_has_to_be_cleared(host):
    board = host()
    rig = board.rig()
    about = rig.open()
    assert about.modes == {Mode.HOST, Mode.MCU}
    assert about.virtual
    assert about.period == 1e-3
    assert about.step == STEP
    assert rig.exchange(0.0).faults == Fault.RESET
    for forbidden in (rig.arm, rig.zero, lambda: rig.configure(WIDE), lambda: rig.start(Mode.HOST)):
        with pytest.raises(RigStopped, match=r"be cleared first\. It is in FAULT: it was switched on or reset\."):
            forbidden()
    rig.clear_fault()
    assert rig.exchange(0.0).mode == Mode.IDLE
    with pytest.raises(RigStopped, match="limits"):
        rig.arm()
    assert dead(board)


def test_modes_follow_one_another_as_the_protocol_says(host):
    board, rig = running(host)
    assert rig.exchange(1.0).mode == Mode.HOST
    assert board.state()[5:7] == [math.floor(1.0 / STEP + 0.5), 1.0]
    for forbidden in (rig.arm, rig.zero, rig.clear_fault, lambda: rig.start(Mode.MCU, PULL)):
        with pytest.raises(RigStopped, match="wrong mode"):
            forbidden()
    rig.stop()
    assert rig.exchange(1.0).mode == Mode.IDLE
    assert dead(board)
    with pytest.raises(RigStopped):
        rig.start(Mode.HOST)  # from ARMED only
    rig.arm()
    assert rig.exchange(1.0).mode == Mode.ARMED
    assert board.state()[5:7] == [0.0, 1.0]
    rig.estop()
    assert rig.exchange(0.0).faults == Fault.STOP
    assert dead(board)


def test_limits_are_held_in_counts_and_steps_never_wider_than_asked(host):
    rig = host().rig()
    rig.open()
    rig.clear_fault()
    asked = Limits(
        travel=(2.0, math.inf), speed=(7.0, 9.0), start=(0.3, math.inf), command=4.0, watchdog=0.0127, saturation=0.5,
        frozen=0.2, twist=0.4,
    )  # fmt: skip
    held = rig.configure(asked)
    window = 8e-3
    for name, count in {"travel": 1 / COUNTS, "speed": 1 / (COUNTS * window), "start": 1 / COUNTS}.items():
        for wanted, got in zip(getattr(asked, name), getattr(held, name), strict=True):
            assert got == wanted if math.isinf(wanted) else 0 <= wanted - got < count * (1 + 1e-9)
    assert 0 <= asked.command - held.command < STEP
    assert held.watchdog == 0.012
    assert held.saturation == 0.5
    assert 0 <= asked.twist - held.twist < 1 / COUNTS
    assert 0 <= asked.frozen - held.frozen < 1 / COUNTS


@pytest.mark.parametrize(
    ("limits", "why"),
    [
        (replace(WIDE, command=10.1), "beyond the converter"),
        (replace(WIDE, command=1e-5), "less than a step"),
        (replace(WIDE, watchdog=6.0), "watchdog"),
        (replace(WIDE, watchdog=5e-4), "watchdog"),
        (Limits(travel=(1.0,), speed=(1.0,), start=(1.0,), command=1.0), "1 coordinates"),
    ],
)
def test_limits_that_cannot_be_held_are_refused(host, limits, why):
    rig = host().rig()
    rig.open()
    rig.clear_fault()
    with pytest.raises(RigStopped, match=why):
        rig.configure(limits)


def test_a_twist_is_measured_between_like_encoders_only(host):
    rig = host().rig(counts=(COUNTS, -COUNTS))
    rig.open()
    rig.clear_fault()
    with pytest.raises(RigStopped, match="same counts and sign"):
        rig.configure(replace(WIDE, twist=0.4))


SLOW = int(19.0 * COUNTS * 8e-3)
"""Counts that one coordinate may move in the speed window of 8 ticks."""


def ramp(board, rig, to, by, at=(0, 0)):
    """Both encoders or one moved in steps, a tick each, until the rig stops or is there; the last sample."""
    at, tick = np.array(at), rig.exchange(0.0)
    while not tick.faults and (at != to).any():
        at = at + np.clip(np.asarray(to) - at, -by, by)
        board.do(f"counts {int(at[0])} {int(at[1])}")
        tick = rig.exchange(0.0)
    return tick


@pytest.mark.parametrize("mode", [Mode.HOST, Mode.MCU])
@pytest.mark.parametrize(
    ("limits", "to", "by", "fault"),
    [
        (WIDE, (0, 10**5), 45, Fault.OVERTRAVEL),
        (WIDE, (-(10**5), 0), 45, Fault.OVERTRAVEL),
        (WIDE, (0, 4000), 60, Fault.OVERSPEED),
        (WIDE, (0, -(2**30)), 2**30, Fault.OVERTRAVEL | Fault.OVERSPEED),
        (replace(WIDE, twist=0.4), (1000, -1000), 10, Fault.TWIST),
        (replace(WIDE, frozen=0.2), (0, 1000), 20, Fault.ENCODER),
    ],
)
def test_a_limit_that_is_passed_stops_the_rig_in_that_tick(host, mode, limits, to, by, fault):
    board, rig = running(host, mode, limits)
    tick = ramp(board, rig, to, by)
    assert tick.mode == Mode.FAULT
    assert tick.faults == fault
    assert tick.applied == 0.0
    assert dead(board)
    seen = rig.snapshot()
    assert seen.faults == fault
    assert seen.mode == mode
    assert seen.tick == tick.tick
    assert seen.sample.counts == tick.counts
    with pytest.raises(RigStopped, match="cleared"):
        rig.arm()


@pytest.mark.parametrize(
    ("limits", "to", "by"),
    [
        (WIDE, (int(2.99 * COUNTS), int(-3.99 * COUNTS)), SLOW // 8),
        (replace(WIDE, twist=0.4), (5000, 5900), 10),
        (replace(WIDE, frozen=0.5), (0, 1200), 20),
        (replace(WIDE, frozen=0.2), (1000, 1000), 20),
    ],
)
def test_what_stays_within_the_limits_goes_on(host, limits, to, by):
    board, rig = running(host, Mode.HOST, limits)
    assert ramp(board, rig, to, by).mode == Mode.HOST


def test_a_hand_may_turn_one_coordinate_alone_before_a_run(host):
    board = host()
    rig = board.rig()
    rig.open()
    rig.clear_fault()
    rig.configure(replace(WIDE, frozen=0.2))
    ramp(board, rig, (1200, 0), 20)
    rig.arm()
    assert rig.exchange(0.0).mode == Mode.ARMED
    assert ramp(board, rig, (1200 + 2000, 0), 20, (1200, 0)).faults == Fault.ENCODER


def test_a_request_whose_answer_was_lost_is_told_again_and_not_done_again(host):
    line = TerminalLine(host().port)
    rig = rig_on(line)
    rig.open()
    rig.clear_fault()
    rig.configure(WIDE)

    session = rig.session

    def ask(kind, sequence):
        line.write(pack(kind, sequence, session))
        (reply,) = Parser().feed(line.read(1.0))
        read = status(reply.body)
        assert read is not None
        return read[0].result

    assert ask(Kind.ARM, 77) == Result.DONE
    assert ask(Kind.ARM, 77) == Result.DONE
    session += 1
    assert ask(Kind.ARM, 78) == Result.WRONG_MODE
    assert ask(Kind.ARM, 78) == Result.WRONG_MODE
    assert rig.exchange(0.0).mode == Mode.ARMED


class Recorded:
    """A line that keeps what was sent."""

    def __init__(self, port):
        self.name, self._line, self.sent = port, TerminalLine(port), []

    def write(self, data):
        self.sent.append(data)
        self._line.write(data)

    def read(self, patience):
        return self._line.read(patience)

    def close(self):
        self._line.close()


@pytest.mark.parametrize("since", ["stopped", "stopped by hand and cleared", "stopped itself and was cleared", "reset"])
@pytest.mark.parametrize("mode", [Mode.HOST, Mode.MCU])
def test_what_was_recorded_of_a_run_and_is_sent_again_switches_nothing_on(host, mode, since):
    board = host()
    line = Recorded(board.port)
    rig = rig_on(line)
    rig.open()
    rig.clear_fault()
    rig.configure(WIDE)
    rig.arm()
    rig.start(mode, PULL)
    for _ in range(3):
        rig.exchange(1.0)
    recorded = list(line.sent)
    rig.stop()
    if since == "stopped by hand and cleared":
        rig.estop()
        rig.clear_fault()
    elif since == "stopped itself and was cleared":
        rig.arm()
        rig.start(Mode.HOST)
        board.do("run 21")
        rig.clear_fault()
    elif since == "reset":
        board.do("reset", "run 50")
    for frame in [*recorded[1:], *recorded]:  # with a greeting and without
        line.write(frame)
        line.read(0.05)
        board.do("run 1")
        assert dead(board)


@pytest.mark.slow
def test_an_exchange_of_65536_ticks_ago_is_not_followed(host):
    """Their last 16 bits are those of now."""
    line = TerminalLine(host().port)
    rig = rig_on(line)
    rig.open()
    rig.clear_fault()
    rig.configure(replace(WIDE, saturation=math.inf))
    rig.arm()
    rig.start(Mode.HOST)
    old = rig.exchange(0.0).tick
    for _ in range(65_536 - 1):
        rig.exchange(0.0)
    line.write(pack(Kind.EXCHANGE, 200, rig.session, exchange(1000.0, old)))
    tick = rig.exchange(0.0)
    assert tick.faults == Fault.STALE
    assert tick.applied == 0.0


def test_an_exchange_of_another_session_stops_a_run_and_feeds_no_watchdog(host):
    board = host()
    line = TerminalLine(board.port)
    rig = rig_on(line)
    rig.open()
    rig.clear_fault()
    rig.configure(WIDE)
    rig.arm()
    board.do("run 9999")
    line.write(pack(Kind.EXCHANGE, 200, rig.session - 1, exchange(0.0, 9999)))
    line.read(0.05)
    board.do("run 1")
    assert dead(board)
    assert rig.exchange(0.0).faults == Fault.WATCHDOG
    rig.clear_fault()
    rig.arm()
    rig.start(Mode.HOST)
    now = rig.exchange(0.0).tick
    line.write(pack(Kind.EXCHANGE, 200, rig.session - 1, exchange(1000.0, now)))
    assert rig.exchange(0.0).faults == Fault.STALE
    assert dead(board)


def test_a_fault_that_came_meanwhile_is_cleared_when_it_is_asked_for(host):
    board, rig = running(host)
    rig.exchange(0.0)
    board.do("run 30")
    rig.clear_fault()
    assert rig.exchange(0.0).faults == Fault(0)


CEILINGS = {
    name: int(value, 0)
    for name, value in re.findall(
        r"#define CEILING_(\w+) (\w+)",
        (Path(__file__).parents[2] / "firmware" / "ceilings.h").read_text(encoding="utf-8"),
    )
}


def test_no_host_goes_beyond_what_the_board_was_compiled_for(host):
    rig = host().rig()
    rig.open()
    rig.clear_fault()
    free = Limits(travel=(math.inf,) * 2, speed=(math.inf,) * 2, start=(math.inf,) * 2, command=10.0, watchdog=0.02,
                  saturation=math.inf)  # fmt: skip
    held = rig.configure(free)
    assert held.travel[0] == pytest.approx(CEILINGS["TRAVEL_1"] / COUNTS)
    assert held.travel[1] == math.inf
    assert held.speed == pytest.approx([CEILINGS[f"SPEED_{i}"] / (COUNTS * 8e-3) for i in (1, 2)])
    assert held.command == pytest.approx(CEILINGS["COMMAND"] / 100 * 10.0, abs=STEP)
    assert held.saturation == pytest.approx(CEILINGS["SATURATION"] * 1e-3)


@pytest.mark.parametrize(("at", "fault"), [(40_000, Fault(0)), (40_001, Fault.OVERTRAVEL)])
def test_a_rig_without_limits_of_its_host_stops_at_its_ceiling(host, at, fault):
    free = Limits(travel=(math.inf,) * 2, speed=(math.inf,) * 2, start=(math.inf,) * 2, command=10.0, watchdog=0.02)
    board, rig = running(host, limits=free)
    assert ramp(board, rig, (at, 0), 100).faults == fault
    assert rig.exchange(10.0).applied == (0.0 if fault else pytest.approx(0.1 * CEILINGS["COMMAND"], abs=STEP))


@pytest.mark.parametrize("mode", [Mode.IDLE, Mode.FAULT, Mode.ARMED])
def test_a_converter_that_lost_its_zero_gets_it_again_in_the_next_tick(host, mode):
    board, rig = running(host)
    rig.exchange(1.0)
    rig.estop() if mode == Mode.FAULT else rig.stop()
    if mode == Mode.ARMED:
        rig.arm()
    board.do("glitch 12345")
    assert board.state()[5] == 12345
    board.do("run 1")
    assert board.state()[5:] == [0.0, float(mode == Mode.ARMED), mode]


@pytest.mark.parametrize("mode", [Mode.ARMED, Mode.HOST, Mode.MCU])
def test_a_board_that_starts_anew_stands_in_a_fault_and_says_so(host, mode):
    board, rig = running(host)
    if mode != Mode.HOST:
        rig.stop()
        rig.arm()
    if mode == Mode.MCU:
        rig.start(mode, PULL)
    rig.exchange(0.5)
    board.do("reset")
    assert dead(board)
    tick = rig.exchange(0.5)
    assert (tick.mode, tick.faults, tick.applied) == (Mode.FAULT, Fault.RESET, 0.0)
    rig.clear_fault()
    with pytest.raises(RigStopped, match="limits"):
        rig.arm()


def test_a_run_starts_within_its_window_only(host):
    board = host()
    rig = board.rig()
    rig.open()
    rig.clear_fault()
    rig.configure(WIDE)
    board.do(f"counts {int(0.6 * COUNTS)} 0")
    rig.exchange(0.0)
    with pytest.raises(RigStopped, match="it was not where a run may start"):
        rig.arm()
    assert dead(board)
    rig.clear_fault()
    rig.zero()
    rig.arm()
    assert rig.exchange(0.0).counts == (0, 0)


def test_commands_stay_within_their_limit_and_not_for_long_at_it(host):
    board, rig = running(host)
    held = math.floor(WIDE.command / STEP)
    for _ in range(100):
        tick = rig.exchange(-9.0)
    assert round(tick.applied / STEP) == -held
    assert board.state()[5] == -held
    assert tick.mode == Mode.HOST
    assert rig.exchange(-9.0).faults == Fault.SATURATION
    assert dead(board)


@pytest.mark.parametrize("mode", [Mode.HOST, Mode.MCU])
def test_a_silent_host_is_waited_for_no_longer_than_the_watchdog(host, mode):
    board, rig = running(host, mode)
    rig.exchange(0.1)
    board.do("run 19")  # 20 ticks since the command, its own among them
    assert board.state()[7] == mode
    board.do("run 1")
    assert board.state()[7] == Mode.FAULT
    assert dead(board)
    assert rig.exchange(0.1).faults == Fault.WATCHDOG


def test_an_armed_rig_whose_host_went_away_is_switched_off(host):
    board, rig = running(host)
    rig.stop()
    rig.arm()
    board.do("run 1000")
    assert board.state()[6:] == [1.0, Mode.ARMED]
    board.do("run 1")
    assert dead(board)
    assert rig.exchange(0.0).faults == Fault.WATCHDOG


def test_a_command_that_answers_an_old_sample_is_not_followed(host):
    line = TerminalLine(host().port)
    rig = rig_on(line)
    rig.open()
    rig.clear_fault()
    rig.configure(WIDE)
    rig.arm()
    rig.start(Mode.HOST)
    old = rig.exchange(0.1).tick
    for _ in range(20):
        assert rig.exchange(0.2).mode == Mode.HOST
    line.write(pack(Kind.EXCHANGE, 200, rig.session, exchange(1000.0, old)))  # as it may lie in a driver's buffer
    assert rig.exchange(0.2).mode == Mode.HOST  # 20 ticks old: the watchdog allows for as many
    line.write(pack(Kind.EXCHANGE, 201, rig.session, exchange(1000.0, old)))
    tick = rig.exchange(0.2)
    assert tick.faults == Fault.STALE
    assert tick.applied == 0.0


def test_a_board_that_cannot_keep_its_ticks_stops(host):
    board, rig = running(host)
    board.do("skip 20")
    assert rig.exchange(0.1).mode == Mode.HOST
    board.do("skip 20")
    assert rig.exchange(0.1).faults == Fault.WATCHDOG  # 21 ticks of silence
    board, rig = running(host)
    rig.exchange(0.1)
    board.do("skip 21")
    assert dead(board)
    assert rig.exchange(0.1).faults == Fault.OVERRUN
    assert rig.snapshot().lost == 20
    board, rig = running(host)
    board.do("overrun")
    assert rig.exchange(0.1).faults == Fault.OVERRUN
    assert dead(board)


@pytest.mark.parametrize("skipped", [2, 5, 8, 15])
@pytest.mark.parametrize(("by", "fault"), [(45, Fault(0)), (56, Fault.OVERSPEED)])
def test_a_speed_is_seen_alike_when_ticks_are_late(host, skipped, by, fault):
    board, rig = running(host)  # 20 rad/s are 50.9 counts a tick
    tick, at = rig.exchange(0.0), 0
    for _ in range(4):
        at += skipped * by
        board.do(f"counts 0 {at}", f"skip {skipped}")
        at += by
        board.do(f"counts 0 {at}")
        tick = rig.exchange(0.0)
    assert tick.faults == fault


@pytest.mark.parametrize(
    ("skipped", "counts", "moved"),
    [  # of a straight line over the ticks that never came, the part in the last 8 of them
        (1, 50, 50), (5, 200, 200), (7, 210, 210), (8, 240, 240), (9, 270, 240), (15, 600, 320), (16, -640, -320),
        (20, 100, 40), (20, 1017, 406), (20, -1017, -406),
    ],
)  # fmt: skip
def test_counts_of_the_last_8_ticks_make_the_speed_however_late_a_tick_is(host, skipped, counts, moved):
    board, rig = running(host)  # 20 rad/s are 407 counts in 8 ticks
    board.do(f"counts 0 {counts}", f"skip {skipped}")
    assert board.state()[7] == Mode.HOST
    rig.estop()
    assert rig.snapshot().moved == (0, moved)


def test_a_speed_beyond_its_limit_is_seen_in_the_first_tick_that_comes_late(host):
    board, _ = running(host)
    board.do("counts 0 1020", "skip 20")  # 1020 * 8/20 = 408 counts in 8 ticks, and 407 are 20 rad/s
    assert dead(board)


@pytest.mark.parametrize(
    ("counts", "faults"), [(90, Fault(0)), (-90, Fault(0)), (110, Fault.OVERSPEED), (-110, Fault.OVERSPEED)]
)
def test_counts_that_jump_are_no_slow_motion(host, counts, faults):
    board, rig = running(host)  # 20 rad/s are 50.9 counts a tick, and 407 in the window
    board.do(f"counts 0 {counts}")
    assert rig.exchange(0.0).faults == faults


def test_a_transition_that_no_encoder_makes_stops_the_rig(host):
    board, rig = running(host)
    board.do("illegal")
    assert rig.exchange(7.0).faults == Fault.ENCODER
    assert dead(board)
    seen = rig.snapshot()
    assert seen.command == math.floor(7.0 / STEP + 0.5)
    assert seen.sample.applied == math.floor(WIDE.command / STEP)


@pytest.mark.parametrize("mode", [Mode.HOST, Mode.MCU])
@pytest.mark.parametrize("absurd", [math.nan, math.inf, -math.inf, 1e30, 1e300])
def test_a_command_that_is_no_number_stops_the_rig(host, mode, absurd):
    board, rig = running(host, mode)
    tick = rig.exchange(absurd)
    if mode == Mode.HOST and math.isfinite(absurd):
        assert round(tick.applied / STEP) == math.floor(WIDE.command / STEP)
    else:
        assert tick.faults == Fault.GAINS
        assert dead(board)


def law(D, z=0.0):
    return Law(np.array([[z]]), np.zeros((1, 2)), np.ones((1, 1)), np.array([[D, 0.0]]), initial=[1.0])


def test_gains_by_which_one_count_is_everything_are_refused(host):
    board, rig = running(host)
    rig.stop()
    rig.arm()
    rig.start(Mode.MCU, law(0.99 * WIDE.command * COUNTS))
    rig.stop()
    rig.arm()
    with pytest.raises(RigStopped, match="its gains are absurd"):
        rig.start(Mode.MCU, law(1.01 * WIDE.command * COUNTS))
    assert dead(board)
    for beyond in (1e12, 1e200):
        rig.clear_fault()
        rig.arm()
        with pytest.raises(RigStopped, match="gains and units"):
            rig.start(Mode.MCU, law(beyond))


@pytest.mark.parametrize(
    ("growth", "taken"), [(1.0, True), (1.008, True), (1.02, False), (-1.02, False), (30.0, False)]
)
def test_a_law_that_grows_by_itself_is_refused(host, growth, taken):
    """By 2.7 times in 125 samples, and in 50."""
    board, rig = running(host)
    rig.stop()
    rig.arm()
    if taken:
        rig.start(Mode.MCU, law(0.0, z=growth))
    else:
        with pytest.raises(RigStopped, match="may not grow by itself"):
            rig.start(Mode.MCU, law(0.0, z=growth))
        assert dead(board)


@pytest.mark.parametrize("turn", [0.3, math.pi / 1024, 3 * math.pi / 1024])
@pytest.mark.parametrize(("size", "taken"), [(0.999, True), (1.025, False)])
def test_a_law_that_swings_up_by_itself_is_refused_whatever_its_frequency(host, turn, size, taken):
    """With pi/1024 a sample the trace of A^512 is 2 size^512 cos(pi/2) = 0."""
    _, rig = running(host)
    rig.stop()
    rig.arm()
    A = size * np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    swinging = Law(A, np.zeros((2, 2)), np.ones((1, 2)), np.zeros((1, 2)), initial=[1.0, 0.0])
    if taken:
        rig.start(Mode.MCU, swinging)
    else:
        with pytest.raises(RigStopped, match="may not grow by itself"):
            rig.start(Mode.MCU, swinging)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_a_count_that_stays_may_not_add_up_to_everything(host, share):
    """A sum over 100 samples: 1/100 of the command from each, which an impulse of one sample does not show."""
    _, rig = running(host)
    rig.stop()
    rig.arm()
    adding = Law(np.eye(1), np.array([[share * WIDE.command * COUNTS / 100, 0.0]]), np.ones((1, 1)), np.zeros((1, 2)))
    if share < 1:
        rig.start(Mode.MCU, adding)
    else:
        with pytest.raises(RigStopped, match="one that stays"):
            rig.start(Mode.MCU, adding)


@pytest.mark.parametrize("path", PATHS)
def test_a_count_that_is_everything_is_refused_whatever_way_it_takes(host, path):
    """By 1 % to either side of the limit; float32 rounds by a hundred-thousandth of that."""
    board, rig = running(host)
    for share in (0.99, 1.01):
        rig.stop()
        rig.arm()
        law = PATHS[path](share * WIDE.command * COUNTS)
        if share < 1:
            rig.start(Mode.MCU, law)
        else:
            with pytest.raises(RigStopped, match="its gains are absurd"):
                rig.start(Mode.MCU, law)
    assert dead(board)


def test_a_law_that_runs_away_stops_the_rig_before_its_number_overflows(host):
    growing = law(0.0, z=1.008)  # as fast as a board takes it
    nearly = replace(growing, initial=[0.99 * 2**30 * STEP])  # 2^30 is beyond what it takes for a number
    board, rig = running(host, Mode.MCU, replace(WIDE, saturation=math.inf), nearly)
    ticks = [rig.exchange(0.0) for _ in range(12)]
    assert ticks[-1].faults == Fault.GAINS
    assert dead(board)
    assert max(abs(t.applied) for t in ticks) <= WIDE.command


def test_a_counter_may_run_over_while_nobody_notices(host):
    board = host()
    rig = board.rig()
    rig.open()
    rig.clear_fault()
    rig.configure(WIDE)
    board.do(f"wrap 0 {2**31 - 10}", f"wrap 1 {2**32 - 10}")
    board.do("run 8")  # until no speed is seen in it
    rig.zero()
    rig.arm()
    rig.start(Mode.HOST)
    board.do(f"wrap 0 {2**31 + 10}", "wrap 1 7")
    tick = rig.exchange(0.0)
    assert tick.counts == (20, 17)
    assert tick.mode == Mode.HOST


def test_a_self_test_pushes_for_its_time_and_tells_who_moved(host):
    board = host()
    rig = board.rig()
    rig.open()
    rig.clear_fault()
    rig.configure(WIDE)
    rig.arm()
    told = rig.self_test(0.5, 0.01)
    assert told.moved == {"psi": 0.0, "theta": 0.0}
    assert "psi, theta" in told.complaint
    assert board.state()[5:] == [0.0, 1.0, Mode.ARMED]
    with pytest.raises(RigStopped, match="beyond"):
        rig.self_test(6.0, 0.01)
    for seconds in (0.301, 0.0, -0.1, math.nan):
        with pytest.raises(RigStopped, match=r"up to 0\.3 s"):
            rig.self_test(0.5, seconds)


FULL = math.floor(WIDE.command / STEP)


def pulsed(host, ticks, watchdog=0.02):
    """A board in a pulse of full command that its host asked for, and the answer that it gave."""
    board = host()
    line = TerminalLine(board.port)
    rig = rig_on(line)
    rig.open()
    rig.clear_fault()
    rig.configure(replace(WIDE, watchdog=watchdog, saturation=math.inf))
    rig.arm()
    board.do("run 900")  # most of its patience while armed
    line.write(pack(Kind.SELF_TEST, 200, rig.session, self_test_body(FULL, ticks)))
    (reply,) = Parser().feed(line.read(1.0))
    read = status(reply.body)
    assert read is not None
    return board, rig, read[0].result


def test_a_host_that_dies_during_a_pulse_is_waited_for_no_longer_than_the_watchdog(host):
    board, rig, result = pulsed(host, 300)
    assert result == Result.DONE
    board.do("run 20")
    assert board.state()[5:] == [FULL, 1.0, Mode.ARMED]
    board.do("run 1")
    assert dead(board)
    tick = rig.exchange(0.0)
    assert (tick.mode, tick.faults) == (Mode.FAULT, Fault.WATCHDOG)


def test_a_pulse_lasts_as_long_as_its_host_speaks(host):
    board, rig, _ = pulsed(host, 300)
    for _ in range(15):
        assert rig.exchange(0.0).mode == Mode.ARMED
        board.do("run 19")
        assert board.state()[5:] == [FULL, 1.0, Mode.ARMED]
    assert rig.exchange(0.0).mode == Mode.ARMED
    assert board.state()[5:] == [0.0, 1.0, Mode.ARMED]


@pytest.mark.parametrize("skipped", [1, 10])
def test_no_pulse_is_longer_than_300_ms_whatever_the_watchdog_allows_and_ticks_are_late(host, skipped):
    board, rig, result = pulsed(host, 301, watchdog=5.0)
    assert result == Result.WRONG_VALUE
    board.do("run 1")
    assert board.state()[5:] == [0.0, 1.0, Mode.ARMED]
    board, rig, result = pulsed(host, 300, watchdog=5.0)
    assert result == Result.DONE
    board.do(*[f"skip {skipped}"] * (300 // skipped))
    assert board.state()[5:] == [FULL, 1.0, Mode.ARMED]
    board.do("run 1")
    assert board.state()[5:] == [0.0, 1.0, Mode.ARMED]
    assert rig.exchange(0.0).faults == Fault(0)


def test_a_new_host_finds_the_rig_stopped_and_without_limits(host):
    board, rig = running(host, patience=0.05)
    rig.exchange(1.0)
    board.do("cut")
    rig.close()  # whose word to stop is lost
    board.do("join")
    assert board.state()[5:] == [math.floor(1.0 / STEP + 0.5), 1.0, Mode.HOST]
    again = board.rig()
    again.open()
    assert dead(board)
    assert again.exchange(0.0).faults == Fault.RESET
    again.clear_fault()
    with pytest.raises(RigStopped, match="limits"):
        again.arm()


@pytest.mark.parametrize(("left", "found"), [("stopped", Fault.RESET), ("silent", Fault.RESET | Fault.WATCHDOG)])
def test_a_new_host_is_told_what_the_rig_found_but_not_what_hosts_said(host, left, found):
    board, rig = running(host)
    rig.exchange(0.1)
    if left == "stopped":
        rig.estop()
    else:
        board.do("run 20")
    rig.close()
    again = board.rig()
    again.open()
    assert again.exchange(0.0).faults == found
    again.clear_fault()
    assert again.exchange(0.0).faults == Fault(0)


def test_less_than_a_count_is_no_limit(host):
    rig = host().rig()
    rig.open()
    rig.clear_fault()
    with pytest.raises(RigStopped, match="less than a count"):
        rig.configure(replace(WIDE, travel=(0.4 / COUNTS, 1.0)))


def test_a_run_that_starts_during_a_self_test_starts_at_zero(host):
    board = host()
    line = TerminalLine(board.port)
    rig = rig_on(line)
    rig.open()
    rig.clear_fault()
    rig.configure(WIDE)
    rig.arm()
    line.write(pack(Kind.SELF_TEST, 99, rig.session, self_test_body(500, 50)))
    assert line.read(1.0)
    rig.exchange(0.0)
    assert board.state()[5] == 500
    rig.start(Mode.HOST)
    assert board.state()[5:] == [0.0, 1.0, Mode.HOST]


def test_a_cut_link_is_told_as_one_and_the_rig_stops_itself(host):
    board = host()
    rig = board.rig(patience=0.05)
    rig.open()
    rig.clear_fault()
    rig.configure(WIDE)
    rig.arm()
    rig.start(Mode.HOST)
    rig.exchange(1.0)
    board.do("cut")
    with pytest.raises(RigStopped, match="did not answer"):
        rig.exchange(1.0)
    board.do("run 20")
    assert dead(board)
    rig.estop()  # says nothing on a dead line
    rig.close()
    rig.close()
