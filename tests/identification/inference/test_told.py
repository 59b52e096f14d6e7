"""Sentences and intervals of optima made by hand: what is blind, what rests on what, what a bound leaves."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from upright.identification import GreyBox, Parameter, Run
from upright.identification.inference.assumptions import (
    assumption_sentences,
    assumptions,
    remedy,
    resting,
    with_assumptions,
)
from upright.identification.inference.covariance import Identifiability, Optimum, assess, identifiability, student
from upright.identification.inference.intervals import (
    beside_bound,
    estimate,
    profile_work,
    shared_estimates,
    widened,
    with_left_out,
)
from upright.identification.inference.unseen.reach import beyond, reached
from upright.identification.model.fit import Assumption, Estimate
from upright.identification.problem.normal_equations import Normal
from upright.identification.problem.residuals import formulate
from upright.identification.problem.unknowns import Unknown
from upright.identification.search.descent import SearchLog, descend
from upright.physics import find
from upright.simulation import simulate

CART = find("rectilinear-1")
DT, N = 0.01, 400
TRUTH = {"m_1": 2.0, "k_1": 50.0, "c_1": 1.5, "actuator.gain": 3.0}
UNITS = {"m_1": "kg", "k_1": "N/m", "c_1": "N s/m", "actuator.gain": "N/V"}


def command() -> np.ndarray:
    return np.sign(np.sin(4.0 * DT * np.arange(N)))


def motion(values: dict[str, float]) -> np.ndarray:
    plant = {n: v for n, v in values.items() if not n.startswith("actuator")}
    drive = {n: v for n, v in values.items() if n.startswith("actuator")}
    return simulate(CART(**plant), drive, [0.0, 0.0], command(), DT, samples=N)[:, :1, 0]


def driven(**about: Any) -> Run:
    y = motion(TRUTH) + 2e-3 * np.random.default_rng(3).normal(size=(N, 1))
    rest = {"unknown": (), "initial": {"x_1": 0.0, "x_1_dot": 0.0}, "measured": ("x_1",)}
    return Run(
        **{"label": "run", "role": "fit", "t": DT * np.arange(N), "u": command()[:, None], "y": y, **rest, **about}
    )


def cart(*asked: str, assumed: str = "", **other: float) -> GreyBox:
    values = {**TRUTH, **other}
    numbers = [Parameter(name=n, value=v, unit=UNITS[n], estimate=n in asked, assumed=n == assumed)
               for n, v in values.items()]  # fmt: skip
    return GreyBox(plant=CART, parameters={p.name: p for p in numbers})


def fitted(rig: GreyBox, *runs: Run) -> Optimum:
    problem = formulate(rig, runs or [driven()])
    problem.settle_steps(problem.start)
    return assess(problem, descend(problem.normal, problem.start, problem.lower, problem.upper).x)


def seen(names: str, *blind: list[float], effects: list[float] | None = None) -> Identifiability:
    n = len(names.split())
    return Identifiability(
        names=tuple(names.split()), singular_values=np.ones(n), directions=np.eye(n), blind=np.array(blind),
        effects=np.ones(n) if effects is None else np.array(effects),
    )  # fmt: skip


def test_a_blind_direction_is_told_with_the_number_that_is_weighed_most_easily() -> None:
    units = {"J": "kg m^2", "m": "kg", "l": "m", "b": "N m s/rad", "c": "N m"}
    (alike,) = seen("b J m", [0.6, 0.58, 0.62]).sentences(units)
    assert alike == (
        "m, b and J scale together: the data see only their ratios. Give m, or any other one of them (J or b), as a "
        "known value to fix it."
    )
    (mixed,) = seen("c b l", [0.5, -1.0, 0.2]).sentences(units)
    assert mixed == (
        "The data cannot see a common change of b by +100 %, c by -50 %, l by -20 %: the outputs stay the same. Give "
        "l, or any other one of them (b or c), as a known value to fix it."
    )
    (alone,) = seen("c b", [0.0, 1.0]).sentences(units)
    assert alone == (
        "The data cannot see b: no measured output changes with it. Give its value, or add a run in which it matters."
    )


def test_a_number_that_is_felt_is_blind_only_beside_another_as_in_chaos() -> None:
    (lost,) = seen("c b", [0.0, 1.0], effects=[3e9, 30.0]).sentences({})
    assert lost.startswith("The data cannot see b beside c: the motion depends on that 1e+08 times as strongly")
    assert "no measured output changes" not in lost


@pytest.mark.parametrize(("second", "together"), [(0.91, True), (0.89, False), (1.0, True)])
def test_numbers_scale_together_where_they_change_alike_to_a_tenth(second: float, together: bool) -> None:
    (said,) = seen("a b", [1.0, second]).sentences({})
    assert ("scale together" in said) == together


def test_a_number_takes_part_by_its_size_or_by_its_effect() -> None:
    """From a twentieth of the largest on; small ones too where what they do is as large."""
    d = np.array([-2.0, 0.1, 0.098, 1e-3])
    assert seen("a b c d").parts(d) == [("a", 1.0), ("b", -0.05)]
    assert [n for n, _ in seen("a b c d", effects=[1.0, 1.0, 1.0, 100.0]).parts(d)] == ["a", "b", "d"]
    assert [n for n, _ in seen("a b c d", effects=[0.0, 0.0, 0.0, 0.0]).parts(d)] == ["a", "b"]
    assert seen("a b c d", list(d)).hidden == {"a", "b"}


def test_the_jacobian_is_scaled_to_relative_changes_and_what_differs_from_run_to_run_eliminated() -> None:
    """Of the matrix [[4, 2, 1], [2, 3, 0], [1, 0, 2]] with the last a run's own, at values 10 and log."""
    A = np.array([[4.0, 2.0, 1.0], [2.0, 3.0, 0.5], [1.0, 0.5, 2.0]])
    one = Unknown(name="a", runs=(), value=1.0, lower=-math.inf, upper=math.inf, log=False, scale=7.0)
    unknowns = [one, replace(one, name="b", log=True), replace(one, name="own", runs=(0,))]

    class Sought:
        def __init__(self, first: float) -> None:
            self.unknowns, self.first = unknowns, first

        def value(self, x: np.ndarray) -> np.ndarray:
            return np.array([self.first, 5.0, 1.0])

    S = A[:2, :2] - np.outer(A[:2, 2], A[2, :2]) / 2.0
    for first, size in ((10.0, 10.0), (-10.0, 10.0), (8e-3, 8e-3), (6e-3, 7.0), (0.0, 7.0)):
        best = Optimum(
            problem=Sought(first), x=np.zeros(3), covariance=np.eye(3), sandwich=np.eye(3), white=np.ones(3), matrix=A,
            variance=1.0, memory=0.0, samples=100.0, pinned=np.zeros(3, dtype=bool),
        )  # fmt: skip
        found = identifiability(best)
        scaled = S * np.outer([size, 1.0], [size, 1.0])
        assert found.names == ("a", "b")
        assert found.singular_values**2 == pytest.approx(np.linalg.eigvalsh(scaled)[::-1])
        assert found.effects == pytest.approx(np.sqrt(np.diag(scaled)))
        assert np.allclose(np.abs(found.directions @ scaled @ found.directions.T), np.diag(found.singular_values**2))
        assert found.blind.shape == (0, 2)


