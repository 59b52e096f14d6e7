"""The laboratory on a rig behind a wire: identified, held upright, swung up and let swing by what its firmware counts.

Time is the board's own, a tick for every exchange, and so is the hand that lifts the pendulum (`firmware/hand.c`): runs
are the same on a busy machine.
"""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import upright as up
from benchmarks.boards import COUNTS, FULL_SCALE, plant
from upright.logs import read_log
from upright.physics import Furuta

TRUTH = Furuta(m_p=0.1331, l_cg=0.185, r=0.152, J_d=7.1e-3, J_p=6.1e-4, J_a=2e-5, b_1=2e-3, b_2=4e-5)
GAIN = 0.63
TILT = math.radians(4)
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
[board]
patience = 20.0
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


TRUE = {**TRUTH.parameters(), "actuator.gain": GAIN}


def misses(numbers, names):
    """Those of the parameters whose intervals leave the truth out."""
    intervals = {name: numbers["parameters"][name]["interval"] for name in names}
    return {name: told for name, told in intervals.items() if not told[0] <= TRUE[name] <= told[1]}


@pytest.mark.slow
def test_a_rig_behind_a_wire_is_identified_held_swung_up_and_let_swing(host, tmp_path):
    board = host(*plant(TRUTH.parameters(), GAIN))
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text(RIG.format(port=board.port), encoding="utf-8")
    asked: list[str] = []

    def person(sentence: str) -> bool:
        """Puts every sentence into the words of the board's own hand."""
        asked.append(sentence)
        assert "hang at rest" in sentence
        board.do("put 0 0 0 0", "release")
        if "bring it up" in sentence:
            board.do(f"lift {math.pi + TILT!r}")
        if lifted := re.search(r"lift theta to about (\d+) degrees", sentence):
            board.do(f"lift {math.radians(float(lifted[1]))!r}")
        return True

    done = up.lab(rig=str(tmp_path / "RIG.toml"), ask=person, out=tmp_path / "out")
    told = {key: experiment["numbers"] for key, experiment in done.numbers["experiments"].items()}
    assert {key: experiment["state"] for key, experiment in done.numbers["experiments"].items()} == dict.fromkeys(
        ("1b", "2", "2b", "4"), "done"
    )
    assert told["1b"]["trusted"]
    assert not misses(told["1b"], ("J_d", "J_p", "b_1", "b_2", "actuator.gain"))

    sets = told["2"]["sets"]
    expected = {name: s for name, s in sets.items() if s["before"]["words"]["stabilised"] >= 0.5}
    assert expected
    assert {name: (s["after"]["word"], s["after"]["ended"]) for name, s in expected.items()} == dict.fromkeys(
        expected, ("stabilised", None)
    )

    assert told["2b"]["swing_up"]["held"]
    assert told["2b"]["swing_up"]["tripped"] == math.inf
    arm = read_log(tmp_path / "out" / "2b" / "swing_up.mcap").columns["psi"]
    assert arm[0] > 0.1  # where the pulse has left it
    assert told["2b"]["swing_up"]["travel"] == pytest.approx(np.abs(arm).max())

    assert told["4"]["trusted"]
    assert not misses(told["4"], ("J_p", "b_1", "b_2"))
    assert len(asked) == 4 + len([s for s in sets.values() if s["after"]]) + 2 + 2


def minute(board, folder, travel=2.0, speed=20.0, **more):
    """Numbers of a minute at a board, with more lines in the `[board]` of its RIG.toml; nobody but once is asked."""
    text = RIG.format(port=board.port).replace('"2 rad"', f'"{travel} rad"').replace('"20 rad/s"', f'"{speed} rad/s"')
    lines = "\n".join(["[board]", *(f"{key} = {value}" for key, value in more.items())])
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    (folder / "RIG.toml").write_text(text.replace("[board]", lines), encoding="utf-8")
    asked: list[str] = []
    done = up.lab(rig=str(folder / "RIG.toml"), quick=True, out=folder / "out",
                  ask=lambda sentence: not asked.append(sentence))  # fmt: skip
    assert len(asked) == 1
    return done.numbers["experiments"]["quick"]["numbers"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wiring", "refused"),
    [({}, None), ({"gain": -GAIN}, "motor leads swapped"),
     ({"counts_theta": -COUNTS * 8192 / 16000},
      "encoder channels of theta swapped; theta: counts per turn 8000 or 8192, not 16000")],
)  # fmt: skip
def test_firmware_comes_upright_in_a_minute_or_its_wiring_is_named(host, tmp_path, wiring, refused):
    given = {**wiring, "gain": wiring.get("gain", GAIN)}
    arguments = [a for a in plant(TRUTH.parameters(), GAIN) if a.partition("=")[0] not in given]
    board = host(*arguments, *(f"{name}={value!r}" for name, value in given.items()))
    told = minute(board, tmp_path)
    assert told["refused"] == refused
    milliseconds, arm, _, theta, *_ = board.state()
    assert milliseconds < 60_000
    assert abs(arm) < 2.0  # its travel
    if not refused:
        assert told["upright"]
        assert abs(abs(theta) % (2 * math.pi) - math.pi) < math.radians(10)
        assert not misses(told["fit"], ("J_d", "J_p", "b_1", "b_2", "actuator.gain"))


@pytest.mark.slow
@pytest.mark.parametrize(("travel", "speed"), [(1.6, 8.0), (3.0, 5.0)])
def test_firmware_with_tight_limits_comes_upright_within_them(host, tmp_path, travel, speed):
    board = host(*plant(TRUTH.parameters(), GAIN))
    told = minute(board, tmp_path, travel, speed)
    assert told["upright"], told["verdict"]
    log = read_log(tmp_path / "out" / "quick" / "swing_up.mcap")
    assert np.abs(log.columns["psi"]).max() < travel
    t, psi = log.columns["t"], log.columns["psi"]
    assert np.abs((psi[8:] - psi[:-8]) / (t[8:] - t[:-8])).max() < speed  # as the board measures it


@pytest.mark.slow
def test_the_mega_s_own_program_brings_its_rig_upright_in_a_minute(avr, tmp_path):
    """With every edge that its encoders have on the way up, 35,000 a second at the bottom."""
    board = avr(*plant(TRUTH.parameters(), GAIN))
    told = minute(board, tmp_path, lockstep="true")
    assert told["upright"]
    milliseconds, arm, *_ = board.state()
    assert milliseconds < 60_000
    assert abs(arm) < 2.0
