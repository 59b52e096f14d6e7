"""Reversed signs, zeros that stand upright, frictions that are not there: the verdict says so."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, shaken, swing
from upright.identification.estimate import identify, predict
from upright.identification.inference.covariance import Optimum, assess
from upright.identification.inference.loop import standing
from upright.identification.inference.verdict import judge, trusted
from upright.identification.inference.verdict.evidence import Evidence
from upright.identification.model.fit import Assumption, Estimate, Judgement, RunScore
from upright.identification.model.grey_box import GreyBox, Parameter
from upright.identification.model.runs import Run
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import descend_progressively
from upright.physics import Furuta, Pendulum
from upright.simulation import simulate


def test_a_reversed_sensor_is_named() -> None:
    run = noisy(shaken(seconds=3.0), 1e-4, seed=1)
    reversed_ = replace(run, y=run.y * [1.0, -1.0])
    fit = identify(rig(Furuta, FURUTA, {"J_d": 0.01, "b_1": 4e-3}), [reversed_])
    assert not fit.trusted
    assert "sign = -1 for theta" in fit.verdict or "sign = -1 for psi" in fit.verdict


def test_a_zero_that_stands_upright_is_named() -> None:
    run = noisy(swing(seconds=6.0), 1e-3, seed=2)
    upright = replace(run, y=run.y + math.pi)
    fit = identify(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3}), [upright])
    assert not fit.trusted
    assert "offset of pi to theta" in fit.verdict


def test_a_friction_that_is_not_there_is_left_out_or_zero() -> None:
    viscous = {**PENDULUM, "b_2": 4e-3, "b_2c": 0.0, "b_2q": 0.0}
    run = noisy(swing(viscous), 2e-3, seed=3)
    fit = identify(rig(Pendulum, viscous, {"b_2": 1e-3, "b_2c": 1e-3, "b_2q": 1e-3, "J_p": 3e-3}), [run])
    assert fit.estimates["b_2"].value == pytest.approx(4e-3, rel=0.05)
    for name, unit in (("b_2c", 4e-3 * 3.0), ("b_2q", 4e-3 / 3.0)):
        e = fit.estimates[name]
        assert e.status in ("left out", "at bound", "poorly determined")
        assert e.value < 0.05 * unit


def test_coulomb_friction_that_is_there_is_kept() -> None:
    dry = {**PENDULUM, "b_2": 1e-3, "b_2c": 5e-3, "b_2q": 0.0}
    fit = identify(rig(Pendulum, dry, {"b_2": 2e-3, "b_2c": 1e-3, "J_p": 3e-3}), [noisy(swing(dry), 1e-3, seed=4)])
    assert fit.estimates["b_2c"].value == pytest.approx(5e-3, rel=0.02)
    assert fit.estimates["b_2c"].status == "well determined"


def test_a_run_that_no_parameter_explains_is_not_trusted() -> None:
    generator = np.random.default_rng(5)
    run = swing(seconds=4.0)
    noise = replace(run, y=generator.normal(size=run.y.shape))
    fit = identify(rig(Pendulum, PENDULUM, {"b_2": 1e-3, "b_2c": 1e-3}), [noise])
    assert not fit.trusted
    assert "not explained" in fit.verdict


def test_no_answer_is_nan_or_none() -> None:
    fit = identify(rig(Pendulum, PENDULUM, {"m_p": 0.3, "J_p": 3e-3, "b_2": 1e-3}, b_2c=0.0, b_2q=0.0),
                   [swing({**PENDULUM, "b_2c": 0.0, "b_2q": 0.0})])  # fmt: skip
    for e in fit.estimates.values():
        assert not any(math.isnan(v) for v in (e.value, e.stderr, *e.interval))
    assert np.all(np.isfinite(fit.correlation))
    assert np.all(np.isfinite(fit.singular_values))
    assert math.isfinite(fit.cost)


def test_a_fifth_of_a_swing_tells_no_friction_and_is_not_trusted() -> None:
    run = noisy(swing(seconds=0.3, dt=0.005), 3e-3, seed=8)
    guesses = {n: PENDULUM[n] for n in ("J_p", "b_2", "b_2c", "b_2q")}
    fit = identify(rig(Pendulum, PENDULUM, guesses), [run])
    assert min(fit.runs["swing"].fit_percent.values()) > 95
    assert not fit.trusted
    assert "No estimated number is determined well" in fit.verdict or "cannot see" in fit.verdict


def test_a_bound_that_excludes_the_truth_is_not_trusted() -> None:
    question = rig(Pendulum, PENDULUM, {"J_p": 8e-3, "b_2": 1e-3, "b_2c": 1e-3, "b_2q": 1e-3})
    bounded = {**question.parameters, "J_p": replace(question.parameters["J_p"], lower=4e-3)}  # twice the truth
    fit = identify(replace(question, parameters=bounded), [noisy(swing(), 1e-3, seed=9)])
    assert fit.estimates["J_p"].value == pytest.approx(4e-3)
    assert not fit.trusted
    assert "push J_p past a bound" in fit.verdict


def test_a_column_that_stands_still_has_no_doubtful_convention() -> None:
    run = replace(swing(), y=np.full((1001, 1), 3.1))
    fit = identify(rig(Pendulum, PENDULUM, {"b_2": 1e-3, "J_p": 3e-3}), [run])
    assert not fit.trusted
    assert "conventions" not in fit.verdict


def test_a_speed_that_is_held_scores_what_the_closed_form_says() -> None:
    """A swing A sin(wt): held from its zero crossings for h, it misses A (wt - sin wt)."""
    w, dt = 2 * math.pi, 1e-3
    t = np.arange(1001) * dt
    run = replace(swing(seconds=1.0, dt=dt), t=t, u=np.zeros((t.size, 1)), y=0.01 * np.sin(w * t)[:, None], horizon=0.5)
    ahead = np.tile(dt * np.arange(1, 501), 2)
    y = np.sin(w * np.arange(1, 1001) * dt)
    missed = np.linalg.norm(w * ahead - np.sin(w * ahead)) / np.linalg.norm(y - y.mean())
    score = predict({}, rig(Pendulum, PENDULUM, {}), [run])["swing"]
    # the restart's speed is smoothed over a polynomial of order 4
    assert score.naive["theta"] == pytest.approx(100 * (1 - missed), abs=0.02 * 100 * missed)
    free = predict({}, rig(Pendulum, PENDULUM, {}), [replace(run, horizon=None)])["swing"]
    assert free.naive == {}


def test_nothing_held_out_is_not_tested() -> None:
    question = rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3})
    runs = [noisy(swing(), 1e-3, seed=11), replace(noisy(swing(angle=1.0), 1e-3, seed=12), label="other")]
    alone = identify(question, runs)
    assert alone.answers[0].answer == "not tested"
    assert "hold" in alone.answers[0].advice.lower()
    tested = identify(question, [runs[0], replace(runs[1], role="predict")])
    assert tested.answers[0].answer == "yes"
    wrong = replace(runs[1], role="predict", y=runs[1].y * 0.5)
    assert identify(question, [runs[0], wrong]).answers[0].answer == "no"


def test_a_range_goes_from_the_least_to_the_greatest_percent() -> None:
    """Whatever the order of the runs; runs that are explained alike are given one number."""
    runs = {name: _score("fit", percent, None) for name, percent in (("a", 93.0), ("b", 98.5), ("c", 91.2))}
    assert "It explains 91.2 to 98.5 % of the fitted runs." in _judged(runs)[0].headline
    assert "It explains 93.0 % of the fitted runs." in _judged({"a": runs["a"]})[0].headline


def test_horizons_are_compared_with_their_like() -> None:
    """At 0.05 s everything is predicted; that 2 s ahead is harder is no sign of a bad model."""
    near, far = (_score(role, 100 - missed, h) for role, missed, h in (("fit", 1.0, 0.05), ("predict", 22.0, 2.0)))
    assert "much worse" not in _judged({"near": near, "far": far})[0].text()
    assert "much worse" in _judged({"near": replace(near, horizon=2.0), "far": far})[0].text()


def test_an_inertia_over_four_decades_is_no_number_to_use() -> None:
    firm = Estimate(value=2e-3, stderr=1e-5, interval=(1.9e-3, 2.1e-3), unit="N m s/rad")
    vague = Estimate(value=0.1, stderr=1.0, interval=(2.7e-4, 83.0), unit="kg m^2", status="poorly determined")
    answers = _judged({"a": _score("fit", 99.0, None)}, {"J_p": vague, "b_2": firm})
    assert answers[1].answer == "no"
    assert not trusted(answers)
    assert any("J_p lies anywhere from 0.00027 to 83 kg m^2" in r for r in answers[1].reasons)
    tested = {"a": _score("fit", 99.0, None), "b": _score("predict", 99.0, None)}
    assert _judged(tested, {"b_2": firm})[1].answer == "yes"


def test_no_answer_is_better_than_the_prediction_it_rests_on() -> None:
    """A firm number of a model that misses its runs is that model's number, not the rig's."""
    firm = Estimate(value=2e-3, stderr=1e-5, interval=(1.9e-3, 2.1e-3), unit="N m s/rad")
    answers = _judged({"a": _score("fit", 39.0, None)}, {"b_2": firm})
    assert [a.answer for a in answers[:2]] == ["no", "in part"]
    assert "does not predict" in answers[1].reasons[0]


NOTHING = (
    "these data give no evidence for it (at most {}), and the other intervals hold what so much of it would change."
)


def test_friction_at_zero_takes_nothing_from_the_other_numbers() -> None:
    """Their intervals hold what it would change, were it as large as its own allows: as of a term that was left out."""
    none = Estimate(value=0.0, stderr=0.0, interval=(0.0, 3e-4), unit="N m", status="at bound")
    firm = Estimate(value=2e-3, stderr=1e-5, interval=(1.9e-3, 2.1e-3), unit="kg m^2")
    tested = {"a": _score("fit", 99.0, None), "b": _score("predict", 99.0, None)}
    told = _judged(tested, {"b_2c": none, "J_p": firm})[1]
    assert (told.answer, told.headline) == ("yes", "All numbers can be used: J_p. It is known to 5 % or better.")
    assert told.reasons == (f"b_2c reached its lower limit, 0: {NOTHING.format('0.0003 N m')}",)
    vague = replace(firm, interval=(1e-3, 5e-3), status="poorly determined")
    assert _judged(tested, {"b_2c": none, "J_p": vague, "b_2": firm})[1].answer == "in part"


@pytest.mark.parametrize("name", ["J_p", "l_cg"])
def test_an_inertia_or_a_length_of_zero_is_no_small_matter(name: str) -> None:
    none = Estimate(value=0.0, stderr=0.0, interval=(0.0, 3e-4), unit="kg m^2", status="at bound")
    firm = Estimate(value=2e-3, stderr=1e-5, interval=(1.9e-3, 2.1e-3), unit="N m s/rad")
    tested = {"a": _score("fit", 99.0, None), "b": _score("predict", 99.0, None)}
    assert _judged(tested, {name: none, "b_2": firm})[1].answer == "in part"


def late(seed: int, **delay: float) -> tuple[Estimate, Judgement]:
    """The dead time of a Furuta pendulum's drive that has none, and what is said of its numbers."""
    dt, n = 4e-3, 1001
    t = np.arange(n) * dt
    runs: list[Run] = []
    for label, role, slow in (("one", "fit", 0.7), ("two", "predict", 0.5)):
        u = (0.04 * np.sin(2 * np.pi * slow * t) + 0.03 * np.sin(2 * np.pi * 1.9 * t))[:, None]
        x = simulate(Furuta(**FURUTA), {}, [0.0, 0.0, 0.5, 0.0], u, dt, samples=n, substeps=4)
        run = Run(label=label, role=role, t=t, u=u, y=x[:, [0, 2], 0], measured=("psi", "theta"))  # type: ignore[arg-type]
        runs.append(noisy(run, 1e-3, seed=seed))
    asked = Parameter(
        **{"name": "actuator.delay", "value": 4e-3, "unit": "s", "estimate": True, "lower": 0.0, "upper": 0.2} | delay
    )
    known = rig(Furuta, FURUTA, {"J_d": 0.006, "b_1": 6e-3, "b_1c": 2e-3})
    fit = identify(replace(known, substeps=4, parameters={**known.parameters, asked.name: asked}), runs)
    for name in ("J_d", "b_1", "b_1c"):
        assert fit.estimates[name].value == pytest.approx(FURUTA[name], rel=0.03), name
    return fit.estimates[asked.name], fit.answers[1]


