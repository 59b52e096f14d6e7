"""Are many logs shown one after the other, each with a picture of its own, and what comes next said once?"""

from __future__ import annotations

import io
import json

import pytest
from typer.testing import CliRunner

from tests.logs.runs import HEADER, row, written
from upright.cli import app
from upright.logs.layout import RunFile

LOG = "t,theta [rad]\n" + "".join(f"{0.01 * k:.2f},{(k % 7) / 10}\n" for k in range(50))


def upright(*words):
    return CliRunner().invoke(app, [*map(str, words)], terminal_width=200)


@pytest.fixture
def logs(tmp_path):
    made = []
    for name in ("a/my swing.csv", "b/my swing.csv", "c/my swing.csv"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(LOG, encoding="utf-8")
        made.append(path)
    return made


def test_logs_that_are_called_alike_have_pictures_that_are_not(logs, tmp_path):
    done = upright("show", *logs, "-o", tmp_path / "out")
    assert done.exit_code == 0
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "show-my_swing-2.svg", "show-my_swing-3.svg", "show-my_swing.svg",
    ]  # fmt: skip
    assert done.stdout.count("What next:") == 1
    assert done.stdout.index("What next:") > done.stdout.index("show-my_swing-3.svg")
    assert "upright init" in done.stdout.partition("What next:")[2]


def test_without_pictures_none_is_written_and_many_answers_are_one_list_in_json(logs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    done = upright("show", logs[0], logs[1], "--no-plot", "--json")
    told = json.loads(done.stdout)
    assert [piece["time"]["samples"] for piece in told] == [50, 50]
    assert [piece["figure"] for piece in told] == ["", ""]
    assert sorted(tmp_path.iterdir()) == before


def test_a_picture_of_a_run_is_drawn_where_it_has_two_rows_and_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.mcap").write_bytes(written(2))
    stream = io.BytesIO()
    one = RunFile(stream, HEADER)
    one.row(row(0))
    one.finish()
    (tmp_path / "one.mcap").write_bytes(stream.getvalue())
    assert upright("log", "show", "one.mcap", "--plot").exit_code == 0
    assert upright("log", "show", "two.mcap").exit_code == 0
    assert not list(tmp_path.glob("*.svg"))
    assert upright("log", "show", "two.mcap", "--plot").exit_code == 0
    assert [p.name for p in tmp_path.glob("*.svg")] == ["show-two.svg"]


def test_a_tail_tells_the_last_row_of_each_chunk_with_its_units_and_how_many_came(tmp_path):
    (tmp_path / "run.mcap").write_bytes(written(250))
    done = upright("log", "tail", tmp_path / "run.mcap")
    lines = [line for line in done.stdout.splitlines() if "rows)" in line]
    assert [line.rpartition("(")[2] for line in lines] == ["100 rows)", "200 rows)", "250 rows)"]
    t, _, _, _, psi, theta, u, applied, *_ = row(99)
    assert lines[0].startswith(f"{t:10.3f} s  psi {psi:.5g} rad  theta {theta:.5g} rad  u {u:.5g} V")
    assert f"u_applied {applied:.5g} V  HOST  (100 rows)" in lines[0]
    assert "     0.250 s  stop: asked" in done.stdout


def test_what_was_converted_is_told_with_its_columns(tmp_path):
    (tmp_path / "run.mcap").write_bytes(written(20))
    done = upright("log", "convert", tmp_path / "run.mcap", "-o", tmp_path / "run.csv", "--json")
    told = json.loads(done.stdout)
    assert (told["rows"], told["columns"][:3]) == (20, ["t", "tick", "psi_counts"])
    assert "20 rows of 10 columns." in upright("log", "convert", tmp_path / "run.mcap", "-o", tmp_path / "x.csv").stdout
    assert upright("log", "convert", tmp_path / "run.mcap", "-o", tmp_path / "run.xlsx").exit_code == 2
