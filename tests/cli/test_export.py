"""Does `upright export` turn what `upright design` wrote into a program that passes its own test?"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import upright as up
from tests.gains.furuta import STUDY
from upright.cli import app

MODEL = """
A = [[0, 1], [20, -0.1]]
B = [[0], [3]]
C = [[1, 0]]
outputs = ["angle"]
inputs = ["volts"]
[units]
volts = "V"
"""


def upright(*arguments: object):
    return CliRunner().invoke(app, [*map(str, arguments)], terminal_width=200)


@pytest.fixture(scope="module")
def designed(tmp_path_factory) -> Path:
    """Folder of a design for plain matrices, by an observer."""
    folder = tmp_path_factory.mktemp("design")
    (folder / "model.toml").write_text(MODEL)
    asked = ("--poles", "-4+-2j", "--period", "5 ms", "--limit", 10, "--speed", "observer", "-o", folder)
    assert upright("design", "--matrices", folder / "model.toml", *asked).exit_code == 0
    return folder


@pytest.mark.parametrize("form", ["c", "arduino", "python", "matlab", "simulink"])
def test_every_form_says_what_to_do_next(form, designed, tmp_path):
    outcome = upright("export", designed, "--to", form, "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    assert "What next" in outcome.stdout
    assert "bit for bit" in outcome.stdout
    assert any(tmp_path.rglob("law*"))


def test_a_design_goes_from_python_to_python(tmp_path):
    study = tmp_path / "rig.toml"
    study.write_text(STUDY, encoding="utf-8")
    gains = up.design(study, poles="-4.1484+-1.6341j, -16.8545, -3.222", limit=0.6, track="psi")
    done = up.export(gains, to="python", out=tmp_path)
    ran = subprocess.run([sys.executable, "-I", *done.value], capture_output=True, text=True, check=False)
    assert ran.stdout.strip() == "law: every sample is the expected one"


def test_single_precision_says_what_it_costs(designed, tmp_path):
    outcome = upright("export", designed, "--to", "c", "--float", "-o", tmp_path)
    assert "in single precision" in outcome.stdout
    assert "typedef float law_real" in (tmp_path / "law.h").read_text()
    assert upright("export", designed, "--to", "python", "--float", "-o", tmp_path).exit_code == 2


def test_a_command_without_a_limit_is_warned_of(tmp_path):
    (tmp_path / "model.toml").write_text(MODEL)
    asked = ("--matrices", tmp_path / "model.toml", "--poles", "-4+-2j", "--period", "5 ms", "-o", tmp_path)
    upright("design", *asked)
    assert (
        "Warning: The command's limit is not specified"
        in upright("export", tmp_path, "--to", "c", "-o", tmp_path).stdout
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"margins": None, "verdict": "The sampled loop falls."}, "The sampled loop falls."),
        ({"readings": ...}, "lacks readings"),
        ({"law": {"A": "x"}}, "lacks the law's kind"),
        ({"law": {"kind": "linear", "A": "x"}}, "the values are no law's"),
        ({"law": ...}, "is not a design.json"),
    ],
)
def test_what_is_no_law_to_be_run_is_refused(change, words, designed, tmp_path):
    content = json.loads((designed / "design.json").read_text())
    changed = {k: v for k, v in (content | change).items() if v is not ...}
    path = tmp_path / "design.json"
    path.write_text(json.dumps(changed))
    outcome = upright("export", path, "--to", "c", "-o", tmp_path)
    assert outcome.exit_code == 2
    assert words in outcome.stderr
    assert not (tmp_path / "law.c").exists()


def test_a_fit_is_told_from_a_design(tmp_path):
    path = tmp_path / "fit.json"
    path.write_text('{"plant": "furuta", "parameters": {}}')
    assert "exported to gymnasium, mjcf or fmu" in upright("export", path, "--to", "c").stderr


def test_what_design_prints_as_json_is_taken_too(designed, tmp_path):
    asked = ("--poles", "-4+-2j", "--period", "5 ms", "--limit", 10, "--speed", "observer", "--json", "-o", tmp_path)
    path = tmp_path / "gains.json"
    path.write_text(upright("design", "--matrices", designed / "model.toml", *asked).stdout)
    assert upright("export", path, "--to", "python", "-o", tmp_path).exit_code == 0
    upright("export", designed, "--to", "python", "-o", tmp_path / "other")
    assert (tmp_path / "law.py").read_text() == (tmp_path / "other" / "law.py").read_text()


def test_forms_and_files_that_do_not_exist_are_refused(designed, tmp_path):
    assert "did you mean 'arduino'" in upright("export", designed, "--to", "arduin").stderr
    assert "does not exist" in upright("export", tmp_path / "nothing.json", "--to", "c").stderr
