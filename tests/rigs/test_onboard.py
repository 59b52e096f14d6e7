"""Do the numbers that a board multiplies give the law's commands, from counts to steps?"""

from __future__ import annotations

import math
import struct
from dataclasses import replace

import numpy as np
import pytest

from upright.errors import BadInput
from upright.laws import Law, state_feedback
from upright.rigs import Capabilities
from upright.rigs.onboard import onboard, ticks

ABOUT = Capabilities(
    name="bench", coordinates=("psi", "theta"), counts=(2000.0, -500.0), command_unit="V", full_scale=10.0,
    steps=20_000, period=1e-3,
)  # fmt: skip
RNG = np.random.default_rng(2)
LAW = state_feedback([1.2, 0.03, -4.0, 0.2], 2e-3, memory=0.6, k_pf=0.8, limit=2.0, target=[0.1, -0.2])


def ran(board, counts, references):
    """Commands [steps] and memories, as docs/reference/firmware.md has the loop, in float32."""
    z, u, kept = board.initial + board.begin @ (counts[0] - board.target), [], []
    for now, r in zip(counts, references, strict=True):
        out = board.matrix @ np.concatenate([z, now - board.target, [r]]).astype(np.float32)
        kept.append(z)
        u.append(float(np.clip(out[-1], -board.limit, board.limit)))
        held = [bool(board.held_sums >> i & 1) and abs(out[-1]) > board.limit for i in range(4)]
        z = np.where(held, z, out[:4])
    return np.array(u), np.array(kept)


def test_a_board_s_matrix_gives_the_law_s_commands():
    y = np.cumsum(RNG.normal(size=(60, 2)), axis=0) * 0.01
    r = np.sin(0.2 * np.arange(60))
    board = onboard(LAW, ABOUT, 1e-3)
    counts = y * np.array(ABOUT.counts)
    u, _ = ran(board, counts, r)
    expected = replace(LAW, references=r).follow(y)[0][:, 0]
    assert np.abs(expected).max() == 2.0  # some of it at the limit
    # float32 keeps seven digits of numbers whose differences are taken
    assert u * ABOUT.step == pytest.approx(expected, abs=3e-3)
    assert (board.every, board.limit) == (2, 4000)
    assert board.target == pytest.approx([200.0, 100.0])


def test_sums_that_stand_still_at_the_limit_are_marked_by_their_bits():
    A = np.diag([1.0, 0.5, 1.0])
    law = Law(A, RNG.normal(size=(3, 2)), RNG.normal(size=(1, 3)), RNG.normal(size=(1, 2)), windup="hold", limit=1.0,
              initial=[0.1, 0.2, 0.3])  # fmt: skip
    board = onboard(law, ABOUT, 1e-3)
    assert board.held_sums == 0b101
    assert onboard(replace(law, windup="free"), ABOUT, 1e-3).held_sums == 0
    assert board.initial == pytest.approx([0.1, 0.2, 0.3, 0.0])
    y = RNG.normal(size=(40, 2)) * 0.1
    u, z = ran(board, y * np.array(ABOUT.counts), np.zeros(40))
    assert u * ABOUT.step == pytest.approx(law.follow(y)[0][:, 0], abs=1e-4)
    assert z[:, :3] == pytest.approx(law.follow(y)[1], abs=1e-5)
    assert board.every == 1  # of a law without a period


def test_a_law_of_named_readings_finds_them_on_the_rig():
    law = state_feedback([2.0, 0.1], 1e-3, measured=("theta",))
    board = onboard(law, ABOUT, 1e-3)
    y = np.cumsum(RNG.normal(size=(20, 2)), axis=0) * 0.01
    u, _ = ran(board, y * np.array(ABOUT.counts), np.zeros(20))
    expected = np.clip(law.follow(y[:, 1])[0][:, 0], -20_000 * ABOUT.step, 20_000 * ABOUT.step)
    assert u * ABOUT.step == pytest.approx(expected, abs=1e-2)


def test_the_body_is_the_matrix_row_by_row_and_three_numbers():
    board = onboard(LAW, ABOUT, 1e-3)
    body = board.body()
    assert len(body) == 4 * (35 + 2 + 4 + 8) + 4
    assert np.frombuffer(body, "<f4", 35).reshape(5, 7) == pytest.approx(board.matrix)
    assert struct.unpack("<hBB", body[-4:]) == (4000, 0, 2)


@pytest.mark.parametrize(
    ("period", "whole"), [(1e-3, 1), (0.255, 255), (2.0019e-3, 2), (0.256, None), (2.003e-3, None), (1e-4, None)]
)
def test_a_period_is_a_whole_number_of_ticks_up_to_255(period, whole):
    if whole is None:
        with pytest.raises(BadInput, match="the rig ticks every 1 ms"):
            ticks(period, 1e-3)
    else:
        assert ticks(period, 1e-3) == whole


def test_a_limit_is_rounded_down_to_steps_of_the_converter():
    small = replace(LAW, limit=1.2349e-3, target=[0.0, 0.0])
    assert onboard(small, ABOUT, 1e-3).limit == 2
    assert onboard(replace(LAW, limit=math.inf), ABOUT, 1e-3).limit == 20_000
    fine = replace(ABOUT, steps=40_000)
    assert onboard(replace(LAW, limit=math.inf), fine, 1e-3).limit == 32_767
    assert onboard(replace(LAW, limit=5e-4), ABOUT, 1e-3).limit == 1
    with pytest.raises(BadInput, match=r"limit of 0\.0004 V is less than the converter's step of 0\.0005 V"):
        onboard(replace(LAW, limit=4e-4), ABOUT, 1e-3)


def sized(memories, signals, commands=1, **more):
    """A law of zeros."""
    A, C = np.eye(memories), np.zeros((commands, memories))
    return Law(A, np.zeros((memories, signals)), C, np.zeros((commands, signals)), **more)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (sized(5, 2), "room for 4 memories, and this law has 5"),
        (sized(1, 2, 2), "room for 1 commands, and this law has 2"),
        (sized(1, 4, reference_names=("r", "s")), "room for 1 references, and this law has 2"),
        (sized(1, 3), "reads 3 coordinates, and the rig has 2"),
        (state_feedback([2.0, 0.1], 1e-3, measured=("phi",)), "the law reads phi, and the rig has psi, theta"),
        (replace(LAW, initial=np.zeros((4, 3))), "of several lanes"),
    ],
)
def test_what_has_no_room_on_a_board_is_refused(law, words):
    with pytest.raises(BadInput, match=words):
        onboard(law, ABOUT, 1e-3)
    assert onboard(sized(4, 2), ABOUT, 1e-3).matrix.shape == (5, 7)
