"""Does `upright log` show, follow, mend, convert and replay the log of a run, in words and exit codes?"""

from __future__ import annotations

import inspect
import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import upright as up
from tests.logs.runs import row, written
from tests.logs.test_replay import run
from upright.cli import NESTED, app
from upright.records import Record

CLI_ONLY = {"as_json", "help", "plot"}  # in Python an answer is asked to .plot()


def log(*arguments: object):
    outcome = CliRunner().invoke(app, ["log", *map(str, arguments)], terminal_width=200)
    return outcome.exit_code, " ".join(outcome.stdout.split()), " ".join(outcome.stderr.split())


@pytest.fixture
def torn(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(written(400, finish=False)[:-3000])
    return path


def test_show_says_what_ran_and_what_is_missing(torn, tmp_path):
    code, told, _ = log("show", torn, "--plot", "-o", tmp_path)
    assert code == 0
    for words in ("300 whole rows", "Its writer was stopped", "every 1 ms", "HOST", 'name = "twin"', "upright 0.1.0"):
        assert words in told
    assert "u_applied" in (tmp_path / "show-run.svg").read_text(encoding="utf-8")
    numbers = json.loads(log("show", torn, "--json")[1])
    assert (numbers["rows"], numbers["columns"]["theta"]) == (300, "rad")


def test_recover_says_how_much_was_kept_and_lost(torn, tmp_path):
    code, told, _ = log("recover", torn, "-o", tmp_path / "whole.mcap")
    assert code == 0
    assert "300 rows and 0 events kept" in told
    assert "bytes behind them (about" in told
    assert "The log is whole: 300 rows" in log("show", tmp_path / "whole.mcap")[1]
    assert log("recover", torn, "-o", torn)[0] == 2


@pytest.mark.parametrize(
    ("ending", "read"), [("csv", Record.from_csv), ("parquet", Record.from_parquet), ("mat", Record.from_mat)]
)
def test_convert_keeps_every_number(torn, tmp_path, ending, read):
    pytest.importorskip("pyarrow") if ending == "parquet" else None
    out = tmp_path / f"run.{ending}"
    code, told, _ = log("convert", torn, "-o", out)
    assert (code, "300 rows of 10 columns" in told) == (0, True)
    record = read(out)
    np.testing.assert_array_equal(record["theta"], [row(k)[5] for k in range(300)])
    assert record.units["theta"] == "rad"
    assert "Its writer was stopped" in " ".join(record.provenance.notes)


def test_convert_knows_three_formats(torn, tmp_path):
    code, _, told = log("convert", torn, "-o", tmp_path / "run.xls")
    assert code == 2
    assert ".csv, .parquet, .mat" in told


def test_tail_prints_a_line_for_each_chunk_and_the_events(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(written(300))
    code, told, _ = log("tail", path)
    assert code == 0
    assert told.count("rows)") == 3
    assert f"u_applied {row(299)[7]:.5g} V HOST (300 rows)" in told
    assert "stop: asked" in told
    assert log("tail", tmp_path / "gone.mcap")[0] == 2


def test_replay_answers_by_its_exit_code(tmp_path):
    from upright.logs.layout import RunFile

    path = tmp_path / "run.mcap"

    def write(found):
        with open(path, "wb") as stream:
            file = RunFile(stream, found.header)
            for k in range(len(found)):
                file.row(found.row(k))
            file.finish()

    write(run())
    code, told, _ = log("replay", path)
    assert (code, "All 400 commands are bit-identical" in told) == (0, True)
    write(run(change=lambda k, u: u + 0.125 if k == 7 else u))
    code, told, _ = log("replay", path)
    assert code == 3
    assert "1 of 400 commands differ, the first in row 8 at 5.007 s" in told
    assert json.loads(log("replay", path, "--json")[1])["first"]["row"] == 8


@pytest.mark.parametrize(("first", "name"), [(first, name) for first, names in NESTED.items() for name in names])
def test_every_command_of_two_words_explains_itself_and_has_its_verb(first, name):
    outcome = CliRunner().invoke(app, [first, name, "--help"])
    assert outcome.exit_code == 0, outcome.output
    assert NESTED[first][name].split(":")[0][:20] in " ".join(outcome.stdout.split())
    group = typer.main.get_command(app)
    nested = group.resolve_command(group.make_context("upright", [first]), [first])[1]
    command = nested.resolve_command(nested.make_context(first, [name]), [name])[1]
    verb = getattr(up, f"{first}_{name}".replace("-", "_"))
    options = {p.name for p in command.params if p.param_type_name == "option"}
    assert options - CLI_ONLY <= set(inspect.signature(verb).parameters)
    assert "Parameters\n" in verb.__doc__


def test_a_misspelt_second_word_is_answered_with_the_nearest():
    code, _, told = log("shwo")
    assert code == 2
    assert "show" in told


@pytest.mark.parametrize("name", ["show", "recover", "convert", "replay", "tail"])
def test_what_is_no_log_gets_one_sentence(tmp_path, name):
    path = tmp_path / "x.csv"
    path.write_text("t,x\n0,1\n", encoding="utf-8")
    code, _, told = log(name, path)
    assert code == 2
    assert told.startswith("upright: ")
