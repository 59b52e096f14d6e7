"""Experiments on a rig at hand: what is asked of it is within its travel, and what it answered is told as it was."""

from __future__ import annotations

import json
import math
import re
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import upright as up
from tests.experiments.rigs import OWN, made
from tests.exports.rigs import fit_file
from tests.running.test_accepted import SERIAL, STUDY
from upright.basis import NOT_TRUSTED, Basis
from upright.control.swing_up import MODE
from upright.errors import BadInput, RigStopped
from upright.experiments.laboratory import chosen_experiments
from upright.experiments.regulation_2.run import scored
from upright.experiments.stand import live
from upright.experiments.stand.live import live_stand, run_of
from upright.experiments.stand.studies import write_study
from upright.experiments.swing_up_2b.run import run_swing_up
from upright.gains import feedback, filtered, place
from upright.laws import Law, as_values, of_values
from upright.logs import read_log
from upright.rig.makes import MAKES, make_rig
from upright.running import run as run_module
from upright.running.run import RunRequest, run_rig
from upright.study.load import load_study


@pytest.fixture
def own(tmp_path):
    """A twin of a rig that only its owner's study tells of."""
    (tmp_path / "study.toml").write_text(OWN, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nstudy = "study.toml"\n', encoding="utf-8")
    return live_stand(tmp_path / "RIG.toml")


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


@pytest.mark.parametrize(
    ("at", "start", "settled", "tilt", "from_rest"),
    [
        ("hanging", None, False, 0.0, False), ("inverted", None, True, 0.0, True),
        ("inverted", [0.0, 0.0, 0.1, 0.0], False, 0.1, False),
    ],
)  # fmt: skip
def test_a_loop_begins_where_its_rig_rests_or_as_far_aside_as_a_hand_holds_it(
    own, tmp_path, monkeypatch, at, start, settled, tilt, from_rest
):
    """And runs one sample longer than its seconds, so that it has both ends."""
    asked: list[RunRequest] = []

    def run(_self, request, _folder):
        asked.append(request)
        raise KeyboardInterrupt

    monkeypatch.setattr(type(own), "_run", run)
    with pytest.raises(KeyboardInterrupt):
        own.hold(
            Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), [[0.0, -1.0]]),
            at,
            tmp_path,
            "held",
            3.0,
            start=start,
            settled=settled,
        )
    (request,) = asked
    assert (request.tilt, request.from_rest, request.settled, request.check) == (tilt, from_rest, settled, not settled)
    assert request.seconds == pytest.approx(3.0 + 0.002)


def test_a_rig_described_by_a_fit_is_that_rig_still(tmp_path):
    text = 'kind = "twin"\nmake = "furuta"\nseed = 3\n[limits]\ncommand = "4 V"\n[limits.psi]\ntravel = "1 rad"\n'
    copied = made(tmp_path, text).file.with_fit(tmp_path / "1b" / "fit.json", tmp_path / "2" / "rig.toml")
    told = copied.read_text("utf-8")
    assert 'fit = "../1b/fit.json"' in told
    assert "seed = 3" in told
    assert 'travel = "1 rad"' in told


def test_whose_rig_it_is_may_be_said_by_either_file(own, tmp_path):
    assert own.make is None
    said = tmp_path / "study.toml"
    said.write_text(OWN.replace('name = "qube 7"', 'vendor = "ECP 205"'), encoding="utf-8")
    assert live_stand(tmp_path / "RIG.toml").make is MAKES["furuta"]
    said.write_text(OWN, encoding="utf-8")
    assert made(tmp_path, 'kind = "twin"\nstudy = "study.toml"\nvendor = "ECP 205"\n').make is MAKES["furuta"]


def test_a_fit_alone_is_not_identified_again(own, tmp_path):
    assert [e.name for e in chosen_experiments((), "RIG.toml", own)] == ["1b", "2", "2b", "4"]
    counts = {"value": 2048.0, "unit": "1/rev", "source": "known"}
    said = {
        "servo_period": {"value": 2e-3, "unit": "s", "source": "known"},
        "counts.psi": counts,
        "counts.theta": counts,
    }
    fit_file(tmp_path, own.rig.plant, name="furuta", **said)
    alone = made(tmp_path, 'kind = "twin"\nfit = "fit.json"\n')
    assert [e.name for e in chosen_experiments((), "RIG.toml", alone)] == ["2", "2b"]


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


