"""Is what is told beforehand bounded by theory, and right where the answer is known?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from upright import gains as design
from upright.control import Score, Scores, score, trial
from upright.control.preflight import WORDS, Task, largest, preflight, word, words
from upright.control.score import outcomes
from upright.errors import BadInput
from upright.gains.requests import read_poles
from upright.paper.reproduce import TABLE_1
from upright.rig.makes import make_rig

RIG = make_rig("furuta")
MODEL = RIG.linear("inverted")
SAMPLED = MODEL.to_sampled(RIG.period, RIG.delay / RIG.period)
# the same compiled terms as on the true rig, with next to nothing in them
IDEAL = RIG.changed(b_1c=1e-15, b_2c=1e-15).replace(lag=0.0, converter=0.0, counts=(1e14, 1e14), travel=math.inf)


def law(which):
    K = design.place(MODEL.A, MODEL.B, read_poles(TABLE_1[which])).K
    return design.feedback(design.filtered(SAMPLED, 0.5), K)


@pytest.mark.parametrize("direction", [[0, 0, 1, 0], [0, 0, 0, 1]])
def test_a_law_on_the_unstable_mode_recovers_what_the_limit_can(direction):
    """The coordinate z of that mode, z' = p z + b u, runs away beyond b U/p whatever u does; u = -k z reaches it."""
    rig = IDEAL.replace(limit=0.01)  # so small that the rig is linear
    values, left = np.linalg.eig(MODEL.A.T)
    mode = int(np.argmax(values.real))
    p, w = values[mode].real, left[:, mode].real
    bound = abs(w @ MODEL.B[:, 0]) * rig.limit / p / abs(w @ np.array(direction))
    mirrored = np.concatenate([np.delete(values.real, mode), [-p]])  # the others stay, but for the drifting arm
    mirrored[np.argmin(np.abs(mirrored))] = -0.02
    K = design.place(MODEL.A, MODEL.B, mirrored).K
    found = largest(rig, design.feedback(design.filtered(SAMPLED, 0.5), K), "inverted", direction, most=3 * bound)
    # the filtered difference is late by a sample and a half, the command by one on its way and half of one held
    late = 2 * RIG.period + RIG.delay
    assert math.exp(-p * late) * bound < found < bound
    assert largest(rig, law(3), "inverted", direction, most=3 * bound) < bound


def test_twice_the_start_with_twice_the_friction_and_limit_is_twice_the_motion():
    """Linear but for dry friction and limit, both of degree one: the limit cycle grows with the friction."""
    start = np.array([0.0, 0.0, 2e-4, 0.0])
    found = [
        outcomes(
            IDEAL.replace(limit=8e-4 * k), law(0), at="inverted", starts=[k * start], seconds=6.0,
            parameters={"b_1c": k * 5e-5, "b_2c": k * 1e-6},
        )
        for k in (1, 2)
    ]  # fmt: skip
    assert found[0].saturated[0] > 0
    for name in ("peaks", "final", "effort_peak", "effort_rms"):
        np.testing.assert_allclose(getattr(found[1], name), 2 * getattr(found[0], name), rtol=1e-3)


def told(rig, start, hand=(), lanes=200):
    task = Task(start=start, seconds=3.0, hand=hand)
    return preflight(rig, MODEL, SAMPLED, law(0), task, parameters={}, lanes=lanes, seed=1)


def test_the_chance_of_a_hand_that_errs_about_the_edge_is_the_normal_distribution():
    edge, spread = largest(RIG, law(0), "inverted", [0, 0, 1, 0], most=math.pi / 2), 0.02
    for z in (-1.0, 0.5):
        chance = told(RIG, (0, 0, edge + z * spread, 0), hand=(0, 0, spread, 0)).chance
        expected = 0.5 * math.erfc(z / math.sqrt(2))
        assert chance == pytest.approx(expected, abs=3 * math.sqrt(expected * (1 - expected) / 200))


def test_what_is_sure_has_chance_one_or_none():
    easy = told(RIG, (0, 0, 0.05, 0))
    assert easy.chance == 1.0
    assert easy.word == "stabilised"
    beyond = told(RIG, (0, 0, 1.2, 0))
    assert beyond.chance == 0.0
    assert beyond.word == "falls"


