"""Does `upright show` say what a log holds, draw it, and refuse damage in one sentence?"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.readers import logs
from upright.cli import app


def show(*arguments: object):
    return CliRunner().invoke(app, ["show", *map(str, arguments)], terminal_width=200)


def test_it_names_columns_rate_and_lies_and_draws_them(tmp_path: Path) -> None:
    log = tmp_path / "front end.txt"
    log.write_bytes(logs.tab_export(400))
    outcome = show(log, "--out", tmp_path / "figures")
    assert outcome.exit_code == 0, outcome.stderr
    told = " ".join(outcome.stdout.split())
    assert "period 1.12" in told
    assert "rebuilt from stamps rounded to 1 ms" in told
    assert "the sample index" in told
    assert "upright init" in told
    picture = (tmp_path / "figures" / "show-front_end.svg").read_text(encoding="utf-8")
    assert "Encoder 1 Pos" in picture
    assert "time [s]" in picture


def test_json_can_be_read_by_a_program(tmp_path: Path) -> None:
    log = tmp_path / "bag.csv"
    log.write_bytes(logs.ros_bag())
    outcome = show(log, log, "--json", "--no-plot")
    first, second = json.loads(outcome.stdout)
    assert first == second
    assert first["time"]["samples"] == 60
    assert {c["name"] for c in first["columns"]} >= {"/effort_control/data.0", "/joint_states/joint1/position"}
    assert list(tmp_path.iterdir()) == [log]


@pytest.mark.parametrize("name", logs.SYNTHETIC)
def test_every_format_is_shown(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(logs.SYNTHETIC[name]())
    assert show(tmp_path / name, "--out", tmp_path).exit_code == 0


def test_damage_is_one_sentence_and_exit_code_2(tmp_path: Path) -> None:
    log = tmp_path / "damaged.csv"
    log.write_bytes(logs.named_csv().replace(b"-1.0", b"minus one", 1))
    outcome = show(log)
    assert outcome.exit_code == 2
    assert "line 2, column 3 (plant_input)" in " ".join(outcome.stderr.split())
    assert "Traceback" not in outcome.stderr


def test_two_logs_of_one_name_get_two_figures(tmp_path: Path) -> None:
    for folder in ("monday", "tuesday"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "run.csv").write_bytes(logs.named_csv())
    show(tmp_path / "monday/run.csv", tmp_path / "tuesday/run.csv", "--out", tmp_path)
    assert {p.name for p in tmp_path.glob("*.svg")} == {"show-run.svg", "show-run-2.svg"}


@pytest.mark.real_data
@pytest.mark.parametrize(
    "name",
    [
        "flexible_robot_freqresp/step1.txt",  # a column called $\theta$
        "ecp210_rectilinear_ucsd_1khz/07-Feb-2025 09_20_49.txt",
        "furuta_diy_odrive/hardware_step_response_01.csv",  # thirty columns
    ],
)
def test_public_logs_are_drawn(name: str, tmp_path: Path) -> None:
    outcome = show(logs.real(name), "--out", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    assert len(list(tmp_path.glob("*.svg"))) == 1
