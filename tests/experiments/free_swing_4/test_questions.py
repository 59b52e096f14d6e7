"""Do the studies of experiment 4 ask what they should, of guesses 30 % off, on the logs that are written?"""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from upright.experiments.free_swing_4 import run as free_swing
from upright.experiments.free_swing_4.release import anchored, freed
from upright.experiments.free_swing_4.run import (
    FRICTION,
    FreeSwing,
    balance,
    logs,
    measured_beforehand,
    questions,
    recovered,
    run_free_swing,
    write_questions,
)
from upright.experiments.stand.known import Known
from upright.identification.model.fit import Estimate
from upright.rig.makes import MAKES, MOTOR_AND_BELT, SERVO, make_rig
from upright.study.load import load_study

DISK, CART = freed(make_rig("furuta", 3)), freed(make_rig("linear", 3))
TILTED = ("release_90_tilted.csv", "release_60_tilted.csv", "release_90_spring.csv", "release_60_spring.csv")


def test_releases_are_from_horizontal_and_from_sixty_degrees_on_the_other_side():
    """A rig out of level by its lean, and the same on its spring; of a cart the level ones alone."""
    of_disk, of_cart = logs(DISK), logs(CART)
    assert list(of_cart) == ["release_90.csv", "release_60.csv"]
    assert list(of_disk) == [*of_cart, *TILTED]
    for file, log in {**of_disk, **of_cart}.items():
        assert abs(math.degrees(_angle(log)) - (90 if "90" in file else -60)) < 3.0  # within what the hand errs
    starts = [log["psi"][:40] for log in of_disk.values()]
    assert not any(np.array_equal(a, b) for i, a in enumerate(starts) for b in starts[:i])  # each is a shot of its own
    # gravity's lever moves a leaning disk off; the spring keeps it nearer
    ends = {file: abs(log["psi"][-400:].mean() - log["psi"][0]) for file, log in of_disk.items()}
    assert ends["release_90_tilted.csv"] > 2 * ends["release_90_spring.csv"]
    assert ends["release_60_tilted.csv"] > 2 * ends["release_60_spring.csv"]


def _angle(log):
    """Where the pendulum was released [rad], from the log's counts."""
    return log["theta"][0] * (2 * math.pi / 16000 if log.units["theta"] == "counts" else 1.0)


@pytest.mark.parametrize(("rig", "body"), [(DISK, "J_d"), (CART, "m_c")])
def test_what_was_measured_beforehand_errs_by_its_uncertainty(rig, body):
    """1 % of the inertia, half a millimetre of the rod's centre; over many rigs the scatter is what is said."""
    truth = rig.plant.parameters()
    known = measured_beforehand(rig)
    assert known[body][1] == pytest.approx(0.01 * truth[body])
    assert known["l_cg"][1] == 0.5e-3
    assert set(known) == ({body, "l_cg", "r", "J_a"} if body == "J_d" else {body, "l_cg"})
    off = []
    for seed in range(200):
        other = freed(make_rig("furuta" if rig is DISK else "linear", seed))
        found, true = measured_beforehand(other), other.plant.parameters()
        off += [(found[n][0] - true[n]) / found[n][1] for n in ("l_cg", body)]
    # 400 standard normal numbers: mean within 4/sqrt(400), scatter within 4/sqrt(800)
    assert abs(np.mean(off)) < 0.2
    assert np.std(off) == pytest.approx(1.0, abs=0.15)


def test_what_experiment_1a_weighed_takes_the_place_of_a_guess_less_what_was_taken_off():
    """The belt is off in experiment 4, so a disk weighs motor and belt less; a cart is as it was."""
    weighed = measured_beforehand(DISK, Known(name="J_d", value=0.01, stderr=2e-5))
    assert weighed["J_d"] == pytest.approx((0.01 - MOTOR_AND_BELT, 2e-5))
    assert measured_beforehand(CART, Known(name="m_c", value=0.9, stderr=2e-3))["m_c"] == (0.9, 2e-3)
    assert measured_beforehand(DISK, Known(name="k_12", value=1.0, stderr=0.1)) == measured_beforehand(DISK)
    assert measured_beforehand(DISK)["J_a"] == (DISK.plant.J_a, 0.0)  # from a drawing, without an error