@pytest.mark.parametrize("seed", [0, 1, 4, 5])
def test_a_dead_time_that_is_not_there_leaves_all_numbers_usable(seed: int) -> None:
    """Whether its estimate ends at zero or, by noise, a hundredth of a millisecond above."""
    e, told = late(seed)
    assert 0 == e.interval[0] <= e.value < e.interval[1] < 1e-3
    assert told.answer == "yes"
    assert any("actuator.delay" in r and "no evidence" in r for r in told.reasons)


def test_a_dead_time_that_its_limit_bounds_and_no_data_do_may_matter() -> None:
    e, told = late(5, value=1e-5, upper=2e-5)
    assert e.interval[1] == 2e-5
    assert told.answer == "in part"


@pytest.mark.parametrize(
    ("friction", "headline"),
    [
        (1.0, "Known all the same: J_p/gain = 0.002 (0.0019 to 0.0021) kg m^2; b_2/gain = 0.002"),
        (0.5, "Known all the same: J_p/gain = 0.002 (0.0019 to 0.0021) kg m^2."),
    ],
)
def test_numbers_that_all_scale_with_an_assumed_gain_are_known_as_ratios(friction: float, headline: str) -> None:
    """In J w' + b w = g u, J and b both double with g, so J/b is known; where b does not, J/b changes with g too."""
    firm = Estimate(value=2e-3, stderr=1e-5, interval=(1.9e-3, 2.1e-3), unit="kg m^2")
    follows = {"J_p": 1.0, "b_2": friction}
    ratios = {f"{n}/gain": firm for n, power in follows.items() if power == 1.0}
    gain = Assumption(name="actuator.gain", value=1.0, unit="N m/V", follows=follows, without={}, ratios=ratios)
    runs = {"a": _score("fit", 99.0, None)}
    usable = _judged(runs, {"J_p": firm, "b_2": firm}, assumptions=[gain])[1]
    assert usable.answer == "in part"
    assert usable.headline.startswith("No number can be used before actuator.gain is measured.")
    assert headline in usable.headline


