"""Does another package add a command to `upright` without touching it, and does a broken one harm nobody else?"""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from upright.cli import app

MODULE = '''
from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from upright.verbs.command import command


def weigh(log: str | Path, *, masses: Mapping[str, float] | None = None, gravity: float = 9.81, fast: bool = True,
          out: str | Path | None = None) -> str:
    """Weigh what a log says.

    In newtons, with ``[kg]`` of each cart.

    Parameters
    ----------
    log : path
        Log of a scale.
    masses : mapping
        Mass by cart.
    gravity : float
        Where the scale stands [m/s^2].
    """
    import json

    return json.dumps([isinstance(log, Path), str(log), masses, gravity, fast, str(out)])


@command("Control", metavars={"gain": "K"}, names={"gain": "--gain -k"}, ranges={"gain": (0.0, None)},
         wrong=lambda said: said == "0.0", more="upright shaker shake -k 2")
def shake(*, gain: float = 1.0) -> str:
    """Shake a bench."""
    return str(gain)
'''


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A distribution on the path, as pip would install it."""
    about = tmp_path / "bench_tools-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: bench-tools\nVersion: 1.0\n", encoding="utf-8")
    (about / "entry_points.txt").write_text(
        "[upright.commands]\nweigh = bench_tools:weigh\nshaker shake = bench_tools:shake\n"
        "identify = bench_tools:weigh\nlost = no_such_module:verb\n",
        encoding="utf-8",
    )
    (tmp_path / "bench_tools.py").write_text(MODULE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    sys.modules.pop("bench_tools", None)


def run(*words: str):
    return CliRunner().invoke(app, [*words], terminal_width=200, env={"COLUMNS": "200"})


def test_a_function_of_another_package_is_a_command(package):
    done = run("weigh", "a.csv", "--masses", "one=0.5", "--masses", "two=1", "--gravity", "9.8", "--no-fast", "-o", "x")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout) == [True, "a.csv", {"one": "0.5", "two": "1"}, 9.8, False, "x"]


def test_its_help_is_its_docstring(package):
    told = " ".join(run("weigh", "--help").stdout.split())
    for words in ("Weigh what a log says.", "In newtons, with [kg] of each cart.", "Log of a scale.", "Mass by cart.",
                  "[m/s^2]. [default: 9.81]", "--no-fast"):  # fmt: skip
        assert words in told


def test_it_stands_in_the_listing_under_its_own_words(package):
    lines = [line.split() for line in run("--help").stdout.splitlines()]
    assert ["weigh", "Weigh", "what", "a", "log", "says."] in lines
    assert ["shaker", "shake", "Shake", "a", "bench."] in lines
    assert ["Other", "packages:"] in lines
    assert run("shaker", "--help").stdout.count("Shake a bench.") == 1


def test_a_command_of_two_words_declares_what_its_signature_cannot(package):
    assert (run("shaker", "shake", "-k", "2").stdout, run("shaker", "shake", "-k", "2").exit_code) == ("2.0\n", 0)
    assert run("shaker", "shake", "--gain", "0").exit_code == 3
    assert run("shaker", "shake", "--gain", "-1").exit_code == 2
    assert "upright shaker shake -k 2" in run("shaker", "shake", "--help").stdout


def test_no_package_takes_the_place_of_a_command(package):
    assert "Fit a rig's parameters" in run("identify", "--help").stdout


def test_a_package_that_cannot_be_imported_says_so_in_its_own_line(package):
    assert "upright lost cannot be imported from no_such_module:verb" in run("--help").stdout
    done = run("lost")
    assert done.exit_code == 2
    assert "cannot be imported from no_such_module:verb" in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_misspelt_command_may_be_meant_for_another_package(package):
    done = run("weihg")
    assert done.exit_code == 2
    assert "'weigh'" in done.stderr


def test_packages_without_commands_are_not_searched_by_importlib(tmp_path):
    """It takes as long to import as everything else of `upright --help`."""
    code = (
        "import sys; sys.argv = ['upright', '--help']\n"
        "from upright.cli import main\n"
        "try: main()\n"
        "except SystemExit: print('importlib.metadata' in sys.modules)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True)
    assert out.stdout.splitlines()[-1] == "False"