@pytest.mark.parametrize("rig", [DISK, CART])
def test_guesses_are_30_percent_off_and_without_an_inertia_it_is_asked_as_well(rig):
    truth = rig.plant.parameters()
    asked = {q.name: q for q in questions(rig)}
    assert list(asked) == ["free_swing", "no_scale", *(("level_model", "tilt_model", "spring") if rig is DISK else ())]
    for q in asked.values():
        for name in ("m_p", "J_p", *FRICTION):
            assert abs(q.guesses[name] / truth[name] - 1) == pytest.approx(0.3)
        assert not q.guesses.keys() & q.known.keys()
    blind, seen = asked["no_scale"], asked["free_swing"]
    inertias = {"J_d", "J_a"} if rig is DISK else {"m_c"}
    assert blind.guesses.keys() - seen.guesses.keys() == inertias
    assert seen.known.keys() - blind.known.keys() == inertias
    for name in inertias:
        assert abs(blind.guesses[name] / seen.known[name][0] - 1) == pytest.approx(0.3)
    assert (seen.fitted, seen.predicted) == ("release_90.csv", "release_60.csv")


def test_a_leaning_rig_is_asked_three_times():
    """As if level, with a lean of at most 0.1 either way, and on its spring, known to 1 %."""
    level, tilt, spring = questions(DISK)[2:]
    assert [q.fitted for q in (level, tilt, spring)] == [TILTED[0], TILTED[0], TILTED[2]]
    assert [q.predicted for q in (level, tilt, spring)] == [TILTED[1], TILTED[1], TILTED[3]]
    assert (tilt.guesses["tilt_x"], tilt.guesses["tilt_y"]) == (0.0, 0.0)
    assert tilt.bounds == {"tilt_x": (-0.1, 0.1), "tilt_y": (-0.1, 0.1)}
    assert level.bounds == spring.bounds == {}
    assert "tilt_y" not in level.guesses
    anchor = MAKES["furuta"].anchor
    assert spring.known["k_psi"] == (anchor, 0.01 * anchor)
    assert (level.method, tilt.method, spring.method) == ("least-squares", "auto", "least-squares")
    assert spring.unknown == ("initial", "offset")
    assert anchored(DISK).plant.k_psi == anchor


@pytest.mark.parametrize("rig", [DISK, CART])
def test_studies_say_to_their_digits_what_was_asked(rig, tmp_path):
    """Six figures of every number, bounds where there are some, released from rest."""
    for q, path in write_questions(rig, tmp_path):
        study = load_study(path)
        numbers = study.model.parameters
        for name, (value, spread) in q.known.items():
            assert numbers[name].value == pytest.approx(value, rel=1e-5)
            assert (numbers[name].uncertainty or 0.0) == pytest.approx(spread, rel=1e-5)
            assert not numbers[name].estimate
        for name, guess in q.guesses.items():
            assert numbers[name].estimate
            assert numbers[name].value == pytest.approx(guess, rel=1e-5)
            assert study.model.bounds(name) == q.bounds.get(name, (0.0, math.inf))
        assert [run.role for run in study.runs] == ["fit", "predict"]
        assert study.path.name == f"{q.name}.toml"


def fake_fit(values, **more):
    names = {**values, **more}
    return SimpleNamespace(estimates=values, model=SimpleNamespace(parameters=dict.fromkeys(names), plant=DISK.plant))


def test_a_number_is_found_where_its_interval_holds_the_truth():
    true = DISK.plant.parameters()
    low, high = Estimate.within(0.9 * true["m_p"], 0.0, 0.05 * true["m_p"]), Estimate.within(true["b_2"], 0, 0.0)
    known = Estimate(value=1.0, stderr=0.0, interval=(0, 2), status="known")
    fit = fake_fit({"m_p": low, "b_2": high, "J_d": known, "offset": high})
    found = {f.name: f for f in recovered(DISK, fit)}
    assert found.keys() == {"m_p", "b_2"}  # neither what was known nor what is no number of the rig
    assert (found["m_p"].inside, found["b_2"].inside) == (False, True)
    assert found["m_p"].truth == true["m_p"]
    wide = fake_fit({"m_p": Estimate.within(0.9 * true["m_p"], 0.0, 0.1 * true["m_p"])})
    assert recovered(DISK, wide)[0].inside


