"""Does `upright law` say which law closed a loop, in words, numbers, a picture and the line that a study takes?"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
from typer.testing import CliRunner

from tests.closed_loop.programs import Pid, closed_loop
from upright.cli import app


def law(*arguments: object):
    return CliRunner().invoke(app, ["law", *map(str, arguments)], terminal_width=200)


def written(folder: Path, **changes: np.ndarray) -> Path:
    record = closed_loop(Pid(kp=4.0, ki=3.0, kd=0.2, second=0.8, on="measurement"), rows=2000, step=0.01)
    table = {"t": record.t, **record.signals, **changes}
    log = folder / "run 1.csv"
    np.savetxt(log, np.column_stack(list(table.values())), "%.9g", ",", header=",".join(table), comments="")
    return log


def test_a_law_is_told_drawn_and_handed_on(tmp_path: Path) -> None:
    log = written(tmp_path)
    outcome = law(log, "--command", "u", "--measured", "y", "--reference", "r", "-o", tmp_path / "out")
    assert outcome.exit_code == 0, outcome.stderr
    told = " ".join(outcome.stdout.split())
    assert "PID; two-tap difference of the measurement" in told
    assert "exact but for the rounding" in told
    assert "What next" in told
    picture = (tmp_path / "out" / "law-run_1.svg").read_text(encoding="utf-8")
    assert "recorded" in picture
    assert "time [s]" in picture
    found = json.loads((tmp_path / "out" / "law-run_1.json").read_text(encoding="utf-8"))
    assert found["gains"]["kp"]["low"] <= 4.0 <= found["gains"]["kp"]["high"]
    lines = [line.strip() for line in outcome.stdout.splitlines() if line.strip().startswith("loop = ")]
    recovering, numbers = (tomllib.loads(line)["loop"] for line in lines)
    assert recovering["kind"] == "recover"
    assert numbers["units"] == "log"
    assert numbers["ki"] == round(found["gains"]["ki"]["value"], 5)


def test_without_columns_the_log_is_described(tmp_path: Path) -> None:
    outcome = law(written(tmp_path))
    assert outcome.exit_code == 2
    assert "holds the columns y, r, u" in " ".join(outcome.stderr.split())


def test_a_command_that_nothing_explains_is_said_to_be_none(tmp_path: Path) -> None:
    noise = np.random.default_rng(4).normal(size=2000)
    outcome = law(written(tmp_path, u=noise), "--command", "u", "--measured", "y", "--reference", "r", "-o", tmp_path)
    told = " ".join((outcome.stdout + outcome.stderr).split())
    assert "no linear law" in told or "does not depend" in told
    assert "Traceback" not in told
