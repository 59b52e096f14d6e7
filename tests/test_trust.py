"""Is code that came with somebody's study announced before it runs for the first time, and refused where asked?"""

import io
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from upright.cli import app
from upright.diagnosis.case import read_known
from upright.errors import BadInput
from upright.study.load import load_study
from upright.study.stored_rig import read_stored_rig
from upright.trust import allow_code, no_code

PLANT = """
from pathlib import Path
Path(__file__).with_name("ran").write_text("yes")
from upright.physics import Coordinate, Plant
from upright.quantities import quantity

class Mine(Plant):
    m: float = quantity("kg", "mass", above=0)
    coordinates = (Coordinate("x", "m", "position"),)

    @staticmethod
    def energies(p, q, v):
        return p.m * v[0] ** 2 / 2, 0, 0
"""
STUDY = """\
[rig]
plant = "mine.py:Mine"
[parameters]
m = { guess = "1 kg" }
[sensors.x]
unit = "m"
[[runs]]
file = "log.csv"
"""


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """A study with a plant of its own, a fit of it, and a user who has met nothing yet."""
    monkeypatch.setenv("UPRIGHT_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("UPRIGHT_NO_CODE", raising=False)
    monkeypatch.setattr("upright.trust._SINCE_START", set())
    here = tmp_path / "elsewhere"
    here.mkdir()
    t = np.arange(100) * 0.01
    np.savetxt(here / "log.csv", np.column_stack([t, t]), "%.6g", ",", header="t,x", comments="")
    (here / "mine.py").write_text(PLANT, encoding="utf-8")
    (here / "study.toml").write_text(STUDY, encoding="utf-8")
    fit = {"format": 1, "plant": "mine.py:Mine", "verdict": "", "parameters": {"m": 1.0}}
    (here / "fit.json").write_text(json.dumps(fit), encoding="utf-8")
    return here


def met_before(monkeypatch):
    """The next process: nothing is known but what was written down."""
    monkeypatch.setattr("upright.trust._SINCE_START", set())


def test_code_is_announced_once_for_its_content_wherever_it_lies(elsewhere, capsys, monkeypatch):
    load_study(elsewhere / "study.toml")
    said = capsys.readouterr().err
    assert "study.toml runs the Python code of" in said
    assert said.count("\n") == 1
    met_before(monkeypatch)
    load_study(elsewhere / "study.toml")
    (elsewhere.parent / "mine.py").write_text(PLANT, encoding="utf-8")
    (elsewhere.parent / "log.csv").write_bytes((elsewhere / "log.csv").read_bytes())
    (elsewhere.parent / "study.toml").write_text(STUDY, encoding="utf-8")
    load_study(elsewhere.parent / "study.toml")
    assert capsys.readouterr().err == ""
    other = elsewhere.parent / "other"
    other.mkdir()
    for name in ("log.csv", "study.toml"):
        (other / name).write_bytes((elsewhere / name).read_bytes())
    (other / "mine.py").write_text(PLANT + "\n# of somebody else\n", encoding="utf-8")
    load_study(other / "study.toml")
    assert "was not met here before" in capsys.readouterr().err


def test_code_that_changed_at_a_known_path_is_announced_as_changed(elsewhere, capsys, monkeypatch):
    load_study(elsewhere / "study.toml")
    capsys.readouterr()
    for version in ("# first of somebody else", "# second of somebody else"):
        met_before(monkeypatch)
        (elsewhere / "mine.py").write_text(f"{PLANT}\n{version}\n", encoding="utf-8")
        load_study(elsewhere / "study.toml")
        said = capsys.readouterr().err
        assert "mine.py, which has changed since it was met here" in said
        assert said.count("\n") == 1
        load_study(elsewhere / "study.toml")
        met_before(monkeypatch)
        load_study(elsewhere / "study.toml")
        assert capsys.readouterr().err == ""


def test_where_nothing_can_be_remembered_it_is_said_again(elsewhere, capsys, monkeypatch):
    (elsewhere / "file").write_text("")
    monkeypatch.setenv("UPRIGHT_CACHE", str(elsewhere / "file"))
    for _ in range(2):
        met_before(monkeypatch)
        load_study(elsewhere / "study.toml")
        assert "was not met here before" in capsys.readouterr().err


READERS = {
    "study": lambda here: load_study(here / "study.toml"),
    "fit": lambda here: read_stored_rig(here / "fit.json"),
    "folder of a fit": lambda here: read_known(str(here)),
    "rig of the doctor": lambda here: read_known(str(here / "study.toml"), "log.csv"),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("way", ["context", "environment"])
def test_refused_code_does_not_run(elsewhere, monkeypatch, capsys, reader, way):
    if way == "environment":
        monkeypatch.setenv("UPRIGHT_NO_CODE", "1")
    with no_code(way == "context"), pytest.raises(BadInput, match=r"--no-code .* refuses that"):
        READERS[reader](elsewhere)
    assert not (elsewhere / "ran").exists()
    monkeypatch.delenv("UPRIGHT_NO_CODE", raising=False)
    READERS[reader](elsewhere)
    assert (elsewhere / "ran").exists()
    assert "runs the Python code of" in capsys.readouterr().err


@pytest.mark.parametrize(
    "line",
    [
        "--no-code identify study.toml",
        "identify study.toml --no-code",
        "design fit.json --poles=-1,-2 --no-code",
        "doctor log.csv --no-code --rig fit.json",
    ],
)
def test_the_command_line_refuses_code_wherever_the_option_stands(elsewhere, monkeypatch, line):
    monkeypatch.chdir(elsewhere)
    done = CliRunner().invoke(app, line.split())
    assert done.exit_code == 2
    assert "would run the Python code of mine.py, and --no-code" in done.stderr
    assert not (elsewhere / "ran").exists()


def test_a_shipped_plant_is_no_code(elsewhere):
    with no_code(), pytest.raises(BadInput, match="needs m_p"):
        load_study(elsewhere / "study.toml", text=STUDY.replace("mine.py:Mine", "pendulum").replace("m = ", "l_cg = "))


class Terminal(io.StringIO):
    """A person at a terminal."""

    def isatty(self):
        return True


@pytest.mark.parametrize("reader", READERS)
def test_code_runs_nowhere_unasked_where_nobody_can_answer(elsewhere, monkeypatch, reader):
    monkeypatch.delenv("UPRIGHT_ALLOW_CODE")
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))  # a pipe is nobody
    with pytest.raises(BadInput, match=r"mine\.py, which was not met here before, and nobody agreed to that.*--allow-"):
        READERS[reader](elsewhere)
    assert not (elsewhere / "ran").exists()
    with allow_code():
        READERS[reader](elsewhere)
    assert (elsewhere / "ran").exists()
    met_before(monkeypatch)
    READERS[reader](elsewhere)  # what was agreed to is remembered by its hash
    met_before(monkeypatch)
    (elsewhere / "mine.py").write_text(PLANT + "\n# of somebody else\n", encoding="utf-8")
    with pytest.raises(BadInput, match="which has changed since it was met here, and nobody agreed"):
        READERS[reader](elsewhere)


