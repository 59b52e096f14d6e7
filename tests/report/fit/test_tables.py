"""Does each cell of a fit's tables hold what its heading says, and does its chapter say no more than the fit?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.identification import Estimate, Parameter, RunScore
from upright.identification.ladder.cross_validation import CrossValidation
from upright.identification.model.fit import Assumption, Judgement, Offer, Pole
from upright.report.fit.advice import fit_steps
from upright.report.fit.chapter import chapter, headline, motion_part
from upright.report.fit.pictures import score_pictures
from upright.report.fit.tables import (
    cross_table,
    finding,
    interval,
    parameter_table,
    plain_estimate,
    pole_table,
    ratio_table,
    run_table,
    score_table,
    within,
)
from upright.report.symbols import plain

MASS = Estimate(value=0.25, stderr=0.01, interval=(0.23, 0.27), unit="kg m^2")


def cells(table, row=0):
    return dict(zip(table.headings, table.rows[row], strict=True))


@pytest.fixture
def two(changed, fit):
    """A fit of J_d, with m_p known to within something, r exactly, g assumed and the drive's numbers."""
    parameters = {
        "J_d": Parameter(name="J_d", value=0.2, unit="kg m^2", meaning="inertia", estimate=True, uncertainty=0.1),
        "m_p": Parameter(name="m_p", value=0.1, unit="kg", meaning="mass", uncertainty=1.5e-3),
        "r": Parameter(name="r", value=0.16, unit="m"),
        "g": Parameter(name="g", value=9.81, unit="m/s^2", meaning="gravity", assumed=True),
        "b_1q": Parameter(name="b_1q", value=0.0, unit="1"),
        "tilt_x": Parameter(name="tilt_x", value=0.0, unit="1", assumed=True),
        "actuator.gain": Parameter(name="actuator.gain", value=1.0, unit="N m/V"),
        "actuator.lag": Parameter(name="actuator.lag", value=0.0, unit="s"),
        "actuator.delay": Parameter(name="actuator.delay", value=0.5, unit="s"),
    }
    known = replace(MASS, status="known")
    return changed(model=replace(fit.model, parameters=parameters), estimates={"J_d": MASS, "r": known})


def test_parameters_stand_with_error_interval_unit_and_how_they_are_known(two):
    table = parameter_table(two)
    assert table.headings == ("symbol", "value", "std. error", "95 % interval", "unit", "status", "name and meaning")
    assert table.rows[0] == (
        "J_d", "0.250", "0.010", "0.230 to 0.270", "kg m²", "well determined (±8 %)",
        "J_d, inertia, known beforehand",
    )  # fmt: skip
    assert table.rows[1:] == (
        ("m_p", "0.1000", "1.5·10⁻³", "", "kg", "given", "m_p, mass"), ("r", "0.1600", "exact", "", "m", "given", "r"),
        ("g", "9.810", "–", "", "m/s²", "assumed", "g, gravity"), ("tilt_x", "0", "–", "", "", "assumed", "tilt_x"),
        ("actuator.delay", "0.5000", "exact", "", "s", "given", "actuator.delay"),
    )  # fmt: skip
    assert [table.headings[i] for i in table.numbers] == ["value", "std. error", "95 % interval"]
    assert table.headings[table.badge] == "status"


def test_the_drive_s_gain_is_listed_where_it_is_not_the_usual_one(two):
    """One N m per unit of command is what a drive has of which nothing is said."""
    assert "actuator.gain" not in [row[0] for row in parameter_table(two).rows]
    given = two.model.parameters | {"actuator.gain": Parameter(name="actuator.gain", value=2.0, unit="N m/V")}
    table = parameter_table(replace(two, model=replace(two.model, parameters=given)))
    assert "actuator.gain" in [row[0] for row in table.rows]