def test_a_loop_too_slow_for_its_pole_falls_beforehand():
    """Forty milliseconds of further delay are beyond the margin of set 4, 24 ms."""
    late = MODEL.to_sampled(RIG.period, (RIG.delay + 0.04) / RIG.period)
    task = Task(start=(0, 0, 0.05, 0), seconds=3.0)
    found = preflight(
        RIG.replace(delay=RIG.delay + 0.04), MODEL, late, law(3), task, parameters={}, lanes=16, seed=0
    )  # fmt: skip
    assert found.margins is None
    assert found.chance == 0.0


def test_every_end_of_a_run_has_its_word():
    inf = np.inf
    found = Scores(
        fell=np.array([inf, inf, inf, inf, 0.4, 0.4, inf, inf]),
        ran_out=np.array([inf, inf, inf, 0.3, 0.3, inf, inf, inf]),
        settled=np.array([1.0, 1.0, inf, 1.0, inf, inf, 1.0, 1.0]),
        saturated=np.zeros(8), at_limit=np.array([0.0, 0.1, 0.0, 0.0, 0.1, 0.1, 0.0, 0.1]),
        peaks=np.zeros((2, 8)), final=np.zeros((2, 8)), effort_peak=np.zeros(8), effort_rms=np.zeros(8),
        rest_rms=np.array([0.0, 0.0, 0.0, 0.0, 0.9, 0.9, 0.2, 0.0]),
        rest_peak=np.array([0.0, 0.0, 0.9, 0.9, 0.9, 0.9, 0.4, 0.85]),
    )  # fmt: skip
    out, busy = "leaves its travel", "stabilised with excessive effort"
    assert words(found) == [
        "stabilised",
        "stabilised with saturation",
        "does not settle",
        out,
        out,
        "falls",
        busy,
        busy,
    ]
    assert found.held.tolist() == [True, True, True, False, False, False, True, True]


@pytest.mark.parametrize("force_limit", [math.inf, 1.5])
def test_one_run_and_many_of_its_start_say_the_same(force_limit):
    """Sample by sample: starts from easy to lost, each on a rig with a gain and a friction of its own."""
    rig = RIG.replace(limit=4.0, more={"actuator.force_limit": force_limit})
    angles = np.linspace(0.02, 0.9, 12)
    starts = np.zeros((angles.size, 4))
    starts[:, 2] = angles
    own = {"actuator.gain": rig.gain * np.linspace(0.9, 1.1, angles.size)[::-1], "b_1c": np.linspace(4e-3, 9e-3, 12)}
    # the last digit is the order in which a processor adds; where the drive gives all it can, nothing holds it from
    # growing as the rig falls, by exp(p t)
    grown = np.finfo(float).eps * math.exp(3.0 * MODEL.poles().real.max())
    many = outcomes(rig, law(3), at="inverted", starts=starts, seconds=3.0, parameters=own)
    assert 0 < np.sum(many.at_limit > 5e-3) < angles.size
    assert 0 < np.sum(many.held) < angles.size
    for i, start in enumerate(starts):
        alone = replace(rig.changed(b_1c=own["b_1c"][i]), gain=own["actuator.gain"][i])
        one = score(trial(alone, law(3), at="inverted", start=start, seconds=3.0))
        for name, value in vars(one).items():
            both = getattr(many, name)[..., i], value
            np.testing.assert_allclose(*both, rtol=1e-9, atol=grown, err_msg=f"{name} of start {i}")


def test_runs_too_long_for_a_whole_block_say_what_short_ones_say():
    """Of equals at rest at their equilibrium, nothing moves however long it takes and however the lanes are cut."""
    found = outcomes(RIG, law(3), at="inverted", starts=np.zeros((50, 4)), seconds=9.0)
    assert found.held.all()
    assert found.peaks.max() == 0


def test_no_direction_is_no_question():
    with pytest.raises(BadInput, match="not zero"):
        largest(RIG, law(0), "inverted", [0, 0, 0, 0], most=1.0)


