"""Does a trial do what the loop's matrix says, with encoders, converter and limit where they belong?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.control import Trial, score, trial
from upright.control.score import scores
from upright.control.trial import law_on_rig, logged, readings, twin_log
from upright.errors import BadInput
from upright.gains import feedback, filtered, place
from upright.gains.loop import closed
from upright.records import Record
from upright.rig.drive import full_command, saturation
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
    rounding = RIG.converter / 2 + abs(GAINS[0, 2]) * RIG.resolution[1] / 2
    assert run.u[0] == pytest.approx(-GAINS[0, 2] * 0.1, abs=rounding)


def test_an_encoder_shows_its_scale_times_the_truth_to_a_count():
    wrong = replace(RIG, scales=(1.0, 1.03))
    run = trial(wrong, LAW, at="inverted", start=tilt(0.05), seconds=0.05)
    assert np.abs(run.record["theta"] - 1.03 * run.x[:, 2]).max() <= RIG.resolution[1] / 2 * (1 + 1e-9)
    assert np.abs(run.record["psi"] - run.x[:, 0]).max() <= RIG.resolution[0] / 2 * (1 + 1e-9)
    # a law that takes the true half turn for upright is told of a tilt of 3 % of it
    assert run.u[0] == pytest.approx(-GAINS[0, 2] * (1.03 * (math.pi + 0.05) - math.pi), abs=0.02)


def test_readings_are_whole_counts():
    q = np.array([[0.1, 3.0], [-0.2, math.pi]])
    counts = readings(RIG, q) * np.array(RIG.per_unit)
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


def lanes_of(theta, *, psi=None, u=None, rig=RIG, dt=0.5, **how):
    """Figures of deviations by hand, shape (N, lanes)."""
    theta = np.asarray(theta, dtype=float)
    away = np.stack([np.zeros_like(theta) if psi is None else np.asarray(psi, dtype=float), theta], axis=1)
    t = np.arange(len(theta)) * dt
    return scores(rig, t, away, np.zeros_like(theta) if u is None else np.asarray(u, dtype=float), **how)


def test_figures_of_runs_side_by_side_are_those_of_each():
    theta = np.array([[0.5, 0.1, 0.02], [0.3, 0.3, 0.02], [1.0, 0.1, -0.02], [1.1, 0.1, 0.01], [9.0, 0.0, 0.0],
                      [9.0, -0.1, 0.0]])  # fmt: skip
    psi = np.array([[0.1, -2.0, 0.0], [0.1, 0.5, 0.3], [0.1, 0.5, 0.1], [-0.4, 0.2, 0.1], [7.0, 0.6, 0.3],
                    [9.0, 0.2, 0.2]])  # fmt: skip
    u = np.array([[3.0, 1.0, -5.0], [4.0, -1.0, 0.0], [0.0, 1.0, 4.9], [-5.0, 1.0, 0.0], [5.0, 1.0, 0.0],
                  [5.0, 3.0, 5.0]])  # fmt: skip
    rig = RIG.replace(travel=2.0, limit=5.0)
    found = lanes_of(theta, psi=psi, u=u, rig=rig, fallen=1.0, band=0.1)
    # a bound itself is still within: 1 rad has not fallen, 2 rad of travel are there, a band's edge is settled
    assert found.fell.tolist() == [1.5, math.inf, math.inf]
    assert found.ran_out.tolist() == [2.0, math.inf, math.inf]
    assert found.settled.tolist() == [math.inf, 1.0, 0.0]
    assert found.held.tolist() == [False, True, True]
    # to the loss, with its sample
    assert found.peaks.tolist() == [[0.4, 2.0, 0.3], [1.1, 0.3, 0.02]]
    # half of what the last third, two samples of six, swings
    assert found.final == pytest.approx(np.array([[1.0, 0.2, 0.05], [0.0, 0.05, 0.0]]))
    assert found.effort_peak.tolist() == [5.0, 3.0, 5.0]
    assert found.effort_rms == pytest.approx(np.sqrt([50 / 4, 14 / 6, (50 + 4.9**2) / 6]))
    assert found.saturated == pytest.approx([1 / 4, 0.0, 2 / 6])
    assert found.at_limit == pytest.approx([0.5, 0.0, 1.0])
    # of the last two commands of six, over 5 V: half their distance, and the larger
    assert found.rest_rms == pytest.approx([0.0, 0.2, 0.5])
    assert found.rest_peak == pytest.approx([1.0, 0.6, 1.0])
    assert found.quiet.tolist() == [False, False, False]
    own = lanes_of(theta, psi=psi, u=u, rig=rig, fallen=1.0, band=0.1, full=[4.0, 1.0, 6.0])
    assert own.at_limit == pytest.approx([1.0, 3.0, 0.0])


def test_a_run_that_leaves_its_band_at_the_end_has_not_settled_and_one_that_comes_last_has():
    found = lanes_of(np.array([[0.0, 1.0], [0.0, 1.0], [1.0, 0.0]]), band=0.5)
    assert found.settled.tolist() == [math.inf, 1.0]


def test_a_watched_coordinate_falls_and_settles_instead_of_the_last():
    found = lanes_of(np.full((4, 1), 9.0), psi=[[0.3], [0.1], [0.0], [0.0]], watched="psi", fallen=1.0, band=0.2)
    assert found.fell[0] == math.inf
    assert found.settled[0] == 0.5


def test_a_driven_body_faster_than_its_limit_has_run_out():
    psi = np.array([[0.0], [0.0], [1.0], [2.5], [4.5]])  # central differences 0, 1, 2.5, 3.5, 4 rad/s
    rig = RIG.replace(speed_limit=2.5, travel=100.0)
    assert lanes_of(np.zeros((5, 1)), psi=psi, rig=rig).ran_out[0] == 1.5
    early = lanes_of(np.zeros((5, 1)), psi=psi, rig=rig.replace(travel=0.5))
    assert early.ran_out[0] == 1.0  # whichever comes first


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"counts": (100.0,)}, "2 positive numbers of counts"),
        ({"counts": (100.0, 0.0)}, "2 positive numbers of counts"),
        ({"counts": (math.nan, 10.0)}, "2 positive numbers of counts"),
        ({"scales": (1.0,)}, "2 scales"),
        ({"limit": 0.0}, "limit of a rig must be positive and finite, got 0"),
        ({"limit": math.inf}, "limit of a rig must be positive"),
        ({"period": -1.0}, "period of a rig must be positive and finite, got -1"),
    ],
)
def test_a_rig_that_cannot_be_is_refused(changed, words):
    with pytest.raises(BadInput, match=words):
        RIG.replace(**changed)


def test_a_drive_s_braking_goes_with_the_speed_of_what_it_drives():
    """Gain u less (slope + damping + standby) psi': the columns of psi' change by that along B."""
    more = {"actuator.slope": 0.02, "actuator.damping": 0.03, "actuator.standby": 0.05}
    bare, braked = RIG.linear("inverted"), RIG.replace(more=more).linear("inverted")
    force = bare.B[:, 0] / RIG.gain
    expected = bare.A.copy()
    expected[:, 1] -= 0.1 * force
    assert pytest.approx(expected) == braked.A
    assert bare.A[1, 1] != braked.A[1, 1]
    assert pytest.approx(bare.B) == braked.B
    assert pytest.approx(RIG.plant.linear("inverted").B * RIG.gain) == bare.B


@pytest.mark.parametrize(
    ("force", "droop", "gain", "full"),
    [
        (math.inf, 0.0, 2.0, math.inf),
        (3.0, 0.0, 2.0, 1.5),
        (3.0, 0.0, -2.0, 1.5),
        (3.0, 0.5, 2.0, 6.0),  # gain u - droop u force, as far as that is above none
        (4.0, 0.5, 2.0, math.inf),
        (5.0, 0.5, 2.0, math.inf),
    ],
)
def test_a_force_limit_is_met_at_its_command(force, droop, gain, full):
    drive = {
        "actuator.gain": gain, "actuator.limit": 4.0, "actuator.force_limit": force, "actuator.droop": droop,
    }  # fmt: skip
    assert full_command(drive) == full
    assert saturation(drive) == min(4.0, full)


def test_a_log_has_readings_command_and_the_reference_that_is_held():
    t, x = np.arange(4) * 0.1, np.arange(16.0).reshape(4, 4)
    rig = RIG.replace(counts=(10 * math.tau, 4 * math.tau), unit="A", scales=(1.0, 2.0))
    log = logged(rig, t, x + 0.06, np.array([1.0, 2.0, 3.0, 4.0]), [7.0, 8.0])
    assert log["psi"] == pytest.approx([0.1, 4.1, 8.1, 12.1])
    assert log["theta"] == pytest.approx([4.0, 12.0, 20.0, 28.0])  # of 56.24 half radians, 112 counts of them
    assert log["reference"].tolist() == [7.0, 8.0, 8.0, 8.0]
    assert log["u"].tolist() == [1.0, 2.0, 3.0, 4.0]
    assert {n: log.units[n] for n in ("u", "psi", "theta")} == {"u": "A", "psi": "rad", "theta": "rad"}
    assert (log.inputs, log.outputs) == (("u",), ("psi", "theta"))


def test_a_twin_s_log_may_be_in_another_unit_and_without_a_command():
    y = np.array([[1.0, 2.0], [3.0, 4.0]])
    log = twin_log(RIG, np.arange(2.0), y, unit="deg")
    assert log["theta"].tolist() == [2.0, 4.0]
    assert (log.units["psi"], log.units["theta"], log.inputs) == ("deg", "deg", ())
    assert "u" not in log.signals


def test_a_drive_switched_off_commands_nothing_from_that_sample_on():
    off = 20 * RIG.period
    run = trial(RIG, LAW, at="inverted", start=tilt(0.05), seconds=0.04, off=off)
    alone = trial(RIG, LAW, at="inverted", start=tilt(0.05), seconds=0.04)
    assert run.u[:20] == pytest.approx(alone.u[:20])
    assert np.all(run.u[20:] == 0.0)
    assert np.all(alone.u[15:25] != 0.0)
    assert run.t.size == round(0.04 / RIG.period) + 1


def test_pushes_shorter_than_the_run_end_and_longer_ones_are_cut():
    short = trial(RIG, replace_law(LAW), at="hanging", start=tilt(0.0), seconds=9 * RIG.period, pushes=[0.5, 0.5])
    step = RIG.converter
    assert short.u == pytest.approx(np.array([0.5, 0.5, *np.zeros(8)]), abs=step)
    long = trial(RIG, replace_law(LAW), at="hanging", start=tilt(0.0), seconds=9 * RIG.period, pushes=np.full(50, 0.5))
    assert long.u == pytest.approx(np.full(10, 0.5), abs=step)


def test_a_law_at_work_takes_rest_and_reference_of_the_rig():
    rig = RIG.replace(scales=(1.0, -0.5), converter=0.25)
    made = law_on_rig(rig, LAW, [0.1, 3.0])
    assert (made.delay, made.command_resolution) == (0.0, 0.25)
    assert np.asarray(made.resolution) == pytest.approx(rig.resolution * [1.0, 2.0])
    assert made.references is LAW.references
    assert np.asarray(law_on_rig(rig, LAW, [0.1, 3.0], [1.0, 2.0]).references).tolist() == [1.0, 2.0]
