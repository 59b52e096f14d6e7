"""A predicted run is fitted too where the others leave a number undetermined, and still counts as predicted."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from tests.identification.twins import rig
from upright.identification import Run, identify
from upright.identification.checks.refit import as_tested, with_refit
from upright.identification.model.fit import Fit, Judgement, RunScore
from upright.physics import find

INERTIA, DAMPING, STIFFNESS = 5e-4, 0.1, 0.1


def disk(seconds: float, seed: int, **fields: Any) -> Run:
    """A disk with noise of 0.06 rad whose inertia shows for 5 ms after each step of its torque (SciPy, exact)."""
    period, chance = 5e-3, np.random.default_rng(seed)
    t = np.arange(round(seconds / period)) * period
    u = 0.1 * np.repeat(chance.choice([-1.0, 1.0], size=int(2 * seconds) + 2), 100)[: t.size]
    A, B = [[0, 1], [-STIFFNESS / INERTIA, -DAMPING / INERTIA]], [[0], [1 / INERTIA]]
    y = lsim(StateSpace(A, B, [[1, 0]], [[0]]), u, t, interp=False)[1] + 0.06 * chance.standard_normal(t.size)
    return Run(t=t, u=u[:, None], y=y[:, None], measured=("theta_1",), **fields)


def test_a_short_run_leaves_the_inertia_open_until_the_predicted_one_is_fitted_too() -> None:
    short = disk(4, 1, label="short", role="fit")
    long = disk(16, 11, label="long", role="predict", unknown=())
    model = rig(find("torsional-1"), {}, {"J_1": 2e-3, "c_1": 2e-3, "k_1": 1e-2})
    first, whole = identify(model, [short, long]), identify(model, [short, replace(long, refit=True)])
    assert [first.trusted, whole.trusted] == [False, True]
    assert ["fitted too" in fit.verdict for fit in (first, whole)] == [False, True]
    assert whole.runs["long"].role == "predict"
    # what counts is the prediction of the fit that had not seen it
    np.testing.assert_array_equal(whole.runs["long"].simulated, first.runs["long"].simulated)
    low, high = whole.estimates["J_1"].interval
    assert low < INERTIA < high
    assert high - low < 0.5 * np.ptp(first.estimates["J_1"].interval)  # five times the data: 0.45


def score(percent: float, role: str = "fit") -> RunScore:
    empty = np.zeros(0)
    return RunScore(role=role, fit_percent={"theta": percent}, horizon=None, t=empty, y=empty, simulated=empty,
                    measured=("theta",))  # fmt: skip


def test_a_run_that_is_then_explained_worse_than_it_was_predicted_has_not_been_tested() -> None:
    before = {"b": score(90.0, "predict")}
    assert as_tested({"a": score(95.0), "b": score(88.0)}, before)["b"].role == "predict"
    assert as_tested({"a": score(95.0), "b": score(80.0)}, before)["b"].role == "fit"


def outcome(predicts: str, usable: str, status: str = "poorly determined", percent: float = 95.0) -> Fit:
    questions = {"Does it predict?": predicts, "Can its numbers be used?": usable}
    return cast(Fit, SimpleNamespace(
        answers=[Judgement(question=q, answer=cast(Any, a), headline="") for q, a in questions.items()],
        estimates={"k_1": SimpleNamespace(status=status)}, interrupted=False, runs={"a": score(percent)},
    ))  # fmt: skip


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (outcome("no", "no"), outcome("yes", "yes")),  # its test failed: more data mend no model
        (outcome("yes", "in part"), outcome("yes", "yes")),  # nothing to gain
        (outcome("yes", "no", "at bound"), outcome("yes", "yes")),  # more data would not help
        (outcome("yes", "no"), outcome("yes", "no")),  # and did not help
        (outcome("yes", "no"), outcome("yes", "yes", percent=90.0)),  # the search went astray
    ],
)
def test_elsewhere_the_fit_stays_that_of_the_fitted_runs(before: Fit, after: Fit) -> None:
    held_out = disk(1, 1, label="b", role="predict", refit=True)
    assert with_refit(before, [held_out], lambda _runs, _fit: after) is before
