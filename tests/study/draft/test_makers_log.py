"""Does what a maker's board prints, counts and a duty without a word of units, lead to the rig that was driven?"""

from __future__ import annotations

import re
import tomllib

import numpy as np
import pytest

import upright as up

BUILT = up.Furuta(m_p=0.12, r=0.15, l_cg=0.17, J_d=8e-3, J_p=7e-4, b_1=4e-3, b_2=1.5e-4, b_1c=6e-3, b_2c=1e-4)
COUNTS = {"psi": 1200, "theta": 2400}
GAIN = 0.05 * 12 / 255  # N m per step of the duty: 0.05 N m/V from a supply of 12 V


def printed(seconds: float = 20.0, period: float = 5e-3) -> str:
    t = np.arange(0.0, seconds, period)
    duty = np.round(90 * np.sin(4.4 * t + 2 * np.sin(0.4 * t))) * (t > 1)
    motion = up.simulate(BUILT, u=GAIN * duty, seconds=seconds, dt=period)
    arm, pend = (np.round(motion[n][: t.size] * counts / (2 * np.pi)) for n, counts in COUNTS.items())
    rows = zip(1e3 * t, arm, pend, duty, strict=True)
    return "boot ok\n" + "".join(f"ms:{m:.0f}\tarm:{a:.0f}\tpend:{p:.0f}\tpwm:{d:.0f}\n" for m, a, p, d in rows)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("maker")
    (folder / "board.txt").write_text(printed(), encoding="utf-8")
    up.init(folder / "board.txt", out=folder / "study.toml")
    return folder


@pytest.mark.slow
def test_the_draft_is_of_a_furuta_pendulum_whose_duty_is_no_voltage(folder):
    study = tomllib.loads((folder / "study.toml").read_text(encoding="utf-8"))
    assert study["rig"]["plant"] == "furuta"
    assert {n: s["column"] for n, s in study["sensors"].items()} == {"psi": "arm", "theta": "pend"}
    assert study["drive"] == {"column": "pwm", "unit": "counts"}
    assert all(s["counts_per_rev"]["assumed"] for s in study["sensors"].values())


@pytest.mark.slow
def test_before_anything_is_measured_the_fit_says_no_and_where_to_look(folder):
    fit = up.identify(folder / "study.toml").value
    assert not fit.trusted
    assert "rests on sensors.psi.counts_per_rev, sensors.theta.counts_per_rev (assumed). Measure them" in fit.verdict
    assert {"sensors.psi.counts_per_rev", "sensors.theta.counts_per_rev"} <= set(fit.estimates["r"].rests_on)


@pytest.mark.slow
def test_with_what_a_person_can_measure_the_rest_is_the_rig_that_was_driven(folder):
    text = (folder / "study.toml").read_text(encoding="utf-8")
    measured = {"m_p": '"120 g"', "r": '"15 cm"', "J_p": '"7e-4 kg m^2"', "limit": '"255 counts"'}
    lines, sensor = list[str](), ""
    for line in text.splitlines():
        key = line.partition(" = ")[0]
        sensor = line[1:-1].partition(".")[2] if line.startswith("[") else sensor
        value = f"{COUNTS[sensor]}" if key == "counts_per_rev" else measured.get(key, "")
        lines.append(f"{key} = {value}" if value else line)
    (folder / "measured.toml").write_text("\n".join(lines), encoding="utf-8")
    fit = up.identify(folder / "measured.toml").value
    truth = BUILT.parameters() | {"actuator.gain": GAIN}
    for name, e in fit.estimates.items():
        assert e.interval[0] <= truth[name] <= e.interval[1]
    assert {"l_cg", "J_d", "b_1", "b_1c", "actuator.gain"} <= {
        name for name, e in fit.estimates.items() if e.half < 0.02 and e.status == "well determined"
    }


def magnetic(bits: int = 14, hangs: int = 15000) -> str:
    """The same rig with encoders that begin again after a turn, released by hand; the pendulum's counts backwards."""
    t = np.arange(0.0, 16.0, 5e-3)
    duty = np.round(90 * np.sin(4.4 * t + 2 * np.sin(0.4 * t))) * (t > 6)
    motion = up.simulate(BUILT, u=GAIN * duty, start={"psi": 2.6, "theta": 2.2}, seconds=16.0, dt=5e-3)
    turn = 2**bits
    arm, pend = (np.round(motion[n][: t.size] * turn / (2 * np.pi)) for n in ("psi", "theta"))
    rows = zip(1e3 * t, (arm + 200) % turn, (hangs - pend) % turn, duty, strict=True)
    return "ms,arm,pendulum,pwm\n" + "".join(f"{m:.0f},{a:.0f},{p:.0f},{d:.0f}\n" for m, a, p, d in rows)


@pytest.mark.slow
def test_magnetic_encoders_say_themselves_what_a_turn_is(tmp_path):
    (tmp_path / "board.csv").write_text(magnetic(), encoding="utf-8")
    up.init(tmp_path / "board.csv", out=tmp_path / "study.toml")
    text = (tmp_path / "study.toml").read_text(encoding="utf-8")
    study = tomllib.loads(text)
    sensors = study["sensors"]
    assert [sensors[n]["counts_per_rev"] for n in ("psi", "theta")] == 2 * [{"value": 2**14, "measured": True}]
    assert sensors["theta"]["sign"] == -1
    off = (sensors["theta"]["offset"] - 15000 + 2**13) % 2**14 - 2**13
    assert abs(off) < 0.1 * 2**14 / (2 * np.pi)  # it still swings by twice as much where it begins to be driven
    for given in ('m_p = "120 g"', 'l_cg = "17 cm"', 'J_p = { guess = "1e-4 kg m^2" }'):
        text = re.sub(rf"(?m)^{given.partition(' ')[0]} = .*$", given, text)
    (tmp_path / "measured.toml").write_text(text, encoding="utf-8")
    fit = up.identify(tmp_path / "measured.toml").value
    assert fit.trusted
    truth = BUILT.parameters() | {"actuator.gain": GAIN}
    assert [n for n, e in fit.estimates.items() if not e.interval[0] <= truth[n] <= e.interval[1]] == []