@pytest.mark.parametrize("counts", [500.0, 2000.0])
def test_a_length_that_rests_on_counts_nobody_knows_is_not_called_known(counts: float) -> None:
    """The period of a swing of 1 rad says the length, and that of 4 counts read as 1 another one."""
    question = rig(Pendulum, PENDULUM, {"l_cg": 0.2, "b_2": 1e-3})
    inertia = replace(question.parameters["J_p"], value=0.0, assumed=True, estimate=False)
    question = replace(
        question, parameters=question.parameters | {"J_p": inertia},
        assumed_scales={"sensors.theta.counts_per_rev": counts},
    )  # fmt: skip
    run = noisy(swing(angle=1.0), 1e-3, seed=11)
    read = replace(run, y=run.y * 2000.0 / counts)
    usable = identify(question, [read]).answers[1]
    assert "Known all the same" not in usable.headline
    assert (
        "Known all the same: J_A/(m_p l_cg) ="
        in identify(replace(question, assumed_scales={}), [run]).answers[1].headline
    )


def test_a_guessed_plant_is_a_guess_until_a_prediction_confirms_it() -> None:
    question = replace(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3}), guessed=True)
    run, other = noisy(swing(), 1e-3, seed=11), replace(noisy(swing(angle=1.0), 1e-3, seed=12), label="other")
    alone = identify(question, [run, other]).answers[1]
    assert alone.answer == "in part"
    assert "guessed" in alone.headline
    assert "guessed" not in identify(question, [run, replace(other, role="predict")]).answers[1].text()
    assert "guessed" not in identify(replace(question, guessed=False), [run, other]).answers[1].text()