def test_a_twin_s_truth_stands_beside_its_estimate(two):
    table = parameter_table(two, truth={"J_d": 0.27, "m_p": 0.11}, beside=("paper", {"J_d": "0.24", "g": "9.8"}))
    assert table.headings == (
        "symbol", "truth", "value", "std. error", "95 % interval", "truth is", "paper", "unit", "status",
        "name and meaning",
    )  # fmt: skip
    first, second, third, fourth = (cells(table, i) for i in range(4))
    assert (first["truth"], first["truth is"], first["paper"], first["value"]) == ("0.270", "inside", "0.24", "0.250")
    assert (second["truth"], second["truth is"], second["paper"]) == ("0.1100", "", "")
    assert (third["truth"], fourth["paper"]) == ("", "9.8")
    assert [table.headings[i] for i in table.numbers] == ["truth", "value", "std. error", "95 % interval", "paper"]
    assert table.headings[table.badge] == "status"
    assert cells(parameter_table(two, truth={"J_d": 0.2701}))["truth is"] == "outside"


@pytest.mark.parametrize(("true", "inside"), [(0.23, True), (0.27, True), (0.2299, False), (0.2701, False)])
def test_an_interval_holds_its_ends(true, inside):
    assert within(MASS, true) == inside
    assert plain_estimate(MASS, true) == {
        "value": 0.25, "stderr": 0.01, "interval": (0.23, 0.27), "truth": true, "inside": inside,
    }  # fmt: skip
    assert "truth" not in plain_estimate(MASS)


def test_an_estimate_on_the_cover_has_the_figures_that_its_error_leaves():
    told = finding("inertia", MASS, 0.26)
    assert (told.what, told.value, told.interval, told.truth) == ("inertia", "0.250", "0.230 to 0.270", "0.260")
    assert finding("inertia", MASS).truth == ""
    assert interval(replace(MASS, stderr=0.0)) == "0.2300 to 0.2700"


def test_what_rests_on_assumed_numbers_stands_without_them(two):
    ratios = {"J_d/gain": MASS, "b_1/gain": replace(MASS, rests_on=("J_a",), status="rests on J_a")}
    assumed = Assumption(
        name="actuator.gain",
        value=1.0,
        unit="N m/V",
        follows={"J_d": 1.0},
        without={},
        ratios=ratios,
        range=(0.1, 10.0),
    )
    table = ratio_table(replace(two, assumptions=(assumed,)))
    assert table.rows == (
        (plain("J_d/gain"), "0.250", "0.010", "0.230 to 0.270", "kg m²", "well determined (±8 %)"),
        (plain("b_1/gain"), "0.250", "0.010", "0.230 to 0.270", "kg m²", "rests on J_a"),
    )
    of_the_rig = parameter_table(replace(two, assumptions=(assumed,)))
    assert [row[3] for row in of_the_rig.rows if row[0] == "actuator.gain"] == []  # as it is by default
    assert [table.headings[i] for i in table.numbers] == ["value", "std. error", "95 % interval"]
    assert table.headings[table.badge] == "status"


def test_numbers_of_groups_and_runs_stand_under_their_headings(changed):
    table = run_table(
        changed(groups={"day": {"friction": MASS}}, per_run={"a": {"theta": replace(MASS, status="poorly determined")}})
    )
    assert cells(table) == {
        "run": "group day", "symbol": "friction", "value": "0.250", "std. error": "0.010",
        "95 % interval": "0.230 to 0.270", "unit": "kg m²", "status": "well determined (±8 %)",
    }  # fmt: skip
    assert table.rows[1][0] == "a"
    assert [table.headings[i] for i in table.numbers] == ["value", "std. error", "95 % interval"]
    assert table.headings[table.badge] == "status"
    assert table.folded.endswith("(2)")


def score(role="fit", theta=90.0, **more):
    t = np.linspace(1.0, 3.0, 5)
    zero = np.zeros((5, 2))
    return RunScore(
        role=role, fit_percent={"theta": theta, "psi": theta - 10}, horizon=None, t=t, y=zero, simulated=zero,
        measured=("theta", "psi"),
    ) if not more else replace(score(role, theta), **more)  # fmt: skip


def test_scores_stand_signal_by_signal_fitted_runs_first():
    table = score_table({"tail": score("predict", 70.0), "whole": score()})
    assert table.headings == ("run", "role", "signal", "fit", "simulated")
    assert table.rows == (
        ("whole", "fitted", "θ", "90.0 %", "from the first sample"),
        ("whole", "fitted", "ψ", "80.0 %", "from the first sample"),
        ("tail", "predicted", "θ", "70.0 %", "from the first sample"),
        ("tail", "predicted", "ψ", "60.0 %", "from the first sample"),
    )
    assert table.numbers == (3,)


