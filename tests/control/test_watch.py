"""Is a wrong encoder or drive told from hands and friction while a pendulum is held?"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from upright import gains as design
from upright.control import trial
from upright.control.score import FALLEN
from upright.control.trial import readings
from upright.control.watch import (
    BOUNDS,
    CORNER,
    DRIFTED,
    FACTORS,
    OUT_OF_TRUE,
    STRENGTHS,
    Suspicion,
    Watch,
    held_by,
    sticking,
)
from upright.control.watch import watched as guarded
from upright.experiments.nonideal import nonideal
from upright.rig.makes import make_rig

MAKES = ("linear", "furuta")


@cache
def loop(make):
    """Watch, and the law it watches: set 1 of Table 1."""
    rig = make_rig(make)
    model = rig.linear("inverted")
    sampled = model.to_sampled(rig.period, (rig.delay + rig.lag) / rig.period)
    estimator = design.filtered(sampled, 0.8)
    K = design.place_sampled(sampled, estimator, [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220])
    return Watch(rig), design.feedback(estimator, K)


def watched(make, shown, seed=3, seconds=2.5):
    watch, law = loop(make)
    rig = replace(make_rig(make, seed), scales=shown)
    rest = readings(rig, [0.0, math.pi])
    run = trial(rig, law, at="inverted", start=[0.0, 0.0, 0.05, 0.0], seconds=seconds, rest=rest)
    seen = np.column_stack([run.record[c.name] for c in rig.plant.coordinates]) - rest
    return watch.over(seen, run.u), run


@pytest.mark.parametrize("make", ["furuta", pytest.param("linear", marks=pytest.mark.slow)])
def test_the_watch_speaks_before_the_fall(make):
    first = make_rig(make).plant.coordinates[0].name
    for shown, what in (
        ((1.0, -1.0), Suspicion(name="theta", factor=-1.0)),
        ((-1.0, 1.0), Suspicion(name=first, factor=-1.0)),
        ((1.0, 0.5), Suspicion(name="theta", factor=0.5)),
        ((4.0, 1.0), Suspicion(name=first, factor=4.0)),
    ):
        alarm, run = watched(make, shown)
        fallen = np.flatnonzero(np.abs(run.deviation[:, 1]) > FALLEN)
        k = int(alarm.sample[0])
        assert 0 <= k < 0.75 * fallen[0]
        assert abs(run.deviation[k, 1]) < math.radians(15)
        assert alarm.what[0] == what
    alarm, run = watched(make, (1.0, 1.0))
    assert alarm.sample[0] == -1
    assert np.abs(run.deviation[-1, 1]) < 0.02


@pytest.mark.parametrize("make", MAKES)
@pytest.mark.parametrize("shown", [(1.0, 1.0), (1.0, -1.0), (4.0, 1.0)])
def test_a_loop_in_a_mirror_is_suspected_of_the_same_at_the_same_sample(make, shown):
    """Linear models are odd, and so are the law and what a hand can do."""
    watch, _ = loop(make)
    alarm, run = watched(make, shown, seconds=1.0)
    seen = np.column_stack([run.record[c.name] for c in watch.model.plant.coordinates]) - run.rest
    mirrored = watch.over(-seen, -run.u)
    assert (mirrored.sample == alarm.sample).all()
    assert mirrored.what == alarm.what
    assert mirrored.odds == pytest.approx(alarm.odds, rel=1e-9, abs=1e-9)


@pytest.mark.slow
def test_a_watched_drive_stops_pushing():
    """The same run up to the alarm, no command after it, and then no more energy than a falling pendulum has."""
    watch, law = loop("linear")
    rig = replace(make_rig("linear", 3), scales=(1.0, -1.0))
    rest = readings(rig, [0.0, math.pi])
    how = {"start": [0.0, 0.0, 0.05, 0.0], "seconds": 1.0, "rest": rest}
    alone = trial(rig, law, at="inverted", **how)
    run, alarm = guarded(watch, rig, law, **how)
    k = int(alarm.sample[0]) + 1
    assert 0 < k < 200
    assert np.allclose(run.x[: k + 1], alone.x[: k + 1], rtol=0, atol=1e-9)
    assert np.all(run.u[k:] == 0.0)
    energy = rig.plant.energy(run.x[k + 2 * math.ceil(rig.lag / rig.period) :])
    lost = np.diff(energy)
    assert lost.max() < 1e-4 * np.ptp(energy)  # friction only takes, once the drive's lag is over
    assert np.abs(run.x[:, 1]).max() < 0.5 * np.abs(alone.x[:, 1]).max()


@pytest.mark.parametrize("make", ["furuta", "linear"])
@pytest.mark.parametrize("tilt", [0.03, pytest.param(0.08, marks=pytest.mark.slow)])
def test_a_sound_loop_that_has_come_to_rest_is_not_suspected(make, tilt):
    """Close to rest dry friction holds what the filters take for free; evidence of that adds up over seconds."""
    model = make_rig(make)
    linear = model.linear("inverted")
    sampled = linear.to_sampled(model.period, model.delay / model.period)
    gains = design.place(linear.A, linear.B, [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220])
    law = design.feedback(design.filtered(sampled, 0.5), gains.K)
    run = trial(model, law, at="inverted", start=[0.0, 0.0, tilt, 0.0], seconds=5.0)
    shown = np.column_stack([run.record[c.name] for c in model.plant.coordinates]) - run.rest
    assert Watch(model).over(shown, run.u).sample[0] == -1


@pytest.mark.parametrize(("make", "far", "seed"), [("furuta", 0.4, 1), ("linear", 0.05, 2)])
def test_rounding_of_coarse_encoders_is_not_taken_for_a_lie(make, far, seed):
    """2,000 counts a turn at 1.1 kHz: the same rounding for six samples is no evidence six times over."""

    def coarse(rig):
        return rig.replace(counts=tuple(c / 8 for c in rig.counts))

    model = coarse(make_rig(make))
    linear = model.linear("inverted")
    sampled = linear.to_sampled(model.period, model.delay / model.period)
    gains = design.place(linear.A, linear.B, [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220])
    law = design.feedback(design.filtered(sampled, 0.5), gains.K)
    truth, watch = coarse(nonideal(make_rig(make, seed), seed)), Watch(model)
    run, alarm = guarded(watch, truth, law, start=[far, 0.0, 0.02, 0.0], seconds=2.0)
    assert alarm.sample[0] == -1
    assert np.any(run.u[-200:] != 0.0)  # the drive stays on


def test_a_suspicion_says_the_sensor_and_its_factor():
    assert str(Suspicion()) == "all sensors sound"
    assert str(Suspicion(name="theta", factor=-1.0)) == "theta shown the wrong way round"
    assert str(Suspicion(name="psi", factor=0.5)) == "psi shown 0.5 times what is true"
    assert str(Suspicion(name="psi", factor=0.0)) == "psi shown not at all"
    assert str(Suspicion(name="the drive", factor=0.5)) == "the drive giving 0.5 times what is asked"
    assert str(Suspicion(name="theta", factor=1.0)) == "the zero of theta moving"


def test_a_watch_suspects_each_sensor_of_each_factor_the_drive_and_a_zero_that_moves():
    watch, _ = loop("linear")
    assert {(s.name, s.factor) for s in watch.suspicions} == {
        ("", 1.0), ("theta", 1.0), ("the drive", 0.25), ("the drive", 0.5),
        *((n, f) for n in ("x", "theta") for f in (0.0, -1.0, 0.25, 0.5, 2.0, 4.0)),
    }  # fmt: skip
    assert not watch.suspicions[0].name  # against which all others are weighed


def test_dry_friction_of_the_driven_body_takes_its_share_of_the_command():
    rig = replace(make_rig("furuta").changed(b_1c=0.3, b_2c=0.5), gain=-2.0)
    assert sticking(rig) == pytest.approx(0.15)  # that of the pendulum's hinge is not the drive's
    bare = make_rig("furuta").changed(b_1c=0.0, b_2c=0.5)
    assert sticking(bare) == 0.0


PROMPT = {make: make_rig(make).replace(delay=0.0, lag=0.0) for make in MAKES}


def moving(make, rate=7.0, seconds=3.0, size=0.5, body=1.0, other=1.0, drive=1.0, at_body=0.0, at_other=0.0):
    """Readings and commands of a loop in closed form, without rounding: all goes as ``exp(3 t) sin(rate t)``.

    Both rows of the model are solved for the coordinates under a command of `size` times the limit and forces at
    either, in shares of what the command does; then the encoders show `body` and `other` times what is true.
    """
    rig = PROMPT[make]
    model, T = rig.linear("inverted"), rig.period
    t = np.arange(round(seconds / T)) * T
    command, s = size * rig.limit, 3.0 + 1j * rate
    force = command * (
        drive * model.B[1::2, 0] + at_body * model.B[1::2, 0] + np.array([0.0, at_other * model.B[3, 0]])
    )
    rows = np.array([[s**2 * (i == j) - model.A[2 * i + 1, 2 * j] - s * model.A[2 * i + 1, 2 * j + 1]
                      for j in range(2)] for i in range(2)])  # fmt: skip
    q = np.linalg.solve(rows, force)
    turn = np.exp(s * t - 3.0 * seconds)
    return np.imag(np.outer(turn, q)) * [body, other], np.imag(turn) * command


def spoken(make, shown, commands):
    """What may be wrong when the watch speaks; nothing where it does not."""
    watch = Watch(PROMPT[make])
    for y, u in zip(shown, commands, strict=True):
        watch.see(y[None], u)
        if watch.speaks()[0][0]:
            return watch.likely()
    return ()


@pytest.mark.parametrize("make", MAKES)
@pytest.mark.parametrize("rate", [6.0, 15.0])
def test_a_motion_that_obeys_the_model_is_believed(make, rate):
    watch = Watch(PROMPT[make])
    shown, commands = moving(make, rate)
    assert watch.over(shown, commands).odds.max() < 0.5


@pytest.mark.parametrize("make", MAKES)
@pytest.mark.parametrize("which", ["body", "other"])
@pytest.mark.parametrize("factor", [f for f in FACTORS if f])
def test_an_encoder_that_shows_a_factor_is_named_with_it(make, which, factor):
    """Alone, or beside the other one by the inverse factor while friction might still take the command."""
    names = [c.name for c in PROMPT[make].plant.coordinates]
    name, other = names[which == "other"], names[which == "body"]
    found = spoken(make, *moving(make, **{which: factor}))
    assert Suspicion(name=name, factor=factor) in found
    assert {s.name for s in found} <= {name, other}


@pytest.mark.parametrize("make", MAKES)
@pytest.mark.parametrize("strength", STRENGTHS)
def test_a_drive_that_gives_a_share_is_named_and_not_an_encoder(make, strength):
    found = spoken(make, *moving(make, drive=strength))
    assert Suspicion(name="the drive", factor=strength) in found
    assert found[0].name == "the drive"


@pytest.mark.parametrize("make", MAKES)
def test_dry_friction_as_large_as_may_be_is_no_evidence(make):
    """A force against the command of `HELD_BY` times what the model knows of, for as long as it likes."""
    rig = PROMPT[make]
    share = held_by(rig, "inverted") / abs(rig.linear("inverted").B[1, 0])  # as a command
    size = 1.5 * share / rig.limit
    shown, commands = moving(make, size=size, at_body=-share / (size * rig.limit))
    watch = Watch(rig)
    watch.over(shown, commands)
    assert watch.odds.max() < min(BOUNDS.values())


RATES = (math.radians(0.3), math.radians(0.5))


@pytest.mark.parametrize("make", ["furuta", pytest.param("linear", marks=pytest.mark.slow)])
def test_a_zero_that_drifts_is_found_when_the_sum_of_its_excess_says_and_a_frame_out_of_level_never(make):
    """Page: a ramp r t passes the bound B at B/r, and its excess adds up to S after sqrt(2 S/r) more."""
    rig = PROMPT[make]
    t = np.arange(round(20.0 / rig.period)) * rig.period
    level = 0.95 * OUT_OF_TRUE * (1 - np.exp(-t / 0.5))
    lean = np.column_stack([*(rate * t for rate in RATES), level])
    alarm = Watch(rig).over(np.stack([0 * lean, lean], axis=1), 0 * lean)
    assert alarm.what[:2] == (Suspicion(name="theta", factor=1.0),) * 2
    for rate, sample in zip(RATES, alarm.sample[:2], strict=True):
        expected = OUT_OF_TRUE / rate + math.sqrt(2 * DRIFTED / rate)
        assert sample * rig.period == pytest.approx(expected, abs=5 / CORNER)
    assert alarm.sample[2] == -1


@pytest.mark.parametrize("make", MAKES)
def test_a_frame_that_moves_steadily_shows_nothing(make):
    """Galilei: the body's zero drifts at a constant speed, and no law of motion without friction tells."""
    rig = PROMPT[make]
    shown, commands = moving(make)
    t = np.arange(len(shown)) * rig.period
    drift = 0.08 * (t - 0.2 * (1 - np.exp(-t / 0.2)))  # it sets in as softly as a coupling begins to creep
    odds = Watch(PROMPT[make]).over(shown + np.column_stack([drift, 0 * drift]), commands).odds
    assert odds.max() < min(BOUNDS.values())