def test_the_standard_error_of_a_logarithm_is_relative() -> None:
    """A mass is sought by its logarithm, a stiffness as it is; the interval is so many of them to either side."""
    best = fitted(cart("m_1", "k_1", "actuator.gain"))
    for place, u in enumerate(best.problem.unknowns):
        value, sigma = best.values[place], best.sigma[place]
        for quantile in (None, 3.0):
            q = student(best.samples - 3) if quantile is None else quantile
            e = estimate(best, place, quantile)
            assert (e.value, e.unit) == (value, UNITS[u.name])
            if u.log:
                assert e.stderr == pytest.approx(value * sigma)
                assert e.interval == pytest.approx((value * math.exp(-q * sigma), value * math.exp(q * sigma)))
            else:
                assert e.stderr == pytest.approx(sigma)
                assert e.interval == pytest.approx((value - q * sigma, value + q * sigma))
    assert {u.log for u in best.problem.unknowns} == {True, False}
    assert student(7.0) == pytest.approx(stats.t.ppf(0.975, 7))
    assert student(0.5, 0.9) == pytest.approx(stats.t.ppf(0.9, 2))


class Bowl:
    """Two numbers whose cost is a quadratic; the first lies at its bound."""

    evaluations = 0
    lower, upper = np.array([0.0, -np.inf]), np.array([np.inf, np.inf])

    def __init__(self, *, log: bool = False) -> None:
        u = Unknown(name="a", runs=(), value=1.0, lower=0.0, upper=math.inf, log=log, scale=1.0)
        self.unknowns = [u, replace(u, name="b", log=False)]
        self.rig = cart()

    def value(self, x: np.ndarray) -> np.ndarray:
        return np.array([math.exp(x[0]) if self.unknowns[0].log else x[0], x[1]])

    def normal(self, x: np.ndarray) -> Normal:
        return Normal(1.0, np.array([[4.0, 1.0], [1.0, 2.0]]), np.array([0.3, 0.0]))


