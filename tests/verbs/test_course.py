"""Do the verbs of a course give what can be counted by hand, or is printed in the paper?"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.experiments.rigs import declared
from upright.errors import BadInput
from upright.experiments import laboratory
from upright.experiments.stand.experiment import Experiment
from upright.report.page import Chapter, Step
from upright.verbs.course import _typed, lab, reproduce, survey

TABLE_1_SET_1 = [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.222]


@pytest.mark.slow
def test_printed_poles_come_again(tmp_path):
    found = reproduce()
    again = found.tables[0].again[0]
    for pole in TABLE_1_SET_1:
        assert np.abs(again - pole).min() < 1e-4  # four digits behind the point are printed
    assert found.files == ()
    assert reproduce(out=tmp_path).files == (tmp_path / "reproduce.html",)


def test_the_mean_of_a_survey_is_that_of_a_hand(tmp_path):
    sheet = tmp_path / "class.csv"
    sheet.write_text("id,feedback pre,feedback post\na,2,3\nb,1,3\nc,2,4\nd,3,3\n", encoding="utf-8")
    found = survey(sheet, out=tmp_path / "out")
    feedback = found.numbers["found"]["feedback"]
    assert (feedback["n"], feedback["pre"], feedback["post"], feedback["gain"]) == (4, 2.0, 3.25, 1.25)
    assert feedback["spread"] == pytest.approx(np.std([1, 2, 2, 0], ddof=1))
    assert found.files == (tmp_path / "out" / "report.html",)
    assert survey(sheet, scale=(1, 4)).numbers["found"] == found.numbers["found"]
    with pytest.raises(BadInput, match="--n is for printed summaries"):
        survey(sheet, n=4)
    with pytest.raises(BadInput, match="its two ends"):
        survey(sheet, scale=(4, 1))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"seed": -1}, "at least 0"),
        ({"rig": "furutta"}, "did you mean 'furuta'"),
        ({"experiment": "5"}, "there is no experiment '5'"),
        ({"experiment": ["4"], "rig": "torsional"}, "torsional has experiments"),
    ],
)
def test_a_laboratory_that_is_not_there_is_said(tmp_path, options, sentence):
    with pytest.raises(BadInput, match=sentence):
        lab(out=tmp_path / "new", **options)
    assert not (tmp_path / "new").exists()


@pytest.mark.slow
def test_the_shortest_experiment_is_told_as_numbers_and_page(tmp_path):
    steps = []
    done = lab(experiment="1a", rig="rectilinear", seed=2, out=tmp_path / "lab", progress=lambda s, x: steps.append(s))
    k = done.numbers["experiments"]["1a"]["numbers"]["k"]
    assert abs(k["value"] - k["truth"]) < 6 * k["stderr"]
    assert done.files[0] == tmp_path / "lab" / "report.html"
    assert not done.interrupted
    assert steps[-1] == "writing the report"
    assert "1a" in repr(done)
    again = lab(experiment="1a", rig="rectilinear", seed=2, out=tmp_path / "lab").experiment("1a")  # as kept
    assert again.value["k"]["value"] == k["value"]
    assert "<svg" in again.plot("line")._repr_svg_()
    with pytest.raises(BadInput, match="experiment '1b' was not run; valid names: 1a"):
        done.experiment("1b")


@pytest.fixture
def small(monkeypatch):
    """A laboratory of two experiments that take no time; one is sound."""

    def experiment(name, sound):
        def tell(at):
            (at.folder / "log.csv").write_text("t,x", encoding="utf-8")
            return Chapter(title=name, verdict=f"{name} told.", sound=sound, numbers={"x": 1}, steps=AGAIN), True

        return Experiment(
            name=name, title=name, makes=("furuta", "linear"), on=lambda _: False, tell=tell, order=int(name[0])
        )  # fmt: skip

    monkeypatch.setattr(laboratory, "EXPERIMENTS", declared(experiment("1a", True), experiment("1b", False)))


AGAIN = (Step("Again.", "upright lab"),)


def test_a_laboratory_counts_its_sound_verdicts_and_leaves_a_report_only_where_a_folder_was_named(small, tmp_path):
    told = []
    done = lab(rig="linear", seed=3, out=tmp_path / "lab", progress=lambda step, share: told.append((step, share)))
    assert done.chapter.verdict == "1 of 2 verdicts are sound."
    assert not done.chapter.sound
    assert done.chapter.finished
    assert (tmp_path / "lab" / "1a" / "log.csv").exists()
    assert done.files[0] == tmp_path / "lab" / "report.html"
    assert (done.numbers["folder"], done.numbers["report"]) == (str(tmp_path / "lab"), str(done.files[0]))
    assert (done.numbers["seed"], done.numbers["rig"], done.numbers["nonideal"]) == (3, "linear", False)
    assert told[-1] == ("writing the report", 1.0)
    assert done.chapter.steps
    assert all(chapter.steps for chapter in done.value.book.chapters)
    assert done.value.experiment("1b").value == {"x": 1}
    with pytest.raises(BadInput, match="experiment '4' was not run"):
        done.value.experiment("4")
    again = lab(rig="linear", seed=3, out=tmp_path / "lab", experiment="1a")
    assert "as kept from an earlier run; 0.0 s" in again.value.book.chapters[0].about
    assert "kept" not in done.value.book.chapters[0].about
    alone = lab(rig="linear", seed=3, experiment=("1a",))
    assert alone.chapter.sound
    assert (alone.files, alone.chapter.steps, alone.value.book.chapters[0].steps) == ((), (), ())
    assert "report" not in alone.numbers


@pytest.mark.parametrize(
    ("typed", "folder"),
    [
        ({}, "upright-lab"), ({"rig": "linear"}, "upright-lab-linear"), ({"seed": 3}, "upright-lab-3"),
        ({"rig": "furuta", "seed": 3, "nonideal": True}, "upright-lab-furuta-3-nonideal"),
        ({"rig": "bench/RIG.toml"}, "upright-lab-RIG"), ({"rig": "serial:COM3"}, "."),
    ],
)  # fmt: skip
def test_every_rig_has_a_folder_of_its_own_and_a_twin_asks_nobody(typed, folder):
    words = {"rig": None, "seed": None, "nonideal": False, "out": None, "ask": print, "watching": print} | typed
    prepared = _typed(words)
    assert prepared["out"] == Path(folder)
    itself = str(typed.get("rig", "")).endswith(".toml")
    assert (prepared["ask"] is None, prepared["watching"] is None) == (not itself, not itself)
    assert _typed({**words, "out": Path("mine")})["out"] == Path("mine")


def test_a_scale_has_two_ends_and_summaries_the_number_of_answers(tmp_path):
    """Two answers at least; a frame is read as its file is, and what is no sheet is named."""
    sheet = tmp_path / "class.csv"
    sheet.write_text("id,feedback pre,feedback post\na,2,3\nb,1,3\n", encoding="utf-8")
    frame = pd.read_csv(sheet)
    assert survey(frame).numbers["found"] == survey(sheet).numbers["found"]
    assert survey(frame).chapter.steps == ()
    assert survey(sheet).chapter.steps[0].command == f"upright survey {sheet} --json"
    assert survey(sheet, scale=" 0 to 100 ").numbers["found"]["feedback"]["pre"] == 1.5
    printed = tmp_path / "means.csv"
    printed.write_text("concept,pre,post\nfeedback,2.1,3.3\n", encoding="utf-8")
    assert survey(printed, n=2).chapter.steps[0].command == f"upright survey {printed} --n 2 --json"
    for n, said in ((1, "at least 2, got 1"), (None, "say with --n how many answers")):
        with pytest.raises(BadInput, match=said):
            survey(printed, n=n)
    for scale in ("4-1", "3-3", "4", "a-b"):
        with pytest.raises(BadInput, match="two ends"):
            survey(sheet, scale=scale)
    with pytest.raises(BadInput, match="CSV file or a pandas DataFrame, got list"):
        survey([1, 2])
