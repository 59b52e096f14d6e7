"""Is the swing-up that was simulated the program that is exported?"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import upright as up
from upright.errors import BadInput
from upright.experiments.swing_up_2b.chapter import chapter


@pytest.fixture(scope="module")
def swing(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Path]:
    folder = tmp_path_factory.mktemp("swing")
    return up.swing_up(rig="furuta", seed=0, seconds=8.0, out=folder), folder


def test_the_program_gives_the_commands_that_swung_the_twin_up(swing: tuple[Any, Path], tmp_path: Path) -> None:
    answer, folder = swing
    up.export(folder, to="python", out=tmp_path)  # swing_up.json by its folder
    space: dict[str, Any] = {"__name__": "law"}
    exec((tmp_path / "law.py").read_text(encoding="utf-8"), space)
    assert space["self_test"]() is None
    run, law = answer.value.ascent.trial, space["Law"]()
    readings = zip(run.record["psi"].tolist(), run.record["theta"].tolist(), strict=True)
    commands = [law.step(y)[0] for y in readings]
    # the twin's encoders show multiples of their steps, which are rounded once more in decimal files
    assert commands == pytest.approx(run.u.tolist(), abs=1e-9)
    assert max(map(abs, commands)) > 1.0
    assert space["PERIOD"] == run.rig.period


def test_limit_units_and_the_zero_of_encoders_are_in_the_program(swing: tuple[Any, Path], tmp_path: Path) -> None:
    answer, _ = swing
    written = up.export(answer, to="c", out=tmp_path)
    head = (tmp_path / "law.h").read_text(encoding="utf-8")
    assert f"limited to {answer.value.law.limit!r} either way" in head
    assert "psi [rad], theta [rad]" in head
    assert "u [V]" in head
    assert "zero them at rest, a pendulum hanging, before a run" in head
    assert written.numbers["limit"] == answer.value.law.limit


def test_a_swing_up_that_was_not_caught_is_no_program(swing: tuple[Any, Path], tmp_path: Path) -> None:
    content = json.loads((swing[1] / "swing_up.json").read_text(encoding="utf-8"))
    content["swing_up"]["held"] = False
    file = tmp_path / "swing_up.json"
    file.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(BadInput, match="did not end upright"):
        up.export(file, to="c", out=tmp_path)
    del content["rule"]  # as older versions wrote it
    file.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(BadInput, match=r"not a swing_up\.json with a law; write it again with `upright swing-up"):
        up.export(file, to="c", out=tmp_path)


def test_a_pendulum_that_stands_by_a_busy_command_is_caught_and_not_sound(swing: tuple[Any, Path]) -> None:
    """Three tenths of the limit to either side from sample to sample: an rms of 0.3, where 0.1 is quiet."""
    run = swing[0].value
    assert run.sound
    trial, limit = run.ascent.trial, run.law.limit
    restless = trial.u + 0.3 * limit * (-1.0) ** np.arange(trial.u.size)
    busy = replace(run, ascent=replace(run.ascent, trial=replace(trial, u=restless)))
    assert busy.caught
    assert busy.rest.rms == pytest.approx(0.3, abs=0.02)
    assert not busy.sound
    assert "This effort is excessive" in chapter(busy).verdict
