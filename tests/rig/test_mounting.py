"""Do encoders with play and off centre show what geometry says, in a log and in a loop?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.control import trial
from upright.control.trial import readings
from upright.gains import feedback, filtered, place
from upright.rig.makes import make_rig
from upright.rig.mounting import Mounting

RIG = make_rig("furuta")
TURN = (2 * math.pi, 2 * math.pi)


def mounted(play=(0.0, 0.0), off_centre=(0.0, 0.0), phase=(0.0, 0.0)):
    return replace(RIG, mounting=Mounting(play=play, off_centre=off_centre, phase=phase, turn=TURN))


def test_after_a_reversal_play_is_lost_before_the_encoder_follows():
    there = np.linspace(0.0, 1.0, 1001)
    q = np.repeat(np.concatenate([there, there[::-1]])[:, None], 2, axis=1)
    shown = readings(mounted(play=(0.02, 0.0)), q)
    lost = shown[:1001] - shown[:1000:-1]  # the same place on the way out and back
    step = RIG.resolution[0]
    inside = slice(30, 970)  # from where the play is taken up on either way
    assert np.abs(np.abs(lost[inside, 0]) - 0.02).max() <= step * (1 + 1e-9)
    assert np.abs(lost[:, 1]).max() == 0.0


def test_many_motions_are_read_as_each_alone():
    q = np.cumsum(np.random.default_rng(3).normal(0, 0.01, (200, 5, 2)), axis=0)
    rig = mounted(play=(0.02, 0.01), off_centre=(0.002, 0.001), phase=(0.3, 2.0))
    together = readings(rig, q)
    for i in range(5):
        np.testing.assert_array_equal(together[:, i], readings(rig, q[:, i]))


def test_a_shaft_off_centre_errs_once_a_turn_from_where_it_was_zeroed():
    turns = np.linspace(0.0, 4 * math.pi, 401)
    error, phase = 0.01, 0.7
    shown = readings(mounted(off_centre=(error, 0.0), phase=(phase, 0.0)), np.column_stack([turns, turns]))
    expected = turns + error * (np.sin(turns + phase) - math.sin(phase))
    assert np.abs(shown[:, 0] - expected).max() <= RIG.resolution[0] / 2 * (1 + 1e-9)


@pytest.mark.parametrize("phase", [0.0, 0.7, 2.5])
def test_a_loop_reads_the_same_as_its_log_close_to_upright(phase):
    """By the first command, -K of what is shown; what the tangent leaves out is e d^2/2 of a deviation d."""
    model = RIG.linear("inverted")
    K = place(model.A, model.B, [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]).K
    law = feedback(filtered(model.to_sampled(RIG.period, RIG.delay / RIG.period), 0.5), K)
    error, tilt = 0.01, 0.05
    rig = mounted(off_centre=(0.0, error), phase=(0.0, phase))
    run = trial(rig, law, at="inverted", start=[0, 0, tilt, 0], seconds=0.01)
    expected = tilt + error * (math.sin(math.pi + tilt + phase) - math.sin(phase))
    rounding = RIG.converter / 2 + abs(K[0, 2]) * (RIG.resolution[1] / 2 + error * tilt**2 / 2)
    assert run.u[0] == pytest.approx(-K[0, 2] * expected, abs=rounding)
    assert run.record["theta"][0] - math.pi == pytest.approx(expected, abs=RIG.resolution[1] / 2)


def test_an_off_centre_error_goes_with_the_turn_of_its_own_shaft():
    """Two turns of the shaft per radian: by hand, and its slope by a difference."""
    made = Mounting(play=(0.0, 0.0), off_centre=(0.1, 0.0), phase=(0.4, 0.0), turn=(0.5, 1.0))
    q = np.array([0.3, 0.2])
    assert made.turned(q) == pytest.approx([0.3 + 0.1 * (math.sin(4 * math.pi * 0.3 + 0.4) - math.sin(0.4)), 0.2])
    step = 1e-6
    assert made.slope(q) == pytest.approx((made.turned(q + step) - made.turned(q - step)) / (2 * step), rel=1e-6)


def test_play_begins_in_its_middle():
    made = Mounting(play=(0.2, 0.0), off_centre=(0.0, 0.0), phase=(0.0, 0.0), turn=(1.0, 1.0))
    q = np.repeat(np.array([0.0, 0.05, 0.1, 0.15, 0.3, 0.2, 0.1, 0.05])[:, None], 2, axis=1)
    assert made.felt(q)[:, 0] == pytest.approx([0.0, 0.0, 0.0, 0.05, 0.2, 0.2, 0.2, 0.15])
    assert made.felt(q)[:, 1] == pytest.approx(q[:, 1])
