"""The ladder stops where the truth does, and where one run says about another as much as the model does."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.errors import BadInput
from upright.identification import GreyBox, Run
from upright.identification.ladder.growth import Ladder, climb
from upright.identification.ladder.rungs import Rung, default_rungs
from upright.physics import Pendulum, find
from upright.simulation import simulate
from upright.study.load import load_study

STUDIES = Path(__file__).parents[3] / "examples" / "studies"
DISK = {
    "J_1": 2e-3,
    "k_1": 0.0,
    "a_1": 0.0,
    "c_1": 4e-3,
    "f_1c": 0.0,
    "actuator.gain": 0.1,
    "actuator.knee": 4.0,
    "actuator.fade": 8e-3,
}


def asked(**truth: float) -> GreyBox:
    guesses = {"J_p": 1.4e-3, "b_2": 1.4e-3, "b_2c": 1.4e-3, "b_2q": 7e-4}
    return rig(Pendulum, PENDULUM | truth, guesses)


def swings(seed: int, *angles: float, sigma: float = 3e-3, **truth: float) -> list[Run]:
    """Noisy swings whose clocks begin at 3 s."""
    clean = [swing(PENDULUM | truth, angle=a, label=f"from {a}") for a in angles]
    return [noisy(replace(run, t=run.t + 3.0), sigma, seed=100 * seed + k) for k, run in enumerate(clean)]


PLAIN = swings(0, 1.5, 1.0, 1.2)


def chosen(ladder: Ladder) -> list[str]:
    return [s.rung.name for s in ladder.accepted]


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2, 3))])
@pytest.mark.parametrize("angles", [(1.5,), (1.5, 1.0), (1.5, 1.2, 0.9)])
@pytest.mark.parametrize(
    ("truth", "rungs"),
    [
        ({"b_2c": 0.0, "b_2q": 0.0}, ["viscous friction"]),
        ({"b_2c": 4e-3, "b_2q": 0.0}, ["viscous friction", "Coulomb friction"]),
        ({"b_2c": 2e-3, "b_2q": 1e-3}, ["viscous friction", "Coulomb friction", "quadratic drag"]),
    ],
)
def test_the_ladder_stops_at_the_rung_of_the_truth(seed, angles, truth, rungs):
    shares: list[float] = []
    runs = swings(seed, *angles, **truth)
    ladder = climb(asked(**truth), runs, progress=lambda _, share: shares.append(share))
    assert sorted(chosen(ladder)) == sorted(rungs)
    assert ladder.warnings == ()
    # of the rig inertia and friction, of each run its initial angle and speed
    assert (ladder.accepted[0].parameters, ladder.accepted[0].per_run) == (2, 2 * len(angles))
    # of a single swing of 10 s the last third is predicted
    begin = 20 / 3 if len(angles) == 1 else 0.0
    assert [s.score_from for s in ladder.scores.values()] == pytest.approx([begin] * len(angles))
    assert ("last third" in ladder.held_out) is (len(angles) == 1)
    percents = [s.fit_percent["theta"] for s in ladder.scores.values()]
    assert ladder.accepted[-1].predicted_percent == pytest.approx(sum(percents) / len(angles))
    assert min(shares) >= 0
    assert max(shares) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("fade", [0.0, DISK["actuator.fade"]])
def test_a_torque_that_falls_with_speed_is_found_where_it_is(fade):
    disk, dt = find("torsional-1"), 0.01
    truth = DISK | {"actuator.fade": fade}
    t = np.arange(400) * dt
    runs = []
    for k, volts in enumerate((1.0, 0.7, -0.9)):
        u = volts * np.where(t % 2 < 1, 1.0, 0.0)[:, None]
        x = simulate(disk, truth, [0.0, 0.0], u, dt, samples=t.size, substeps=2)
        run = Run(label=f"{volts} V", role="fit", t=t, u=u, y=x[:, [0], 0], measured=("theta_1",),
                  initial={"theta_1": 0.0, "theta_1_dot": 0.0})  # fmt: skip
        runs.append(noisy(run, 2e-3, seed=k))
    guesses = {"J_1": 1.5e-3, "c_1": 3e-3, "f_1c": 5e-3, "actuator.knee": 5.0, "actuator.fade": 4e-3}
    ladder = climb(rig(disk, {k: v for k, v in truth.items() if k not in guesses}, guesses), runs)
    assert ("torque that falls with speed" in chosen(ladder)) is (fade > 0)
    assert "f_1c" in ladder.left_out
    if fade:
        found = ladder.accepted[-1].values
        assert found["actuator.knee"] == pytest.approx(DISK["actuator.knee"], rel=0.05)
        assert found["actuator.fade"] == pytest.approx(fade, rel=0.05)


def test_nothing_is_tried_above_the_ceiling():
    """Three repeats of one noisy run: viscous friction is the truth, and predicts as well as a repeat does."""
    truth = {"b_2c": 0.0, "b_2q": 0.0}
    runs = [replace(r, label=str(k), repeats="swing") for k, r in enumerate(swings(3, 1.5, 1.5, 1.5, **truth))]
    ladder = climb(asked(**truth), runs)
    assert len(ladder.steps) == 1
    assert "not tried" in ladder.stopped


def test_a_rung_that_was_refused_is_tried_again_once_something_else_is_known():
    """Coulomb friction on top of viscous friction alone says little while the drag is missing."""
    rungs = [
        Rung(name="nothing"),
        Rung(name="drag", adds=("b_2q",)),
        Rung(name="viscous", adds=("b_2",)),
        Rung(name="dry", adds=("b_2c",)),
    ]
    truth = {"b_2c": 2e-3, "b_2q": 1e-3}
    ladder = climb(asked(**truth), swings(1, 1.5, 1.2, 0.9, **truth), rungs)
    assert set(chosen(ladder)) == {r.name for r in rungs}
    assert ladder.left_out == ()


def test_a_rung_may_drop_what_another_added():
    rungs = [Rung(name="viscous"), Rung(name="drag instead", adds=("b_2q",), drops=("b_2",))]
    truth = {"b_2": 0.0, "b_2c": 0.0, "b_2q": 2e-3}
    question = asked(**truth)
    parameters = {n: p for n, p in question.parameters.items() if n != "b_2c"}
    parameters["b_2c"] = replace(question.parameters["b_2c"], value=0.0, estimate=False)
    ladder = climb(replace(question, parameters=parameters), swings(2, 1.5, 1.2, 0.9, **truth), rungs)
    assert chosen(ladder) == ["viscous", "drag instead"]
    assert ladder.left_out == ("b_2",)


def test_friction_of_each_run_is_offered_only_where_there_are_runs_and_friction():
    names = [r.name for r in default_rungs(asked(), swings(0, 1.5, 1.0))]
    assert names == ["viscous friction", "Coulomb friction", "quadratic drag", "friction of each run"]
    assert "friction of each run" not in [r.name for r in default_rungs(asked(), swings(0, 1.5))]


@pytest.mark.parametrize(
    ("friction", "offered"), [({}, False), ({"b_2": 0.0}, False), ({"b_2": 1e-3}, True), ({"b_2c": 1e-3}, True)]
)
def test_friction_that_is_known_may_differ_from_run_to_run_too_unless_it_is_none(friction, offered):
    known = rig(Pendulum, PENDULUM | {"b_2": 0.0, "b_2c": 0.0, "b_2q": 0.0} | friction, {"J_p": 1.4e-3})
    assert ("friction of each run" in [r.name for r in default_rungs(known, PLAIN)]) is offered


@pytest.mark.parametrize(
    ("levels_of", "offered"),
    [
        (({}, {}), True),
        (({"unknown": ("friction",)}, {}), False),  # said of one run: it was thought of
        (({}, {"shared": {"friction": "cold"}}), False),
        (({"unknown": ("gain",)}, {"unknown": ("gain",)}), True),
        (({}, {"role": "predict"}), False),  # one run alone is fitted
        (({}, {}, {"role": "predict", "unknown": ("friction",)}), True),
    ],
)
def test_friction_of_each_run_is_offered_where_no_fitted_run_speaks_of_it(levels_of, offered):
    runs = [replace(run, **about) for run, about in zip(PLAIN, levels_of, strict=False)]
    assert ("friction of each run" in [r.name for r in default_rungs(asked(), runs)]) is offered


def test_an_interrupted_climb_keeps_the_rungs_so_far():
    def stop(stage: str, share: float) -> None:
        if stage.startswith("quadratic drag"):
            raise KeyboardInterrupt

    truth = {"b_2c": 4e-3, "b_2q": 0.0}
    ladder = climb(asked(**truth), swings(0, 1.5, 1.0, **truth), progress=stop)
    assert chosen(ladder) == ["viscous friction", "Coulomb friction"]
    assert ladder.interrupted


@pytest.mark.parametrize(
    ("rungs", "said"),
    [
        ([Rung(name="a", adds=("b_2cc",))], "did you mean 'b_2c'"),
        ([Rung(name="a", adds=("b_2c",)), Rung(name="b", adds=("b_2c",))], "a second time"),
    ],
)
def test_a_rung_that_makes_no_sense_is_refused(rungs, said):
    with pytest.raises(BadInput, match=said):
        climb(asked(), swings(0, 1.5, 1.0), rungs)


@pytest.mark.parametrize("runs", [[swing(seconds=1.0)], [swing(role="predict")], []])
def test_a_ladder_needs_something_to_hold_out(runs):
    with pytest.raises(BadInput, match="hold something out"):
        climb(asked(), runs)


def test_a_rung_that_drops_what_is_true_is_refused_without_a_warning():
    """It does not contain the poorer model, so a larger cost is no search that stalled."""
    rungs = [Rung(name="viscous"), Rung(name="dry instead", adds=("b_2c",), drops=("b_2",))]
    truth = {"b_2c": 0.0, "b_2q": 0.0}
    ladder = climb(asked(**truth), swings(2, 1.5, 1.2, **truth), rungs)
    assert chosen(ladder) == ["viscous"]
    assert ladder.steps[1].cost > 1.05 * ladder.steps[0].cost
    assert ladder.warnings == ()


def test_what_only_the_run_held_out_tells_does_not_predict_it():
    """Of a swing that is driven and one that is not only the first tells the gain of the drive."""
    truth, dt = PENDULUM | {"b_2c": 0.0, "b_2q": 0.0}, 0.01
    t = np.arange(1001) * dt
    u = 0.05 * np.sin(4.0 * t)[:, None]
    x = simulate(Pendulum(**truth), {"actuator.gain": 2.0}, [0.0, 0.0], u, dt, samples=t.size, substeps=2)
    driven = Run(label="driven", role="fit", t=t, u=u, y=x[:, [0], 0], measured=("theta",))
    runs = [noisy(driven, 3e-3, seed=1), noisy(swing(truth, angle=1.0), 3e-3, seed=2)]
    question = rig(Pendulum, truth, {"J_p": 1.4e-3, "b_2": 1.4e-3, "actuator.gain": 1.5})
    ladder = climb(question, runs, [Rung(name="no drive"), Rung(name="drive", adds=("actuator.gain",))])
    assert ladder.steps[1].fitted["driven"]["theta"] > 95
    # with the gain of a drive that does nothing to the command, 1, half the motion is missed
    assert ladder.steps[1].predicted["driven"]["theta"] == pytest.approx(50, abs=10)


@pytest.mark.slow
@pytest.mark.real_data
def test_a_real_pendulum_asks_for_dry_friction_and_drag():
    """Throw-away fits of this log gave 73 to 90 % viscous, 85 to 97 % with Coulomb, 98.6 % and more with drag."""
    study = load_study(STUDIES / "aau_pendulum.toml", data=os.environ["UPRIGHT_REAL_DATA"])
    ladder = climb(study.model, study.runs)
    assert chosen(ladder) == ["viscous friction", "Coulomb friction", "quadratic drag"]
    viscous, coulomb, drag = ladder.accepted
    assert 73 < viscous.fit_percent < 90
    assert coulomb.fit_percent > 85
    assert drag.fit_percent > 98.6
    assert viscous.predicted_percent < coulomb.predicted_percent < drag.predicted_percent


@pytest.mark.real_data
@pytest.mark.slow
def test_two_real_carts_are_predicted_as_well_as_they_repeat_themselves():
    """Repeats of this rig predict one another to 91 to 99 %; throw-away fits predicted 92 % and 91 %."""
    study = load_study(STUDIES / "ecp210_ladder.toml", data=os.environ["UPRIGHT_REAL_DATA"])
    ladder = climb(study.model, study.runs, study.ladder)
    (group,) = ladder.repeats
    assert all(91 < v < 99 for v in group.ceiling.values())
    assert {"Coulomb", "brake by the drive"} <= set(chosen(ladder))
    assert "not tried" in ladder.stopped
    for signal, least in (("x_1", 92.0), ("x_2", 91.0)):
        assert np.mean([s.fit_percent[signal] for s in ladder.scores.values()]) > least