@pytest.mark.parametrize("log", [False, True])
def test_a_number_at_its_bound_reaches_as_far_as_the_cost_allows(log: bool) -> None:
    """``2 g s + c s^2 = rise`` with the curvature 4 - 1/2 that is left when the other follows, and the rise of
    two standard errors of a residual variance 0.25 that a memory has made 3 times as large."""
    best = Optimum(
        problem=Bowl(log=log), x=np.array([0.0, 1.0]), covariance=np.diag([0.0, 0.3]), sandwich=np.eye(2),
        white=np.array([0.0, 0.1]), matrix=np.eye(2), variance=0.25, memory=0.0, samples=1e9,
        pinned=np.array([True, False]),
    )  # fmt: skip
    rise, g, c = 2.0**2 * 0.25 * 3.0, 0.3, 3.5
    down, up = (max(np.roots([c, 2 * side * g, -rise])) for side in (-1, 1))
    expected = (math.exp(-down), math.exp(up)) if log else (-down, up)
    assert beside_bound(best, 0, 2.0).interval == pytest.approx(expected)
    plain = estimate(best, 1, 2.0)
    assert beside_bound(best, 1, 2.0) == plain
    assert plain.interval == pytest.approx((1 - 2 * math.sqrt(0.3), 1 + 2 * math.sqrt(0.3)))


def test_a_profile_costs_forty_simulations_of_so_many_lanes() -> None:
    best = fitted(cart("m_1", "k_1", "actuator.gain"))
    assert profile_work(best) == pytest.approx(40 * N * 4 / 16)


@pytest.mark.parametrize(("half", "status"), [(0.49, "well determined"), (0.51, "poorly determined")])
def test_an_interval_that_grows_wider_than_its_value_makes_a_number_weak(half: float, status: str) -> None:
    e = Estimate(value=-2.0, stderr=0.1, interval=(-2.1, -1.9))
    wide = widened(e, (-2.0 - 2 * half, -2.0 + 2 * half))
    assert wide.interval == (-2.0 - 2 * half, -2.0 + 2 * half)
    assert wide.status == status
    assert widened(e, (-2.05, -1.0)).interval == (-2.1, -1.0)
    assert widened(replace(e, status="at bound"), (-9.0, 9.0)).status == "at bound"


def test_what_is_hidden_has_no_interval_and_what_is_known_keeps_its_own() -> None:
    asked = cart("k_1", "actuator.gain")
    mass = replace(asked.parameters["m_1"], uncertainty=0.01)
    best = fitted(replace(asked, parameters={**asked.parameters, "m_1": mass}))
    told = shared_estimates(best, ("k_1",), SearchLog(), profiles=False)
    assert {n: e.status for n, e in told.items()} == {
        "m_1": "known",
        "k_1": "unseen",
        "actuator.gain": "well determined",
    }
    assert told["k_1"].interval == (-math.inf, math.inf)
    assert told["m_1"].stderr == pytest.approx(0.01, rel=0.2)