def ends(held):
    """Figures of runs of which some are held."""
    held = np.asarray(held)
    lost, none = np.where(held, math.inf, 0.1), np.zeros(held.size)
    return Scores(
        fell=lost, ran_out=np.full(held.size, math.inf), settled=none, peaks=none[None], final=none[None],
        effort_peak=none, effort_rms=none, saturated=none, at_limit=none, rest_rms=none, rest_peak=none,
    )  # fmt: skip


@pytest.mark.parametrize("edge", [1.2345, 0.0101, 1.9999, 0.0])
def test_the_largest_start_is_found_to_a_64th_of_a_64th_of_a_64th(edge, monkeypatch):
    asked = []

    def stub(rig, law, *, at, starts, seconds):
        asked.append((at, seconds))
        assert np.all(starts[:, [0, 1, 3]] == 0)
        return ends(starts[:, 2] / 0.5 <= edge)

    monkeypatch.setattr("upright.control.preflight.outcomes", stub)
    found = largest(RIG, law(0), "inverted", [0, 0, 0.5, 0], most=2.0, seconds=1.5)
    assert edge - 2.0 / 64**3 <= found <= edge
    assert asked == [("inverted", 1.5)] * 3
    assert largest(RIG, law(0), "inverted", [0, 0, 0.5, 0], most=edge / 2 or 1e-9) == (edge / 2)


@pytest.mark.parametrize("most", [0.0, -1.0, math.nan])
def test_nothing_to_try_is_no_question(most):
    with pytest.raises(BadInput, match="most must be above 0"):
        largest(RIG, law(0), "inverted", [0, 0, 1, 0], most=most)


def test_a_preflight_asks_for_the_tilt_and_for_a_tap_of_the_last_coordinate_each_alone(monkeypatch):
    def stub(rig, law, at, direction, *, most, seconds=3.0):
        return (at, tuple(direction), most)

    monkeypatch.setattr("upright.control.preflight.largest", stub)
    found = told(RIG, (0.1, 0, 0.05, 0), lanes=2)
    assert found.tilt == ("inverted", (0, 0, 1, 0), math.pi / 2)
    assert found.push == ("inverted", (0, 0, 0, 1), 20.0)
    assert found.run.deviation[0] == pytest.approx([0.1, 0.05])
    assert found.run.t[-1] == pytest.approx(3.0, abs=RIG.period)
    assert found.score.held
    # margins and noise of the loop with the rig's own lag, whatever the law was designed on
    driven = MODEL.to_sampled(SAMPLED.period, SAMPLED.delay, RIG.lag)
    assert found.margins == design.margins(driven, law(0))
    assert sum(found.words.values()) == 1.0
    assert found.words == {word: float(word == "stabilised") for word in WORDS}
    assert found.quiet_share == 1.0


def test_a_hand_errs_by_its_spread_about_the_start():
    task = Task(start=(1.0, 2.0, 3.0, 4.0), hand=(0.0, 0.1, 0.2, 0.0))
    found = task.starts(4000, np.random.default_rng(2))
    assert found.shape == (4000, 4)
    # five standard errors of a mean and of a standard deviation
    assert found.mean(axis=0) == pytest.approx([1, 2, 3, 4], abs=5 * 0.2 / math.sqrt(4000))
    assert found.std(axis=0) == pytest.approx([0, 0.1, 0.2, 0], abs=5 * 0.2 / math.sqrt(8000))
    assert np.all(Task(start=(1.0, 2.0, 3.0, 4.0)).starts(3, np.random.default_rng(2)) == [1, 2, 3, 4])


def test_five_milliseconds_at_the_limit_are_not_yet_saturation_and_the_last_word_is_the_commonest():
    inf = np.full(4, math.inf)
    found = replace(
        ends([True] * 4), fell=inf, settled=np.ones(4), at_limit=np.array([5e-3, 5.1e-3, 6e-3, 0.0])
    )  # fmt: skip
    assert words(found) == ["stabilised", *["stabilised with saturation"] * 2, "stabilised"]
    assert word(Score(**{n: v[..., 1] for n, v in vars(found).items()})) == "stabilised with saturation"
    both = replace(ends([False]), ran_out=np.array([0.1]))
    assert words(both) == ["leaves its travel"]  # fallen and out of travel at once


