"""Ends of intervals that were followed along a valley of the cost, and those that were not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification.inference import intervals
from upright.identification.inference.covariance import Optimum, assess
from upright.identification.inference.intervals import beside_bound, profile
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import SearchLog, descend_progressively
from upright.physics import Pendulum


@pytest.fixture(scope="module")
def best() -> Optimum:
    """A swing whose friction is asked."""
    asked = rig(Pendulum, {**PENDULUM, "b_2q": 0.0}, {"b_2": 1.5e-3, "b_2c": 1.5e-3})
    problem = formulate(asked, [noisy(swing({**PENDULUM, "b_2q": 0.0}), 1e-3, 1)])
    return assess(problem, descend_progressively(problem, problem.start).x)


@pytest.mark.parametrize("side", [0, 1])
def test_no_end_is_the_estimate_itself_where_no_wall_stands(
    best: Optimum, side: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # a refit that stalls beside the estimate shrinks the bracket; the standard error says how far the end is
    place = [u.name for u in best.problem.unknowns].index("b_2")
    plain, x = beside_bound(best, place), float(best.x[place])
    stalled = (x * (1 - 1e-6), 3 * x) if side == 0 else (0.1 * x, x * (1 + 1e-6))
    monkeypatch.setattr(intervals, "_ends", lambda *_: stalled)
    found = profile(best, place, plain, best.quantile, SearchLog())
    assert found[side] == pytest.approx(plain.interval[side], rel=1e-2)
    assert found[1 - side] == stalled[1 - side]


def test_an_end_at_a_wall_stays(best: Optimum, monkeypatch: pytest.MonkeyPatch) -> None:
    place = [u.name for u in best.problem.unknowns].index("b_2")
    plain, x = beside_bound(best, place), float(best.x[place])
    wall = x * (1 - 1e-6)
    walled = [replace(u, lower=wall) if u.name == "b_2" else u for u in best.problem.unknowns]
    monkeypatch.setattr(best.problem, "unknowns", walled)
    monkeypatch.setattr(intervals, "_ends", lambda *_: (wall, 3 * x))
    assert profile(best, place, plain, best.quantile, SearchLog()) == (wall, 3 * x)
