"""The laboratory on a rig behind a wire: identified hanging by what its firmware counts."""

from __future__ import annotations

import math

import pytest

import upright as up
from benchmarks.boards import COUNTS, FULL_SCALE, plant
from upright.physics import Furuta

TRUTH = Furuta(m_p=0.1331, l_cg=0.185, r=0.152, J_d=7.1e-3, J_p=6.1e-4, J_a=2e-5, b_1=2e-3, b_2=4e-5)
GAIN = 0.63
STUDY = f"""
[rig]
plant = "furuta"
name = "bench 3"
servo_period = "1 ms"
travel = "2 rad"
[parameters]
m_p = {{ value = "0.1331 kg", uncertainty = "0.2 %" }}
l_cg = {{ value = "0.185 m", uncertainty = "0.3 %" }}
r = {{ value = "0.152 m", uncertainty = "0.3 %" }}
J_a = "2e-5 kg m^2"
J_d = {{ guess = "8.5e-3 kg m^2", min = 0 }}
J_p = {{ guess = "5e-4 kg m^2", min = 0 }}
b_1 = {{ guess = "3e-3 N m s/rad", min = 0 }}
b_2 = {{ guess = "2e-5 N m s/rad", min = 0 }}
[actuator]
gain = {{ guess = "0.5 N m/V", min = 0 }}
limit = {{ value = "5 V", measured = true }}
converter = "{FULL_SCALE / 32768} V"
delay = "0 s"
[sensors.psi]
column = "psi"
counts_per_rev = {{ value = {COUNTS * 2 * math.pi}, measured = true }}
[sensors.theta]
column = "theta"
counts_per_rev = {{ value = {COUNTS * 2 * math.pi}, measured = true }}
"""
RIG = """
kind = "serial"
port = "{port}"
study = "study.toml"
[limits]
command = "5 V"
watchdog = "0.5 s"
lean = "25 deg"
[limits.psi]
travel = "2 rad"
speed = "20 rad/s"
start = "0.5 rad"
[limits.theta]
travel = "10 rad"
speed = "100 rad/s"
start = "10 rad"
"""


@pytest.mark.slow
def test_a_rig_behind_a_wire_is_identified(host, tmp_path):
    """What is held upright or let swing needs a hand in the board's own time, which a test beside it has not."""
    board = host(*plant(TRUTH.parameters(), GAIN))
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text(RIG.format(port=board.port), encoding="utf-8")
    asked: list[str] = []

    def person(sentence: str) -> bool:
        asked.append(sentence)
        board.do("put 0 0 0 0", "release")
        return True

    done = up.lab(rig=str(tmp_path / "RIG.toml"), experiment="1b", ask=person, out=tmp_path / "out")
    told = done.numbers["experiments"]["1b"]
    assert told["state"] == "done"
    assert told["numbers"]["trusted"]
    true = {**TRUTH.parameters(), "actuator.gain": GAIN}
    for name in ("J_d", "J_p", "b_1", "b_2", "actuator.gain"):
        low, high = told["numbers"]["parameters"][name]["interval"]
        assert low <= true[name] <= high, name
    assert len(asked) == 4
    assert all("hang at rest" in sentence for sentence in asked)
