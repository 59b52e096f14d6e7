"""Firm, weak or unseen: what a number is called follows from its interval, and from what the model explains."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification.inference.covariance import Optimum, assess
from upright.identification.inference.intervals import (
    beyond_bounds,
    run_estimates,
    shared_estimates,
    with_model_uncertainty,
)
from upright.identification.inference.loop import Standing
from upright.identification.inference.verdict import judge, trusted
from upright.identification.inference.verdict.evidence import Evidence
from upright.identification.model.fit import Estimate, Judgement, RunScore
from upright.identification.model.grey_box import Parameter
from upright.identification.model.runs import Run
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import SearchLog, descend_progressively
from upright.physics import CartPendulum, Pendulum


@pytest.fixture(scope="module")
def best() -> Optimum:
    """A swing whose inertia and viscous friction are asked."""
    problem = formulate(rig(Pendulum, PENDULUM, {"J_p": 2e-3, "b_2": 2e-3}), [noisy(swing(seconds=4.0), 1e-3, seed=1)])
    return assess(problem, descend_progressively(problem, problem.start).x)


def everything(best: Optimum) -> dict[str, Estimate]:
    return shared_estimates(best, (), SearchLog(), profiles=False) | run_estimates(best)[0]["swing"]


def with_sigma(best: Optimum, sigma: float) -> Optimum:
    """The same with one standard error for every coordinate."""
    return replace(best, covariance=sigma**2 * np.eye(best.x.size))


def test_a_well_seen_number_is_firm(best: Optimum) -> None:
    assert {e.status for e in everything(best).values()} == {"well determined"}


@pytest.mark.parametrize("sigma", [0.0, 1e-16])
def test_an_interval_without_width_says_nothing(best: Optimum, sigma: float) -> None:
    """No measurement is exact: 1.6454 +- 1e-18 comes from a motion that hangs on it beyond all bounds."""
    for name, e in everything(with_sigma(best, sigma)).items():
        assert (e.status, e.stderr, e.interval) == ("unseen", math.inf, (-math.inf, math.inf)), name


def test_an_interval_of_a_few_parts_in_a_billion_is_one(best: Optimum) -> None:
    assert {e.status for n, e in everything(with_sigma(best, 1e-9)).items()} == {"well determined"}


def test_no_number_is_firm_where_the_runs_are_missed_by_more_than_they_vary(best: Optimum) -> None:
    """A mean squared residual of 1, in units of the signal's spread, is what its mean alone misses."""
    assert {e.status for e in everything(replace(best, variance=0.99)).values()} == {"well determined"}
    assert {e.status for e in everything(replace(best, variance=1.01)).values()} == {"poorly determined"}


@pytest.mark.parametrize(("half", "status"), [(0.49, "well determined"), (0.51, "poorly determined")])
def test_a_first_angle_is_weak_when_its_interval_is_wider_than_what_would_matter(
    best: Optimum, half: float, status: str
) -> None:
    """Its interval reaches as far to either side, so it is one size wide at half of one."""
    (u,) = [u for u in best.problem.unknowns if u.name == "initial.theta"]
    e = run_estimates(with_sigma(best, half * u.scale / best.quantile))[0]["swing"]["initial.theta"]
    assert e.interval[1] - e.interval[0] == pytest.approx(2 * half * u.scale)
    assert e.status == status


@pytest.mark.parametrize(("half", "status"), [(0.49, "well determined"), (0.51, "poorly determined")])
def test_an_inertia_is_weak_when_its_interval_is_wider_than_itself(best: Optimum, half: float, status: str) -> None:
    """J_p is sought as it is, so its interval is twice as wide as it reaches to one side."""
    size = float(best.values[0])
    e = shared_estimates(with_sigma(best, half * size / best.quantile), (), SearchLog(), profiles=False)["J_p"]
    assert (e.value, e.status) == (size, status)


@pytest.mark.parametrize("size", [0.03, 1.0, 20.0])
@pytest.mark.parametrize(("share", "status"), [(0.98, "well determined"), (1.02, "poorly determined")])
def test_a_factor_of_a_run_is_weak_when_its_interval_is_wider_than_itself(
    best: Optimum, size: float, share: float, status: str
) -> None:
    """It is sought by its logarithm: size (e^h - e^-h) = 2 size sinh h is as wide as the factor at h = asinh(1/2)."""
    (i,) = [i for i, u in enumerate(best.problem.unknowns) if u.name == "initial.theta"]
    factors = [
        replace(u, name="gain", log=True, value=1.0, lower=0.0, upper=math.inf, scale=1.0, prior=None) if k == i else u
        for k, u in enumerate(best.problem.unknowns)
    ]
    x = best.x.copy()
    x[i] = math.log(size)
    factored = replace(best, problem=replace(best.problem, unknowns=factors), x=x, pinned=best.pinned & False)
    half = math.asinh(share / 2)
    e = run_estimates(with_sigma(factored, half / best.quantile))[0]["swing"]["gain"]
    assert e.value == pytest.approx(size)
    assert e.interval == pytest.approx((size * math.exp(-half), size * math.exp(half)))
    assert e.status == status


