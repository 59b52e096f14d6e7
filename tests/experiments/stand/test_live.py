"""Experiments on a rig at hand: what is asked of it is within its travel, and what it answered is told as it was."""

from __future__ import annotations

import json
import math
import re
import sys

import numpy as np
import pytest
from scipy.signal import lsim

import upright as up
from tests.exports.rigs import fit_file
from upright.control.swing_up import MODE
from upright.errors import BadInput
from upright.experiments.frequency_1b.at_once import _level, asking
from upright.experiments.laboratory import choose
from upright.experiments.regulation_2.run import scored
from upright.experiments.stand.live import live_stand, run_of
from upright.experiments.stand.strength import SHARE
from upright.experiments.stand.studies import write_study
from upright.experiments.swing_up_2b.run import run_swing_up
from upright.gains import feedback, filtered, place
from upright.laws import as_values, of_values
from upright.logs import read_log
from upright.rig.makes import MAKES, make_rig
from upright.running.run import RunRequest, run_rig
from upright.study.load import load_study

OWN = """
[rig]
plant = "furuta"
name = "qube 7"
servo_period = "2 ms"
travel = "2 rad"
[parameters]
m_p = { value = "24 g", measured = true }
l_cg = { value = "64.5 mm", uncertainty = "0.5 mm" }
r = { value = "85 mm", measured = true }
J_d = { guess = "8e-5 kg m^2", min = 0 }
J_p = { guess = "3.3e-5 kg m^2", min = 0 }
J_a = "0 kg m^2"
b_1 = { guess = "1.5e-4 N m s/rad", min = 0 }
b_2 = { guess = "1e-5 N m s/rad", min = 0 }
[actuator]
gain = { guess = "0.005 N m/V", min = 0 }
limit = { value = "10 V", measured = true }
delay = "2 ms"
[sensors.psi]
column = "psi"
counts_per_rev = { value = 2048, measured = true }
[sensors.theta]
column = "theta"
counts_per_rev = { value = 2048, measured = true }
"""

LOOSE = """
[rig]
plant = "rectilinear-1"
servo_period = "1 ms"
travel = "0.1 m"
[parameters]
m_1 = { guess = "1 kg", min = 0 }
k_1 = "0 N/m"
c_1 = { guess = "1 N s/m", min = 0 }
[actuator]
gain = { guess = "2 N/V", min = 0 }
limit = { value = "5 V", measured = true }
[sensors.x_1]
column = "x_1"
counts_per_m = { value = 20000, measured = true }
"""


