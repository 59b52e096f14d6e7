"""Do the verbs of a loop hand on gains that place the poles asked, given as texts or as numbers?"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.cli.test_first_line import TRUSTED, UNTRUSTED, fit_of
from tests.gains.furuta import RIG, STUDY
from upright.errors import BadInput
from upright.files import json_text
from upright.laws import of_values
from upright.paper.reproduce import TABLE_1
from upright.verbs.control.design import design
from upright.verbs.control.regulate import regulate
from upright.verbs.control.swing_up import swing_up
from upright.verbs.control.track import track
from upright.verbs.export import export
from upright.verbs.values import read_pole_list

POLES = [-4 + 2j, -4 - 2j, -17, -3]


@pytest.fixture
def study(tmp_path: Path) -> Path:
    path = tmp_path / "rig.toml"
    path.write_text(STUDY, encoding="utf-8")
    return path


def test_the_gains_place_the_poles_asked(study):
    found = design(study, poles=POLES)
    model = RIG.linear("inverted")
    closed = np.linalg.eigvals(model.A - model.B @ np.atleast_2d(found.K))
    np.testing.assert_allclose(np.sort_complex(closed), np.sort_complex(np.array(POLES, complex)), rtol=1e-6)
    assert found.files == ()


def test_numbers_in_si_say_the_same_as_texts(study, tmp_path):
    said = design(
        study, poles="-4+-2j, -17, -3", period="2 ms", start="theta=5 deg", counts="theta=4000", limit=0.5,
        out=tmp_path / "out",
    )  # fmt: skip
    meant = design(study, poles=POLES, period=0.002, start={"theta": np.pi / 36}, counts={"theta": 4000}, limit=0.5)
    assert json_text(said.numbers) == json_text(meant.numbers)
    assert said.files == (tmp_path / "out" / "design.json", tmp_path / "out" / "design.html")
    weighed = [design(study, lqr=lqr, effort_weight=1.0) for lqr in ("1,0,1,0", [1, 0, 1, 0])]
    np.testing.assert_array_equal(weighed[0].K, weighed[1].K)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"poles": POLES, "lqr": "1,0,1,0"}, "give either --poles"),
        ({"poles": POLES[:2]}, "needs 4 poles, got 2"),
        ({"poles": POLES, "at": "invertted"}, "did you mean 'inverted'"),
        ({"poles": POLES, "counts": -5}, "above 0, got '-5'"),
        ({"poles": POLES, "counts": {"phi": 5}}, "names coordinates"),
        ({"poles": POLES, "start": {"phi": 0.1}}, "names states"),
        ({"poles": POLES, "period": float("nan")}, "finite"),
        ({"poles": POLES, "pdf": True}, "none was named"),
    ],
)
def test_a_design_that_cannot_be_had_is_said(study, options, sentence):
    with pytest.raises(BadInput, match=sentence):
        design(study, **options)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: regulate(which=1, poles=POLES), "give either --set"),
        (lambda: regulate(which=5), "--set is 1 to 4"),
        (lambda: regulate(start="5 kg"), "rad"),
        (lambda: swing_up(travel=-1.0), "--travel must be above 0"),
        (lambda: swing_up(seconds=0.5), "from 1 to 120 s"),
        (lambda: swing_up(seconds=1, fault="theta=0"), "a factor between"),
        (lambda: swing_up(seconds=120, fault="theta=0"), "a factor between"),
        (lambda: swing_up(fault={"phi": 2}), "fault names a coordinate"),
        (lambda: swing_up(fault="theta=0"), "a factor between"),
        (lambda: track(rig="furuta"), "--rig is rectilinear or torsional"),
        (lambda: track(sets=5), "sets 1 to 4"),
        (lambda: track(step=-1e-3), "--step needs a size above 0"),
        (lambda: track(step="5 mm", limit=-1.0), "--limit must be above 0"),
        (lambda: track(poles=[-1, -2]), "needs 4 poles, got 2"),
    ],
)
def test_what_cannot_be_run_is_said_before_anything_is_written(tmp_path, monkeypatch, call, sentence):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInput, match=sentence):
        call()
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def regulated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("regulated")
    fit = fit_of("furuta", folder, TRUSTED)
    return fit, folder / "out", regulate(fit, draws=4, seconds=2.0, out=folder / "out")


def test_the_set_that_is_recommended_is_written_as_a_design_that_exports(regulated, tmp_path):
    fit, folder, answer = regulated
    best = answer.value.best
    content = json.loads((folder / "design.json").read_text(encoding="utf-8"))
    law = of_values(content["law"])
    for name in "ABCD":  # the law that was simulated, not another one with its poles
        np.testing.assert_allclose(getattr(law, name), getattr(best.law, name), rtol=1e-12, atol=1e-12)
    assert (content["limit"], content["period"]) == (answer.value.rig.limit, answer.value.rig.period)
    assert content["basis"]["level"] == "trusted"
    assert any("design.json --to c" in step.command for step in answer.chapter.steps)
    export(folder, to="c", out=tmp_path)
    assert (tmp_path / "law.c").exists()
    same = design(fit, poles=best.name)  # "set 3"
    np.testing.assert_allclose(same.K[0], content["K"], rtol=1e-9)


@pytest.mark.parametrize("number", range(1, 5))
def test_design_takes_the_sets_of_table_1_by_name(study, number):
    attained = design(study, poles=f"set {number}").placement.attained
    printed = read_pole_list(TABLE_1[number - 1])
    np.testing.assert_allclose(np.sort_complex(attained), np.sort_complex(printed), rtol=1e-9)


def test_a_set_that_table_1_has_not_is_refused(study):
    with pytest.raises(BadInput, match="1 to 4 of Table 1, got '7'"):
        design(study, poles="set 7")


def test_no_design_is_written_where_no_set_is_recommended(tmp_path):
    answer = regulate(fit_of("furuta", tmp_path, UNTRUSTED), which=3, draws=2, seconds=0.5, out=tmp_path / "out")
    assert [f.name for f in answer.files] == ["report.html"]
    assert not (tmp_path / "out" / "design.json").exists()
