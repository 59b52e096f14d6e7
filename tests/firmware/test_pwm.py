"""Does an H-bridge on the ATmega2560 get the command, edge by edge under simavr, and never both sides at once?"""

from __future__ import annotations

import pytest

from benchmarks.boards import COUNTS, plant
from benchmarks.designs import GAIN, LIMITS, PARAMETERS, inverted
from benchmarks.minute import UPRIGHT, held
from tests.firmware.test_loops import KICKS, settled
from upright.rigs.protocol import Mode

DRIVES = ("pair", "sign")
SUPPLY, STEPS = 12.0, 800
"""Of the motor [V], and steps of the PWM to either side."""
CYCLES = 16_000
"""Of the processor, in a tick of 1 ms."""
HEAVY = {**PARAMETERS, "J_d": 1e3}
"""An arm that nothing moves."""


def driven(avr, drive, *arguments, mode=Mode.HOST, law=None):
    board = avr(*arguments, f"step={SUPPLY / STEPS!r}", drive=drive)
    rig = board.rig(lockstep=True, full_scale=SUPPLY)
    rig.open()
    rig.clear_fault()
    rig.configure(LIMITS)
    rig.zero()
    rig.arm()
    rig.start(mode, law)
    return board, rig


def pulses(board):
    """Shortest and longest time between two rises [cycles], and cycles forward, backward and both, since the last."""
    return [int(word) for word in board.say("pwm").split()]


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("steps", [5, 250, 533, -5, -400, -533])
def test_a_command_is_a_part_of_each_period_of_20_khz(avr, drive, steps):
    """From 5 steps on: of pulses as short as an instruction simavr leaves some out."""
    board, rig = driven(avr, drive, *plant(HEAVY, GAIN))
    for _ in range(3):
        rig.exchange(steps * SUPPLY / STEPS)
    pulses(board)
    before = board.state()[0]
    for _ in range(20):
        tick = rig.exchange(steps * SUPPLY / STEPS)
    passed = round(CYCLES * (board.state()[0] - before))
    shortest, longest, forward, backward, both = pulses(board)
    assert round(tick.applied * STEPS / SUPPLY) == steps
    # 16 MHz / 800; simavr's edges are late by an instruction of up to 4 cycles and an interrupt's entry
    assert abs(shortest - STEPS) <= 8
    assert abs(longest - STEPS) <= 8
    share = (forward - backward) / passed
    assert share == pytest.approx(steps / STEPS, abs=8 / STEPS)
    assert min(forward, backward) == both == 0


@pytest.mark.parametrize("drive", DRIVES)
def test_full_reversals_push_one_way_at_a_time(avr, drive):
    board, rig = driven(avr, drive, *plant(HEAVY, GAIN))
    pulses(board)
    for k in range(60):
        rig.exchange(8.0 * (-1) ** (k // 2))
    *_, forward, backward, both = pulses(board)
    assert both == 0
    assert min(forward, backward) > 0.8 * 0.5 * 8.0 / SUPPLY * 60 * CYCLES


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("how", ["stopped", "stopped by hand", "silent", "hung"])
def test_a_bridge_gets_nothing_once_the_rig_is_stopped(avr, drive, how):
    board, rig = driven(avr, drive, *plant(HEAVY, GAIN))
    for _ in range(5):
        rig.exchange(5.0)
    assert pulses(board)[2] > 0
    if how == "stopped":
        rig.stop()
    elif how == "stopped by hand":
        rig.estop()
    elif how == "silent":
        board.do("run 22")
    else:
        board.do("hang", "run 25")
    board.do("run 2")
    pulses(board)
    board.do("run 50")
    assert pulses(board) == [0, 0, 0, 0, 0]
    assert board.state()[5:7] == [0.0, 0.0]


@pytest.mark.slow
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("mode", [Mode.MCU, Mode.HOST])
def test_the_inverted_pendulum_is_held_through_kicks_by_pwm(avr, drive, mode):
    """Within the bounds of the same run with a converter of 16 bits (`test_loops`)."""
    board = avr(*UPRIGHT, f"step={SUPPLY / STEPS!r}", drive=drive)
    rows, rig = held(board, mode, inverted(), 4.0, KICKS, lockstep=True, full_scale=SUPPLY)
    rest, farthest = settled(rows, KICKS)
    assert rest < 0.02 * COUNTS
    assert 0.05 * COUNTS < farthest < 0.3 * COUNTS
    assert rig.snapshot().lost == 0