def test_what_a_score_is_compared_with_has_a_column_where_it_is_known():
    compared = score(horizon=0.5, naive={"theta": 40.0}, black_box={"psi": 50.0}, band={"theta": np.full(5, 0.1)})
    table = score_table({"a": compared, "b": score()})
    assert table.headings == (
        "run", "role", "signal", "fit, free run", "fit, ahead", "held speed", "black box", "in 90 % band", "simulated",
    )  # fmt: skip
    assert [cells(table, i)["fit, free run"] for i in range(4)] == ["", "", "90.0 %", "80.0 %"]
    assert [cells(table, i)["fit, ahead"] for i in range(4)] == ["90.0 %", "80.0 %", "", ""]
    assert [cells(table, i)["held speed"] for i in range(4)] == ["40.0 %", "", "", ""]
    assert [cells(table, i)["black box"] for i in range(4)] == ["", "50.0 %", "", ""]
    assert [cells(table, i)["in 90 % band"] for i in range(4)] == ["100.00 %", "", "", ""]
    assert cells(table)["simulated"] == "restarted every 0.5 s"
    assert table.numbers == (3, 4, 5, 6, 7)


def test_what_the_start_state_allows_stands_beside_every_horizon():
    ahead = {0.1: {"theta": 90.0}, 0.5: {"theta": 60.0}}
    table = score_table({"a": score(horizon=0.1, ahead=ahead, ceiling={0.1: {"theta": 95.0}, 0.5: {"theta": 70.0}})})
    assert [(r[2], r[3], r[4]) for r in table.rows if r[2] == "θ"] == [
        ("θ", "90.0 %", "95.0 %"),
        ("θ", "60.0 %", "70.0 %"),
    ]


def test_further_horizons_have_rows_of_their_own_that_nothing_is_compared_with():
    ahead = {0.2: {"theta": 90.0, "psi": 80.0}, 1.0: {"theta": 60.0, "psi": 50.0}}
    table = score_table({"a": score(horizon=0.2, ahead=ahead, naive={"theta": 40.0}, score_from=0.5)})
    assert [(r[2], r[3], r[4], r[5]) for r in table.rows] == [
        ("θ", "90.0 %", "40.0 %", "0.2 s ahead; scored from 0.5 s on"),
        ("ψ", "80.0 %", "", "0.2 s ahead; scored from 0.5 s on"),
        ("θ", "60.0 %", "", "1 s ahead"), ("ψ", "50.0 %", "", "1 s ahead"),
    ]  # fmt: skip


def test_every_run_stands_fitted_and_predicted_by_the_others():
    crossed = CrossValidation(
        fitted={"a": score(), "b": score(theta=95.0)}, predicted={"a": score("predict", 75.0)}, values={},
        blind={"a": ("b_1", "b_2")},
    )  # fmt: skip
    table = cross_table(crossed)
    assert table.rows == (
        ("a", "θ", "90.0 %", "75.0 %", "b_1, b_2"), ("a", "ψ", "80.0 %", "65.0 %", "b_1, b_2"),
        ("b", "θ", "95.0 %", "", ""), ("b", "ψ", "85.0 %", "", ""),
    )  # fmt: skip
    assert [table.headings[i] for i in table.numbers] == ["fitted", "predicted"]