def test_a_length_beside_no_inertia_is_the_equivalent_length() -> None:
    known = {**PENDULUM, "J_p": 0.0, "b_2c": 0.0, "b_2q": 0.0}
    fit = identify(rig(Pendulum, known, {"l_cg": 0.4, "b_2": 1e-3}), [noisy(swing(known), 1e-3, seed=13)])
    assert any("equivalent point pendulum" in r for r in fit.answers[1].reasons)


def test_the_pole_upright_and_the_loops_that_hold() -> None:
    question = rig(Furuta, FURUTA, {"J_d": 0.9 * FURUTA["J_d"], "J_p": 1.1 * FURUTA["J_p"], "b_1": 4e-3})
    fit = identify(question, [noisy(shaken(seconds=4.0), 1e-4, seed=14)])
    assert fit.answers[2].answer == "yes"
    best = _optimum(question, noisy(shaken(seconds=4.0), 1e-4, seed=14))
    told = standing(best)
    assert told is not None
    truth = max(Furuta(**FURUTA).linear("inverted").poles().real)
    assert told.at == "inverted"
    assert told.growth.interval[0] < truth < told.growth.interval[1]
    assert told.share == 1.0
    wide = replace(best, covariance=best.covariance * (3.0 / best.sigma.max()) ** 2)  # a factor of 20 to either side
    rough = standing(wide)
    assert rough is not None
    assert rough.share < 1.0
    assert rough.growth.interval[1] - rough.growth.interval[0] > told.growth.interval[1] - told.growth.interval[0]


