"""Does a trial do what the loop's matrix says, with encoders, converter and limit where they belong?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.control import Trial, score, trial
from upright.control.trial import readings
from upright.errors import BadInput
from upright.gains import feedback, filtered, place
from upright.gains.loop import closed
from upright.records import Record
from upright.rig.makes import make_rig

RIG = make_rig("furuta")
MODEL = RIG.linear("inverted")
SAMPLED = MODEL.to_sampled(RIG.period, RIG.delay / RIG.period)
SET_1 = [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]
GAINS = place(MODEL.A, MODEL.B, SET_1).K
LAW = feedback(filtered(SAMPLED, 0.5), GAINS)
# the same compiled terms as on the true rig, with next to nothing in them
IDEAL = RIG.changed(b_1c=1e-15, b_2c=1e-15).replace(
    lag=0.0, converter=0.0, counts=(1e14, 1e14)
)  # fmt: skip


def tilt(angle):
    return [0.0, 0.0, angle, 0.0]


def test_a_small_tilt_comes_back_as_the_matrix_of_the_loop_says():
    run = trial(IDEAL, LAW, at="inverted", start=tilt(1e-4), seconds=1.0)
    M = closed(SAMPLED, LAW)
    state = np.concatenate([tilt(1e-4), [0.0], LAW.begin @ [0.0, 1e-4]])
    expected = np.empty((run.t.size, 2))
    for k in range(run.t.size):
        expected[k] = state[[0, 2]]
        state = M @ state
    # the rig is nonlinear in the square of the tilt, and its centrifugal terms in the square of the speed
    assert np.all(np.abs(run.deviation - expected) < 1e-6 * np.abs(expected).max(axis=0))


def test_switching_on_off_centre_is_not_taken_for_a_speed():
    run = trial(RIG, LAW, at="inverted", start=tilt(0.1), seconds=0.01)
    rounding = RIG.converter / 2 + abs(GAINS[0, 2]) * RIG.quantum[1] / 2
    assert run.u[0] == pytest.approx(-GAINS[0, 2] * 0.1, abs=rounding)


def test_an_encoder_shows_its_scale_times_the_truth_to_a_count():
    wrong = replace(RIG, scales=(1.0, 1.03))
    run = trial(wrong, LAW, at="inverted", start=tilt(0.05), seconds=0.05)
    assert np.abs(run.record["theta"] - 1.03 * run.x[:, 2]).max() <= RIG.quantum[1] / 2 * (1 + 1e-9)
    assert np.abs(run.record["psi"] - run.x[:, 0]).max() <= RIG.quantum[0] / 2 * (1 + 1e-9)
    # a law that takes the true half turn for upright is told of a tilt of 3 % of it
    assert run.u[0] == pytest.approx(-GAINS[0, 2] * (1.03 * (math.pi + 0.05) - math.pi), abs=0.02)


def test_readings_are_whole_counts():
    q = np.array([[0.1, 3.0], [-0.2, math.pi]])
    counts = readings(RIG, q) * np.array(RIG.counts)
    np.testing.assert_allclose(counts, np.round(q * 16_000 / math.tau), atol=1e-9)


def test_a_command_is_rounded_to_the_converter_and_limited():
    kicks = np.concatenate([np.full(5, 0.3456), np.full(5, 40.0), np.full(5, -40.0)])
    nothing = replace_law(LAW)
    run = trial(RIG, nothing, at="hanging", start=tilt(0.0), seconds=14 * RIG.period, pushes=kicks)
    expected = np.clip(np.round(kicks / RIG.converter) * RIG.converter, -RIG.limit, RIG.limit)
    np.testing.assert_allclose(run.u, expected, atol=1e-12)
    assert score(run).saturated == pytest.approx(10 / 15)
    assert score(run).at_limit == pytest.approx(10 * RIG.period)
    assert score(run).effort_peak == RIG.limit


def replace_law(law):
    """A law of the same size that commands nothing."""
    return replace(law, A=0 * law.A, B=0 * law.B, C=0 * law.C, D=0 * law.D)


def path(theta):
    t = np.arange(theta.size) * 0.01
    x = np.zeros((theta.size, 4))
    x[:, 2] = math.pi + theta
    x[:, 0] = 0.2 * np.exp(-t)
    u = np.sin(t)
    return Trial(
        rig=RIG, at="inverted", t=t, x=x, u=u, rest=np.array([0.0, math.pi]),
        record=Record(t=t, signals={"u": u}),
    )  # fmt: skip


def test_settling_of_an_exponential_is_the_logarithm_of_the_band():
    t = np.arange(1001) * 0.01
    found = score(path(0.3 * np.exp(-t)), band=0.03)
    assert found.held
    assert found.settled == pytest.approx(math.log(10), abs=0.01)
    assert found.peaks == pytest.approx([0.2, 0.3])
    assert found.effort_rms == pytest.approx(math.sqrt(0.5 - math.sin(20) / 40), rel=2e-3)  # of a sine over 10 s


def test_a_fall_is_told_with_its_time():
    t = np.arange(301) * 0.01
    found = score(path(0.01 * np.exp(2 * t)), fallen=0.5)
    assert not found.held
    assert found.fell == pytest.approx(math.log(50) / 2, abs=0.01)
    assert found.settled == math.inf


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: trial(RIG, LAW, at="inverted", start=tilt(0.1), seconds=0.0), "needs some time"),
        (lambda: score(path(np.zeros(10)), watched="phi"), "watch one of psi, theta"),
    ],
)
def test_what_cannot_be_is_said(call, words):
    with pytest.raises(BadInput, match=words):
        call()