def test_the_balance_is_that_of_the_fitted_plant_over_twelve_seconds():
    """Twice the weight is twice the energy to begin with: m_p g l_cg above hanging, let go from horizontal."""
    p = DISK.plant
    heavy = {"m_p": Estimate.within(2 * p.m_p, 0.0, 0.0), "J_p": Estimate.within(2 * p.J_p, 0.0, 0.0)}
    named = {n: SimpleNamespace(value=v) for n, v in p.parameters().items()}
    fit = SimpleNamespace(estimates=heavy, model=SimpleNamespace(parameters=named, plant=p))
    done = FreeSwing(rig=DISK, folder=None, answers={"free_swing": SimpleNamespace(fit=fit)})
    b = balance(done)
    assert b.stored[0] == pytest.approx(2 * p.m_p * p.g * p.l_cg, rel=1e-9)
    assert b.t[0] == 0.0
    assert b.t[1] == pytest.approx(0.02, abs=SERVO)
    assert b.t[-1] == pytest.approx(12.0, abs=0.03)
    total = b.stored + sum(b.dissipated.values())
    assert total == pytest.approx(b.stored[0], rel=1e-4)
    assert set(b.dissipated) == {"viscous friction", "Coulomb friction of psi", "Coulomb friction of theta"}


@pytest.fixture
def swung(monkeypatch, tmp_path):
    """A free swing whose fits are said beforehand: what is told, and what came of it when something stops it."""
    monkeypatch.setattr(free_swing, "write_questions", lambda rig, *_: [(q, tmp_path) for q in questions(rig)])
    monkeypatch.setattr(free_swing, "drift_paths", lambda rig: ("paths",))
    monkeypatch.setattr(free_swing, "balance", lambda result: "balance")
    told = []

    def swing(rig=DISK, swallows="", stopped=lambda: False, until=2.0):
        def fit(question, path, progress):
            progress("fitting", 1.0)
            return SimpleNamespace(fit=SimpleNamespace(interrupted=question.name == swallows))

        def tell(step, share):
            told.append(share)
            if share > until:
                raise KeyboardInterrupt

        told.clear()
        monkeypatch.setattr(free_swing, "fit_question", fit)
        return run_free_swing(rig, 5, tmp_path, tell, stopped), list(told)

    return swing


def test_every_question_is_fitted_and_the_share_told_never_goes_back(swung):
    done, told = swung()
    assert list(done.answers) == [q.name for q in questions(DISK)]
    assert (done.drifts, done.balance, done.interrupted) == (("paths",), "balance", False)
    assert (done.rig.seed, done.body, done.make.key) == (5, "disk", "furuta")
    assert told == sorted(told)
    assert (told[0], told[-1]) == (0.0, 0.9)
    assert told[1:-1] == pytest.approx([0.05 + 0.85 * (i + 1) / 5 for i in range(5)])
    assert swung(CART)[0].body == "cart"


def test_what_was_fitted_before_somebody_stopped_it_is_kept(swung):
    for how, kept in (
        ({"swallows": "level_model"}, 3), ({"stopped": lambda: True}, 1), ({"until": -1.0}, 0), ({"until": 0.3}, 1),
    ):  # fmt: skip
        done, _ = swung(**how)
        assert done.interrupted
        assert len(done.answers) == kept
        assert (done.drifts, done.balance) == ((), None)


def test_a_question_is_fitted_by_its_own_method_under_its_own_title(tmp_path, monkeypatch):
    asked, told = [], []

    def fitted(model, runs, *, method, progress):
        asked.append((model, [run.role for run in runs], method))
        progress("searching", 0.25)
        progress("done", 1.0)
        return "fit"

    monkeypatch.setattr("upright.identification.estimate.identify", fitted)
    pair = write_questions(CART, tmp_path)[1]
    answer = free_swing.fit_question(*pair, lambda step, share: told.append((step, share)))
    assert (answer.question, answer.fit, answer.study.path) == (pair[0], "fit", pair[1])
    assert asked == [(answer.study.model, ["fit", "predict"], "auto")]
    assert [share for _, share in told] == [0.25, 1.0]
    assert all(pair[0].title in step for step, _ in told)
