"""Two valleys of the cost that explain the runs alike: neither answer is the only one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification.inference.covariance import assess
from upright.identification.inference.intervals import allowed_rise, shared_estimates, with_valleys
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import SearchLog, descend_progressively
from upright.physics import Pendulum


@pytest.fixture(scope="module")
def swung():
    """A pendulum's fit: its optimum, its estimates, and by how much the cost may rise within J_p's interval."""
    problem = formulate(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3}), [noisy(swing(seconds=4.0), 1e-3, seed=2)])
    best = assess(problem, descend_progressively(problem, problem.start).x)
    place = next(i for i, u in enumerate(problem.unknowns) if u.name == "J_p")
    return best, shared_estimates(best, (), SearchLog()), place, allowed_rise(best, place)


def told(swung, *valleys: tuple[float, float]):
    """Estimates and sentence after descents that ended with costs above the best and J_p so many times as large."""
    best, estimates, place, rise = swung
    log, cost = SearchLog(), best.problem.cost(best.x)
    for share, factor in valleys:
        x = best.x.copy()
        x[place] = best.problem.unknowns[place].coordinate(factor * float(best.values[place]))
        log.valleys.append((best.problem, cost + share * rise, x))
    return with_valleys(estimates, best, log)


def test_a_number_that_another_valley_as_low_tells_otherwise_is_not_well_determined(swung) -> None:
    estimates, sentence = told(swung, (0.5, 1.3))
    J_p = swung[1]["J_p"]
    assert J_p.status == "well determined"
    assert (estimates["J_p"].status, estimates["b_2"]) == ("poorly determined", swung[1]["b_2"])
    assert estimates["J_p"].interval == pytest.approx((J_p.interval[0], 1.3 * J_p.value))
    either = f"J_p {J_p.value:.2g} or {1.3 * J_p.value:.2g} kg m^2"
    assert sentence == f"Two answers explain the log alike: {either}."


def test_a_valley_that_an_interval_would_not_reach_up_to_says_nothing(swung) -> None:
    assert told(swung, (1.01, 1.3)) == (swung[1], "")


def test_one_valley_met_twice_is_one_answer(swung) -> None:
    assert told(swung, (0.0, 1.01), (0.1, 1.05)) == (swung[1], "")
    assert told(swung, (0.2, 1.3), (0.3, 1.31))[1].startswith("Two answers")
    assert told(swung, (0.2, 1.3), (0.3, 0.7))[1].startswith("Three answers")


def test_valleys_of_another_model_are_not_answers_of_this_one(swung) -> None:
    best, estimates, place, _ = swung
    x = best.x.copy()
    x[place] = best.problem.unknowns[place].coordinate(1.3 * float(best.values[place]))
    log = SearchLog()
    log.valleys.append((replace(best.problem), 0.0, x))
    assert with_valleys(estimates, best, log) == (estimates, "")
