"""What differs from run to run: groups of runs share one value, single runs have their own, predictions keep both."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, shaken, swing
from upright.identification.estimate import identify, predict
from upright.identification.problem.residuals import formulate
from upright.physics import Furuta, Pendulum

GUESSES = {"J_p": 2.6e-3, "b_2": 1.4e-3, "b_2c": 2.6e-3}
FRICTION = ("b_2", "b_2c", "b_2q")


def on_a_day(factor: float, angle: float, day: str, seed: int, **run):
    """A swing on a day when all friction is `factor` times as large."""
    values = PENDULUM | {n: factor * PENDULUM[n] for n in FRICTION}
    fields = {"label": f"{day} from {angle}", "shared": {"friction": day}} | run
    return noisy(swing(values, angle=angle, **fields), 1e-3, seed)


@pytest.fixture(scope="module")
def two_days():
    """Two runs on each of two days, and one run of the second day to predict; friction is 0.8 and 1.25 times usual."""
    runs = [on_a_day(0.8, a, "Monday", seed=k) for k, a in enumerate((0.9, 2.0))]
    runs += [on_a_day(1.25, a, "Tuesday", seed=k) for k, a in enumerate((1.1, 1.7), start=5)]
    runs.append(on_a_day(1.25, 2.5, "Tuesday", seed=9, role="predict"))
    return identify(rig(Pendulum, PENDULUM, GUESSES), runs), runs


def test_days_get_one_friction_each_whose_intervals_hold_the_truth(two_days):
    fit, _ = two_days
    days = {day: group["friction"] for day, group in fit.groups.items()}
    assert set(days) == {"Monday", "Tuesday"}
    assert all("friction" not in own for own in fit.per_run.values())
    # only the ratio of two days is in the data; their geometric mean, 1 here, belongs to the shared friction
    assert days["Tuesday"].value / days["Monday"].value == pytest.approx(1.25 / 0.8, rel=0.02)
    assert days["Tuesday"].value * days["Monday"].value == pytest.approx(1.0, abs=0.01)
    for day, truth in (("Monday", 0.8), ("Tuesday", 1.25)):
        assert days[day].interval[0] < truth < days[day].interval[1]
        assert days[day].unit == "1"
    for name in ("J_p", "b_2", "b_2c"):
        low, high = fit.estimates[name].interval
        assert low < PENDULUM[name] < high, name


def test_a_run_of_a_fitted_day_is_predicted_without_choosing_its_friction(two_days):
    fit, runs = two_days
    told = fit.runs[runs[-1].label]
    assert told.adapted == ("initial",)
    # noise of 1e-3 rad limits the score: 100 (1 - sigma / spread)
    limit = 100 * (1 - 1e-3 / float(np.std(runs[-1].y)))
    assert told.fit_percent["theta"] > limit - 1
    again = predict(fit, fit.model, [runs[-1]])[runs[-1].label]
    assert again.fit_percent["theta"] == pytest.approx(told.fit_percent["theta"], abs=1e-6)
    stranger = replace(runs[-1], shared={"friction": "Sunday"})
    assert predict(fit, fit.model, [stranger])[runs[-1].label].adapted == ("initial", "friction")


def test_a_run_of_another_day_is_offered_the_friction_of_that_day(two_days):
    fit, runs = two_days
    alone = replace(runs[-1], shared={})  # friction of the fit: the geometric mean of both days
    told = predict(fit, fit.model, [alone])[alone.label]
    assert told.offer is not None
    assert told.offer.name == "friction"
    that_day = fit.groups["Tuesday"]["friction"]  # known from the day's other runs
    assert told.offer.factor.value == pytest.approx(1.25, rel=0.03)
    assert max(told.offer.factor.interval[0], that_day.interval[0]) < min(
        told.offer.factor.interval[1], that_day.interval[1]
    )
    assert told.adapted == ("initial",)
    assert told.offer.fit_percent["theta"] > fit.runs[alone.label].fit_percent["theta"] - 1
    assert "1.25" in told.offer.sentence(alone.label, told.fit_percent)
    of_that_day = fit.runs[alone.label]
    assert of_that_day.offer is None


def test_the_wrong_day_predicts_worse(two_days):
    fit, runs = two_days
    right = fit.runs[runs[-1].label].fit_percent["theta"]
    wrong = predict(fit, fit.model, [replace(runs[-1], shared={"friction": "Monday"})])[runs[-1].label]
    assert wrong.adapted == ("initial",)
    assert wrong.fit_percent["theta"] < right - 10


def test_a_narrow_spread_keeps_a_factor_near_one():
    runs = [on_a_day(f, 1.5, day, seed=3, seconds=3.0) for f, day in ((0.8, "Monday"), (1.25, "Tuesday"))]
    tight = [replace(r, spread={"friction": 1e-4}) for r in runs]
    asked = rig(Pendulum, PENDULUM, GUESSES)
    ratios = []
    for posed in (runs, tight):
        groups = identify(asked, posed).groups
        ratios.append(groups["Tuesday"]["friction"].value / groups["Monday"]["friction"].value)
    assert ratios[0] > 1.4
    assert ratios[1] == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("windows", [None, 0.5])
def test_a_sensor_that_counts_too_much_in_some_runs_is_found(windows):
    unknown = () if windows else ("initial",)
    runs = [
        noisy(shaken(label=f"run {k}", seconds=4.0, horizon=windows, unknown=unknown), 1e-4, seed=k) for k in (1, 2, 3)
    ]
    for k in (1, 2):
        y = runs[k].y * [1.0, 1.3]
        runs[k] = replace(runs[k], y=y, shared={"scale.theta": "new encoder"})
    fit = identify(rig(Furuta, FURUTA, {"J_d": 0.01, "b_1": 4e-3}), runs)
    scale = fit.groups["new encoder"]["scale.theta"]
    assert scale.value == pytest.approx(1.3, rel=2e-3)
    assert scale.status == "well determined"
    assert fit.estimates["J_d"].value == pytest.approx(FURUTA["J_d"], rel=0.02)


def test_what_the_runs_say_nothing_about_is_unseen():
    """A gain has no effect on a free swing."""
    fit = identify(rig(Pendulum, PENDULUM, GUESSES), [noisy(swing(unknown=("initial", "gain")), 1e-3, seed=1)])
    gain = fit.per_run["swing"]["gain"]
    assert gain.status == "unseen"
    assert gain.value == pytest.approx(1.0)


def test_a_fit_file_keeps_what_groups_share(two_days, tmp_path):
    from types import SimpleNamespace

    from upright.rig.hardware import Hardware
    from upright.study.results import write_fit
    from upright.study.stored_fit import read_fit

    fit, runs = two_days
    study = SimpleNamespace(
        title="", plant="pendulum", path=tmp_path, sha256="", source="", runs=runs, hardware=Hardware()
    )
    content = write_fit(fit, study, tmp_path / "fit.json")
    assert content["groups"]["Monday"]["friction"]["status"] == "well determined"
    assert content["runs"][runs[-1].label]["adapted"] == ["initial"]
    stored = read_fit(tmp_path / "fit.json")
    again = predict(stored.values, fit.model, [runs[-1]], groups=stored.groups)[runs[-1].label]
    assert again.adapted == ("initial",)
    assert again.fit_percent["theta"] == pytest.approx(fit.runs[runs[-1].label].fit_percent["theta"], abs=1e-6)


@pytest.mark.parametrize("offset", [0.4, 0.0, -0.3])
def test_what_is_known_of_the_first_state_is_what_the_sensor_read(offset):
    """At the truth a sensor's unknown zero leaves nothing to hold against the first state."""
    run = swing(seconds=2.0, unknown=("initial", "offset"))
    problem = formulate(rig(Pendulum, PENDULUM, GUESSES), [replace(run, y=run.y + offset)])
    truth = {"initial.theta": 1.5, "initial.theta_dot": 0.0, "offset.theta": offset}
    x = np.array([u.coordinate(truth.get(u.name, u.value)) for u in problem.unknowns])
    r, J = problem.prior_rows(x)
    assert r.size == 2
    # the reading was smoothed before it was known: within a tenth of a sigma of the samples
    assert np.all(np.abs(r) < 0.1 * problem.noise)
    for i in range(x.size):
        e = 1e-3 * np.eye(x.size)[i]
        slope = (problem.prior_rows(x + e)[0] - problem.prior_rows(x - e)[0]) / 2e-3
        assert slope == pytest.approx(J[:, i], abs=1e-9)
