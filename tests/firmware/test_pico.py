"""Does the Pico's own image, on an emulated RP2040, count edges and compute as every other board?

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
from tests.firmware.test_pwm import STEPS, SUPPLY, WIDE, driven
from upright.laws import state_feedback
from upright.rigs.protocol import Fault, Mode


def on(board):
    return rig_on(PicoLine(board), lockstep=True, full_scale=SUPPLY)


def test_every_edge_is_counted(pico):
    board = pico()
    rig = driven(on(board))
    for k in range(300):
        tick = rig.exchange(3.0 if k < 150 else -3.0)
    assert tick.mode == Mode.HOST
    assert abs(tick.counts[0]) > 1000
    _, psi, _, theta, *_ = board.state()
    # the rig moves on between a tick and its answer, by up to 48 rad/s in 1 ms
    assert tick.counts == (pytest.approx(psi * COUNTS, abs=130), pytest.approx(theta * COUNTS, abs=130))


def test_a_transition_that_no_encoder_makes_stops_the_rig(pico):
    board = pico()
    rig = driven(on(board))
    rig.exchange(1.0)
    board.do("illegal")
    assert rig.exchange(1.0).faults == Fault.ENCODER


def test_its_arithmetic_is_that_of_every_other_board(pico):
    """The commands of a law in float32, from the counts that it tells, to the last step."""
    law = state_feedback([-0.8, -0.03, 0.5, 0.02], 1e-3, memory=0.5, target=[0.3, 0.1])
    rig = driven(on(pico()), Mode.MCU, law)
    ticks = [rig.exchange(0.0) for _ in range(400)]
    assert {t.mode for t in ticks} == {Mode.MCU}
    assert np.array_equal(np.diff([t.tick for t in ticks]), np.ones(399))
    about = replace(ABOUT, full_scale=SUPPLY, steps=STEPS["Pico"])
    put, most = (
        [round(t.applied * STEPS["Pico"] / SUPPLY) for t in ticks],
        math.floor(WIDE.command * STEPS["Pico"] / SUPPLY),
    )
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
