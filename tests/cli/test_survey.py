"""Does `upright survey` tell what answers and printed tables can say?"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from upright.cli import app

EXAMPLES = Path(__file__).parents[2] / "examples" / "survey"


def survey(*arguments: object):
    return CliRunner().invoke(app, ["survey", *map(str, arguments)], terminal_width=200)


def test_the_papers_table_4_is_judged(tmp_path):
    outcome = survey(EXAMPLES / "table_4.csv", "--n", 53, "--json", "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    found = json.loads(outcome.stdout)["found"]
    assert len(found["impossible"]) == 8  # erratum 6
    assert found["fits"]["53"] == 16
    assert {b["verdict"] for b in found["bounds"].values()} == {"significant"}
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count('<div class="still') == 2
    assert "8 of 24 means cannot come from 53 answers" in page


def test_the_papers_table_3_is_judged(tmp_path):
    outcome = survey(EXAMPLES / "table_3.csv", "--n", 53, "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    assert "46 %, 54 %" in outcome.stdout
    assert "48 or 52 fit most" in outcome.stdout


def test_answers_of_people_are_compared(tmp_path):
    outcome = survey(EXAMPLES / "synthetic_wide.csv", "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    assert "feedback: raised by" in outcome.stdout
    assert "What next" in outcome.stdout
    assert (tmp_path / "report.html").read_text(encoding="utf-8").count('<div class="still') == 2


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["table_4.csv"], "say with --n how many answers"),
        (["synthetic_wide.csv", "--n", "24"], "--n is for printed summaries"),
        (["synthetic_wide.csv", "--scale", "four"], "such as 1-4"),
        (["none.csv"], "There is no file"),
    ],
)
def test_what_cannot_be_judged_is_said(tmp_path, arguments, sentence):
    outcome = survey(EXAMPLES / arguments[0], *arguments[1:], "-o", tmp_path)
    assert outcome.exit_code == 2
    assert sentence in " ".join(outcome.stderr.split())
