"""Do the verbs of a loop hand on gains that place the poles asked, given as texts or as numbers?"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.gains.furuta import RIG, STUDY
from upright.errors import BadInput
from upright.files import json_text
from upright.verbs.control.design import design
from upright.verbs.control.regulate import regulate
from upright.verbs.control.swing_up import swing_up
from upright.verbs.control.track import track

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
        (lambda: swing_up(lie={"phi": 2}), "--lie names a coordinate"),
        (lambda: swing_up(lie="theta=0"), "a factor between"),
        (lambda: track(rig="furuta"), "--rig is rectilinear or torsional"),
        (lambda: track(sets=5), "sets 1 to 4"),
        (lambda: track(step=-1e-3), "--step needs a size above 0"),
        (lambda: track(poles=[-1, -2]), "needs 4 poles, got 2"),
    ],
)
def test_what_cannot_be_run_is_said_before_anything_is_written(tmp_path, monkeypatch, call, sentence):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInput, match=sentence):
        call()
    assert list(tmp_path.iterdir()) == []