def test_a_term_left_out_widens_the_others_to_what_they_are_with_it() -> None:
    """The damper: gain and stiffness of the richer model, from its own optimum and standard errors."""
    asked = cart("k_1", "c_1", "actuator.gain")
    chosen = fitted(cart("k_1", "actuator.gain", c_1=1.45))
    told = with_left_out(chosen, asked, ["c_1"], SearchLog())
    whole = fitted(asked)
    q = stats.t.ppf(0.975, chosen.samples - 2 - 1)
    for place, u in enumerate(whole.problem.unknowns):
        expected = whole.values[place] + q * whole.sigma[place] * np.array([-1, 1])
        # both are weighed by the noise that the poorer model leaves
        assert np.allclose(told[u.name], expected, atol=0.1 * q * whole.sigma[place]), u.name


def assumed(name: str, value: float, unit: str, known: tuple[str, ...] = (), **follows: float) -> Assumption:
    firm = Estimate(value=1.0, stderr=0.1, interval=(0.8, 1.2))
    ratios = dict.fromkeys(known, firm)
    return Assumption(name=name, value=value, unit=unit, follows=follows, without={}, ratios=ratios)


@pytest.mark.parametrize(
    ("a", "said"),
    [
        (
            assumed("actuator.gain", 0.5, "N/V", m=1.0, k=0.985, w=0.0, z=-0.015),
            "actuator.gain = 0.5 N/V is assumed, not known; m, k are proportional to it, so their ratios are known; w, "
            'z do not depend on it. Measure actuator.gain and give it as known, gain = "... N/V" under [actuator].',
        ),
        (
            assumed("m_p", 2.0, "1", J=1.0, w=0.0, b=-0.5),
            "m_p = 2 is assumed, not known; J is proportional to it, so their ratios are known; for every percent of "
            'it b by -0.5 % would follow; w does not depend on it. Measure m_p and give it as known, m_p = "..." under '
            "[parameters].",
        ),
        (
            assumed("J_p", 0.0, "kg m^2", ("J_A/(m_p l_cg)",), l_cg=1.3, b=0.4, w=0.0),
            "J_p = 0 kg m^2 is assumed, not known; l_cg, b would move with it; J_A/(m_p l_cg) does not; "
            'w does not depend on it. Measure J_p and give it as known, J_p = "... kg m^2" under [parameters].',
        ),
        (assumed("g", 9.81, "", w=0.01), "g = 9.81 is assumed, not known; w does not depend on it."),
        (
            assumed("m_p", 2.0, "kg", J=math.nan),
            "m_p = 2 kg is assumed, not known; what rests on it was not evaluated, so every estimate may. Measure m_p "
            'and give it as known, m_p = "... kg" under [parameters].',
        ),
    ],
)  # fmt: skip
def test_what_rests_on_an_assumed_number_is_told(a: Assumption, said: str) -> None:
    assert assumption_sentences([a]) == (said,)
    assert (remedy(a) in said) == bool(resting(a))


def test_an_estimate_names_every_assumed_number_that_it_rests_on() -> None:
    e = Estimate(value=1.0, stderr=0.1, interval=(0.8, 1.2))
    found = [
        assumed("a", 1.0, "", m=1.0, k=0.0),
        assumed("b", 1.0, "", m=0.5, k=0.03),
        assumed("c", 0.0, "", m=2.0),
    ]
    told = with_assumptions({"m": e, "k": e, "other": e}, found)
    assert {n: x.rests_on for n, x in told.items()} == {"m": ("a", "b", "c"), "k": ("b",), "other": ()}


