"""Do the verbs of a course give what can be counted by hand, or is printed in the paper?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.verbs.course import lab, reproduce, survey

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
