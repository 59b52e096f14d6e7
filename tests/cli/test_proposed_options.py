"""Does what the tool proposes exist? Every option that a sentence of the source names, and what a run proposes."""

from __future__ import annotations

import ast
import json
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

import upright
from tests.rigs.test_twin import LAW
from upright.cli import COMMANDS, NESTED, app
from upright.laws import as_values
from upright.rig.makes import make_rig

SOURCE = Path(upright.__file__).parent
RUNNER = CliRunner()
OPTION = re.compile(r"(?<![\w-])(?<!var\()--[a-z][a-z-]*")
PROPOSED = re.compile(rf"upright ({'|'.join([*(f'{a} {b}' for a, bs in NESTED.items() for b in bs), *COMMANDS])})\b")
OTHERS = {
    "--upload", "--path", "--eval", "--mjcf", "--show-plot", "--start-values", "--always", "--dirty", "--error-unmatch",
    "--nthreads", "--prefix",
}  # fmt: skip
"""Options of arduino-cli, Octave, MuJoCo, FMPy, git, Dask and npm."""
SHOWN_BY = {
    "rigs/firmware": "firmware flash",
    "rigs": "run", "realtime": "run", "running/run.py": "run", "running/rig.py": "run",
    "designing": "design", "experiments/regulation_2": "regulate", "experiments/swing_up_2b": "swing-up",
    "experiments/tracking_3": "track", "experiments/frequency_1b": "frequency", "study/draft": "init",
    "closed_loop": "law", "diagnosis": "doctor", "questionnaire": "survey", "identification/ladder": "ladder",
}  # fmt: skip
"""Rooms whose sentences one command shows: an option without a command in front of it is that command's."""


def options(command: str) -> set[str]:
    """What a command takes, `rig doctor` among them."""
    words = command.split()
    here = typer.main.get_command(app)
    for word in words:
        here = here.resolve_command(here.make_context("upright", [word]), [word])[1]
    return {name for p in here.params for name in (*p.opts, *p.secondary_opts)} | {"--help"}


OPTIONS = {name: options(name) for name in [*COMMANDS, *(f"{a} {b}" for a, bs in NESTED.items() for b in bs)]}
ALL = set().union(*OPTIONS.values()) | {"--version", "--no-code", "--allow-code"}


def sentences(path: Path) -> Iterator[tuple[int, str]]:
    """Line and text of every string of a file but docstrings, what an f-string fills in as {}."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    skipped = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            skipped.add(node.value)
        if isinstance(node, ast.JoinedStr):
            skipped |= set(node.values)
            yield node.lineno, "".join(p.value if isinstance(p, ast.Constant) else "{}" for p in node.values)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in skipped:
            yield node.lineno, node.value


def wrong(text: str, here: set[str]) -> list[str]:
    """Options named in a text that the command named before them lacks; `here` are those of a text that names none."""
    found = []
    pieces = PROPOSED.split(text)
    for command, piece in zip([None, *pieces[1::2]], pieces[::2], strict=True):
        valid = here if command is None else OPTIONS[command]
        # behind a command, its line ends where the sentence goes on
        line, rest = (piece, "") if command is None else re.match(r"([^;,)\n]*)(.*)", piece, re.S).groups()
        found += [f"{command or 'the command'} {o}" for o in OPTION.findall(line) if o not in valid | OTHERS]
        found += [o for o in OPTION.findall(rest) if o not in here | valid | OTHERS]
    return found


def test_every_option_that_a_sentence_names_exists():
    found: dict[str, list[str]] = {}
    for path in sorted(SOURCE.rglob("*.py")):
        name = path.relative_to(SOURCE).as_posix()
        command = next((c for room, c in SHOWN_BY.items() if name.startswith(room)), None)
        here = ALL if command is None else OPTIONS[command]
        found |= {f"{name}:{line}": bad for line, text in sentences(path) if (bad := wrong(text, here))}
    assert found == {}


def test_an_option_of_another_command_is_seen():
    assert wrong("design for that: --period 1 ms", OPTIONS["run"]) == ["the command --period"]
    assert wrong("design for that: upright design FIT --period 1 ms", OPTIONS["run"]) == []
    assert wrong("try upright run --rig RIG.toml --limit 5", ALL) == ["run --limit"]
    assert wrong("clear it (upright rig doctor --clear).", OPTIONS["run"]) == []


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """A twin of 0.884 ms with a law for it and one of 2 ms, and a fit that says nothing of drive and encoders."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\n', encoding="utf-8")
    (tmp_path / "BARE.toml").write_text('kind = "twin"\nfit = "fit.json"\n', encoding="utf-8")
    numbers = make_rig("linear").plant.parameters() | {"actuator.gain": 4.0}
    entries = {n: {"value": v, "stderr": 0.0, "unit": "", "status": "known"} for n, v in numbers.items()}
    fit = {"format": 1, "plant": "cart-pendulum", "verdict": "", "trusted": True, "parameters": entries,
           "estimated": [], "correlation": [], "rig": {"name": "bench 3"}}  # fmt: skip
    (tmp_path / "fit.json").write_text(json.dumps(fit), encoding="utf-8")
    law = as_values(LAW)
    (tmp_path / "design.json").write_text(json.dumps({"law": law}), encoding="utf-8")
    (tmp_path / "slow.json").write_text(json.dumps({"law": law | {"period": 2e-3}}), encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--rig RIG.toml --law slow.json", "--period"),
        ("--rig RIG.toml --law slow.json --mode mcu", "--period"),
        ("--rig RIG.toml --law design.json --reference 'step 0.1'", "--track"),
        ("--rig RIG.toml", "--law"),
        ("--rig BARE.toml --law design.json", "vendor"),
    ],
)
@pytest.mark.usefixtures("bench")
def test_a_run_that_is_refused_proposes_only_what_can_be_typed(words, said):
    done = RUNNER.invoke(app, ["run", *shlex.split(words), "--duration", "0.1", "--no-check"])
    assert done.exit_code == 2, done.output
    shown = " ".join(done.stderr.split())
    assert said in shown
    assert wrong(shown, OPTIONS["run"]) == []
