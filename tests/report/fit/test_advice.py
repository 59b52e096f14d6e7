"""Does the report send people to the right next step?"""

from dataclasses import replace

import numpy as np
import pytest

from upright.identification import Estimate
from upright.report.fit.advice import fit_steps


def said(fit, **more):
    return " ".join(f"{s.sentence} {s.command}" for s in fit_steps(fit, **more))


def test_a_reversed_sign_is_the_first_suspicion(changed, swing):
    run = swing(n=200)
    off = replace(run, simulated=-run.simulated, fit_percent={"psi": -100.0, "theta": -99.0})
    first, *_ = fit_steps(changed(runs={"release": off}))
    assert "sign" in first.sentence
    assert first.command == "[sensors.psi]\nsign = -1"


def test_white_residuals_ask_for_no_further_friction(fit):
    assert "not noise" not in said(fit)


def test_residuals_with_a_memory_ask_for_the_friction_that_is_missing(changed, swing):
    run = swing(n=2000)
    slow = run.simulated + 0.05 * np.sin(3 * run.t)[:, None]
    text = said(changed(runs={"release": replace(run, y=slow)}), study="mine.toml", folder="out")
    assert "quadratic drag of psi (b_1q)" in text
    assert "Coulomb friction of psi" not in text  # b_1c is estimated already
    assert "upright ladder mine.toml -o out" in text


@pytest.mark.parametrize(("value", "says"), [(0.0, "need no b_2"), (3.0, "b_2 stopped at its bound")])
def test_a_bound_that_was_hit_is_named(fit, changed, value, says):
    e = Estimate(value=value, stderr=0.0, interval=(0.0, 1e-6), unit="N m s/rad", status="at bound")
    assert says in said(changed(estimates={**fit.estimates, "b_2": e}))


def test_what_the_data_cannot_see_is_passed_on(fit):
    assert fit.unseen[0] in said(fit)


def test_weak_numbers_are_to_be_measured(fit, changed):
    assert "hardly see b_2: measure it on the bench" in said(changed(unseen=()))
    more = {n: replace(fit.estimates["b_2"], status="poorly determined") for n in ("b_1", "b_2")}
    assert "hardly see b_1, b_2: measure one of them" in said(changed(unseen=(), estimates={**fit.estimates, **more}))


def test_a_stopped_search_is_to_be_ended(changed):
    assert "Run it to its end" in said(changed(interrupted=True))


def test_every_fit_is_to_be_tried_on_a_run_it_has_not_met(fit):
    *_, last = fit_steps(fit, folder="out")
    assert last.command == "upright predict out/fit.json OTHER.toml"


def test_a_run_that_is_lost_is_restarted(changed, swing):
    run = swing(n=400)
    lost = replace(run, fit_percent={"psi": 40.0, "theta": 5.0}, horizon=None)
    assert 'horizon = "0.5 s"' in said(changed(runs={"spin": lost}))
    assert 'horizon = "0.5 s"' not in said(changed(runs={"spin": replace(lost, horizon=0.5)}))


def test_a_run_that_is_followed_needs_no_restart(fit):
    assert "horizon" not in said(fit)
