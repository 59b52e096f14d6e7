"""Does every command that writes a page put it on paper too, where that is asked for?"""

from __future__ import annotations

from inspect import getsource
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.verbs.commands import verb
from upright.cli import COMMANDS, app

SURVEY = Path(__file__).parents[2] / "examples" / "survey" / "table_3.csv"


def writes_a_page(name: str) -> bool:
    """Whether the verb of a command does."""
    asked = verb(name)
    return asked is not None and "write_page(" in getsource(asked)


WRITING = sorted(filter(writes_a_page, COMMANDS))


def test_there_are_commands_that_write_pages():
    assert {"identify", "ladder", "doctor", "design", "survey"} <= set(WRITING)


@pytest.mark.parametrize("name", WRITING)
def test_every_command_that_writes_a_page_takes_pdf(name):
    told = CliRunner().invoke(app, [name, "--help"], terminal_width=200).stdout
    assert "--pdf" in told


def test_the_pdf_lies_beside_the_page(tmp_path):
    pypdf = pytest.importorskip("pypdf")
    outcome = CliRunner().invoke(app, ["survey", str(SURVEY), "--n", "53", "--pdf", "-o", str(tmp_path)])
    assert outcome.exit_code == 0, outcome.stderr
    assert (tmp_path / "report.html").exists()
    assert "report.pdf" in outcome.stdout
    paper = " ".join(p.extract_text() for p in pypdf.PdfReader(tmp_path / "report.pdf").pages)
    assert "46 %, 54 %" in " ".join(paper.split())


def test_without_the_extra_it_is_said_before_the_work_begins(tmp_path, monkeypatch):
    monkeypatch.setattr("upright.report.pdf.find_spec", lambda name: None)
    outcome = CliRunner().invoke(app, ["survey", str(SURVEY), "--n", "53", "--pdf", "-o", str(tmp_path / "new")])
    assert outcome.exit_code != 0
    assert not (tmp_path / "new").exists()