@pytest.mark.parametrize(
    ("half", "upper", "profiled", "status"),
    [
        (0.6, math.inf, 0.9, "well determined"),  # too wide by its standard error alone
        (0.6, math.inf, 1.1, "poorly determined"),
        (0.1, 1.05, 1.1, "poorly determined"),  # it reaches past its bound, so the standard error tells little
        (0.1, 1.05, 0.3, "well determined"),
        (0.1, math.inf, None, "well determined"),  # far from all bounds: not followed
    ],
)
def test_a_profile_that_was_followed_says_whether_a_number_is_weak(
    best: Optimum, monkeypatch: pytest.MonkeyPatch, half: float, upper: float, profiled: float | None, status: str
) -> None:
    """`half` and `upper` of the number, `profiled` the width of the profile's interval of it."""
    size, followed = float(best.values[0]), []

    def profile(_best: Optimum, place: int, plain: Estimate, *_: object) -> tuple[float, float]:
        followed.append(place)
        return plain.value * (1 - (profiled or 9.0) / 2), plain.value * (1 + (profiled or 9.0) / 2)

    monkeypatch.setattr("upright.identification.inference.intervals.profile", profile)
    inertia, *others = best.problem.unknowns
    bounded = [replace(inertia, lower=0.0, upper=upper * size), *others]
    asked = replace(best, problem=replace(best.problem, unknowns=bounded))
    covariance = 1e-20 * np.eye(best.x.size)
    covariance[0, 0] = (half * size / best.quantile) ** 2
    e = shared_estimates(replace(asked, covariance=covariance), (), SearchLog())["J_p"]
    assert (e.status, 0 in followed) == (status, profiled is not None)
    reach = half if profiled is None else profiled / 2
    assert e.interval == pytest.approx((size * (1 - reach), size * min(upper, 1 + reach)))


@pytest.mark.parametrize(
    ("at", "interval", "widened"),
    [(2.5e-3, (2.2e-3, 2.5e-3), (1.9e-3, 2.15e-3)), (1.5e-3, (1.5e-3, 1.8e-3), (1.85e-3, 2.1e-3))],
)
def test_a_number_at_its_bound_may_lie_at_the_far_end_of_its_interval_and_others_follow(
    best: Optimum, at: float, interval: tuple[float, float], widened: tuple[float, float]
) -> None:
    """Coupled by 0.5 they go half as far the other way: J_p 0.3e-3 back from its bound, b_2 = 2e-3 0.15e-3 past it."""
    inertia, *others = best.problem.unknowns
    bounded = [replace(inertia, lower=1.5e-3, upper=2.5e-3), *others]
    coupled = np.eye(best.x.size)
    coupled[0, 1] = coupled[1, 0] = 0.5
    x = best.x.copy()
    x[:2] = at, 2e-3
    held = replace(
        best, problem=replace(best.problem, unknowns=bounded), x=x, matrix=coupled, pinned=np.arange(x.size) == 0
    )
    estimates = {
        "J_p": Estimate(value=at, stderr=1e-4, interval=interval, status="at bound"),
        "b_2": Estimate(value=2e-3, stderr=5e-5, interval=(1.9e-3, 2.1e-3)),
    }
    assert beyond_bounds(held, estimates)["b_2"] == pytest.approx(widened)
    asked, log = best.problem.rig, SearchLog()
    for status, told in (
        ("well determined", widened),
        ("poorly determined", widened),
        ("known", (1.9e-3, 2.1e-3)),
        ("unseen", (1.9e-3, 2.1e-3)),
    ):
        other = estimates | {"b_2": replace(estimates["b_2"], status=status)}
        e = with_model_uncertainty(other, held, asked, (), log)["b_2"]
        assert (e.interval, e.status) == (pytest.approx(told), status)


