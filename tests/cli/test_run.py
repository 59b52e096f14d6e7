"""Does the command line run a law on a rig, look at the rig, and measure the machine?"""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from tests.rigs.test_twin import LAW
from upright.cli import app
from upright.cli.watch import effort_bar, lines
from upright.laws import as_values
from upright.realtime.session import RunState
from upright.rigs import Fault, Mode

RUNNER = CliRunner()


@pytest.fixture
def bench(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\nseed = 3\n', encoding="utf-8")
    (tmp_path / "design.json").write_text(json.dumps({"law": as_values(LAW)}), encoding="utf-8")
    return tmp_path


def test_a_run_tells_what_came_and_what_to_do_next(bench):
    words = ["run", "--rig", "RIG.toml", "--law", "design.json", "--duration", "1", "--start", "3 deg"]
    done = RUNNER.invoke(app, words)
    assert done.exit_code == 0, done.output
    for text in ("Stabilised for 1 s", "none late", "upright log replay", "run.mcap"):
        assert text in done.output
    assert {p.name for p in (bench / "upright-run").iterdir()} == {"run.mcap", "run.html"}


def test_a_run_that_stops_says_why_and_ends_with_3(bench):
    text = 'kind = "twin"\nmake = "furuta"\n[limits]\ncommand = "5 V"\n[limits.psi]\ntravel = "2 deg"\n'
    (bench / "RIG.toml").write_text(text, encoding="utf-8")
    words = ["run", "--rig", "RIG.toml", "--law", "design.json", "--duration", "1", "--no-check", "--json"]
    done = RUNNER.invoke(app, [*words, "--tilt", "5 deg"])
    assert done.exit_code == 3
    told = json.loads(done.stdout)
    assert told["faults"] & Fault.OVERTRAVEL
    assert "within its travel" in told["stopped"]


def test_a_rig_that_is_wired_as_described_passes_and_the_machine_is_measured(bench):
    looked = RUNNER.invoke(app, ["rig", "doctor", "RIG.toml"])
    assert looked.exit_code == 0, looked.output
    assert "theta by hand" in looked.output
    measured = RUNNER.invoke(app, ["rig", "check", "--seconds", "0.3", "--rate", "100", "--no-fifo", "--json"])
    assert json.loads(measured.stdout)["ticks"] == 30


def test_mistakes_are_answered_in_a_sentence(bench):
    for words, said in (
        (["run", "--rig", "RIG.toml"], "needs either a law"),
        (["run", "--rig", "NO.toml", "--law", "design.json"], "There is no file"),
        (["run", "--rig", "RIG.toml", "--law", "RIG.toml"], "not JSON"),
        (["run", "--rig", "RIG.toml", "--law", "design.json", "--reference", "step 0.1"], "follows no reference"),
        (["rig", "doctor", "design.json"], "TOML"),
    ):
        done = RUNNER.invoke(app, words)
        assert done.exit_code == 2, done.output
        assert said in done.stderr
        assert "Traceback" not in done.stderr


def test_the_view_shows_state_effort_lateness_and_faults():
    state = RunState(phase="running", time=1.5, tick=1700, late=2, mode=Mode.HOST, faults=Fault.OVERSPEED, applied=-2.5,
                     readings=(0.01, -0.02))  # fmt: skip
    shown = lines(state, 5.0).plain
    for text in ("1.50 s", "HOST", "2 late", "+0.0100", "-0.0200", "-2.500", "faster than its limit", "Esc"):
        assert text in shown
    assert effort_bar(-2.5, 5.0).count("█") == 10
    assert effort_bar(-2.5, 5.0).index("█") < effort_bar(-2.5, 5.0).index("|")
    assert "bring it" in lines(RunState(phase="bring it upright"), 1.0).plain.lower()
