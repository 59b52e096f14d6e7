"""Of nested friction models the one is chosen that predicts best, and what a richer one says otherwise is noted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.problem.test_predictor import GUESSES as BALANCED_GUESSES
from tests.identification.problem.test_predictor import VALUES as BALANCED_VALUES
from tests.identification.problem.test_predictor import balanced
from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification import Run
from upright.identification.ladder import growth
from upright.identification.ladder.growth import choose_friction
from upright.identification.model.grey_box import GreyBox
from upright.identification.problem.residuals import Problem, formulate
from upright.identification.search.descent import Descent, SearchLog, descend, descend_progressively, first_horizon
from upright.identification.search.strategy import closed_form_starts, search
from upright.physics import Furuta, Pendulum
from upright.simulation import simulate

GUESSES = {"J_p": 1.4e-3, "b_2": 1.4e-3, "b_2c": 1.4e-3, "b_2q": 7e-4}
VISCOUS = {"b_2c": 0.0, "b_2q": 0.0}
SIGMA = 3e-3


def swings(seed: int, **truth: float) -> list[Run]:
    """Two noisy swings."""
    values = PENDULUM | truth
    return [
        noisy(swing(values, angle=a, label=f"from {a}"), SIGMA, seed=100 * seed + k) for k, a in enumerate((1.5, 1.0))
    ]


def asked(*names: str, **truth: float) -> GreyBox:
    return rig(Pendulum, PENDULUM | truth, {n: GUESSES[n] for n in names or GUESSES})


@pytest.mark.parametrize("names", [tuple(GUESSES), ("J_p", "b_2", "b_2c")])
def test_friction_that_is_not_there_is_left_out(names: Sequence[str]) -> None:
    log = SearchLog()
    chosen, _ = choose_friction(asked(*names, **VISCOUS), swings(0, **VISCOUS), log)
    assert chosen.estimated == ("J_p", "b_2")
    assert (log.warnings, log.rivals) == ([], {})


@pytest.mark.parametrize("seed", [0, 1])
def test_friction_that_is_there_is_chosen_and_the_final_fit_starts_at_its_optimum(seed: int) -> None:
    truth = {"b_2c": 4e-3, "b_2q": 0.0}
    runs, log = swings(seed, **truth), SearchLog()
    chosen, (start,) = choose_friction(asked(**truth), runs, log)
    assert chosen.estimated == ("J_p", "b_2", "b_2c")
    problem = formulate(chosen, runs)
    found = problem.values_at(start)
    for name in ("J_p", "b_2", "b_2c"):
        assert found[name] == pytest.approx((PENDULUM | truth)[name], rel=0.15)  # ten standard errors and more
    # numbers of single runs come along: nothing is left to gain
    cost = problem.settle_steps(start).cost
    end = descend(problem.normal, start, problem.lower, problem.upper, tolerance=1e-9)
    assert cost < end.normal.cost * (1 + 1e-4)
    assert (log.warnings, log.rivals) == ([], {})


def test_blocks_that_were_left_out_are_missed_by_their_noise() -> None:
    """The mean squared residual of the truth is the noise over the spread of each swing; 11 numbers in 2002 more."""
    truth = {"b_2c": 4e-3, "b_2q": 0.0}
    runs, log = swings(0, **truth), SearchLog()
    choose_friction(asked(**truth), runs, log)
    missed = {name.partition(":")[0]: cost for name, cost, _ in log.history if name.endswith("held-out cost")}
    assert list(missed) == ["viscous friction", "Coulomb friction", "quadratic drag"]
    noise = float(np.mean([(SIGMA / np.std(run.y)) ** 2 for run in runs]))
    # 2002 squares scatter by 3 %; what a third of the blocks cannot tell adds some percent
    assert missed["Coulomb friction"] == pytest.approx(noise, rel=0.2)
    assert missed["viscous friction"] > 10 * noise


def test_without_friction_to_choose_nothing_is_searched() -> None:
    question, runs, log = asked("J_p", "b_2", **VISCOUS), swings(0, **VISCOUS), SearchLog()
    chosen, starts = choose_friction(question, runs, log)
    assert chosen is question
    problem = formulate(question, runs)
    assert len(starts) == 1 + len(closed_form_starts(question, runs))
    assert np.array_equal(starts[0], problem.start)
    assert log.history == []


@pytest.mark.parametrize("alone", [True, False])
def test_where_a_filter_predicts_a_run_all_friction_stays_and_the_best_start_is_taken(alone: bool) -> None:
    question = rig(Furuta, BALANCED_VALUES | {f"noise.{n}": 1e-5 for n in ("psi", "theta", "T")}, BALANCED_GUESSES)
    runs = [balanced(0, seconds=1.5)]
    if not alone:
        runs += [replace(balanced(1, seconds=1.5), label="free", horizon=None, restart="smooth")]
    log = SearchLog()
    chosen, starts = choose_friction(question, runs, log)
    assert chosen is question
    assert log.history == []
    problem = formulate(question, runs)
    others = [problem.start, *(problem.place(s) for s in closed_form_starts(question, runs))]
    assert len(others) > 1
    (cost,) = (problem.cost(x, first_horizon(problem)) for x in starts)
    assert cost == pytest.approx(min(problem.cost(x, first_horizon(problem)) for x in others), rel=1e-12)


def test_a_richer_model_that_was_led_astray_is_fitted_from_the_end_of_the_poorer_one(monkeypatch) -> None:
    """A search may follow a start that looks better over the first seconds: here drag leads it back to no friction."""
    truth = {"b_2c": 6e-3, "b_2q": 3e-4}
    runs = swings(0, **truth)
    ends: list[tuple[Problem, np.ndarray, float]] = []

    def astray(
        problem: Problem, candidates: Sequence[np.ndarray], log: SearchLog, *, patient: bool, stairs: bool
    ) -> Descent:
        assert not stairs  # the simplex waits until a model is chosen
        assert patient is (
            not ends
        )  # more attempts than one for the first model, which has no poorer one to start from
        found = search(problem, candidates, log, patient=patient, stairs=stairs)
        if len(ends) == 2:
            none = {"b_2c": 0.0, "b_2q": 0.0}
            poorest, below = (problem.place(none | p.values_at(x)) for p, x, _ in ends)
            size = np.array([u.scale for u in problem.unknowns])
            begun = np.asarray(candidates[0]) / size
            # what the search was given first: the end of the model just below, and a little drag
            assert np.abs(begun - below / size).max() < 0.1 * np.abs(begun - poorest / size).max()
            x = 0.9 * poorest + 0.1 * below
            found = Descent(x=x, normal=problem.normal(x), converged=True)
        ends.append((problem, found.x, found.normal.cost))
        return found

    monkeypatch.setattr(growth, "search", astray)
    log = SearchLog()
    chosen, (start,) = choose_friction(asked(**truth), runs, log)
    first, second, third = (cost for *_, cost in ends)
    assert second < third < first  # otherwise nothing went astray
    assert chosen.estimated == tuple(GUESSES)
    assert formulate(chosen, runs).cost(start) < second
    assert log.warnings == []


@pytest.mark.parametrize(("seed", "names"), [(5, {"b_2", "b_2c"}), (6, set())])
def test_a_richer_model_that_explains_more_and_predicts_less_is_a_rival_where_it_says_otherwise(
    seed: int, names: set[str]
) -> None:
    """Coulomb friction sets in halfway, which no constant friction explains: drag bends to it.

    The richer model is fitted here from its guess alone; numbers that differ by more than half are told.
    """
    early, late = PENDULUM | VISCOUS, PENDULUM | VISCOUS | {"b_2c": 5e-4}
    run = swing(early)
    half = run.t.size // 2
    x = simulate(Pendulum(**early), {}, [1.5, 0.0], None, 0.01, samples=half + 1, substeps=2)[-1, :, 0]
    y = run.y.copy()
    y[half:] = simulate(Pendulum(**late), {}, x, None, 0.01, samples=y.size - half, substeps=2)[:, [0], 0]
    run, log = noisy(replace(run, y=y), 1e-3, seed), SearchLog()
    chosen, (start,) = choose_friction(asked(), [run], log)
    assert chosen.estimated == ("J_p", "b_2", "b_2c")
    poorer, richer = formulate(chosen, [run]), formulate(asked(), [run])
    end = descend_progressively(richer, richer.start)
    assert end.normal.cost < poorer.cost(start)
    told, other = poorer.shared_at(start), richer.shared_at(end.x)
    apart = {n for n in told if not 0.5 < other[n] / told[n] < 2}
    assert apart == set(log.rivals) == names
    assert log.rivals == pytest.approx({n: other[n] for n in names}, rel=0.01)
    assert ["explained better with b_2q (" in w for w in log.warnings] == [True] * bool(names)


def test_what_a_richer_model_gains_by_chance_is_no_rival() -> None:
    """Under 0.03 rad of noise viscous friction, Coulomb friction and drag are told apart by nothing but luck."""
    run, log = noisy(swing(PENDULUM | VISCOUS, angle=1.0, seconds=5.0), 0.03, seed=0), SearchLog()
    chosen, (start,) = choose_friction(asked(**VISCOUS), [run], log)
    assert chosen.estimated == ("J_p", "b_2")
    poorer, richer = formulate(chosen, [run]), formulate(asked(**VISCOUS), [run])
    end = descend_progressively(richer, richer.start)
    # two numbers that mean nothing lower the cost by 5.99 variances of a residual in one case of 20 (chi squared)
    assert 0 < poorer.cost(start) - end.normal.cost < 5.99 * end.normal.cost / run.t.size
    assert richer.shared_at(end.x)["b_2"] < 0.5 * poorer.shared_at(start)["b_2"]
    assert (log.rivals, log.warnings) == ({}, [])