def test_poles_of_a_pair_stand_with_both_parts(changed):
    turn = 2 * math.pi
    real = Estimate.within(-0.5, 0.01, 0.02)
    pair = Pole(real=real, imag=Estimate.within(4.0 * turn, 0.01 * turn, 0.02 * turn))
    single = Pole(real=Estimate.within(3.0, 0.1, 0.2), imag=Estimate.within(0.0, 0.0, 0.0))
    table = pole_table(changed(poles={"hanging": (pair,), "inverted": (single,)}))
    assert table.rows == (
        ("hanging", "−0.500 ± 25.133 i", "−0.520 to −0.480; ± (25.007 to 25.258) i", "4.000 Hz (3.980 to 4.020)"),
        ("inverted", "3.00", "2.80 to 3.20", ""),
    )
    assert table.headings[table.numbers[0]] == "pole"


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ({"interrupted": True, "failed": True}, "search was interrupted"), ({"failed": True}, "The fit failed"),
        ({"trusted": False}, "Do not rely on this model yet."),
        ({}, "Rely on this model for prediction and for a loop."),
        ({"answers": (Judgement(question="Q", answer="in part", headline="H"),)}, "loop, with the reservations below."),
        ({"answers": (Judgement(question="Q", answer="not tested", headline="H"),)}, "no run was held out."),
        ({"answers": (Judgement(question="Q", answer="yes", headline="H"),
                      Judgement(question="Q", answer="not tested", headline="H"))}, "for prediction; its drive"),
    ],
)  # fmt: skip
def test_the_headline_says_the_worst_first(changed, what, said):
    assert said in headline(changed(**what))


def test_the_question_counts_fitted_and_predicted_runs(changed):
    said = chapter(changed(runs={"a": score(), "b": score(), "c": score("predict")})).question
    assert said.startswith("Which values of J_d, J_p, b_1, b_2, b_1c, b_2c let the equations of motion of 'Furuta'")
    assert said.endswith("follow 2 runs, and does the model then predict 1 more that it has not seen?")
    assert chapter(changed(runs={"a": score()})).question.endswith("follow 1 run?")


def part(fit, key, **more):
    return next((p for p in chapter(fit, **more).parts if p.key == key), None)


def test_the_chapter_stands_on_what_the_fit_has(fit, changed):
    told = chapter(fit, provenance={"a": {"b": 1, "c": None, "d": ""}, "runs": ["x", "y"]})
    assert part(fit, "data").content == ("No origin was stated for these data.",)
    assert told.parts[-1].content[0].pairs == (("a / b", "1"), ("runs", "x; y"))
    assert part(fit, "how").content[0].sentences == (
        "simplex, then Levenberg-Marquardt; 321 evaluations in 1.23 s; final cost 0.456.",
    )
    assert part(fit, "stages").content[0].rows == (
        ("start", "12", "1"), ("simplex", "0.9", "200"), ("least squares", "0.456", "120"),
    )  # fmt: skip
    assert part(changed(history=()), "stages") is None
    assert (part(fit, "verdict"), part(fit, "assumed"), part(fit, "poles")) == (None, None, None)
    judged = Judgement(question="Q?", answer="in part", headline="H.", advice="Do.", reasons=("Because.", "And."))
    table = part(changed(answers=(judged,)), "verdict").content[0]
    assert table.rows == (("Q?", "in part", "Do.", "Because. And."),)
    assert table.headings[table.badge] == "answer"
    assert chapter(changed(answers=(judged,))).detail == "H."
    assert chapter(fit).detail == fit.verdict


def pictures(fit):
    return {b.name: b for b in part(fit, "unseen").content if hasattr(b, "draw")}


def test_pictures_of_what_is_unseen_are_those_that_the_fit_can_fill(fit, changed):
    assert set(pictures(fit)) == {"fit-intervals", "fit-correlation", "fit-directions"}
    strongest = "The strongest correlation is -0.940, between b_1 and b_1c."
    assert pictures(fit)["fit-correlation"].description == strongest
    one = {"names": ("J_d",), "correlation": np.eye(1), "singular_values": np.ones(1), "directions": np.eye(1)}
    assert set(pictures(changed(**one))) == {"fit-intervals", "fit-directions"}
    many = tuple(f"p{i}" for i in range(25))
    wide = {"names": many, "correlation": np.eye(25), "singular_values": np.ones(25), "directions": np.eye(25)}
    assert set(pictures(changed(**wide))) == {"fit-intervals"}
    just = {"names": many[:24], "correlation": np.eye(24), "singular_values": np.ones(24), "directions": np.eye(24)}
    assert set(pictures(changed(**just))) == {"fit-intervals", "fit-correlation", "fit-directions"}
    none = {"estimates": {"a": replace(MASS, status="known"), "b": replace(MASS, value=0.0)}}
    assert "fit-intervals" not in pictures(changed(**none))
    assert pictures(changed(unseen=()))["fit-directions"].description == "No combination of the parameters is unseen."