@pytest.fixture
def own(tmp_path):
    """A twin of a rig that only its owner's study tells of."""
    (tmp_path / "study.toml").write_text(OWN, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nstudy = "study.toml"\n', encoding="utf-8")
    return live_stand(tmp_path / "RIG.toml")


def made(folder, text='kind = "twin"\nmake = "furuta"\nseed = 3\n'):
    (folder / "RIG.toml").write_text(text, encoding="utf-8")
    return live_stand(folder / "RIG.toml")


def test_the_band_holds_the_swing_of_a_rig_that_nobody_makes(own):
    asked = asking(own)
    p = own.rig.plant
    # arm free: the pendulum swings faster than on a fixed hinge, by the inertia that it takes along
    J, arm = p.J_p + p.m_p * p.l_cg**2, p.J_d + p.m_p * p.r**2
    swing = math.sqrt(p.m_p * p.g * p.l_cg / (J - (p.m_p * p.l_cg * p.r) ** 2 / arm))
    assert asked.band[0] < swing < asked.band[1]
    assert asked.band[0] == pytest.approx(0.4 * swing, rel=0.01)
    assert asked.reach[0] <= 0.25 * 2.0


def test_no_coordinate_is_to_go_further_than_asked(own):
    """By scipy's simulation of the model, after its transient."""
    asked = asking(own)
    level = _level(own, asked, SHARE * own.rig.limit)
    u = level * np.tile(asked.wave, 6)
    model = own.rig.linear("hanging")
    # the arm drifts freely, which is no answer to the wave: only what repeats is looked at
    t = np.arange(u.size) * own.rig.period
    _, y, _ = lsim((model.A, model.B, model.C, np.zeros((2, 1))), u, t)
    last = y[-asked.wave.size :]
    swings = np.ptp(last - np.linspace(last[0], last[-1], len(last)), axis=0) / 2
    assert np.max(swings / asked.reach) == pytest.approx(1.0, abs=0.05)


def test_the_study_of_its_logs_says_what_its_owner_says(own, tmp_path):
    text = write_study(own, tmp_path / "1b" / "study.toml", "Hanging", []).read_text("utf-8")
    rows = "".join(f"{0.002 * k},0,0,{0.02 * k}\n" for k in range(11))
    (tmp_path / "log.csv").write_text(f"t,u_applied,psi,theta\n{rows}", "utf-8")
    study = load_study(tmp_path / "x.toml", text=text + '\n[[runs]]\nfile = "log.csv"\n')
    asked = study.model.parameters
    assert {n for n, p in asked.items() if p.estimate} == {"J_d", "J_p", "b_1", "b_2", "actuator.gain"}
    assert asked["l_cg"].value == pytest.approx(0.0645)
    assert asked["l_cg"].uncertainty == pytest.approx(5e-4)
    assert study.hardware.entries["counts.theta"].value == pytest.approx(2048)
    assert study.hardware.entries["travel"].value == 2.0
    assert study.runs[0].y[-1, 1] == pytest.approx(0.2)


def test_a_rig_described_by_a_fit_is_that_rig_still(tmp_path):
    text = 'kind = "twin"\nmake = "furuta"\nseed = 3\n[limits]\ncommand = "4 V"\n[limits.psi]\ntravel = "1 rad"\n'
    copied = made(tmp_path, text).file.with_fit(tmp_path / "1b" / "fit.json", tmp_path / "2" / "rig.toml")
    told = copied.read_text("utf-8")
    assert 'fit = "../1b/fit.json"' in told
    assert "seed = 3" in told
    assert 'travel = "1 rad"' in told


def test_a_limit_of_the_file_bounds_what_is_asked_and_the_rest_is_the_descriptions(tmp_path):
    assert asking(made(tmp_path)).reach[0] == MAKES["furuta"].reach[0]
    limited = 'kind = "twin"\nmake = "furuta"\n[limits]\ncommand = "4 V"\n'
    assert asking(made(tmp_path, limited)).reach[0] == MAKES["furuta"].reach[0]
    narrow = asking(made(tmp_path, limited + '[limits.psi]\ntravel = "1 rad"\n'))
    assert narrow.reach[0] == pytest.approx(0.25)


def test_whose_rig_it_is_may_be_said_by_either_file(own, tmp_path):
    assert own.make is None
    said = tmp_path / "study.toml"
    said.write_text(OWN.replace('name = "qube 7"', 'vendor = "ECP 205"'), encoding="utf-8")
    assert live_stand(tmp_path / "RIG.toml").make is MAKES["furuta"]
    said.write_text(OWN, encoding="utf-8")
    assert made(tmp_path, 'kind = "twin"\nstudy = "study.toml"\nvendor = "ECP 205"\n').make is MAKES["furuta"]


def test_a_fit_alone_is_not_identified_again(own, tmp_path):
    assert [e.key for e in choose((), "RIG.toml", own)] == ["1b", "2", "2b", "4"]
    counts = {"value": 2048.0, "unit": "1/rev", "source": "known"}
    said = {
        "servo_period": {"value": 2e-3, "unit": "s", "source": "known"},
        "counts.psi": counts,
        "counts.theta": counts,
    }
    fit_file(tmp_path, own.rig.plant, name="furuta", **said)
    alone = made(tmp_path, 'kind = "twin"\nfit = "fit.json"\n')
    assert [e.key for e in choose((), "RIG.toml", alone)] == ["2", "2b"]


def test_a_run_that_the_supervisor_ends_was_lost_there(tmp_path):
    """The law's arm leaves a travel of 3 degrees long before its pendulum falls."""
    model = make_rig("furuta")
    linear = model.linear("inverted")
    sampled = linear.to_sampled(model.period, model.delay / model.period)
    law = feedback(filtered(sampled, 0.5), place(linear.A, linear.B, [-4 + 2j, -4 - 2j, -17, -3]).K)
    up_law = tmp_path / "law.json"
    up_law.write_text(json.dumps(as_values(law)), encoding="utf-8")
    made(tmp_path, 'kind = "twin"\nmake = "furuta"\n[limits]\ncommand = "5 V"\n[limits.psi]\ntravel = "3 deg"\n')
    wish = RunRequest(rig=tmp_path / "RIG.toml", law=up_law, seconds=2.0, tilt=0.08, check=False)
    found = scored(run_of(run_rig(wish, tmp_path), "inverted"))
    assert not found.score.held
    assert found.score.ran_out == pytest.approx(found.trial.t[-1])
    assert math.isinf(found.score.settled)
    assert "travel" in found.ended


def test_a_swing_up_is_told_from_the_middle_wherever_its_pulse_left_the_arm(tmp_path):
    plant = up.Furuta(m_p=0.1331, l_cg=0.185, r=0.152, J_d=7.1e-3, J_p=6.1e-4, J_a=2e-5, b_1=2e-3, b_2=4e-5)
    counts = {"value": 16_000.0, "unit": "1/rev", "source": "known"}
    said = {
        "servo_period": {"value": 1e-3, "unit": "s", "source": "known"},
        "travel": {"value": 2.0, "unit": "rad", "source": "known"},
        "counts.psi": counts,
        "counts.theta": counts,
    }
    fit = fit_file(tmp_path, plant, name="furuta", **said)
    rig = made(tmp_path, 'kind = "twin"\nfit = "fit.json"\n')
    done = run_swing_up(rig.rig, rig.described_by(fit, tmp_path / "out"), tmp_path / "out")
    log = read_log(tmp_path / "out" / "swing_up.mcap")
    arm = log.columns["psi"]
    assert abs(arm[0]) > 0.05
    assert done.ascent.travel == pytest.approx(np.abs(arm).max())
    # what it is said to do at each moment is what it did: read as the encoders showed it, the law gives its commands
    readings = np.column_stack([arm, log.columns["theta"]])
    commands, memory = of_values(dict(log.header.law)).follow(readings, rig.rig.period)
    limit = rig.rig.limit
    np.testing.assert_allclose(np.clip(commands[:, 0], -limit, limit), log.columns["u"], atol=0.01)
    assert np.array_equal(done.ascent.mode[:-1], memory[1:, MODE])


def test_what_is_no_rig_at_hand_is_refused(tmp_path):
    with pytest.raises(BadInput, match="no file"):
        up.lab(rig=str(tmp_path / "NONE.toml"), out=tmp_path / "out")
    made(tmp_path)
    with pytest.raises(BadInput, match="as it is, and there is one"):
        up.lab(rig=str(tmp_path / "RIG.toml"), worn=True, out=tmp_path / "out")
    (tmp_path / "run.csv").write_text("t,u,psi,theta\n0,0,0,0\n0.001,0,0,0\n", encoding="utf-8")
    with pytest.raises(BadInput, match="a replay answers nothing"):
        made(tmp_path, 'kind = "replay"\nmake = "furuta"\nrecord = "run.csv"\n')


def test_nothing_is_tried_where_no_log_can_be_kept(tmp_path, monkeypatch):
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nmake = "torsional"\n', encoding="utf-8")
    monkeypatch.setitem(sys.modules, "mcap", None)
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(BadInput, match=r"pip install 'upright\[rig\]'"):
        live_stand(tmp_path / "RIG.toml")


def test_what_does_not_swing_is_told_what_else_identifies_it(tmp_path):
    (tmp_path / "study.toml").write_text(LOOSE, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nstudy = "study.toml"\n', encoding="utf-8")
    with pytest.raises(BadInput, match=r"does not swing.*upright identify"):
        asking(live_stand(tmp_path / "RIG.toml"))


def test_a_port_alone_is_not_driven_but_given_a_file_to_fill_in(tmp_path):
    with pytest.raises(BadInput, match="fill in"):
        up.lab(rig="serial:/dev/ttyACM7", out=tmp_path / "out")
    path = tmp_path / "out" / "RIG.toml"
    assert 'port = "/dev/ttyACM7"' in path.read_text("utf-8")
    study = path.with_name("study.toml")
    with pytest.raises(BadInput, match="m_p"):
        up.lab(rig=str(path), out=tmp_path / "out")
    fill_in(study)
    with pytest.raises(BadInput, match=r"\[limits\] needs the largest command"):
        up.lab(rig=str(path), ask=lambda _: True, out=tmp_path / "out")
    fill_in(path)
    with pytest.raises(BadInput, match="need a person"):
        up.lab(rig=str(path), out=tmp_path / "out")
    asked: list[str] = []
    done = up.lab(rig=str(path), ask=asked.append, out=tmp_path / "out")  # who answers nothing has not done it
    assert "not done" in done.numbers["experiments"]["1b"]["detail"]
    assert not any("bring it up" in sentence for sentence in asked)  # nothing is held upright without a fit


def fill_in(path):
    """Every question answered as its example does."""
    path.write_text(re.sub(r"(?m)^# (?=[\[\w]+ ?[=.])", "", path.read_text("utf-8")), encoding="utf-8")


@pytest.mark.slow
def test_a_twin_with_dry_friction_is_identified_through_the_protocol(tmp_path):
    rig = made(tmp_path, 'kind = "twin"\nmake = "rectilinear"\nseed = 3\n')
    done = up.lab(rig=str(rig.file.path), experiment="1b", out=tmp_path / "out")
    told = done.numbers["experiments"]["1b"]
    assert told["state"] == "done"
    truth = make_rig("rectilinear", 3)
    # not the lag, whose interval of 0.1 us is finer than that the twin steps twice a period and the fit once
    for name, true in {**truth.plant.parameters(), "actuator.gain": truth.gain}.items():
        e = told["numbers"]["parameters"].get(name)
        if e is not None and e["status"] == "firm":
            assert e["interval"][0] <= true <= e["interval"][1], name
    assert told["numbers"]["trusted"]
