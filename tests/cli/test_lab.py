"""Does `upright lab` bring a newcomer from nothing to a report?"""

import json
import re

import pytest
from typer.testing import CliRunner

from upright.cli import app


@pytest.fixture(scope="module")
def spoken(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab") / "new"
    return folder, CliRunner().invoke(app, ["lab", "-o", str(folder)])


@pytest.mark.slow
def test_it_ends_with_the_report_and_what_to_try_next(spoken):
    folder, outcome = spoken
    assert outcome.exit_code == 0, outcome.output
    assert (folder / "report.html").is_file()
    assert re.search(r"Report: .*report\.html", outcome.stdout)
    for command in ("upright identify", "upright predict", "upright show", "upright lab --seed 1"):
        assert command in outcome.stdout


@pytest.mark.slow
def test_what_it_proposes_works(spoken, tmp_path, monkeypatch):
    _, outcome = spoken
    monkeypatch.chdir(tmp_path)
    lines = [line.split() for line in outcome.stdout.splitlines() if line.startswith("    upright ")]
    tried = [line[1:] for line in lines if line[1] in ("identify", "predict", "show")]
    assert len(tried) == 3
    for line in tried:
        again = CliRunner().invoke(app, line)
        assert again.exit_code == 0, (line, again.output)


@pytest.mark.slow
def test_json_is_for_programs(tmp_path):
    outcome = CliRunner().invoke(app, ["lab", "-o", str(tmp_path / "a b"), "--seed", "1", "--json"])
    told = json.loads(outcome.stdout)
    assert told["seed"] == 1
    assert told["fits"]["free_swing"]["trusted"]
    assert set(told["parameters"]["m_p"]) == {"truth", "value", "interval", "inside"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [(["--seed", "-1"], "at least 0"), (["--seed", "x"], "Invalid value"), (["-o", "FILE"], "is a file")],
)
def test_wrong_calls_are_answered_in_a_sentence(tmp_path, arguments, says):
    (tmp_path / "FILE").write_text("", encoding="utf-8")
    arguments = [str(tmp_path / "FILE") if a == "FILE" else a for a in arguments]
    outcome = CliRunner().invoke(app, ["lab", *arguments])
    assert outcome.exit_code == 2
    assert says in outcome.stderr
    assert "Traceback" not in outcome.output