@pytest.mark.parametrize(("quanta", "per"), [((0.0,), 1.0), ((1e-4,), 1e-4), ((1e-4, 2e-4), 1.0)])
def test_numbers_per_assumed_gain_are_in_counts_where_all_encoders_have_one(
    quanta: tuple[float, ...], per: float
) -> None:
    """m/g in V s^2/m; in counts of q m each it is q times that."""
    runs = [driven(resolution=(q,), label=f"{q}") for q in quanta]
    best = fitted(cart("m_1", "k_1", "c_1", assumed="actuator.gain"), *runs)
    given = {n: Estimate(value=v, stderr=0.1 * v, interval=(0.7 * v, 1.4 * v), unit=UNITS[n]) for n, v in TRUTH.items()}
    (a,) = assumptions(best, given)
    assert a.follows == pytest.approx(dict.fromkeys(("m_1", "k_1", "c_1"), 1.0), abs=1e-3)
    assert (a.value, a.unit, a.size) == (3.0, "N/V", 3.0)
    along = "count" if per != 1.0 else "m"
    units = {"m_1": f"V s^2/{along}", "k_1": f"V/{along}", "c_1": f"V s/{along}"}
    for n, e in a.without.items():
        v = TRUTH[n] / 3.0 * per
        assert (e.unit, e.value, e.stderr) == (units[n], pytest.approx(v), pytest.approx(0.1 * v))
        assert e.interval == pytest.approx((0.7 * v, 1.4 * v))
    assert set(a.without) == set(units)


def test_the_size_of_a_number_assumed_to_be_none_is_what_shows_as_much_as_the_most_influential_estimate() -> None:
    """Slopes of the motion by differences of another simulation."""
    best = fitted(cart("m_1", "k_1", assumed="c_1", c_1=0.0), driven(y=motion({**TRUTH, "c_1": 0.0})))
    values = {**TRUTH, "c_1": 0.0}

    def slope(name: str) -> np.ndarray:
        step = 1e-5 * values[name] or 1e-5
        return (motion({**values, name: values[name] + step}) - motion(values))[:, 0] / step

    J = np.column_stack([values[n] * slope(n) for n in ("m_1", "k_1")])
    damper = slope("c_1")
    (a,) = assumptions(best, {})
    assert a.size == pytest.approx(np.linalg.norm(J, axis=0).max() / np.linalg.norm(damper), rel=1e-3)
    moves = -np.linalg.lstsq(J, damper, rcond=None)[0] * a.size
    assert list(a.follows.values()) == pytest.approx(moves, abs=2e-3)
    assert a.range == (-a.size, a.size)  # a damper that nobody measured may drive as well
    assert assumptions(best, {}, evaluate=False)[0].size == 0.0
    assert all(math.isnan(v) for v in assumptions(best, {}, evaluate=False)[0].follows.values())


@pytest.mark.parametrize(
    ("value", "bounds", "expected"),
    [(2.0, {}, (0.2, 20.0)), (2.0, {"upper": 3.0}, (0.2, 3.0)), (2.0, {"lower": 1.0, "upper": 3.0}, (1.0, 3.0))],
)
def test_an_assumed_number_may_be_ten_times_as_large_or_small_or_lie_within_its_bounds(value, bounds, expected) -> None:
    rig = cart("k_1", assumed="m_1", m_1=value)
    parameters = {**rig.parameters, "m_1": replace(rig.parameters["m_1"], **bounds)}
    (a,) = assumptions(fitted(replace(rig, parameters=parameters)), {})
    assert a.range == pytest.approx(expected)


@pytest.mark.parametrize(("factor", "told"), [(1.09, False), (1.11, True)])
def test_a_run_extrapolates_from_a_tenth_more_on(factor: float, told: bool) -> None:
    rig = cart()
    most = reached(rig, [driven()])
    assert most["command.F"] == 1.0
    said = beyond(rig, driven(u=factor * command()[:, None]), most)
    assert (
        said
        == (
            f"Run 'run' extrapolates: the command of F reaches {factor:g} V, {factor:g} times the 1 V that was fitted.",
        )
        * told
    )
    bare = replace(rig, parameters={n: p for n, p in rig.parameters.items() if n != "actuator.gain"})
    (twice,) = beyond(bare, driven(u=-2 * command()[:, None]), most)
    assert "the command of F reaches 2, 2 times the 1 that was fitted" in twice
    (none,) = beyond(rig, driven(), {**most, "command.F": 0.0})
    assert none.endswith("the command of F reaches 1 V, none was fitted.")
    further = beyond(rig, driven(y=3 * driven().y), most)
    assert [s.partition(": ")[2].partition(" reaches")[0] for s in further] == ["the speed x_1_dot", "x_1"]
    assert "m/s, 3 times" in further[0]
    assert " m, 3 times" in further[1]
