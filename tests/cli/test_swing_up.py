"""Does `upright swing-up` do what it says, and answer what it cannot do in a sentence?"""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from upright.cli import app


def upright(*arguments: object):
    return CliRunner().invoke(app, [*map(str, arguments)], terminal_width=200)


@pytest.mark.slow
def test_the_pendulum_gets_up_and_the_page_is_written(tmp_path):
    outcome = upright("swing-up", "--rig", "linear", "--seed", 2, "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    assert "Upright after" in outcome.stdout
    assert "What next" in outcome.stdout
    told = json.loads((tmp_path / "swing_up.json").read_text(encoding="utf-8"))
    assert told["swing_up"]["held"]
    assert told["swing_up"]["travel"] < told["law"]["travel"]
    assert (tmp_path / "swing_up.html").is_file()
    again = upright("swing-up", "--rig", "linear", "--seed", 2, "-o", tmp_path, "--json")
    assert json.loads(again.stdout) == told


@pytest.mark.slow
def test_a_lying_encoder_ends_it_with_a_sentence(tmp_path):
    outcome = upright("swing-up", "--rig", "linear", "--fault", "theta=-1", "-o", tmp_path)
    assert outcome.exit_code == 3
    words = "encoder of theta counts the wrong way round: swap its two channels"
    assert words in outcome.stdout
    again = upright("swing-up", "--rig", "linear", "--check", tmp_path / "sensors.csv", "-o", tmp_path)
    assert again.exit_code == 3
    assert words in again.stdout
    assert (tmp_path / "encoders.html").is_file()


def test_what_cannot_be_done_is_said_in_a_sentence(tmp_path):
    for arguments, words in (
        (("--rig", "torsional"), "needs a pendulum theta on a driven body"),
        (("--rig", "balloon"), "there is no rig model 'balloon'"),
        (("--fault", "phi=2"), "--fault names a coordinate"),
        (("--fault", "theta=zero"), "needs a factor"),
        (("--travel", "-1"), "--travel must be above 0"),
        ((tmp_path / "none.json",), "does not exist"),
    ):
        outcome = upright("swing-up", *arguments, "-o", tmp_path / "out")
        assert outcome.exit_code == 2
        assert words in " ".join(outcome.stderr.split())