def test_a_picture_of_a_run_says_how_it_was_followed(fit):
    plant = fit.model.plant
    runs = {
        "tail": score("predict", horizon=0.5, score_from=0.25, band={"theta": np.full(5, 0.1)}),
        "ahead": score("predict", horizon=0.5, ahead={0.5: {"theta": 1.0}}), "whole": score(),
    }  # fmt: skip
    first, second, third = score_pictures(runs, plant, "p")
    assert [p.name for p in (first, second, third)] == ["p-run0", "p-run1", "p-run2"]
    assert first.caption.startswith("Run 'whole', fitted. Wide light line")
    assert first.description == "Measured and modelled signals over 2 s; fit θ 90.0 %, ψ 80.0 %."
    assert second.caption.startswith(
        "Run 'tail', predicted, not fitted, restarted from the measured state every 0.5 s, scored from 0.25 s on. "
    )
    assert second.caption.endswith("inside are θ 100.00 %.")
    assert "predicted, not fitted, every sample predicted 0.5 s ahead. " in third.caption
    assert "Grey" not in first.caption


def test_equations_leave_out_what_this_fit_has_at_zero_and_keep_what_it_estimates(fit):
    """k_psi is nobody's here and may be zero; b_1 is estimated, even from a guess of zero."""
    parameters = dict(fit.model.parameters)
    parameters["b_1"] = replace(parameters["b_1"], value=0.0)
    parameters["b_2"] = Parameter(name="b_2", value=0.0, unit="N m s/rad")
    del parameters["l_cg"]  # cannot be zero, whoever says it
    markup = motion_part(replace(fit, model=replace(fit.model, parameters=parameters))).content[1].markup
    assert "<mtext>cg</mtext>" in markup
    assert "tilt" not in markup
    assert "<mtext>psi</mtext>" not in markup
    assert "<mi>k</mi>" not in markup
    assert "<msub><mi>b</mi><mtext>2</mtext></msub>" not in markup
    assert "<msub><mi>b</mi><mtext>1</mtext></msub>" in markup


def said(fit, **more):
    return [f"{s.sentence} {s.command}" for s in fit_steps(fit, **more)]


def test_a_fit_that_ran_away_has_one_thing_to_do(changed):
    (only,) = said(changed(failed=True))
    assert only.startswith("Nothing else is known before the simulated motion stays finite")


@pytest.mark.parametrize(
    ("runs", "more", "told"),
    [
        ({"a": score()}, {}, "keep one run or one tail back"),
        ({"a": score(), "b": score()}, {}, "upright identify S.toml -o F --hold-out each"),
        ({"a": score(), "b": score("predict")}, {}, ""), ({"a": score(), "b": score()}, {"crossed": True}, ""),
    ],
)  # fmt: skip
def test_a_model_that_nothing_tests_is_to_be_tested(changed, runs, more, told):
    steps = [s for s in said(changed(runs=runs), study="S.toml", folder="F", **more) if "nothing tests the model" in s]
    assert len(steps) == bool(told)
    assert not told or told in steps[0]
    assert not any("nothing tests" in s for s in said(changed(runs=runs, interrupted=True)))


@pytest.mark.parametrize(("value", "worse"), [(-0.1, True), (0.0, False)])
def test_a_signal_is_worse_than_its_mean_below_zero_percent(changed, value, worse):
    steps = said(changed(runs={"a": score(fit_percent={"theta": value})}))
    assert any("θ is explained worse than by its mean ('a'" in s for s in steps) == worse


