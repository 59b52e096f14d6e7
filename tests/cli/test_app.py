"""What does the command line promise, whatever the command?"""

import subprocess
import sys

import pytest
from typer.testing import CliRunner

from upright import BadInput, __version__
from upright.cli import COMMANDS, app

HEAVY = ("numpy", "scipy", "sympy", "llvmlite", "matplotlib", "pandas", "pint", "control", "lmfit", "xarray")


@pytest.fixture
def show_that_raises(monkeypatch):
    """A command `show` whose reader raises what it is given, run; gives back exit code and stderr."""

    def run(error: BaseException):
        def read(*_, **__) -> None:
            raise error

        monkeypatch.setattr("upright.readers.read", read)
        outcome = CliRunner().invoke(app, ["show", "log.csv"])
        return outcome.exit_code, outcome.stderr

    return run


@pytest.mark.parametrize("line", ["--help", "--version"])
def test_help_and_version_load_no_numerical_library(line):
    code = (
        "import sys; sys.argv = ['upright', sys.argv[1]]\n"
        "from upright.cli import main\n"
        "try: main()\n"
        "except SystemExit as stop: assert not stop.code\n"
        f"print('loaded:', *[name for name in {HEAVY!r} if name in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code, line], capture_output=True, encoding="utf-8", check=True)
    assert out.stdout.splitlines()[-1].strip() == "loaded:"


def test_help_lists_every_command_with_its_line():
    listing = CliRunner().invoke(app, ["--help"], terminal_width=200).stdout
    for name, line in COMMANDS.items():
        assert name in listing
        assert line.split(":")[0][:20] in listing


@pytest.mark.parametrize("words", [[], ["log"]])
def test_without_a_command_the_commands_are_listed(words):
    outcome = CliRunner().invoke(app, words)
    assert outcome.exit_code == 2
    assert outcome.stderr == CliRunner().invoke(app, [*words, "--help"]).stdout
    assert "log replay" in outcome.stderr


def test_version_is_the_package_version():
    assert CliRunner().invoke(app, ["--version"]).stdout.strip() == f"upright {__version__}"


def test_a_misspelt_command_is_answered_with_the_nearest_name():
    outcome = CliRunner().invoke(app, ["idenitfy"])
    assert outcome.exit_code == 2
    assert "'identify'" in outcome.stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_explains_itself(name):
    outcome = CliRunner().invoke(app, [name, "--help"])
    assert outcome.exit_code == 0, outcome.output
    assert "Usage" in outcome.stdout


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (BadInput("line 3, column 2: a number was needed,\ngot 'x'."), 2, "got 'x'"),
        (FileNotFoundError(2, "No such file", "gone.csv"), 2, "'gone.csv' was not found"),
        (PermissionError(13, "denied", "secret.csv"), 2, "'secret.csv' may not be read"),
        (IsADirectoryError(21, "is a directory", "folder"), 2, "'folder' is a folder"),
        (OSError(28, "No space left on device", "big.html"), 2, "No space left"),
        (MemoryError(), 2, "not enough memory"),
        (KeyboardInterrupt(), 130, "stopped by Ctrl-C"),
        (ZeroDivisionError("division by zero"), 1, "bug in upright"),
    ],
)
def test_what_goes_wrong_is_one_sentence_and_an_exit_code(show_that_raises, error, code, says):
    exit_code, stderr = show_that_raises(error)
    assert exit_code == code
    assert says in stderr
    assert stderr.count("\n") == 1
    assert "Traceback" not in stderr


def test_upright_debug_shows_where_it_happened(show_that_raises, monkeypatch):
    monkeypatch.setenv("UPRIGHT_DEBUG", "1")

    def read(*_, **__) -> None:
        raise BadInput("needed a log")

    monkeypatch.setattr("upright.readers.read", read)
    assert isinstance(CliRunner().invoke(app, ["show", "log.csv"]).exception, BadInput)


def test_python_minus_m_upright_is_the_same_program():
    out = subprocess.run(
        [sys.executable, "-m", "upright", "--version"], capture_output=True, encoding="utf-8", check=True
    )
    assert out.stdout.strip() == f"upright {__version__}"
