"""Does `upright doctor` say what is wrong, with its picture, and nothing where nothing is?"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from upright.cli import app
from upright.physics import find
from upright.simulation import simulate

T = np.arange(1500) * 4e-3
SWING = np.round(0.8 * np.exp(-0.3 * T) * np.cos(7 * T), 4)


def doctor(*arguments: object):
    return CliRunner().invoke(app, ["doctor", *map(str, arguments)], terminal_width=200)


def log(folder: Path, t: np.ndarray = T, theta: np.ndarray = SWING) -> Path:
    path = folder / "swing.csv"
    rows = "\n".join(f"{a:.4f},{b:.4f}" for a, b in zip(t, theta, strict=True))
    path.write_text(f"t,theta [rad]\n{rows}\n", encoding="utf-8")
    return path


def test_a_sound_log_is_exit_code_0_and_says_what_was_looked_for(tmp_path: Path) -> None:
    outcome = doctor(log(tmp_path), "--rig", "pendulum")
    told = " ".join(outcome.stdout.split())
    assert outcome.exit_code == 0, outcome.stdout
    assert "Nothing wrong found." in told
    assert "lost counts" in told
    assert "no effort column" in told
    assert "upright init" in told


def test_a_rig_model_and_a_rig_file_stand_for_what_describes_them(tmp_path: Path) -> None:
    """`frequency --rig linear` names the crane, and the RIG.toml that `run` takes names a study or a rig model."""
    path = log(tmp_path)
    study = tmp_path / "study.toml"
    study.write_text('[rig]\nplant = "pendulum"\n[parameters]\nm_p = "0.1 kg"\nl_cg = "0.2 m"\n', encoding="utf-8")
    rigs = {"furuta.toml": 'make = "furuta"', "described.toml": 'study = "study.toml"'}
    for name, described in rigs.items():
        (tmp_path / name).write_text(f'kind = "twin"\n{described}\n', encoding="utf-8")

    def unchecked(rig: object) -> dict[str, str]:
        return json.loads(doctor(path, "--rig", rig, "--json").stdout)["unchecked"]

    assert unchecked("linear") == unchecked("cart-pendulum")
    assert unchecked(tmp_path / "furuta.toml") == unchecked("furuta")
    assert unchecked(tmp_path / "described.toml") == unchecked(study)
    refused = doctor(path, "--rig", "rectilinaer")
    assert (refused.exit_code, "?." in refused.stderr) == (2, False)


def test_lost_counts_are_exit_code_3_with_a_picture(tmp_path: Path) -> None:
    path = log(tmp_path, theta=SWING + np.where(T > 2.2, 0.15, 0.0))
    page = tmp_path / "out" / "page.html"
    outcome = doctor(path, "--html", page)
    assert outcome.exit_code == 3
    assert "fault: jump" in outcome.stdout
    assert "--rig" in outcome.stdout
    text = page.read_text(encoding="utf-8")
    assert text.count('<div class="still') == 1
    assert "src=" not in text  # nothing is fetched from anywhere
    assert "window = [" in text


def test_json_can_be_read_by_a_program(tmp_path: Path) -> None:
    outcome = doctor(log(tmp_path, theta=SWING + np.where(T > 2.2, 0.15, 0.0)), "--json")
    found = json.loads(outcome.stdout)
    assert found["wrong"] is True
    jump = next(f for f in found["findings"] if f["kind"] == "jump")
    assert jump["evidence"]["jump [rad]"] == pytest.approx(0.15, abs=0.03)  # 0.022 rad is the largest step of the swing
    assert "sign" in found["unchecked"]


def disks(folder: Path) -> Path:
    """Counts of two disks on a shaft that a torque has spun up, as an ECP 205 logs them."""
    volts = np.where(T >= 0.5, 0.5, 0.0)
    shaft = find("torsional-2")(J_1=0.01, J_2=0.01, k_12=1.4, c_1=0.007, c_2=0.001)
    x = simulate(shaft, {}, [0.0] * 4, 0.6 * volts, 4e-3, samples=T.size, substeps=4)[:, ::2, 0]
    counts = np.round(16000 / (2 * np.pi) * x)
    path = folder / "run.csv"
    rows = "\n".join(f"{a:.4f},{b:.0f},{c:.0f},{d:.0f}" for a, (b, c), d in zip(T, counts, 819 * volts, strict=True))
    path.write_text(f"t,Encoder 1 Pos,Encoder 2 Pos,Control Effort\n{rows}\n", encoding="utf-8")
    return path


def test_rigs_are_proposed_that_the_columns_can_be_of(tmp_path: Path) -> None:
    path = disks(tmp_path)
    proposed = json.loads(doctor(path, "--json").stdout)["rigs"]
    assert proposed[0] == "torsional-2"  # a cart travels less than 16000 counts
    assert {"rectilinear-2", "furuta"} < set(proposed)
    assert all(len(find(name).coordinates) == 2 for name in proposed)
    told = doctor(path).stdout
    assert f"upright doctor {path.name} --rig torsional-2" in told.replace(str(path), path.name)
    assert all(name in told for name in proposed)


def test_no_rig_of_two_bodies_is_proposed_for_one_angle(tmp_path: Path) -> None:
    told = doctor(log(tmp_path)).stdout
    assert "--rig pendulum" in told
    assert "furuta" not in told


def test_a_clock_that_starts_again_is_a_finding_not_an_error(tmp_path: Path) -> None:
    twice = np.concatenate([T[:900], T[:600]])
    outcome = doctor(log(tmp_path, t=twice))
    assert outcome.exit_code == 3
    assert "The clock starts again 1 time" in " ".join(outcome.stdout.split())
    assert "900 samples" in outcome.stdout


def test_instants_written_twice_are_dropped_and_told(tmp_path: Path) -> None:
    twice = np.sort(np.concatenate([T, T[100:200:10]]))
    outcome = doctor(log(tmp_path, t=twice, theta=np.interp(twice, T, SWING)))
    assert outcome.exit_code == 3
    assert "10 rows repeat the instant of the row before" in " ".join(outcome.stdout.split())


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("missing.csv",), "There is no file"),
        (("swing.csv", "--rig", "furutta"), "furuta"),
        (("swing.csv", "--rig", "none.toml"), "none.toml"),
        (("swing.csv", "--html", "."), "is a folder"),
    ],
)
def test_what_a_person_got_wrong_is_a_sentence(tmp_path: Path, monkeypatch, arguments, sentence) -> None:
    log(tmp_path)
    monkeypatch.chdir(tmp_path)
    outcome = doctor(*arguments)
    assert outcome.exit_code == 2
    assert sentence in " ".join(outcome.stderr.split())
    assert "Traceback" not in outcome.stderr
