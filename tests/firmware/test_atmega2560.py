"""Does the ATmega2560's own firmware, under simavr with real quadrature edges and SPI frames, hold the pendulum?"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.boards import COUNTS, STEP, plant, rig_on
from benchmarks.designs import FURUTA, GAIN, LIMITS, PARAMETERS, PERIOD, inverted
from benchmarks.minute import KICKS, TICK, UPRIGHT, held
from tests.firmware.test_laws import FREE, in_float32
from tests.firmware.test_loops import is_lifted_and_let_go, settled, swung
from upright.errors import RigStopped
from upright.laws import state_feedback
from upright.rigs.line import TerminalLine
from upright.rigs.protocol import Fault, Mode
from upright.simulation import simulate


def started(board, mode, law=None, limits=LIMITS):
    rig = board.rig(lockstep=True)
    rig.open()
    rig.clear_fault()
    rig.configure(limits)
    rig.zero()
    rig.arm()
    rig.start(mode, law)
    return rig


@pytest.mark.slow
@pytest.mark.parametrize("mode", [Mode.MCU, pytest.param(Mode.HOST, marks=pytest.mark.thorough)])
def test_it_is_held_for_a_minute_through_kicks_without_a_lost_tick(avr, mode):
    board = avr(*UPRIGHT)
    rows, rig = held(board, mode, inverted(), 60.0, KICKS, lockstep=True)
    # with a law at work a sample of every second tick has time to leave
    assert set(np.diff(rows[:, 0])) <= ({1} if mode == Mode.HOST else {1, 2})
    rest, farthest = settled(rows, KICKS)
    assert rest < 0.02 * COUNTS  # as on the host port
    assert 0.05 * COUNTS < farthest < 0.3 * COUNTS
    assert rig.snapshot().lost == 0
    worst = board.state()[7]
    print(f"longest tick in {mode.name}: {worst:.0f} cycles, {worst / TICK:.0%} of it")
    assert worst < 0.7 * TICK


@pytest.mark.slow
@pytest.mark.parametrize("mode", [Mode.MCU, Mode.HOST])
def test_runs_are_the_same_to_the_last_bit(avr, mode):
    kicks = {0.5: 0.6, 1.5: -0.9}
    first, again = (held(avr(*UPRIGHT), mode, inverted(), 3.0, kicks, lockstep=True)[0] for _ in range(2))
    assert np.array_equal(first, again)


def test_its_arithmetic_is_that_of_every_other_board(avr):
    law = state_feedback([0.3, 0.02, 0.5, 0.04], 20 * PERIOD, memory=0.5)
    board = avr(*plant(PARAMETERS, GAIN))
    rig = started(board, Mode.MCU, law, FREE)
    rig.exchange(0.0)
    board.do("kick 3.0")
    ticks = [rig.exchange(0.0) for _ in range(1000)]
    counts, put = {t.tick: t.counts for t in ticks}, {t.tick: round(t.applied / STEP) for t in ticks}
    most, fits = math.floor(FREE.command / STEP), []
    # which ticks its samples are is not told: one of the 20 has to fit, from the first sample, which was at rest, on
    for first in range(ticks[0].tick, ticks[0].tick + 20):
        at = [k for k in range(first, ticks[-1].tick - 2, 20) if k in counts]
        expected = in_float32(
            replace(law, period=PERIOD), [(0, 0), *(counts[k] for k in at)], [0.0] * (1 + len(at)), most
        )
        after = [put.get(k + 1, put.get(k + 2)) for k in at]
        if expected[1:].tolist() == after and len(at) > 50:
            fits.append(first)
            assert len(set(after)) > 40
    assert len(fits) == 1


@pytest.mark.slow
def test_its_pendulum_moves_as_the_project_says(avr):
    start = {"psi": 0.3, "psi_dot": -1.0, "theta": 2.0, "theta_dot": 3.0}
    board = avr(*plant(PARAMETERS, GAIN, **start))
    board.do("release", "run 1000")
    x = simulate(FURUTA, {}, [*start.values()], None, PERIOD, samples=1001, substeps=20)[-1, :, 0]
    np.testing.assert_allclose(board.state()[1:5], x, atol=1e-9)


def test_the_hand_beside_it_is_that_of_the_host(avr):
    assert is_lifted_and_let_go(swung(avr(*plant(PARAMETERS, GAIN)), lockstep=True))


@pytest.mark.slow
def test_edges_are_counted_at_every_speed_that_the_tick_leaves_room_for(avr):
    board = avr(*plant({**PARAMETERS, "b_1": 0.0, "b_2": 0.0, "g": 1e-9}, GAIN, psi_dot=0.0, theta_dot=15.0))
    board.do("release")
    rig = board.rig(lockstep=True)
    rig.open()
    rig.clear_fault()
    rig.zero()
    first = board.state()[3]
    ticks = [rig.exchange(0.0) for _ in range(500)]
    # 15 rad/s are 38 edges a tick
    assert abs(ticks[-1].counts[1] - (board.state()[3] - first) * COUNTS) < 60
    assert ticks[-1].counts[1] > 10_000


@pytest.mark.slow
@pytest.mark.parametrize(("arm", "pendulum"), [(14.0, 14.0), (0.0, 20.0)])
def test_a_driven_rig_that_swings_fast_is_counted_edge_by_edge(avr, arm, pendulum):
    """Of 16,000 a turn; a pendulum of 20 cm that comes from upright passes the bottom with 14 rad/s."""
    free = {**PARAMETERS, "b_1": 0.0, "b_2": 0.0, "g": 1e-9, "r": 1e-9}
    board = avr(*plant(free, 1e-9, psi_dot=arm, theta_dot=pendulum))
    rig = started(board, Mode.HOST, limits=FREE)
    first, began = rig.exchange(0.0), board.state()
    ticks = [rig.exchange(0.001 * (k % 7)) for k in range(700)]
    assert {t.mode for t in ticks} == {Mode.HOST}
    ended = board.state()
    for i, speed in enumerate((arm, pendulum)):
        edges = (ended[1 + 2 * i] - began[1 + 2 * i]) * COUNTS
        # the board stands still up to a tick after a sample
        assert abs(ticks[-1].counts[i] - first.counts[i] - edges) <= 2 * speed * COUNTS / 1000 + 1
        assert edges >= 0.5 * speed * COUNTS - 1


def test_a_processor_that_cannot_keep_up_stops(avr):
    far_too_fast = {"psi_dot": 20.0, "theta_dot": 20.0}  # 100,000 edges a second, and a law besides
    board = avr(*plant({**PARAMETERS, "b_1": 0.0, "b_2": 0.0, "g": 1e-9, "r": 1e-9}, GAIN, **far_too_fast))
    rig = started(board, Mode.HOST, limits=FREE)
    assert board.state()[6] == 1.0
    rig.stop()
    with suppress(RigStopped):  # it may not come to answer, or have stopped over the law that it is given
        rig.arm()
        rig.start(Mode.MCU, inverted())
        for _ in range(50):
            rig.exchange(0.0)
    board.do("run 25")
    assert board.state()[6] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mishap", "faults"),
    [
        ("dead 1", Fault.OVERTRAVEL | Fault.OVERSPEED | Fault.ENCODER | Fault.SATURATION),
        ("flip 0", Fault.OVERTRAVEL | Fault.OVERSPEED | Fault.SATURATION),
        ("lose 1 2000", Fault.OVERSPEED | Fault.OVERRUN),
        ("illegal", Fault.ENCODER),
    ],
)
def test_a_lying_encoder_ends_in_a_fault_with_the_power_off(avr, mishap, faults):
    board = avr(*UPRIGHT)
    rig = started(board, Mode.MCU, inverted(), replace(LIMITS, frozen=0.2, speed=(12.0, 12.0)))
    board.do("kick 0.2")
    for _ in range(200):
        assert rig.exchange(0.0).mode == Mode.MCU
    board.do(mishap)
    stopped = next(tick for _ in range(4000) if (tick := rig.exchange(0.0)).mode == Mode.FAULT)
    assert stopped.faults & faults == stopped.faults
    board.do("run 1")  # the converter is told over its own wire
    assert board.state()[5:7] == [0.0, 0.0]


@pytest.mark.parametrize("mode", [Mode.IDLE, Mode.FAULT])
def test_a_converter_that_lost_its_zero_gets_it_again_and_the_enable_line_follows_it(avr, mode):
    board = avr(*UPRIGHT)
    rig = started(board, Mode.HOST)
    rig.exchange(1.0)
    rig.stop() if mode == Mode.IDLE else rig.estop()
    board.do("glitch 12345")
    assert board.state()[5:7] == [12345, 0.0]
    board.do("run 2")
    assert board.state()[5:7] == [0.0, 0.0]
    if mode == Mode.IDLE:
        board.do("glitch 12345")
        rig.arm()
        assert board.say("met") == "0"
        assert board.state()[6] == 1.0


def test_a_processor_that_hangs_is_reset_with_the_power_off(avr):
    board = avr(*UPRIGHT)
    rig = started(board, Mode.MCU, inverted())
    board.do("kick 0.2")
    assert rig.exchange(0.0).mode == Mode.MCU
    assert board.state()[6] == 1.0
    board.do("hang", "run 25")  # its watchdog takes 15 ms
    assert board.state()[6] == 0.0
    assert rig.exchange(0.0).faults == Fault.RESET
    with pytest.raises(RigStopped, match="cleared"):
        rig.arm()


def test_a_cut_link_stops_it_and_a_counter_may_run_over(avr):
    board = avr(*UPRIGHT)
    rig = board.rig(lockstep=True)
    rig.open()
    rig.clear_fault()
    rig.configure(LIMITS)
    board.do(f"wrap 0 {2**31 - 2}", f"wrap 1 {2**32 - 2}", "run 10")
    rig.zero()
    rig.arm()
    rig.start(Mode.MCU, inverted())
    board.do("kick 0.2")
    ticks = [rig.exchange(0.0) for _ in range(300)]
    assert {t.mode for t in ticks} == {Mode.MCU}
    assert max(abs(t.counts[1]) for t in ticks) > 10
    board.do("cut", "run 25")
    assert board.state()[5:7] == [0.0, 0.0]
    board.do("join")
    assert rig.exchange(0.0).faults == Fault.WATCHDOG


def test_a_spoiled_request_takes_no_longer_than_its_bytes(avr):
    """Whoever waits for its answer lets time pass: 16 ms of it for each would outlast every watchdog."""
    board = avr(*UPRIGHT)
    line = TerminalLine(board.port)
    rig = rig_on(line, lockstep=True)
    rig.open()
    before = board.state()[0]
    line.write(bytes([7]) + b"not COBS" + bytes([0]))
    board.state()
    spoiled = board.state()[0]
    assert spoiled - before < 1.0  # 10 bytes at 1 Mbaud take 0.1 ms
    assert rig.snapshot().dropped == 1