def test_a_reversed_sign_is_named_where_the_percent_is_that_of_one(changed):
    """Of y about zero, -y explains 100 (1 - |y + y| / |y|) = -100 %; what is missed by more has another cause."""
    runs = {"a": score(fit_percent={"theta": -100.0}), "b": score(fit_percent={"theta": -90.0})}
    (one,) = (s for s in said(changed(runs=runs)) if "worse than by its mean" in s)
    assert "('a' −100.0 %, 'b' −90.0 %), as by a reversed sign" in one
    (other,) = (s for s in said(changed(runs=runs | {"b": score(fit_percent={"theta": -400.0})})) if "worse than" in s)
    assert "look at the plant and at the units" in other


@pytest.mark.parametrize(("percents", "lost"), [((79.9, 99.0), True), ((80.0, 99.0), False)])
def test_a_free_run_is_lost_below_eighty_percent_of_any_signal(changed, percents, lost):
    run = score(fit_percent=dict(zip(("theta", "psi"), percents, strict=True)))
    assert any("loses the measurement" in s for s in said(changed(runs={"a": run}))) == lost
    assert not any("loses the measurement" in s for s in said(changed(runs={"a": replace(run, horizon=1.0)})))
    assert not any("loses the measurement" in s for s in said(changed(runs={"a": replace(run, role="predict")})))


def test_a_prediction_that_chose_its_own_factor_is_told_once(changed):
    chosen = score("predict", adapted=("initial", "friction"))
    runs = {"a": score(adapted=("gain",)), "b": chosen, "c": chosen}
    steps = [s for s in said(changed(runs=runs)) if "chose its own" in s]
    assert len(steps) == 1
    assert "prediction of run 'b' chose its own friction" in steps[0]
    assert 'shared = { friction = "that day" }' in steps[0]


def test_a_factor_that_would_mend_a_prediction_is_offered(changed):
    factor = Estimate(value=1.5, stderr=0.1, interval=(1.3, 1.7))
    offer = Offer(name="gain", factor=factor, fit_percent={"theta": 91.0, "psi": 92.0})
    steps = said(changed(runs={"a": score("predict", 50.0, adapted=("initial",), offer=offer)}))
    (told,) = [s for s in steps if "would be" in s]
    assert "predicted at 40.0 % (psi)" in told
    assert 'label = "a"\nunknown = ["initial", "gain"]' in told


def test_weak_numbers_are_named_where_nothing_else_is_unseen(changed):
    weak = {"J_d": replace(MASS, status="poorly determined"), "J_p": replace(MASS, status="unseen"), "b_1": MASS}
    (told,) = [s for s in said(changed(estimates=weak, unseen=())) if "hardly see" in s]
    assert "The data hardly see J_d, J_p: measure" in told
    assert "J_d = { value" in told
    assert not any("hardly see" in s for s in said(changed(estimates=weak)))


@pytest.mark.parametrize(("n", "role", "asks"), [(20, "fit", True), (19, "fit", False), (20, "predict", False)])
def test_residuals_with_a_memory_are_looked_at_in_fitted_runs_of_twenty_samples(changed, n, role, asks):
    """A residual that stays positive for ten samples and negative for ten: at lag 1 its correlation is 0.85."""
    off = np.where(np.arange(n) < n // 2, 1.0, -1.0)
    t = np.arange(n) * 0.1
    run = RunScore(role=role, fit_percent={"theta": 90.0}, horizon=None, t=t, y=off[:, None],
                   simulated=np.zeros((n, 1)), measured=("theta",))  # fmt: skip
    steps = [s for s in said(changed(runs={"a": run})) if "not noise" in s]
    assert len(steps) == asks
    assert not asks or "not noise (θ of 'a')" in steps[0]


def test_three_residuals_with_a_memory_are_named_and_a_fourth_is_among_others(changed):
    runs = {}
    for label, others in (("a", ""), ("b", ""), ("c", ""), ("d", " and others")):
        off = np.where(np.arange(20) < 10, 1.0, -1.0)
        runs[label] = RunScore(role="fit", fit_percent={"theta": 90.0}, horizon=None, t=np.arange(20) * 0.1,
                               y=off[:, None], simulated=np.zeros((20, 1)), measured=("theta",))  # fmt: skip
        named = ", ".join(f"θ of '{n}'" for n in list(runs)[:3])
        (step,) = [s for s in said(changed(runs=runs)) if "not noise" in s]
        assert f"not noise ({named}{others})." in step
