"""Does the Pico's own image, on an emulated RP2040, drive its bridge, count edges, and stop?

The emulator knows no wait for the flash, nor the time of a byte that is sent: what is computed is the board's; how long
it takes only a bench shows.
"""

from __future__ import annotations

import math
import runpy
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.boards import COUNTS, FIRMWARE, PicoLine, rig_on
from tests.firmware.test_laws import ABOUT, in_float32
from upright.errors import RigStopped
from upright.laws import state_feedback
from upright.rigs.protocol import Fault, Limits, Mode

SUPPLY, STEPS = 12.0, 6250
PERIOD_NS = 50_000
"""Of the PWM, 20 kHz."""
WIDE = Limits(travel=(1e3, 1e3), speed=(48.0, 48.0), start=(9.0, 9.0), command=9.0, watchdog=0.02, saturation=5.0)


def driven(board, mode=Mode.HOST, law=None):
    rig = rig_on(PicoLine(board), lockstep=True, full_scale=SUPPLY)
    rig.open()
    rig.clear_fault()
    rig.configure(WIDE)
    rig.zero()
    rig.arm()
    rig.start(mode, law)
    return rig


def pulses(board):
    return [int(word) for word in board.say("pwm").split()]


@pytest.mark.parametrize("drive", ["pair", "sign"])
@pytest.mark.parametrize("steps", [1, 700, -1, -4687])
def test_a_command_is_a_part_of_each_period_of_20_khz(pico, drive, steps):
    board = pico(drive)
    rig = driven(board)
    for _ in range(3):
        rig.exchange(steps * SUPPLY / STEPS)
    pulses(board)
    before = board.state()[0]
    ticks = [rig.exchange(steps * SUPPLY / STEPS) for _ in range(10)]
    passed = 1e6 * (board.state()[0] - before)
    shortest, longest, forward, backward, both = pulses(board)
    assert {round(t.applied * STEPS / SUPPLY) for t in ticks} == {steps}
    assert abs(shortest - PERIOD_NS) <= 24  # three cycles of 8 ns: the emulator's time goes by instructions
    assert abs(longest - PERIOD_NS) <= 24
    assert (forward - backward) / passed == pytest.approx(steps / STEPS, abs=4 / STEPS)
    assert min(forward, backward) == both == 0


@pytest.mark.parametrize("drive", ["pair", "sign"])
def test_full_reversals_push_one_way_at_a_time(pico, drive):
    board = pico(drive)
    rig = driven(board)
    pulses(board)
    for k in range(20):
        rig.exchange(9.0 * (-1) ** k)
    *_, forward, backward, both = pulses(board)
    assert both == 0
    assert min(forward, backward) > 0.8 * 0.75 * 10e6  # of 20 ms, three quarters of half the time


@pytest.mark.parametrize("how", ["stopped", "stopped by hand", "silent", "hung", "reset"])
def test_a_bridge_gets_nothing_once_the_rig_is_stopped(pico, how):
    """Hung: its watchdog takes 15 ms."""
    board = pico()
    rig = driven(board)
    for _ in range(3):
        rig.exchange(5.0)
    assert pulses(board)[2] > 0
    if how == "stopped":
        rig.stop()
    elif how == "stopped by hand":
        rig.estop()
    elif how == "silent":
        board.do("run 21")
    elif how == "hung":
        board.do("hang", "run 16")
    else:
        board.do("reset", "run 1")
    board.do("run 1")
    pulses(board)
    board.do("run 20")
    assert pulses(board) == [0, 0, 0, 0, 0]
    assert board.state()[5:7] == [0.0, 0.0]
    tick = rig.exchange(0.0)
    assert tick.faults == {
        "stopped": Fault(0), "stopped by hand": Fault.STOP, "silent": Fault.WATCHDOG, "hung": Fault.RESET,
        "reset": Fault.RESET,
    }[how]  # fmt: skip
    if how == "hung":
        with pytest.raises(RigStopped, match="cleared"):
            rig.arm()


def test_every_edge_is_counted(pico):
    board = pico()
    rig = driven(board)
    for k in range(300):
        tick = rig.exchange(3.0 if k < 150 else -3.0)
    assert tick.mode == Mode.HOST
    assert abs(tick.counts[0]) > 1000
    _, psi, _, theta, *_ = board.state()
    # the rig moves on between a tick and its answer, by up to 48 rad/s in 1 ms
    assert tick.counts == (pytest.approx(psi * COUNTS, abs=130), pytest.approx(theta * COUNTS, abs=130))


def test_a_transition_that_no_encoder_makes_stops_the_rig(pico):
    board = pico()
    rig = driven(board)
    rig.exchange(1.0)
    board.do("illegal")
    assert rig.exchange(1.0).faults == Fault.ENCODER


def test_its_arithmetic_is_that_of_every_other_board(pico):
    """The commands of a law in float32, from the counts that it tells, to the last step."""
    law = state_feedback([-0.8, -0.03, 0.5, 0.02], 1e-3, memory=0.5, target=[0.3, 0.1])
    rig = driven(pico(), Mode.MCU, law)
    ticks = [rig.exchange(0.0) for _ in range(400)]
    assert {t.mode for t in ticks} == {Mode.MCU}
    assert np.array_equal(np.diff([t.tick for t in ticks]), np.ones(399))
    about = replace(ABOUT, full_scale=SUPPLY, steps=STEPS)
    put, most = [round(t.applied * STEPS / SUPPLY) for t in ticks], math.floor(WIDE.command * STEPS / SUPPLY)
    assert len(set(put)) > 40
    fits = 0
    for before in range(3):  # samples at rest before the first that is told
        q = [(0, 0)] * before + [t.counts for t in ticks]
        expected = in_float32(law, q, [0.0] * len(q), most, about)
        fits += expected[before:-1].tolist() == put[1:]
    assert fits >= 1  # from rest it is the same whichever tick was its first


def test_the_boot_rom_s_checksum_is_the_one_whose_check_value_is_published():
    """CRC-32/MPEG-2 of "123456789" is 0376e6e7 in every catalogue."""
    assert runpy.run_path(str(FIRMWARE / "uf2.py"))["checksum"](b"123456789") == 0x0376E6E7
