"""Is a law by which one count is everything refused, whatever way the count takes to the command?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from upright.errors import BadInput
from upright.laws import Law, state_feedback
from upright.rig.makes import make_rig
from upright.rigs import Capabilities, Limits
from upright.rigs.law import RunningLaw, absurdity, for_rig
from upright.rigs.onboard import MEMORIES

PER, LIMIT = 2000.0, 5.0
"""Counts per rad and the largest command [V] of `ABOUT`."""
ABOUT = Capabilities(
    name="bench", coordinates=("psi", "theta"), counts=(PER, -PER), command_unit="V", full_scale=10.0, steps=32768,
    period=1e-3,
)  # fmt: skip
FREE = Limits(travel=(9.0, 9.0), speed=(9.0, 9.0), start=(9.0, 9.0), command=LIMIT)


def chained(gain, memories, reading=1):
    """A shift register: the command is what a reading was so many samples ago, times a gain."""
    B, C = np.zeros((memories, 2)), np.zeros((1, memories))
    B[0, reading], C[0, -1] = gain, 1.0
    return Law(np.eye(memories, k=-1), B, C, np.zeros((1, 2)))


def at_once(gain):
    return Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), np.array([[0.0, gain]]))


def begun(gain):
    """The first reading stays in the memory, as an offset of the command."""
    return Law(np.eye(1), np.zeros((1, 2)), np.ones((1, 1)), np.zeros((1, 2)), begin=np.array([[0.0, gain]]))


def grown(gain):
    """u[k+2] = 30 * (gain/30) w[k]: neither B nor C alone is large."""
    A = np.array([[0.0, 0.0], [30.0, 0.0]])
    return Law(A, np.array([[0.0, gain / 30.0], [0.0, 0.0]]), np.array([[0.0, 1.0]]), np.zeros((1, 2)))


PATHS = {
    "at once": at_once,
    "through one memory": lambda gain: chained(gain, 1),
    "through every memory of the firmware": lambda gain: chained(gain, MEMORIES),
    "through a memory that grows": grown,
    "through the memory that it begins": begun,
}
"""Laws whose command moves by a gain [V/rad] at most after a reading, by the way that it takes."""


@pytest.mark.parametrize("path", PATHS)
def test_a_count_that_moves_the_command_by_all_of_it_is_refused(path):
    assert absurdity(PATHS[path](0.99 * LIMIT * PER), ABOUT, FREE) == ""
    refused = absurdity(PATHS[path](1.01 * LIMIT * PER), ABOUT, FREE)
    assert refused.startswith("its gain on theta is absurd: one count changes the command by 5.05 V")


def test_a_law_of_the_host_may_have_more_memories_than_a_board_and_is_looked_at_through_all():
    assert absurdity(chained(0.99 * LIMIT * PER, 9), ABOUT, FREE) == ""
    assert "5.05 V 9 samples later" in absurdity(chained(1.01 * LIMIT * PER, 9), ABOUT, FREE)


def test_one_count_through_a_memory_of_a_rig_is_390_volts():
    """B = 1e6, C = 1, D = 0 behind an encoder of 16,000 counts per turn: 1e6 * 2 pi/16000 V."""
    rig = make_rig("furuta")
    assert rig.per_unit[0] == pytest.approx(16000 / (2 * np.pi))
    about = Capabilities(
        name="rig", coordinates=("psi", "theta"), counts=rig.per_unit, command_unit="V", full_scale=10.0, steps=32768,
        period=rig.period,
    )  # fmt: skip
    law = Law(np.zeros((1, 1)), np.array([[1e6, 0.0]]), np.ones((1, 1)), np.zeros((1, 2)))
    assert "its gain on psi is absurd: one count changes the command by 393 V 1 sample later" in absurdity(
        law, about, FREE
    )


@pytest.mark.parametrize(("growth", "refused"), [(1.0, False), (-1.0, False), (1.008, False), (1.009, True)])
def test_a_law_that_grows_e_fold_within_123_samples_is_refused(growth, refused):
    law = Law(np.array([[growth]]), np.zeros((1, 2)), np.ones((1, 1)), np.zeros((1, 2)))
    assert ("its own memory is unstable" in absurdity(law, ABOUT, FREE)) == refused


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_a_count_that_stays_for_100_samples_may_not_add_up_to_the_whole_command(share):
    law = Law(np.eye(1), np.array([[0.0, share * LIMIT * PER / 100]]), np.ones((1, 1)), np.zeros((1, 2)))
    refused = absurdity(law, ABOUT, FREE)
    assert ("one count that stays for 100 samples changes the command by 5.05 V" in refused) == (share > 1)


def test_a_number_that_overflows_on_its_way_is_refused():
    A = np.array([[0.0, 0.0], [1e200, 0.0]])
    law = Law(A, np.array([[1e200, 0.0], [0.0, 0.0]]), np.array([[0.0, 1.0]]), np.zeros((1, 2)))
    assert "its gain on psi is absurd" in absurdity(law, ABOUT, FREE)


def test_a_law_without_a_reference_follows_zero_and_another_one_what_it_is_given():
    plain = RunningLaw(at_once(1e-3), 1e-3)
    plain.step([0.1, 0.0])
    assert plain.followed == 0.0
    led = Law(
        np.zeros((0, 0)), np.zeros((0, 3)), np.zeros((1, 0)), np.array([[0.0, 0.0, 2.0]]),
        reference_names=("reference",),
    )  # fmt: skip
    running = RunningLaw(led, 1e-3)
    assert running.step([0.0, 0.0], reference=0.3) == 0.6
    assert running.followed == 0.3


def test_on_a_rig_a_law_is_limited_by_the_narrower_and_puts_out_its_steps():
    """Counts, delay and steps are the rig's own; a law that was simulated with them brings them along."""
    law = replace(at_once(1.0), delay=0.5e-3, resolution=1e-3, command_resolution=0.5)
    for own, limit in ((3.0, 3.0), (7.0, LIMIT)):
        fitted = for_rig(replace(law, limit=own), ABOUT, FREE, (0.1, 0.2))
        assert (fitted.limit, fitted.delay, fitted.resolution) == (limit, 0.0, 0.0)
        assert fitted.command_resolution == ABOUT.step == 10.0 / 32768
        assert fitted.target.tolist() == [0.1, 0.2]
    assert for_rig(law, ABOUT, FREE).target == law.target


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (state_feedback([1.0, 0.0], 1e-3), r"bench shows psi, theta and takes one command; this law reads 1 signals"),
        (Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), np.ones((2, 2))), r"reads 2 signals and gives 2\."),
        (replace(at_once(1.0), D=np.ones((1, 2, 2))), "runs one law, and this one is of several lanes"),
        (replace(at_once(1.0), period=1.002e-3), r"for a period of 1\.002 ms, and bench ticks every 1 ms; design for"),
    ],
)
def test_a_law_of_another_rig_or_of_several_is_refused(law, said):
    with pytest.raises(BadInput, match=said):
        for_rig(law, ABOUT, FREE)
    assert for_rig(replace(at_once(1.0), period=1.0009e-3), ABOUT, FREE)  # clocks that differ by less than 0.1 %
