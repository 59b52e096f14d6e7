"""Does looking at a search show what it has come to, change nothing of it, and take next to no time?"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from tests.identification.problem.test_predictor import LEVELS, balanced, posed
from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, shaken, swing
from upright.identification import identify
from upright.identification.inference import so_far
from upright.identification.inference.so_far import COST, OFTEN, Lookout
from upright.identification.problem.residuals import formulate
from upright.physics import Furuta, Pendulum


@pytest.fixture(scope="module")
def model():
    return rig(Pendulum, PENDULUM, {"J_p": 1.8e-3, "b_2": 2e-3})


@pytest.fixture(scope="module")
def run():
    return noisy(swing(PENDULUM, angle=1.5, seconds=6.0), 3e-3, seed=1)


def test_looking_changes_no_number_and_the_best_so_far_ends_as_the_fit_does(model, run, monkeypatch):
    monkeypatch.setattr(so_far, "OFTEN", 0.0)
    monkeypatch.setattr(so_far, "COST", 1e6)
    seen = []
    watched, alone = identify(model, [run], show=seen.append), identify(model, [run])
    assert {n: (e.value, e.interval) for n, e in watched.estimates.items()} == {
        n: (e.value, e.interval) for n, e in alone.estimates.items()
    }
    assert watched.evaluations == alone.evaluations
    counts = [each.evaluations for each in seen]
    assert all(a <= b for a, b in pairwise(counts))
    assert 0 < counts[0] < counts[-1]
    best = [each.runs[run.label] for each in seen if each.runs is not None]
    percents = [score.fit_percent["theta"] for score in best]
    assert percents == sorted(percents)
    final = watched.runs[run.label]
    assert percents[-1] == pytest.approx(final.fit_percent["theta"], abs=0.1)
    assert best[-1].t[[0, -1]] == pytest.approx(run.t[[0, -1]], abs=0.05)  # a run without input may be thinned
    model_at = np.interp(best[-1].t, final.t, final.simulated[:, 0])
    assert np.abs(best[-1].simulated[:, 0] - model_at).max() < 0.01 * np.ptp(run.y)


@pytest.mark.parametrize(("takes", "waits"), [(1e-4, OFTEN), (1.0, 1.0 / COST)])
def test_looks_are_some_a_second_and_take_a_small_share_of_the_time_however_long_one_takes(model, run, takes, waits):
    problem, looked, now = formulate(model, [run]), [], 0.0

    def clock():
        return now

    def show(picture):
        nonlocal now
        looked.append(now)
        now += takes

    look = Lookout(show, clock)
    while now < 4 * waits:
        look(problem, problem.start)
        now += waits / 20
    assert 2 <= len(looked) <= 4
    assert all(b - a >= waits for a, b in pairwise(looked))


@pytest.mark.parametrize("kind", ["windows", "filtered"])
def test_of_restarted_runs_every_sample_is_shown_with_what_was_measured_there(kind):
    if kind == "windows":
        run = shaken(horizon=0.5, unknown=())
        problem = formulate(rig(Furuta, FURUTA, {"J_d": FURUTA["J_d"]}), [run])
    else:
        run = balanced(0, seconds=3.0)
        problem = posed(run, LEVELS)
    seen = []
    Lookout(seen.append)(problem, problem.start)
    score = seen[0].runs[run.label]
    assert np.diff(score.t).min() > 0
    assert score.y == pytest.approx(np.column_stack([np.interp(score.t, run.t, y) for y in run.y.T]), abs=1e-12)
    assert min(seen[0].explained.values()) > 0