@pytest.mark.parametrize("stated", [True, False])
def test_what_differs_from_run_to_run_has_the_unit_of_its_kind(stated: bool) -> None:
    """States and offsets in that of their coordinate, moments in seconds, factors in none, an offset of a command in
    that of the drive's own offset where that is stated."""
    t = np.arange(200) * 0.01
    y = 0.1 * np.column_stack([np.sin(3 * t), np.cos(5 * t)])
    run = Run(
        label="run", role="fit", t=t, y=y, u=np.ones((200, 1)), measured=("x", "theta"),
        unknown=("initial", "offset.x", "offset.theta", "scale.x", "gain", "friction", "input_offset", "input_start"),
    )  # fmt: skip
    crane = {"m_c": 0.4, "m_p": 0.3, "l_cg": 0.3, "J_p": 5e-3, "b_2": 5e-3}
    asked = rig(CartPendulum, crane, {"m_c": 0.4})
    if stated:
        offset = Parameter(name="actuator.offset", value=0.0, unit="V")
        asked = replace(asked, parameters={**asked.parameters, "actuator.offset": offset})
    problem = formulate(asked, [run])
    units = {n: e.unit for n, e in run_estimates(assess(problem, problem.start))[0]["run"].items()}
    assert units == {
        "initial.x": "m", "initial.x_dot": "m/s", "initial.theta": "rad", "initial.theta_dot": "rad/s",
        "offset.x": "m", "offset.theta": "rad", "scale.x": "1", "gain": "1", "friction": "1",
        "input_offset": "V" if stated else "1", "input_start": "s",
    }  # fmt: skip


def judged(estimates: dict[str, Estimate], *, nothing: bool = False, **evidence: Any) -> tuple[Judgement, ...]:
    score = RunScore(
        role="fit", fit_percent={"theta": -1000.0 if nothing else 99.0}, horizon=None, t=np.zeros(1),
        y=np.zeros((1, 1)), simulated=np.zeros((1, 1)), measured=("theta",),
    )  # fmt: skip
    none: dict[str, Any] = {"converged": True, "interrupted": False, "memory": 0.0, "period": 1.0, "standing": None}
    return judge(
        Evidence(
            rig=rig(Pendulum, PENDULUM, {}), runs={"swing": score}, estimates=estimates, unseen=(), conventions=(),
            assumptions=(), nothing=nothing, **{**none, **evidence},
        )
    )  # fmt: skip


def test_the_verdict_says_why_a_number_without_width_cannot_be_used() -> None:
    firm = Estimate(value=2e-3, stderr=1e-5, interval=(1.9e-3, 2.1e-3), unit="kg m^2")
    none = Estimate(value=1.6454, stderr=math.inf, interval=(-math.inf, math.inf), unit="1/s", status="unseen")
    told = judged({"J_p": firm, "omega": none})
    assert told[1].answer == "no"
    assert told[1].reasons[0].startswith("omega has no interval")
    assert not trusted(told)


def test_the_verdict_says_that_a_fit_that_explains_nothing_determines_nothing() -> None:
    narrow = Estimate(value=2e-3, stderr=1e-5, interval=(1.9e-3, 2.1e-3), unit="kg m^2", status="poorly determined")
    told = judged({"J_p": narrow}, nothing=True)
    assert (told[0].answer, told[1].answer) == ("no", "no")
    assert told[1].reasons == (
        "The model misses the fitted runs by more than these vary, so none of its numbers is determined, however "
        "narrow its interval.",
    )


@pytest.mark.parametrize(
    ("interval", "share", "answer"),
    [
        ((9.1, 10.9), 1.0, "yes"),  # 9 % of the growth rate to either side, and all rigs held
        ((8.9, 11.1), 1.0, "in part"),  # 11 %
        ((7.1, 12.9), 1.0, "in part"),  # 29 %
        ((6.9, 13.1), 1.0, "no"),  # 31 %
        ((9.1, 10.9), 0.98, "in part"),
        ((9.1, 10.9), 0.91, "in part"),
        ((9.1, 10.9), 0.89, "no"),
    ],
)
def test_a_loop_can_be_designed_where_the_growth_is_known_to_a_tenth_and_rigs_within_are_held(
    interval: tuple[float, float], share: float, answer: str
) -> None:
    growth = Estimate(value=10.0, stderr=0.5, interval=interval, unit="1/s")
    told = judged({}, standing=Standing(at="inverted", growth=growth, share=share))[2]
    assert told.answer == answer
    assert bool(told.advice) == (answer != "yes")
    assert f"stabilises {100 * share:.0f} % of the rigs" in told.headline
    # of a search that had not settled no loop follows; of one that was interrupted nothing was looked at
    for state, doubt in (({"converged": False}, "no"), ({"interrupted": True}, "not tested")):
        doubtful = judged({}, standing=Standing(at="inverted", growth=growth, share=share), **state)[2]
        assert doubtful.answer == doubt


def test_residuals_that_resemble_themselves_for_a_twentieth_of_a_period_are_told() -> None:
    for memory, told in ((0.11, True), (0.09, False)):
        reasons = judged({}, memory=memory, period=2.0)[0].reasons
        assert any(f"autocorrelated over about {memory} s" in r for r in reasons) == told
