"""A fit whose motion runs away has failed: it says so in a sentence, and none of its numbers has an interval."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, shaken, swing
from upright.identification.estimate import identify, predict
from upright.identification.inference.covariance import assess
from upright.identification.inference.loop import standing
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import descend_progressively
from upright.physics import Furuta, Pendulum
from upright.report.fit.chapter import chapter

STIFF = {**PENDULUM, "b_2": 100.0, "b_2c": 0.0, "b_2q": 0.0}
"""Steps of Runge and Kutta longer than 2.8 time constants grow; J_A/b_2 is 0.3 ms here at most, samples are 10 ms."""


@pytest.fixture(scope="module")
def failed():
    runs = [noisy(swing(seconds=4.0), 2e-3, seed=1), swing(seconds=4.0, label="later", role="predict")]
    asked = rig(Pendulum, STIFF, {"J_p": 3e-3})
    bounded = {**asked.parameters, "J_p": replace(asked.parameters["J_p"], lower=1e-3, upper=1e-2)}
    return identify(replace(asked, parameters=bounded), runs)


def test_a_motion_that_runs_away_is_a_failed_fit_that_says_so(failed) -> None:
    assert failed.failed
    assert not failed.trusted
    assert [a.answer for a in failed.answers] == ["no", "no", "not tested"]
    assert "The fit failed" in failed.verdict
    assert "'swing' grows beyond all bounds" in failed.verdict
    assert "guesses nearer to the truth" in failed.verdict  # what to try
    assert failed.runs["swing"].fit_percent == {"theta": -1000.0}
    assert "What was held out is not predicted, because the fit failed." in failed.warnings


def test_no_number_of_a_failed_fit_has_an_interval(failed) -> None:
    every = [*failed.estimates.values(), *failed.per_run["swing"].values()]
    assert len(every) > 2
    assert {e.status for e in every} == {"unseen"}
    assert all(math.isinf(e.stderr) for e in every)
    assert all(math.isfinite(e.value) for e in every)
    assert failed.poles == {}
    assert failed.bands is None


def test_a_failed_fit_is_reported_as_one(failed) -> None:
    told = chapter(failed)
    assert told.verdict.startswith("The fit failed")
    assert not told.sound
    (step,) = told.steps
    assert "horizon" in step.command


def test_a_run_that_runs_away_under_given_numbers_is_predicted_badly_and_its_band_has_no_end() -> None:
    """Bands come from a fit of the true rig, the numbers from another."""
    run = replace(noisy(swing(seconds=4.0), 2e-3, seed=1), role="predict")
    fit = identify(rig(Pendulum, PENDULUM, {"b_2": 1e-3}), [replace(run, role="fit")])
    assert fit.bands is not None
    for asked in (run, replace(run, horizon=0.5), replace(run, score_from=1.0)):
        told = predict(STIFF, rig(Pendulum, STIFF, {}), [asked], bands=fit.bands)["swing"]
        assert told.fit_percent == {"theta": -1000.0}
        assert np.max(told.band["theta"]) > 1e100  # squares of what is missed fill the range of numbers
        assert told.offer is None


def test_a_covariance_that_rounding_left_indefinite_still_tells_how_rigs_stand() -> None:
    """Rigs within a millionth of the fitted one are all held by a loop made for it."""
    problem = formulate(rig(Furuta, FURUTA, {"J_d": 8e-3, "l_cg": 0.15}), [noisy(shaken(seconds=3.0), 1e-3, seed=2)])
    best = assess(problem, descend_progressively(problem, problem.start).x)
    size = np.where(np.arange(best.x.size) < 2, 1e-6, 0.0)
    indefinite = np.outer(size, size) * (1 - 1e-7 * np.eye(best.x.size))
    assert np.linalg.eigvalsh(indefinite)[0] < 0
    told = standing(replace(best, covariance=indefinite))
    assert told is not None
    assert told.at == "inverted"
    assert told.share == 1.0
