"""Rigs, runs and estimates as values: bounds, defaults, parts of a run, and what a number is called."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.errors import BadInput
from upright.identification.model.bands import Bands, Spread
from upright.identification.model.fit import Estimate
from upright.identification.model.grey_box import GreyBox, Parameter, base_values, neutral
from upright.identification.model.runs import Run
from upright.identification.problem.residuals import Problem, formulate
from upright.physics import Pendulum


def test_bounds_are_the_narrower_of_what_was_asked_and_what_is_possible() -> None:
    asked = rig(Pendulum, PENDULUM, {"b_2": 1e-3, "actuator.gain": 2.0})

    def bounds(name: str, **limits: float) -> tuple[float, float]:
        p = replace(asked.parameters[name], **limits)
        return replace(asked, parameters={**asked.parameters, name: p}).bounds(name)

    assert bounds("b_2") == (0.0, math.inf)
    assert bounds("b_2", lower=-1.0, upper=0.5) == (0.0, 0.5)
    assert bounds("b_2", lower=0.1) == (0.1, math.inf)
    assert bounds("actuator.gain", lower=-1.0, upper=3.0) == (-1.0, 3.0)
    assert asked.estimated == ("b_2", "actuator.gain")


def test_a_rig_is_known_by_values_or_without_a_term() -> None:
    asked = rig(Pendulum, PENDULUM, {"b_2": 1e-3})
    unsure = replace(asked.parameters["m_p"], uncertainty=0.1)
    asked = replace(asked, parameters={**asked.parameters, "m_p": unsure})
    known = asked.with_values({"b_2": 5e-3, "nobody": 1.0})
    assert known.parameters["b_2"].value == 5e-3
    assert known.parameters["m_p"].value == PENDULUM["m_p"]
    assert known.estimated == ()
    assert known.parameters["m_p"].uncertainty == 0.0
    less = asked.without(["b_2", "b_2c"])
    assert (less.parameters["b_2"].value, less.parameters["b_2c"].value) == (0.0, 0.0)
    assert less.parameters["b_2q"].value == PENDULUM["b_2q"]
    assert less.parameters["m_p"].uncertainty == 0.1
    assert [neutral(Pendulum, n) for n in ("b_2", "actuator.gain", "actuator.limit", "m_p")] == [
        0.0,
        1.0,
        math.inf,
        0.0,
    ]


def test_a_rig_needs_what_its_plant_has_no_default_for() -> None:
    values = base_values(rig(Pendulum, PENDULUM, {}))
    assert values["actuator.gain"] == 1.0
    assert values["g"] == 9.81
    assert values["m_p"] == PENDULUM["m_p"]
    for left, words in ((("m_p",), "m_p, none came; add it"), (("m_p", "l_cg"), "m_p, l_cg, none came; add them")):
        with pytest.raises(BadInput, match=words):
            base_values(rig(Pendulum, {n: v for n, v in PENDULUM.items() if n not in left}, {}))


def run(samples: int, **about: Any) -> Run:
    t = 5.0 + 0.01 * np.arange(samples)
    base: dict[str, Any] = {"label": "r", "role": "fit", "t": t, "u": t[:, None], "y": np.column_stack([t, -t])}
    return Run(**{**base, "measured": ("a", "b"), **about})


def test_the_first_two_thirds_are_fitted_and_a_short_run_whole() -> None:
    assert run(300).first_part().t.size == 200
    assert run(300).first_part(0.5).t.size == 150
    assert run(200).first_part().t.size == 133
    assert run(199).first_part().t.size == 199
    held = run(300, held={"a": np.arange(300.0), "b": 0.3}).first_part()
    assert held.held["a"].tolist() == list(range(200))
    assert held.held["b"] == 0.3


def test_a_run_knows_its_period_its_horizons_and_what_moved() -> None:
    plain = run(101)
    assert plain.period == pytest.approx(0.01)
    assert (plain.horizons, plain.filtered, plain.quanta, plain.free) == ((), False, (0.0, 0.0), [0, 1])
    assert replace(plain, horizon=(0.5, 0.1)).horizons == (0.1, 0.5)
    assert replace(plain, horizon=0.5).horizons == (0.5,)
    assert replace(plain, horizon=0.5, restart="kalman").filtered
    assert not replace(plain, horizon=0.5).filtered
    assert not replace(plain, restart="kalman").filtered
    assert replace(plain, held={"a": 0.0}).free == [1]
    assert replace(plain, resolution=(0.1, 0.2)).quanta == (0.1, 0.2)


def test_an_estimate_is_qualified_by_what_it_rests_on() -> None:
    e = Estimate.within(-2.0, 0.1, 0.3, "kg")
    assert (e.interval, e.unit, e.qualified) == ((-2.3, -1.7), "kg", "well determined")
    rests = replace(e, rests_on=("m", "g"))
    assert rests.qualified == "rests on m, g"
    assert replace(rests, status="poorly determined").qualified == "poorly determined, rests on m, g"
    assert not e.zero_wide
    for half, none in ((0.9e-12, True), (1.1e-12, False)):  # of 2, a part in 10^12 on both sides together
        assert Estimate.within(-2.0, 0.1, half).zero_wide == none
    assert Estimate.within(0.0, 0.0, 0.0).zero_wide


def test_a_free_run_s_spread_serves_none_that_is_restarted_unless_there_is_no_other() -> None:
    free, short, long = (Spread(horizon=h, start=1.0, end=2.0) for h in (0.0, 0.1, 1.0))
    bands = Bands(quantile=1.0, spreads={"x": (free,), "y": (free, short, long)})
    assert bands.spread("x", 0.2) is free
    assert bands.spread("y", 0.3) is short  # by the ratio: 3 times as long, not 3.3 times as short
    assert bands.spread("y", 0.33) is long
    assert free.at(np.array([0.0, 3.0])).tolist() == [2.0, 2.0]


def posed(**about: Any) -> Problem:
    return formulate(
        rig(Pendulum, PENDULUM, {"b_2": 1.5e-3}), [noisy(swing(seconds=4.0, **about), 1e-3, 1)], thin=False
    )


def test_residuals_are_counted_where_they_are_scored() -> None:
    assert posed().count() == 401
    assert posed().count(1.0) == 101
    assert posed(horizon=0.5).count() == 8 * 51
    held = posed()
    held.tracks = [replace(held.tracks[0], retained=np.arange(401) % 4 == 0)]
    assert held.count() == 101
    assert held.count(1.0) == 26
    assert held.duration == pytest.approx(4.0)


def test_weights_are_taken_over_from_another_problem() -> None:
    one, other = posed(), posed()
    one.noise = 0.03
    one.tracks = [replace(one.tracks[0], missed=np.array([2.0]))]
    other.weigh_like(one)
    assert other.noise == 0.03
    assert other.tracks[0].missed.tolist() == [2.0]


def test_a_cost_is_the_sum_of_squares_of_the_rows() -> None:
    """With what was known beforehand: a residual of `noise` per standard deviation."""
    problem = posed()
    x = problem.place({"swing: initial.theta": 1.47})
    r, J = problem.rows(0, x)
    first, _ = problem.prior_rows(x)
    place = [u.name for u in problem.unknowns].index("initial.theta")
    mean, sigma = problem.unknowns[place].prior
    assert first[0] == pytest.approx(problem.noise * (1.47 - mean) / sigma)
    assert problem.cost(x) == pytest.approx(float(np.sum(r * r)) + float(first @ first))
    normal = problem.normal(x)
    assert normal.cost == pytest.approx(problem.cost(x))
    for i in range(x.size):
        step = np.zeros(x.size)
        step[i] = 1e-5 * problem.unknowns[i].scale
        slope = (problem.cost(x + step) - problem.cost(x - step)) / (2 * step[i])
        assert 2 * normal.gradient[i] == pytest.approx(slope, rel=1e-2, abs=1e-3 * abs(normal.gradient).max())
    assert J.shape == (401, 1, x.size)


def test_steps_move_the_outputs_by_what_was_asked() -> None:
    """A hundred-thousandth of their spread, root mean square, whatever the guess of a size was."""
    problem = posed()
    problem.steps = problem.steps * 1e-2
    x = problem.start
    problem.settle_steps(x)
    track = problem.tracks[0]
    y = problem.simulate(0, problem.lanes(x, problem.sought_in(0)), track.length)[:, 0, 0]
    moved = np.sqrt(np.mean((y[:, 1:] - y[:, :1]) ** 2, axis=0)) * track.weights[0]
    assert np.all((moved > 0.3e-5) & (moved < 3e-5))
    lanes = problem.lanes(x, problem.sought_in(0), central=True)
    assert np.allclose(lanes[:, 1:4] - x[:, None], np.diag(problem.steps))
    assert np.allclose(lanes[:, 4:] - x[:, None], -np.diag(problem.steps))


def test_a_parameter_is_no_guess_unless_it_is_said() -> None:
    p = Parameter(name="a", value=1.0)
    assert (p.unit, p.estimate, p.assumed, p.uncertainty, p.lower, p.upper) == (
        "1",
        False,
        False,
        0.0,
        -math.inf,
        math.inf,
    )
    assert not GreyBox(plant=Pendulum, parameters={}).guessed
    assert GreyBox(plant=Pendulum, parameters={}).substeps == 1
