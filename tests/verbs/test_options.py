"""Can whoever knows an option of the command line call the function, and the other way round?"""

from __future__ import annotations

from inspect import signature

import pytest
import typer
from typer.testing import CliRunner

import upright as up
from upright.cli import COMMANDS, app

CLI_ONLY = {"as_json", "keys", "strict", "help"}


def command(name: str):
    """The command itself, as it answers once it is called."""
    group = typer.main.get_command(app)
    return group.resolve_command(group.make_context("upright", [name]), [name])[1]


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_option_of_a_command_is_one_of_its_verb(name):
    asked = getattr(up, name.replace("-", "_"))
    options = {p.name for p in command(name).params if p.param_type_name == "option"}
    assert options - CLI_ONLY <= set(signature(asked).parameters)
    assert "Parameters\n" in (asked.__doc__ or "")


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_argument_and_option_of_a_command_is_explained(name):
    assert [p.name for p in command(name).params if not p.help] == []


@pytest.mark.parametrize(
    ("typed", "offered"), [("upright swi", {"swing-up"}), ("upright doctor --r", {"--rig", "--reader"})]
)
def test_the_shell_completes_commands_and_their_options(typed, offered):
    asked = {"_UPRIGHT_COMPLETE": "complete_bash", "COMP_WORDS": typed, "COMP_CWORD": str(len(typed.split()) - 1)}
    assert set(CliRunner().invoke(app, [], env=asked, prog_name="upright").stdout.split()) == offered


def test_completion_can_be_installed():
    listing = CliRunner().invoke(app, ["--help"], terminal_width=200).stdout
    assert "--install-completion" in listing
    assert "--show-completion" in listing