def test_lanes_are_watched_as_loops_by_themselves():
    motions = [moving("furuta", rate) for rate in (5.0, 9.0)] + [moving("furuta", 9.0, other=-1.0)]
    together = Watch(PROMPT["furuta"]).over(
        np.stack([y for y, _ in motions], axis=-1), np.column_stack([u for _, u in motions])
    )
    for lane, (y, u) in enumerate(motions):
        assert Watch(PROMPT["furuta"]).over(y, u).sample[0] == together.sample[lane]


@pytest.mark.slow
@pytest.mark.thorough
@pytest.mark.parametrize("make", MAKES)
def test_sound_rigs_that_are_played_with_are_left_alone(make):
    """Six minutes of seeds that neither the bounds nor the benchmark have; python -m benchmarks false_stops is 10 h."""
    from benchmarks.hazards.sound import Played

    assert [lane.why for lane in Played(make, range(2001, 2007), 60.0).run()] == [""] * 6


def believing(**odds):
    """What a watch of a Furuta pendulum names, by logarithms of odds of ``name_factor``, what is suspected."""
    watch = Watch(make_rig("furuta"))
    listed = {f"{s.name.removeprefix('the ')}_{s.factor:g}": i for i, s in enumerate(watch.suspicions[1:-1])}
    for name, value in odds.items():
        watch.odds[listed[name.replace("minus", "-")], 0] = value
    return [str(s) for s in watch.likely()]


DEAD, TURNED, TWICE, FOUR = (
    "psi shown not at all", "theta shown the wrong way round", "theta shown 2 times what is true",
    "theta shown 4 times what is true",
)  # fmt: skip


@pytest.mark.parametrize(
    ("odds", "named"),
    [
        ({}, []),
        ({"psi_0": math.log(9.9)}, []),  # ten to one is what it takes to be named
        ({"psi_0": math.log(10.1)}, [DEAD]),
        ({"psi_0": 10.0, "theta_minus1": 8.1}, [DEAD, TURNED]),
        ({"psi_0": 8.1, "theta_minus1": 10.0}, [TURNED, DEAD]),
        ({"psi_0": 10.0, "theta_minus1": 7.9}, [DEAD]),  # less likely by e^2
        ({"psi_0": 10.0, "theta_minus1": 9.9, "theta_2": 9.8, "theta_4": 9.7}, [DEAD, TURNED, TWICE]),
    ],
)
def test_what_is_nearly_as_likely_is_named_too_and_three_at_most(odds, named):
    assert believing(**odds) == named
