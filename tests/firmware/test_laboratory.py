"""The laboratory on a rig behind a wire: identified hanging by what its firmware counts, then held upright by it."""

from __future__ import annotations

import math
import re
import threading

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


class Person:
    """Does what is asked of the person beside the rig, once the rig is ready for it."""

    def __init__(self, board):
        self.board, self.asked = board, []

    def __call__(self, sentence):
        self.asked.append(sentence)
        self.board.do("put 0 0 0 0", "release")
        lift = re.search(r"lift theta to about (\d+) degrees", sentence)
        if lift:
            self._then(lambda mode: mode == 2, math.radians(float(lift[1])))
        elif "bring it up" in sentence:
            seen = []
            # the pulse arms the rig and leaves it idle again
            self._then(lambda mode: seen.append(mode) or (mode == 0 and 1 in seen), math.pi + 0.03)
        return True

    def _then(self, ready, angle):
        threading.Thread(target=self._act, args=(ready, angle), daemon=True).start()

    def _wait(self, until):
        while not until(self.board.state()):  # each is a word with another process
            pass

    def _act(self, ready, angle):
        self._wait(lambda state: ready(int(state[7])))
        self.board.do("put 0 0 0 0", "hold")
        for k in range(1, 101):
            self.board.do(f"put 0 0 {angle * k / 100} 0")
            now = self.board.state()[0]
            self._wait(lambda state, now=now: state[0] >= now + 2)
        self._wait(lambda state: state[7] == 2)
        at = self.board.state()[0]
        self._wait(lambda state: state[0] >= at + 5)
        self.board.do("release")


@pytest.mark.slow
def test_a_rig_behind_a_wire_is_identified_and_held(host, tmp_path):
    board = host(*plant(TRUTH.parameters(), GAIN))
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text(RIG.format(port=board.port), encoding="utf-8")
    person = Person(board)
    done = up.lab(rig=str(tmp_path / "RIG.toml"), ask=person, out=tmp_path / "out")
    told = done.numbers["experiments"]
    assert {key: e["state"] for key, e in told.items()} == {"1b": "done", "2": "done", "2b": "done", "4": "done"}
    estimates = told["1b"]["numbers"]["parameters"]
    true = {**TRUTH.parameters(), "actuator.gain": GAIN}
    for name in ("J_d", "J_p", "b_1", "b_2", "actuator.gain"):
        low, high = estimates[name]["interval"]
        assert low <= true[name] <= high, name
    sets = told["2"]["numbers"]["sets"].values()
    assert [s["after"]["word"] for s in sets] == ["regulates"] * 4
    assert told["2b"]["sound"]
    assert len(person.asked) == 4 + 4 + 2 + 2
