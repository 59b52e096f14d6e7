"""Do `upright loadings` and `upright plan-inertias` tell what they found, and what they cannot use?"""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from upright.cli import app
from upright.experiments.weighing_1a.run import drawn_twin, step_log


def upright(*arguments: object):
    return CliRunner().invoke(app, [*map(str, arguments)], terminal_width=200)


def said(outcome) -> str:
    return " ".join((outcome.stdout + outcome.stderr).split())


@pytest.fixture(scope="module")
def logs(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("loads")
    for count in (0, 2, 4):
        step_log(drawn_twin(2, "torsional"), count).to_csv(folder / f"{count}.csv")
    return folder


@pytest.mark.slow
def test_the_twin_is_weighed_and_its_logs_tell_the_same(tmp_path, monkeypatch):
    outcome = upright("loadings", "--rig", "rectilinear", "--seed", 4, "-o", tmp_path / "out")
    assert outcome.exit_code == 0, outcome.stderr
    assert "true value of the twin" in outcome.stdout
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert page.count('<div class="still') == 3
    assert "http://" not in page.replace("http://www.w3.org", "")
    shown = next(line for line in outcome.stdout.splitlines() if line.strip().startswith("upright loadings"))
    monkeypatch.chdir(tmp_path / "out")
    first = json.loads(upright("loadings", "--rig", "rectilinear", "--seed", 4, "--json", "-o", "again").stdout)
    second = json.loads(upright(*shlex.split(shown)[1:], "--json").stdout)
    # the same logs; the twin also knows how exact its masses are, which weighs the loadings a little differently
    assert second["k"]["value"] == pytest.approx(first["k"]["value"], rel=2e-3)
    assert {s["omega_n"] for s in second["swings"]} == {s["omega_n"] for s in first["swings"]}


@pytest.mark.slow
def test_masses_on_a_bolt_circle_are_inertias(logs, tmp_path):
    files = [logs / f"{n}.csv" for n in (0, 2, 4)]
    added = ["--added", "0", "--added", "2 at 6.5 cm", "--added", "4 at 65 mm"]
    outcome = upright("loadings", *files, *added, "--free", "--json", "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    found = json.loads(outcome.stdout)
    assert found["kind"] == "torsional"
    assert found["k"]["value"] == pytest.approx(drawn_twin(2, "torsional").stiffness, rel=1e-2)
    assert len(found["swings"]) == 3  # --free leaves the swings with the drive on aside


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["0.csv", "--added", "0 kg", "--added", "1 kg"], "needs its --added"),
        (["0.csv", "2.csv", "--added", "0 kg", "--added", "1 kg m^2"], "cannot be mixed"),
        (["0.csv", "2.csv", "--added", "0", "--added", "-1 kg"], "needs what was put on"),
        (["0.csv", "2.csv", "--added", "0", "--added", "1 kg", "--signal", "z"], "no column 'z'"),
        (["0.csv", "2.csv", "--added", "0", "--added", "0"], "two different added inertias"),
        (["--twin", "furuta"], "rectilinear or torsional"),
    ],
)
def test_what_cannot_be_used_is_said(logs, tmp_path, monkeypatch, arguments, sentence):
    monkeypatch.chdir(logs)
    outcome = upright("loadings", *arguments, "-o", tmp_path)
    assert outcome.exit_code == 2
    assert sentence in said(outcome)
    assert "Traceback" not in said(outcome)


def test_a_plan_is_told_drawn_and_reaches_what_is_asked(tmp_path):
    outcome = upright("plan-inertias", "--target", "0.4 %", "--runs", 6, "--json", "-o", tmp_path / "plan.svg")
    assert outcome.exit_code == 0, outcome.stderr
    plan = json.loads(outcome.stdout)
    k = {int(n): p["stiffness"]["k"] for n, p in plan["plans"].items()}
    assert k[plan["chosen"]] <= 4e-3
    assert all(v > 4e-3 for n, v in k.items() if n < plan["chosen"])
    assert "standard error" in (tmp_path / "plan.svg").read_text(encoding="utf-8")
    assert "What next" in upright("plan-inertias", "--rig", "torsional", "--runs", 4, "--radius", "4 cm").stdout


def test_a_plan_that_makes_no_sense_is_refused():
    assert "did you mean 'torsional'" in said(upright("plan-inertias", "--rig", "torsonal"))
    assert "0.2 %" in said(upright("plan-inertias", "--error", "90 %"))
    assert upright("plan-inertias", "--runs", 2).exit_code == 2
