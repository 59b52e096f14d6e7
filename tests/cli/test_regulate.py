"""Does `upright regulate` say what will come, run it, and answer bad calls in a sentence?"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from upright.cli import app
from upright.rig.makes import make_rig


def regulate(*arguments: object):
    return CliRunner().invoke(app, ["regulate", *map(str, arguments)], terminal_width=200)


@pytest.fixture
def fit(tmp_path: Path) -> Path:
    """A fit that found the cart as designed, its drive's gain known to one percent."""
    rig = make_rig("linear")
    entries = {n: {"value": v, "stderr": 0.0, "unit": "", "status": "known"} for n, v in rig.plant.parameters().items()}
    entries["actuator.gain"] = {
        "value": rig.gain,
        "stderr": 0.01 * rig.gain,
        "unit": "N/V",
        "status": "well determined",
    }
    content = {
        "format": 1, "plant": "cart-pendulum", "verdict": "", "trusted": True, "parameters": entries,
        "estimated": ["actuator.gain"], "correlation": [[1.0]], "rig": {"vendor": "ECP 210"},
    }  # fmt: skip
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


@pytest.mark.slow
def test_a_set_is_told_and_run(fit, tmp_path):
    outcome = regulate(fit, "--seed", 0, "--set", 3, "--seconds", 2, "-o", tmp_path / "out")
    assert outcome.exit_code == 0, outcome.stderr
    told = " ".join(outcome.stdout.split())
    assert "measured: stabilised" in told
    assert "The run agreed with its prediction." in told
    assert f"upright regulate {fit} --seed 0" in told
    assert (tmp_path / "out" / "regulation_set_3.csv").exists()
    assert "Holding it upright" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_numbers_for_a_program_are_finite_json(fit, tmp_path):
    outcome = regulate(
        fit, "--poles", "-5+-2j, -20, -3", "--start", "40 deg", "--seconds", 2, "--json", "-o", tmp_path / "out"
    )  # fmt: skip
    assert outcome.exit_code == 0, outcome.stderr
    said = json.loads(outcome.stdout)
    before = said["sets"]["your poles"]["before"]
    assert before["chance"] == 0.0  # on a rail of 20 cm no pole set brings 40 degrees back
    assert before["tilt"] < 0.7
    assert said["sets"]["your poles"]["after"] is None
    assert said["verdict"].startswith("No pole set is recommended for this start")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "5"], "--set is 1 to 4, or all, got '5'"),
        (["--set", "1", "--poles", "-1,-2,-3,-4"], "either --set"),
        (["--speed", "fast"], "plain, filtered, kalman"),
        (["--rig", "furuta"], "is a 'linear'"),
        (["--start", "3 m"], "3 m"),
    ],
)
def test_a_bad_call_is_answered_in_a_sentence(fit, arguments, words):
    outcome = regulate(fit, *arguments)
    assert outcome.exit_code == 2
    assert words in " ".join(outcome.stderr.split())
