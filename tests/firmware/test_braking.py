"""Does a board that was compiled to brake short the motor when it stops, for so long and no longer?"""

from __future__ import annotations

import math
import subprocess

import pytest

import upright as up
from benchmarks.boards import FIRMWARE, Board, plant
from benchmarks.designs import GAIN, PARAMETERS
from tests.firmware.test_pwm import HEAVY, MEGA_STEP, SUPPLY, WIDE, driven
from upright.errors import BadInput
from upright.rigs.firmware import board_of, build_image
from upright.rigs.protocol import Fault

TICKS = 300
ARM = {**PARAMETERS, "m_p": 1e-9, "J_d": 2e-3, "b_1": 2e-4}
"""One that no pendulum pulls at [SI]."""
EMF = 0.02
"""Damping by its motor's own voltage over its resistance, k^2/R [N m s/rad]: 0.1 s of time constant."""


@pytest.fixture
def braking(built, tmp_path):
    """Starts the Mega's image with two PWM lines, compiled to brake for `TICKS`."""
    tools, boards = built("avr", "avr-gcc"), []
    built("simrig", "cc simavr")
    image = tmp_path / "atmega2560-pair.elf"
    subprocess.run(
        ["make", "-s", "-C", FIRMWARE, f"B={tmp_path}", f"CEILINGS=-DCEILING_BRAKE={TICKS}", image],
        check=True, capture_output=True,
    )  # fmt: skip

    def start(parameters, *more):
        boards.append(Board(tools / "simrig", image, "pair", *plant(parameters, GAIN), f"step={MEGA_STEP!r}", *more))
        return boards[-1], driven(boards[-1].rig(lockstep=True, full_scale=SUPPLY))

    yield start
    for board in boards:
        board.close()


STOPS = {
    "stopped": (lambda board, rig: rig.stop(), Fault(0)),
    "stopped by hand, twice": (lambda board, rig: (rig.estop(), rig.estop()), Fault.STOP),
    "silent": (lambda board, rig: board.do("run 22"), Fault.WATCHDOG),
}


@pytest.mark.parametrize("how", STOPS)
def test_both_lines_are_low_and_the_bridge_is_on_for_that_long_and_then_off(braking, how):
    board, rig = braking(HEAVY)
    for _ in range(5):
        rig.exchange(5.0)
    stop, fault = STOPS[how]
    stop(board, rig)
    began = board.state()[0]
    board.say("pwm")
    board.do(f"run {TICKS - 25}")
    assert board.state()[6] == 1.0
    board.do("run 30")
    assert board.state()[0] > began + TICKS
    assert board.state()[6] == 0.0
    assert board.say("pwm").split() == ["0"] * 5
    assert rig.exchange(5.0).faults == fault
    assert board.state()[5:7] == [0.0, 0.0]


def test_a_board_that_is_reset_while_it_brakes_is_off(braking):
    board, rig = braking(HEAVY)
    rig.exchange(5.0)
    rig.stop()
    board.do("run 50")
    assert board.state()[6] == 1.0
    board.do("reset", "run 5")
    assert board.state()[6] == 0.0


def test_a_rig_that_is_armed_while_it_brakes_is_armed_and_stays_on_no_longer_than_it_is(braking):
    board, rig = braking(HEAVY)
    rig.stop()
    rig.arm()
    board.do("run 400")
    assert board.state()[6] == 1.0
    rig.stop()
    board.do("run 310")
    assert board.state()[6] == 0.0


def test_an_arm_whose_motor_is_shorted_stops_as_its_time_constant_says(braking):
    """v exp(-t/tau) with tau = J/(b + k^2/R): 0.47 rad from 5 rad/s, where it would coast 50."""
    board, rig = braking(ARM, f"emf={EMF!r}")
    speed, J = 5.0, ARM["J_d"] + ARM["J_a"] + ARM["m_p"] * ARM["r"] ** 2
    tau, slow = J / (ARM["b_1"] + EMF), J / ARM["b_1"]
    rig.exchange(0.0)
    board.do(f"put 0 {speed} 0 0")
    rig.estop()
    began, psi, psi_dot, *_ = board.state()
    board.do(f"run {TICKS + 100}")
    now, there, after, *_ = board.state()
    left = math.exp(-TICKS * 1e-3 / tau)
    coasted = now - began - TICKS
    # to the ticks at both ends
    assert after == pytest.approx(psi_dot * left * math.exp(-1e-3 * coasted / slow), rel=2e-3 / tau)
    assert there - psi == pytest.approx(psi_dot * (tau * (1 - left) + left * 1e-3 * coasted), abs=2e-3 * speed)
    assert there < speed * slow / 100


@pytest.mark.parametrize(("drive", "brake", "why"), [
    ("sign", "0.3 s", "shorts the motor while both PWM lines are low .BTS7960.: drive.*pair.*, got 'sign'"),
    ("pair", "2 s", "0 to 1 s, got 2 s"), ("pair", -0.1, "0 to 1 s, got -0.1 s"),
])  # fmt: skip
def test_a_maker_is_told_which_brake_there_is_before_a_compiler_is_asked(drive, brake, why, tmp_path):
    with pytest.raises(BadInput, match=why):
        up.firmware_build(drive=drive, brake=brake, out=tmp_path)


@pytest.mark.parametrize("drive", ["analog", "sign"])
def test_what_an_input_that_is_low_does_not_short_is_refused(drive, built, tmp_path):
    built("avr", "avr-gcc")
    with pytest.raises(BadInput, match="a bridge that shorts the motor while both are low: a BTS7960"):
        build_image(board_of("mega"), drive, tmp_path, {"BRAKE": 300})


def test_a_brake_of_more_than_a_second_is_refused(built, tmp_path):
    built("avr", "avr-gcc")
    with pytest.raises(BadInput, match="a brake lasts 1 s at most"):
        build_image(board_of("mega"), "pair", tmp_path, {"BRAKE": 1001})


def test_limits_are_held_while_it_brakes(braking):
    """What is driven in the tick of the stop is not driven again until it is armed."""
    board, rig = braking(HEAVY)
    rig.exchange(WIDE.command)
    rig.stop()
    board.do("run 2")
    board.say("pwm")
    for _ in range(20):
        rig.exchange(WIDE.command)
    assert board.say("pwm").split() == ["0"] * 5