@pytest.mark.parametrize(
    ("answer", "runs"), [("y\n", True), ("yes\n", True), ("n\n", False), ("\n", False), ("", False)]
)
def test_a_person_at_a_terminal_is_asked_once(elsewhere, monkeypatch, answer, runs):
    monkeypatch.delenv("UPRIGHT_ALLOW_CODE")
    monkeypatch.setattr("sys.stdin", Terminal(answer))
    monkeypatch.setattr("sys.stderr", asked := Terminal())
    if runs:
        load_study(elsewhere / "study.toml")
        load_study(elsewhere / "study.toml")
    else:
        with pytest.raises(BadInput, match="nobody agreed"):
            load_study(elsewhere / "study.toml")
    assert (elsewhere / "ran").exists() == runs
    assert asked.getvalue().count("Run it? [y/N]") == 1


@pytest.mark.parametrize("words", ["--allow-code identify study.toml", "identify study.toml --allow-code"])
def test_the_command_line_allows_code_wherever_the_option_stands(elsewhere, monkeypatch, words):
    monkeypatch.delenv("UPRIGHT_ALLOW_CODE")
    monkeypatch.chdir(elsewhere)
    refused = CliRunner().invoke(app, [w for w in words.split() if w != "--allow-code"])
    assert "nobody agreed to that" in refused.stderr
    assert not (elsewhere / "ran").exists()
    CliRunner().invoke(app, words.split())
    assert (elsewhere / "ran").exists()
