"""Is a law whose model is not trusted kept from hardware until somebody says why, and does the log keep the reason?"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import upright as up
from upright.basis import NOT_TRUSTED, RESERVED, Basis
from upright.errors import BadInput
from upright.logs import read_log
from upright.rig.makes import make_rig

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4)
RIG = up.Rig.known(ARM, gain="0.65 N m/V", limit="10 V", period="2 ms", counts=4096)
STUDY = """
[rig]
plant = "furuta"
servo_period = "2 ms"
[drive]
column = "u"
unit = "V"
[sensors.psi]
column = "psi"
counts_per_rev = { value = 4096, measured = true }
[sensors.theta]
column = "theta"
counts_per_rev = { value = 4096, measured = true }
[parameters]
m_p = "0.135 kg"
l_cg = "0.19 m"
r = "0.16 m"
J_d = "0.011 kg m^2"
J_p = "6e-4 kg m^2"
[actuator]
gain = "0.65 N m/V"
limit = { value = "10 V", measured = true }
"""
SERIAL = """
kind = "serial"
port = "/dev/no_such_board"
study = "study.toml"
[limits]
command = "5 V"
[limits.psi]
travel = "2 rad"
speed = "20 rad/s"
start = "0.5 rad"
[limits.theta]
travel = "10 rad"
speed = "100 rad/s"
start = "10 rad"
"""


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """A rig behind a wire that is not there, and a way to design for it from a model of some trust."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text(SERIAL, encoding="utf-8")

    def design(level):
        up.design(RIG.replace(basis=Basis(level=level, sentence="The runs are explained to 41 %.")), out="design")

    return design


def test_such_a_law_is_not_armed(bench):
    bench(NOT_TRUSTED)
    with pytest.raises(BadInput, match=r"not armed on hardware.*explained to 41 %.*accept"):
        up.run("RIG.toml", law="design/design.json", out="runs")


def test_a_drive_that_commands_an_acceleration_gets_no_pulse(bench):
    """A pulse of force ends in rest by friction; of acceleration, in a speed that stays."""
    stepper = (
        STUDY.replace("0.65 N m/V", "1000 N m/(rad/s^2)").replace('"V"', '"rad/s^2"').replace("10 V", "60 rad/s^2")
    )
    Path("study.toml").write_text(stepper, encoding="utf-8")
    Path("RIG.toml").write_text(SERIAL.replace("5 V", "50 rad/s^2"), encoding="utf-8")
    with pytest.raises(BadInput, match=r"commanded by its acceleration.*check=False"):
        up.run("RIG.toml", excite="step 1", out="runs")
    with pytest.raises(BadInput, match=r"commanded by its acceleration.*pulse=False"):
        up.rig_doctor("RIG.toml")
    twin = SERIAL.replace('kind = "serial"\nport = "/dev/no_such_board"', 'kind = "twin"').replace("5 V", "50 rad/s^2")
    Path("TWIN.toml").write_text(twin, encoding="utf-8")
    with pytest.raises(BadInput, match=r"commanded by its acceleration.*pulse=False"):
        up.rig_doctor("TWIN.toml")
    with pytest.raises(BadInput, match="no_such_board"):  # as far as the wire
        up.run("RIG.toml", excite="step 1", out="runs", check=False)


@pytest.mark.parametrize("accept", ["", "  "])
def test_silence_is_no_reason(bench, accept):
    bench(NOT_TRUSTED)
    with pytest.raises(BadInput, match="not armed on hardware"):
        up.run("RIG.toml", law="design/design.json", out="runs", accept=accept)


@pytest.mark.slow
@pytest.mark.parametrize(("level", "accept"), [(NOT_TRUSTED, "the pendulum is held by a string"), (RESERVED, "")])
def test_with_a_reason_or_some_trust_it_goes_as_far_as_the_wire(bench, level, accept):
    bench(level)
    with pytest.raises(BadInput, match="port /dev/no_such_board"):
        up.run("RIG.toml", law="design/design.json", out="runs", accept=accept)


def test_a_design_that_does_not_say_counts_as_not_trusted(bench):
    bench(RESERVED)
    with open("design/design.json", encoding="utf-8") as file:
        content = json.load(file)
    del content["basis"]
    with open("design/design.json", "w", encoding="utf-8") as file:
        json.dump(content, file)
    with pytest.raises(BadInput, match="does not say whether it can be trusted"):
        up.run("RIG.toml", law="design/design.json", out="runs")


def test_the_log_keeps_the_reason(bench, tmp_path):
    model = make_rig("furuta")
    untrusted = model.replace(basis=Basis(level=NOT_TRUSTED, sentence="The runs are explained to 41 %."))
    up.design(untrusted, out="design")
    (tmp_path / "twin.toml").write_text('kind = "twin"\nmake = "furuta"\nseed = 3\n', encoding="utf-8")
    done = up.run("twin.toml", law="design/design.json", out="runs", duration=0.2, accept="held by a string")
    (kept,) = [e for e in read_log(done.value.log_path).events if e.kind == "accepted"]
    assert kept.t == 0.0  # before anything moves
    assert "not trusted" in kept.text
    assert "held by a string" in kept.text
    assert "held by a string" in repr(done)
