"""Do the commands that the tool proposes run as printed? A shell splits them the way the person's shell would."""

import shlex
import subprocess
import sys

import pytest

from upright.report.symbols import typed


@pytest.mark.parametrize(
    "name",
    ["swing.toml", "my runs/swing 1.toml", "a$b.toml", 'q"uote.toml', "it's.toml", "über.toml", "a&b(1).toml", ""],
)
def test_a_path_is_one_word_of_a_command_line(name):
    assert shlex.split(f"upright show {typed(name)}") == ["upright", "show", name]


def test_plain_paths_wear_no_quotes():
    assert typed("../logs/run-01_a.csv") == "../logs/run-01_a.csv"


@pytest.mark.slow
def test_the_command_that_init_proposes_is_found_by_a_shell(tmp_path):
    folder = tmp_path / "two words"
    folder.mkdir()
    rows = "\n".join(f"{0.01 * k:.2f},{0.2 * 0.99 ** (k // 10) * (-1) ** (k // 50):.4f}" for k in range(1000))
    (folder / "log a.csv").write_text("t,theta\n" + rows, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "upright", "init", "two words/log a.csv", "-o", "two words/study b.toml"],
        cwd=tmp_path, capture_output=True, encoding="utf-8", check=True,
    )  # fmt: skip
    proposed = shlex.split(next(line for line in done.stdout.splitlines() if "upright identify" in line))
    assert (tmp_path / proposed[2]).is_file()
    assert proposed[3:] == ["-o", "two words/study b-fit"]
