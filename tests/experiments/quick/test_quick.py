"""A minute at a rig: it comes upright without hands, or no loop is closed and the cause is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import upright as up
from upright.errors import BadInput
from upright.experiments.quick.chapter import chapter
from upright.experiments.quick.run import run_quick
from upright.experiments.stand.live import live_stand
from upright.logs import read_log
from upright.report.page import Table


def described(folder, make="furuta", **faults):
    """RIG.toml of a twin with faults in its wiring."""
    board = "".join(f"{name} = {factor}\n" for name, factor in faults.items())
    board = f"[board]\n{board}" if faults else ""
    (folder / "RIG.toml").write_text(f'kind = "twin"\nmake = "{make}"\nseed = 3\n{board}', encoding="utf-8")
    return folder / "RIG.toml"


def minute(folder, make="furuta", **faults):
    """Numbers of a minute at it."""
    answer = up.lab(rig=str(described(folder, make, **faults)), quick=True, out=folder / "out")
    return answer.numbers["experiments"]["quick"]["numbers"]


@pytest.mark.slow
@pytest.mark.parametrize("make", ["furuta", "linear"])
def test_a_twin_comes_upright_within_a_minute_of_its_own_time_and_nobody_is_asked(tmp_path, make):
    told = minute(tmp_path, make)
    assert told["upright"]
    assert told["seconds"] < 60
    log = read_log(tmp_path / "out" / "quick" / "swing_up.mcap")
    last = log.columns["t"] > log.columns["t"][-1] - 3.0
    turned = np.abs(log.columns["theta"][last]) % (2 * np.pi)
    assert np.abs(turned - np.pi).max() < np.radians(10)


@pytest.mark.slow
def test_the_page_of_a_minute_says_first_what_stops_it_and_gives_gains_in_the_units_of_command_and_state(tmp_path):
    result = run_quick(live_stand(described(tmp_path)), tmp_path / "out")
    gains = next(
        t for p in chapter(result).parts for t in p.content if isinstance(t, Table) and "feedback" in t.caption
    )
    assert [row[2] for row in gains.rows] == ["V/rad", "V/(rad/s)"] * 2
    stopped = chapter(replace(result, ended="the host went silent."))
    assert stopped.verdict.startswith("The swing-up was stopped after ")
    assert "the host went silent." in stopped.verdict
    assert not stopped.sound
    refused = chapter(replace(result, refused="no rig was caught", law=None, ascent=None))
    assert refused.verdict.startswith("No loop was closed: no rig was caught.")
    assert "Gains, swing-up and catch" not in [part.title for part in refused.parts]


@pytest.mark.slow
def test_half_a_supply_is_named_and_a_law_for_what_it_gives_stands(tmp_path):
    told = minute(tmp_path, drive=0.5)
    assert told["weak"].startswith("supply at half")
    assert told["upright"]


@pytest.mark.parametrize(
    ("faults", "cause"),
    [({"drive": -1}, "motor leads swapped"), ({"psi": -1}, "encoder channels of psi swapped"),
     ({"theta": 0.5}, "theta: counts per turn 8000, not 16000")],
)  # fmt: skip
@pytest.mark.slow
def test_a_rig_that_is_wired_otherwise_than_described_is_not_swung_up(tmp_path, faults, cause):
    result = run_quick(live_stand(described(tmp_path, **faults)), tmp_path / "out")
    assert result.refused == cause
    assert not (tmp_path / "out" / "swing_up.mcap").exists()


@pytest.mark.slow
def test_limits_within_which_no_swing_up_can_be_stopped_are_said_and_nothing_is_swung_up(tmp_path):
    path = described(tmp_path)
    text = '[limits]\ncommand = "5 V"\n[limits.psi]\ntravel = "0.5 rad"\nspeed = "6 rad/s"\nstart = "0.4 rad"\n'
    path.write_text(path.read_text(encoding="utf-8") + text, encoding="utf-8")
    answer = up.lab(rig=str(path), quick=True, out=tmp_path / "out")
    told = answer.numbers["experiments"]["quick"]["numbers"]
    assert told["refused"].startswith("no swing-up of ")
    assert told["refused"].endswith("allow more travel or speed")
    assert told["fit"]["parameters"]["J_d"]["value"] > 0  # what it is was found all the same
    assert told["wrong"] == []
    assert not (tmp_path / "out" / "quick" / "swing_up.mcap").exists()
    assert "were caught" not in str(answer)  # none was tried
    assert "wiring: no swing-up" not in str(answer)


def test_a_minute_is_for_a_rig_and_by_itself(tmp_path):
    with pytest.raises(BadInput, match=r"--rig RIG.toml --quick"):
        up.lab(rig="furuta", quick=True, out=tmp_path)
    with pytest.raises(BadInput, match="by itself"):
        up.lab(rig="RIG.toml", quick=True, experiment="1b", out=tmp_path)


def test_a_twin_has_no_wiring_that_its_rig_has_not(tmp_path):
    with pytest.raises(BadInput, match="drive, psi, theta"):
        live_stand(described(tmp_path, phi=-1)).run([0.0] * 10, tmp_path, "run")
    with pytest.raises(BadInput, match="a factor such as"):
        live_stand(described(tmp_path, psi='"swapped"')).run([0.0] * 10, tmp_path, "run")
