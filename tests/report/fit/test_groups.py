"""A reader sees which runs share a number, and what a prediction chose for itself."""

from __future__ import annotations

from dataclasses import replace

from upright.identification import Estimate
from upright.report.fit.advice import fit_steps
from upright.report.fit.tables import run_table, score_table

FACTOR = Estimate(value=1.2, stderr=0.02, interval=(1.16, 1.24), unit="1", status="well determined")


def test_groups_stand_before_single_runs(changed):
    rows = run_table(changed(groups={"28 Jan": {"friction": FACTOR}})).rows
    assert rows[0][:3] == ("group 28 Jan", "friction", "1.200")
    assert rows[1][0] == "release"


def test_a_prediction_says_what_it_took_from_the_run_itself(changed, fit):
    runs = {**fit.runs, "tail": replace(fit.runs["tail"], adapted=("initial", "gain"))}
    tail = [row for row in score_table(runs).rows if row[0] == "tail"]
    assert tail
    assert all(row[-1] == "from the first sample; its own initial, gain" for row in tail)
    said = " ".join(step.sentence for step in fit_steps(changed(runs=runs)))
    assert "'tail' chose its own gain" in said
    plain = {**fit.runs, "tail": replace(fit.runs["tail"], adapted=("initial",))}
    assert "chose its own" not in " ".join(step.sentence for step in fit_steps(changed(runs=plain)))


def test_a_factor_that_nothing_shows_is_to_be_left_out(changed):
    idle = replace(FACTOR, status="unseen")
    said = " ".join(s.sentence for s in fit_steps(changed(groups={"28 Jan": {"gain": idle}})))
    assert "say nothing about gain of group 28 Jan" in said
