"""Does the advice below a ladder name what the study is to lose, and nothing where it has nothing to lose?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from upright.identification.ladder.growth import Ladder, RungResult
from upright.identification.ladder.repeats import Repeats
from upright.identification.ladder.rungs import Rung
from upright.report.ladder import chapter, ladder_figure, ladder_steps, rung_table


@pytest.mark.parametrize(
    ("left_out", "trimmed", "said"),
    [
        ((), False, False),  # nothing was refused
        (("b_1c",), False, True),  # the owner's own study still has it
        (("b_1c",), True, False),  # the study that was written has lost it already
    ],
)
def test_only_what_was_refused_and_is_still_in_the_study_is_to_be_taken_out(fit, left_out, trimmed, said):
    ladder = Ladder(
        steps=(), rig=fit.model, runs=(), held_out="half of the runs", repeats=(), stopped="No rung is left.",
        scores={}, left_out=left_out,
    )  # fmt: skip
    steps = ladder_steps(ladder, study="swing.toml", folder="out", data="", trimmed=trimmed)
    taken = [step.sentence for step in steps if "out of the study" in step.sentence]
    assert len(taken) == said
    assert all("Take b_1c out" in sentence for sentence in taken)


def rung(name, predicted, fitted, accepted=True, **more):
    return RungResult(
        rung=Rung(name=name, **more), accepted=accepted, reason=f"why {name}", fitted={"one": {"theta": fitted}},
        predicted={"one": {"theta": predicted}}, cost=0.031249, parameters=4, per_run=2, values={}, seconds=1.26,
    )  # fmt: skip


TWICE = Repeats(
    labels=("one", "two"), percents={"psi": (90.0, 92.0, 99.5), "theta": (80.0, 84.0)}, errors={"one": 0.0, "two": 0.0}
)
STEPS = (
    rung("viscous", 60.0, 70.0, adds=("b_1", "b_2")), rung("dry", -3.0, 75.0, False, adds=("b_1c",), drops=("b_1",)),
    rung("a gain of every run", 80.0, 85.0, unknown=("gain",)),
)  # fmt: skip


@pytest.fixture
def grown(fit):
    scores = {"one": replace(fit.runs["tail"], fit_percent={"psi": 70.0, "theta": 50.0})}
    scores["two"] = replace(fit.runs["tail"], fit_percent={"psi": 80.0, "theta": 40.0})
    return Ladder(
        steps=STEPS, rig=fit.model, runs=(), held_out="half of the runs", repeats=(TWICE,), stopped="No rung is left.",
        scores=scores, left_out=(),
    )  # fmt: skip


def test_every_rung_stands_with_its_terms_scores_and_decision(grown):
    table = rung_table(grown)
    assert table.rows == (
        ("viscous", "b_1, b_2", "70.0 %", "60.0 %", "0.0312", "4 + 2", "1.3", "kept"),
        ("dry", "b_1c; without b_1", "75.0 %", "−3.0 %", "0.0312", "4 + 2", "1.3", "refused"),
        ("a gain of every run", "gain of each run", "85.0 %", "80.0 %", "0.0312", "4 + 2", "1.3", "kept"),
    )
    assert [table.headings[i] for i in table.numbers] == ["fitted", "predicted", "cost", "parameters", "seconds"]
    assert table.headings[table.badge] == "decision"


def test_the_verdict_names_what_was_kept_with_the_scores_of_the_last_and_what_was_refused(grown):
    page = chapter(grown, title="Ladder", provenance={})
    assert page.verdict == (
        "The data ask for viscous + a gain of every run: 80.0 % predicted on average, 85.0 % fitted."
    )
    assert page.detail == "Refused: dry. No rung is left."
    assert page.sound
    assert page.parts[1].content[0].pairs == (
        ("viscous", "why viscous"), ("dry", "why dry"), ("a gain of every run", "why a gain of every run"),
    )  # fmt: skip
    none = chapter(replace(grown, steps=STEPS[1:2], interrupted=True), title="Ladder", provenance={})
    assert (none.verdict, none.detail, none.sound) == ("No rung was finished.", "No rung is left.", False)


def test_a_rung_that_was_kept_later_is_not_among_the_refused(grown):
    tried_again = (*STEPS, replace(STEPS[1], accepted=True))
    assert chapter(replace(grown, steps=tried_again), title="", provenance={}).detail == "No rung is left."


def test_repeats_stand_with_their_median_and_range_beside_the_model(grown):
    _, table = chapter(grown, title="Ladder", provenance={}).parts[2].content
    assert table.rows == (
        ("one, two", "ψ", "92.0 %", "90.0 % to 99.50 %", "75.0 %"),
        ("one, two", "θ", "82.0 %", "80.0 % to 84.0 %", "45.0 %"),
    )
    (_, nobody) = chapter(replace(grown, scores={}), title="", provenance={}).parts[2].content
    assert {row[-1] for row in nobody.rows} == {"not known"}
    (said,) = chapter(replace(grown, repeats=()), title="", provenance={}).parts[2].content
    assert "No run repeats another" in said


def test_the_picture_of_a_ladder_shows_every_rung_and_the_ceiling(grown):
    (axes,) = ladder_figure(grown).axes
    curves = {line.get_label(): np.array(line.get_data()).tolist() for line in axes.lines}
    assert curves["fitted"] == [[0, 2], [70, 85]]
    assert curves["predicted"] == [[0, 2], [60, 80]]
    assert curves["fitted, refused"] == [[1], [75]]
    assert curves["predicted, refused"] == [[1], [-3]]
    assert curves["a repeat by another"][1] == [87, 87]  # the mean of 92 and 82
    assert curves["_child0"] == [[0, 2], [70, 85]]
    assert curves["_child1"] == [[0, 2], [60, 80]]
    # what is worse than the mean of the data is written at the lower edge
    low, high = axes.get_ylim()
    assert low == pytest.approx(-8)
    assert high == pytest.approx(104)
    assert [(t.get_text(), t.xy) for t in axes.texts] == [("−3.0 % ↓", (1, 0.0))]
    assert axes.get_xlim() == pytest.approx((-0.4, 2.4))
    assert [t.get_text() for t in axes.get_xticklabels()] == [
        "viscous\n4 + 2", "dry\n4 + 2\n(refused)", "a gain of\nevery run\n4 + 2",
    ]  # fmt: skip
    assert axes.get_ylabel() == "mean fit [%]"
    high_up = replace(grown, steps=(STEPS[0], STEPS[2]), repeats=())
    (axes,) = ladder_figure(high_up).axes
    assert axes.get_ylim() == pytest.approx((60 - 3.2, 100 + 1.6))
    assert not axes.texts
    assert "a repeat by another" not in [line.get_label() for line in axes.lines]


def test_what_a_ladder_leaves_to_do_comes_in_order(grown):
    def said(data="", **changes):
        return list(ladder_steps(replace(grown, **changes), study="swing.toml", folder="out", data=data, trimmed=False))

    run = type("run", (), {"unknown": ("gain",)})()
    own, fit, refused = said(runs=(run,))
    assert own.sentence == "Add gain to what each run has unknown."
    assert own.command == '[[runs]]\nunknown = ["gain"]'
    assert fit.command == "upright identify swing.toml -o out/fit"
    assert "If you believe in dry all the same" in refused.sentence
    first = said(steps=STEPS[:1], repeats=(), interrupted=True, data="a.csv")
    assert [s.sentence.partition(" ")[0] for s in first] == ["The", "Fit", "Repeat"]
    assert first[1].command == "upright identify swing.toml --data a.csv -o out/fit"
    trimmed = list(
        ladder_steps(replace(grown, steps=STEPS[:1]), study="swing.toml", folder="out", data="", trimmed=True)
    )
    assert [s.command for s in trimmed] == ["upright identify out/study.toml -o out/fit"]
