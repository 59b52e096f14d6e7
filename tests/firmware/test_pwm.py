"""Does an H-bridge get the command, edge by edge under simavr and rp2040js, never both sides at once, and nothing once
the rig is stopped?
"""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from benchmarks.boards import COUNTS, Board, PicoLine, plant, rig_on
from benchmarks.designs import GAIN, PARAMETERS, inverted
from benchmarks.minute import UPRIGHT, held
from tests.firmware.test_loops import KICKS, settled
from upright.errors import RigStopped
from upright.laws import Law
from upright.rigs.protocol import Fault, Limits, Mode
from upright.rigs.serial import SerialRig

DRIVES = ("pair", "sign")
SUPPLY = 12.0
"""Of the motor [V]."""
STEPS = {"Mega": 800, "Pico": 6250}
"""Of the PWM to either side."""
MEGA_STEP = SUPPLY / STEPS["Mega"]
TICK = {"Mega": 16_000, "Pico": 1_000_000}
"""1 ms as the emulator counts it: cycles of 16 MHz, ns."""
EDGE = {"Mega": 8, "Pico": 24}
"""By which an edge may be late in it: an instruction of up to 4 cycles and an interrupt's entry; 3 cycles of 8 ns."""
ROUNDED = {"Mega": 8, "Pico": 4}
"""The same in steps of the PWM, over the ticks that are looked at."""
WIDE = Limits(travel=(1e3, 1e3), speed=(48.0, 48.0), start=(9.0, 9.0), command=9.0, watchdog=0.02, saturation=5.0)
HEAVY = {**PARAMETERS, "J_d": 1e3}
"""An arm that nothing moves."""


@dataclass(frozen=True, kw_only=True)
class Bridge:
    """A board with an H-bridge that is driven by the host."""

    name: str
    board: Board
    rig: SerialRig

    def pulses(self) -> list[int]:
        """Shortest and longest time between two rises, and how long it pushed forward, backward and both, since the
        last time.
        """
        return [int(word) for word in self.board.say("pwm").split()]

    def time(self) -> float:
        """As its emulator counts it."""
        return TICK[self.name] * self.board.state()[0]


def driven(rig: SerialRig, mode: Mode = Mode.HOST, law: Law | None = None) -> SerialRig:
    """The same rig, with its drive on."""
    rig.open()
    rig.clear_fault()
    rig.configure(WIDE)
    rig.zero()
    rig.arm()
    rig.start(mode, law)
    return rig


@pytest.fixture(params=[(name, drive) for name in STEPS for drive in DRIVES], ids=lambda param: "-".join(param))
def bridge(request):
    name, drive = request.param
    board = request.getfixturevalue("avr" if name == "Mega" else "pico")
    if name == "Mega":
        board = board(*plant(HEAVY, GAIN), f"step={MEGA_STEP!r}", drive=drive)
        rig = board.rig(lockstep=True, full_scale=SUPPLY)
    else:
        board = board(drive)
        rig = rig_on(PicoLine(board), lockstep=True, full_scale=SUPPLY)
    return Bridge(name=name, board=board, rig=driven(rig))


@pytest.mark.parametrize("share", [1 / 160, 0.1, 0.3, 0.667, -1 / 160, -0.5, -0.74])
def test_a_command_is_a_part_of_each_period_of_20_khz(bridge, share):
    """From 1/160 on: of pulses as short as an instruction simavr leaves some out."""
    steps = STEPS[bridge.name]
    asked = round(share * steps)
    for _ in range(3):
        bridge.rig.exchange(asked * SUPPLY / steps)
    bridge.pulses()
    before = bridge.time()
    ticks = [bridge.rig.exchange(asked * SUPPLY / steps) for _ in range(20)]
    passed = bridge.time() - before
    shortest, longest, forward, backward, both = bridge.pulses()
    assert {round(tick.applied * steps / SUPPLY) for tick in ticks} == {asked}
    assert abs(shortest - TICK[bridge.name] / 20) <= EDGE[bridge.name]
    assert abs(longest - TICK[bridge.name] / 20) <= EDGE[bridge.name]
    assert (forward - backward) / passed == pytest.approx(asked / steps, abs=ROUNDED[bridge.name] / steps)
    assert min(forward, backward) == both == 0


def test_full_reversals_push_one_way_at_a_time(bridge):
    bridge.pulses()
    for k in range(40):
        bridge.rig.exchange(9.0 * (-1) ** (k // 2))
    *_, forward, backward, both = bridge.pulses()
    assert both == 0
    assert min(forward, backward) > 0.8 * 0.5 * 9.0 / SUPPLY * 40 * TICK[bridge.name]


STOPS = {
    "stopped": (lambda b: b.rig.stop(), Fault(0)),
    "stopped by hand": (lambda b: b.rig.estop(), Fault.STOP),
    "silent": (lambda b: b.board.do("run 22"), Fault.WATCHDOG),
    "hung": (lambda b: b.board.do("hang", "run 25"), Fault.RESET),  # its own watchdog takes 15 ms
    "reset": (lambda b: b.board.do("reset", "run 5"), Fault.RESET),
}


@pytest.mark.parametrize("how", STOPS)
def test_a_bridge_gets_nothing_once_the_rig_is_stopped(bridge, how):
    for _ in range(5):
        bridge.rig.exchange(5.0)
    assert bridge.pulses()[2] > 0
    stop, fault = STOPS[how]
    stop(bridge)
    bridge.board.do("run 2")
    bridge.pulses()
    bridge.board.do("run 50")
    assert bridge.pulses() == [0, 0, 0, 0, 0]
    assert bridge.board.state()[5:7] == [0.0, 0.0]
    assert bridge.rig.exchange(0.0).faults == fault
    if fault == Fault.RESET:
        with pytest.raises(RigStopped, match="cleared"):
            bridge.rig.arm()


@pytest.mark.slow
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("mode", [Mode.MCU, Mode.HOST])
def test_the_inverted_pendulum_is_held_through_kicks_by_pwm(avr, drive, mode):
    """Within the bounds of the same run with a converter of 16 bits (`test_loops`)."""
    board = avr(*UPRIGHT, f"step={MEGA_STEP!r}", drive=drive)
    rows, rig = held(board, mode, inverted(), 4.0, KICKS, lockstep=True, full_scale=SUPPLY)
    rest, farthest = settled(rows, KICKS)
    assert rest < 0.02 * COUNTS
    assert 0.05 * COUNTS < farthest < 0.3 * COUNTS
    assert rig.snapshot().lost == 0
