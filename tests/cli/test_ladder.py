"""Does a study become a ladder, a page and the study of the chosen model, and does every run get its prediction?"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.identification.twins import PENDULUM, noisy, swing
from upright.cli import app
from upright.identification.ladder import growth as climb
from upright.study.load import load_study

STUDY = """
title = "A rod with a dry hinge"
[rig]
plant = "pendulum"
[parameters]
m_p = "0.2 kg"
l_cg = "0.3 m"
J_p = { guess = "1.5e-3 kg m^2" }
b_2 = { guess = "1e-3 N m s/rad" }
b_2c = { guess = "1e-3 N m" }   # dry
b_2q = { guess = "1e-3 N m s^2/rad^2" }
[sensors.theta]
unit = "rad"
[[runs]]
file = "high.csv"
[[runs]]
file = "low.csv"
"""
LADDER = """
[[ladder]]
name = "viscous"
[[ladder]]
name = "drag"
adds = ["b_2q"]
[[ladder]]
name = "dry"
adds = ["b_2c"]
"""


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """A folder with a study and two swings of a pendulum with viscous and Coulomb friction."""
    monkeypatch.chdir(tmp_path)
    for k, (name, angle) in enumerate((("high", 1.5), ("low", 1.0))):
        run = noisy(swing(PENDULUM | {"b_2c": 4e-3, "b_2q": 0.0}, angle=angle), 3e-3, seed=k)
        rows = np.column_stack([run.t, run.y])
        np.savetxt(f"{name}.csv", rows, "%.9g", ",", header="t,theta", comments="")
    (tmp_path / "study.toml").write_text(STUDY + LADDER, encoding="utf-8")
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(app, list(arguments))


@pytest.mark.slow
def test_a_ladder_says_what_it_chose_and_why(bench):
    outcome = run("ladder", "study.toml", "-o", "out")
    assert outcome.exit_code == 0, outcome.output
    content = json.loads((bench / "out" / "ladder.json").read_text(encoding="utf-8"))
    assert "dry" in content["chosen"]
    assert content["left_out"] == ["b_2q"]
    assert [s["name"] for s in content["steps"]][:3] == ["viscous", "drag", "dry"]
    for words in ("dry", "refused", "held-out error", "What next", "upright identify out/study.toml"):
        assert words in outcome.stdout
    page = (bench / "out" / "ladder.html").read_text(encoding="utf-8")
    for step in content["steps"]:
        assert step["reason"].split(";")[0] in page
    assert "http" not in page.replace("http://www.w3.org", "").replace("http-equiv", "")


@pytest.mark.slow
def test_the_chosen_study_asks_for_what_was_kept_and_can_be_fitted(bench):
    run("ladder", "study.toml", "-o", "out", "--no-report")
    chosen = load_study(bench / "out" / "study.toml", data=bench)
    assert chosen.model.estimated == ("J_p", "b_2", "b_2c")
    assert chosen.model.parameters["b_2q"].value == 0
    assert chosen.ladder == ()
    outcome = run("identify", "out/study.toml", "--data", ".", "-o", "fit", "--no-report")
    assert outcome.exit_code == 0, outcome.output
    fit = json.loads((bench / "fit" / "fit.json").read_text(encoding="utf-8"))
    assert fit["parameters"]["b_2c"]["value"] == pytest.approx(4e-3, rel=0.1)


@pytest.mark.slow
def test_every_run_is_held_out_in_turn(bench):
    outcome = run("identify", "study.toml", "-o", "out", "--hold-out", "each")
    assert outcome.exit_code == 0, outcome.output
    fit = json.loads((bench / "out" / "fit.json").read_text(encoding="utf-8"))
    assert set(fit["cross_validation"]) == {"high", "low"}
    assert all(s["fit_percent"]["theta"] > 98 for s in fit["cross_validation"].values())
    assert {r["role"] for r in fit["runs"].values()} == {"fit"}
    caption = "predicted by a fit of the others"
    assert caption in outcome.stdout
    assert caption in (bench / "out" / "report.html").read_text(encoding="utf-8")


def test_one_run_cannot_be_held_out_of_itself(bench):
    text = STUDY[: STUDY.rindex("[[runs]]")]
    (bench / "one.toml").write_text(text, encoding="utf-8")
    outcome = run("identify", "one.toml", "--hold-out", "each")
    assert outcome.exit_code == 2
    assert "two runs" in outcome.output


@pytest.mark.slow
def test_ctrl_c_writes_the_rungs_so_far(bench, monkeypatch):
    whole = climb.climb
    monkeypatch.setattr(climb, "climb", lambda *a, **k: replace(whole(*a, **k), interrupted=True))
    outcome = run("ladder", "study.toml", "-o", "out", "--json")
    assert outcome.exit_code == 130
    assert json.loads(outcome.stdout)["interrupted"]
    assert "stopped" in (bench / "out" / "ladder.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('["b_2c"]', '["b_2cc"]', "did you mean 'b_2c'"),
        ('adds = ["b_2c"]', 'adss = ["b_2c"]', "did you mean 'adds'"),
        ('["b_2c"]', '["g"]', "nothing asks for"),
        ('name = "dry"', "", "name"),
    ],
)
def test_a_rung_that_is_misspelt_is_answered_with_the_nearest_right_one(bench, old, new, said):
    (bench / "study.toml").write_text((STUDY + LADDER).replace(old, new), encoding="utf-8")
    outcome = run("ladder", "study.toml")
    assert outcome.exit_code == 2
    assert said in outcome.output
    assert "study.toml" in outcome.output or "rung" in outcome.output