def test_a_drive_that_never_acted_is_not_judged() -> None:
    fit = identify(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3}), [noisy(swing(), 1e-3, seed=15)])
    assert fit.answers[2].answer == "not tested"
    assert "no fitted run was driven" in fit.answers[2].headline


def test_what_cannot_fall_asks_for_no_loop() -> None:
    assert _judged({"a": _score("fit", 99.0, None)})[2].answer == "not asked"


def test_a_loop_that_rests_on_numbers_nobody_saw_is_not_evaluated() -> None:
    """Torque and inertia of a driven rig scale together; that says nothing of whether it falls when upright."""
    evidence = Evidence(
        rig=rig(Pendulum, PENDULUM, {}), runs={"a": _score("fit", 99.0, None)}, estimates={},
        unseen=("m_p and J_p scale together.",), conventions=(), assumptions=(), converged=True, interrupted=False,
        memory=0.0, period=1.0, standing=None,
    )  # fmt: skip
    loop = judge(evidence)[2]
    assert loop.answer == "not tested"
    assert "Not evaluated" in loop.headline


def _score(role: str, percent: float, horizon: float | None) -> RunScore:
    nothing = np.zeros((0, 1))
    return RunScore(
        role=role, fit_percent={"theta": percent}, horizon=horizon, t=np.zeros(0), y=nothing, simulated=nothing,
        measured=("theta",),
    )  # fmt: skip


def _judged(
    runs: dict[str, RunScore], estimates: dict[str, Estimate] | None = None, assumptions: Sequence[Assumption] = ()
) -> tuple[Judgement, ...]:
    return judge(
        Evidence(
            rig=rig(Pendulum, PENDULUM, dict.fromkeys(estimates or {}, 1e-3)), runs=runs, estimates=estimates or {},
            unseen=(), conventions=(), assumptions=assumptions, converged=True, interrupted=False, memory=0.0,
            period=1.0, standing=None,
        )
    )  # fmt: skip


def _optimum(question: GreyBox, run: Run) -> Optimum:
    problem = formulate(question, [run])
    return assess(problem, descend_progressively(problem, problem.start).x)


@pytest.mark.parametrize(("horizon", "blank"), [(0.03, True), (1.0, False)])
def test_a_horizon_that_a_held_speed_masters_is_said_to_tell_nothing(horizon: float, blank: bool) -> None:
    run = replace(noisy(swing(), 1e-4, seed=6), horizon=horizon)
    fit = identify(rig(Pendulum, PENDULUM, {"J_p": 3e-3, "b_2": 1e-3}), [run])
    assert ("holding the measured speed" in fit.verdict) is blank
    assert not (blank and fit.trusted)