@pytest.mark.parametrize("make", ["linear", "furuta"])
@pytest.mark.parametrize("which", [0, 3])
def test_dry_friction_of_the_driven_body_cycles_as_its_describing_function_says(make, which):
    """Friction F at the amplitude a and frequency w brakes like a viscous one of 4 F/(pi a w); the loop hunts where
    that takes it to its edge of stability. What this leaves out is the third harmonic: a third of the square wave,
    through the loop at 3 w, which adds to the crests or takes from them."""
    friction = {"linear": 0.05, "furuta": 2e-3}[make]
    named = make_rig(make)
    rig = named.changed(b_1c=friction, b_2c=1e-15).replace(
        lag=0.0, delay=0.0, converter=0.0, counts=(1e14, 1e14), travel=math.inf, limit=1e6
    )
    model = rig.linear("inverted")
    K = design.place(model.A, model.B, read_poles(TABLE_1[which])).K

    def loop(b):
        braked = rig.changed(b_1=rig.plant.b_1 + b).linear("inverted")
        return braked.A - braked.B @ K

    def fastest(b):
        values = np.linalg.eigvals(loop(b))
        return values[np.argmax(values.real)]

    edges = rig.plant.b_1 * np.geomspace(0.1, 1e4, 200)
    growing = [fastest(b).real > 0 for b in edges]
    i = growing.index(True)
    b = brentq(lambda b: fastest(b).real, edges[i - 1], edges[i])
    w = abs(fastest(b).imag)

    def passed(omega):
        """From a force on the driven body to its position and the command; in units of the drive."""
        x = np.linalg.solve(1j * omega * np.eye(4) - loop(0.0), model.B[:, 0] / rig.gain)
        return abs(x[0]), abs((K @ x)[0])

    fundamental, third = passed(w), passed(3 * w)
    swing = 4 * friction / math.pi / (b * w)
    command = swing * fundamental[1] / fundamental[0]
    left_out = [high / low / 3 for low, high in zip(fundamental, third, strict=True)]
    law = design.feedback(design.filtered(model.to_sampled(rig.period, 0.0), 0.0), K)
    for tilt in (0.005, 0.05):  # whatever it begins with
        run = trial(rig, law, at="inverted", start=(0, 0, tilt, 0), seconds=30.0)
        assert score(run).final[0] == pytest.approx(swing, rel=left_out[0])
    # the command's third harmonic is up to half of its fundamental; the shares lie three times below and above 0.1
    rms = command / math.sqrt(2)
    assert max(left_out) < 0.55
    for share, said in ((0.033, "stabilised"), (0.3, "stabilised with excessive effort")):
        drive = rig.replace(limit=rms / share)
        run = trial(drive, law, at="inverted", start=(0, 0, 1e-4, 0), seconds=30.0)
        assert score(run).rest_rms == pytest.approx(share, rel=left_out[1])
        assert word(score(run)) == said


@pytest.mark.parametrize(("counts", "said"), [(16_000, "stabilised"), (1_000, "stabilised with excessive effort")])
def test_coarse_encoders_make_the_same_gains_excessive_and_a_chance_of_holding_does_not_hide_it(counts, said):
    """Plain differences of two independent roundings: K_d q/(T sqrt 6) each. A loop a hundred times slower than its
    samples adds little to that: 1 % in variance, its bandwidth over that of the samples."""
    K = design.place(MODEL.A, MODEL.B, read_poles(TABLE_1[1])).K
    plain = design.feedback(design.filtered(SAMPLED, 0.0), K)
    rig = RIG.changed(b_1c=1e-15, b_2c=1e-15).replace(counts=(counts, counts))
    noise = math.hypot(K[0, 1], K[0, 3]) * math.tau / counts / RIG.period / math.sqrt(6)
    task = Task(start=(0.0, 0.0, 0.02, 0.0), seconds=6.0)
    found = preflight(rig, MODEL, SAMPLED, plain, task, parameters={}, lanes=4, seed=0)
    assert found.noise == pytest.approx(noise, rel=0.01)
    assert found.chance == 1.0
    assert found.word == said
    assert found.rest.quiet is (said == "stabilised")
    assert found.quiet_share == float(said == "stabilised")