@pytest.mark.slow
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
    with pytest.raises(BadInput, match="there is one rig, as it is"):
        up.lab(rig=str(tmp_path / "RIG.toml"), nonideal=True, out=tmp_path / "out")
    (tmp_path / "run.csv").write_text("t,u,psi,theta\n0,0,0,0\n0.001,0,0,0\n", encoding="utf-8")
    with pytest.raises(BadInput, match="a replay does not answer commands"):
        made(tmp_path, 'kind = "replay"\nmake = "furuta"\nrecord = "run.csv"\n')


def test_nothing_is_tried_where_no_log_can_be_kept(tmp_path, monkeypatch):
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nmake = "torsional"\n', encoding="utf-8")
    monkeypatch.setitem(sys.modules, "mcap", None)
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(BadInput, match=r"pip install 'upright\[rig\]'"):
        live_stand(tmp_path / "RIG.toml")


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
    path.write_text(re.sub(r"(?m)^# (?=\[\w+\]|[\[\w]+ ?[=.])", "", path.read_text("utf-8")), encoding="utf-8")


UNTRUSTED = Basis(level=NOT_TRUSTED, sentence="The runs are explained to 41 %.")


@pytest.mark.parametrize("accept", ["", "the pendulum hangs on a string"])
def test_a_law_from_a_fit_that_is_not_trusted_is_not_armed_on_hardware_without_a_reason(tmp_path, monkeypatch, accept):
    """Behind a wire that is not there: with a reason it comes as far as the port."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text(SERIAL, encoding="utf-8")
    model_and_truth = run_module.model_and_truth
    monkeypatch.setattr(
        run_module, "model_and_truth", lambda file: tuple(r.replace(basis=UNTRUSTED) for r in model_and_truth(file))
    )
    live = live_stand(tmp_path / "RIG.toml", lambda _sentence: True, accept=accept)
    law = Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), np.zeros((1, 2)), period=2e-3)
    said = "port /dev/no_such_board" if accept else "not armed on hardware.*explained to 41 %"
    with pytest.raises(BadInput, match=said):
        live.hold(law, "inverted", tmp_path, "held", 1.0, start=np.zeros(4))


def test_a_signal_or_an_exploration_is_compared_with_no_model_and_watched_by_none(own, tmp_path, monkeypatch):
    """A signal lasts as many periods as it has samples; hands lift and bolt on before it."""
    asked: list[RunRequest] = []
    monkeypatch.setattr(type(own), "_logged", lambda _self, request, _folder: asked.append(request))
    own.run([0.0, 1.0, 2.0], tmp_path, "steps", lifted=0.5, bolted=0.25)
    own.explore("rule", 9.0, tmp_path, "explore")
    signal, found = asked
    assert (signal.samples, signal.seconds) == ((0.0, 1.0, 2.0), pytest.approx(3 * 0.002))
    assert (signal.tilt, signal.bolted, signal.stem) == (0.5, 0.25, "steps")
    assert (found.exploration, found.seconds, found.stem, found.tilt) == ("rule", 9.0, "explore", 0.0)
    for request in asked:
        assert (request.check, request.watch, request.rig) == (False, False, own.file.path)


@pytest.mark.parametrize(("zero", "at", "away"), [("hanging", "inverted", math.pi), ("inverted", "hanging", -math.pi)])
def test_what_goes_from_where_it_rests_counts_from_where_its_encoders_were_zeroed(
    own, tmp_path, monkeypatch, zero, at, away
):
    """Half a turn to the other equilibrium; no law that it is let go under has such an origin."""
    told: list[object] = []
    result = SimpleNamespace(log=[1, 2, 3], end=SimpleNamespace(stopped=""))
    monkeypatch.setattr(type(own), "_run", lambda *_: result)
    monkeypatch.setattr(live, "run_of", lambda result, at, origin: told.append((at, origin)))
    law = Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), [[0.0, -1.0]])
    stand = replace(own, zero=zero)
    stand.hold(law, at, tmp_path, "held", 3.0)
    stand.hold(law, at, tmp_path, "held", 3.0, start=np.array([0.0, 0.0, 0.1, 0.0]))
    stand.hold(law, zero, tmp_path, "held", 3.0)
    assert told == [(at, [0.0, pytest.approx(away)]), (at, None), (zero, None)]
    result.log = [1, 2]
    with pytest.raises(RigStopped):
        stand.hold(law, at, tmp_path, "held", 3.0)
