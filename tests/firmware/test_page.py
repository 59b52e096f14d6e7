"""Do the steps of docs/tutorials/own_rig.md come to what the page says, on the emulated Mega with an H-bridge?"""

from __future__ import annotations

import math
import re
import shutil
from pathlib import Path

import pytest

import upright as up
from benchmarks.boards import COUNTS, plant
from tests.firmware.test_laboratory import GAIN, RIG, STUDY, TRUTH
from tests.firmware.test_power_up import Maker
from tests.firmware.test_pwm import MEGA_STEP, SUPPLY
from upright.running.doctor import check_up

PAGE = (Path(__file__).parents[2] / "docs" / "tutorials" / "own_rig.md").read_text(encoding="utf-8")
FOLLOWED = STUDY.replace('converter = "0.00030517578125 V"', f'converter = "{MEGA_STEP} V"')
"""The study of a rig with its supply in steps of PWM, as step 3 asks."""
SCALE = re.search(r"\[board\]\n +(full_scale = [\d.]+)\n", PAGE)[1]


@pytest.fixture
def described(tmp_path):
    assert FOLLOWED != STUDY
    (tmp_path / "study.toml").write_text(FOLLOWED, encoding="utf-8")

    def write(port):
        text = RIG.format(port=port).replace("[board]\n", f"[board]\nlockstep = true\n{SCALE}\n")
        (tmp_path / "RIG.toml").write_text(text, encoding="utf-8")
        return tmp_path / "RIG.toml"

    return write


def test_the_doctor_of_step_4_leaves_the_drive_off_and_that_of_step_6_tries_it(avr, described):
    board = avr(*plant(TRUTH.parameters(), GAIN), f"step={MEGA_STEP!r}", drive="pair")
    rig, maker = described(board.port), Maker(board)
    first = up.rig_doctor(rig, clear=True, pulse=False, hand=maker).value
    observed = {f.what: f.observed for f in first.findings}
    assert "two PWM lines" in observed["link"]
    assert {"psi by hand", "theta by hand"} <= observed.keys()
    assert first.sound
    assert not [s for s in maker.said if "Supply on" in s]
    second = check_up(rig, clear=True, hand=maker, wait=lambda seconds: board.do(f"run {round(1e3 * seconds)}"))
    assert second.sound, second.verdict
    assert [f for f in second.findings if f.good is None] == []


def test_the_ceilings_of_step_5_are_the_limits_of_rig_toml(described, tmp_path):
    if shutil.which("avr-gcc") is None:
        pytest.skip("avr-gcc is missing")
    image = up.firmware_build(drive="pair", rig=described("COM3"), out=tmp_path)
    limits = dict(re.findall(r'^(\w+) = "([\d.]+) ', RIG.partition("[limits.psi]")[2].partition("[")[0], re.MULTILINE))
    assert image.ceilings["COMMAND"] == math.ceil(100 * 5.0 / SUPPLY)
    assert image.ceilings["TRAVEL_1"] == math.ceil(float(limits["travel"]) * COUNTS)
    assert image.ceilings["SPEED_1"] == math.ceil(float(limits["speed"]) * COUNTS * 8e-3)


def test_every_command_and_picture_of_the_page_is_there():
    root = Path(__file__).parents[2] / "docs" / "tutorials"
    pictures = re.findall(r"\]\((\.\./images/[^)]+)\)", PAGE)
    assert pictures
    for picture in pictures:
        assert (root / picture).is_file()
    for words in re.findall(r"upright (firmware \w+|rig \w+)", PAGE):
        assert hasattr(up, words.replace(" ", "_"))
