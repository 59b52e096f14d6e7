"""Do the steps of docs/tutorials/own_rig.md come to what the page says, on the emulated Mega with an H-bridge?"""

from __future__ import annotations

import math
import re
import shutil
from pathlib import Path

import pytest

import upright as up
from benchmarks.boards import COUNTS, plant
from benchmarks.designs import GAIN, PARAMETERS
from tests.firmware.test_laboratory import RIG, STUDY
from tests.firmware.test_pwm import STEPS, SUPPLY

PAGE = (Path(__file__).parents[2] / "docs" / "tutorials" / "own_rig.md").read_text(encoding="utf-8")
FOLLOWED = STUDY.replace('converter = "0.00030517578125 V"', f'converter = "{SUPPLY / STEPS} V"')
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


def test_the_doctor_of_step_4_finds_a_rig_that_is_wired_well(avr, described):
    board = avr(*plant(PARAMETERS, GAIN), f"step={SUPPLY / STEPS!r}", drive="pair")

    def turns(sentence):
        board.do("put 0.3 0 0.3 0" if "theta" in sentence else "put 0.3 0 0 0", "hold", "run 20")
        return True

    found = up.rig_doctor(described(board.port), clear=True, pulse=False, hand=turns)
    told = {f.what: f for f in found.value.findings}
    assert "two PWM lines" in told["link"].observed
    assert [f for f in told.values() if f.good is False] == []
    assert {"psi by hand", "theta by hand"} <= told.keys()


def test_the_doctor_of_step_4_finds_channels_that_are_swapped(avr, described):
    board = avr(*plant(PARAMETERS, GAIN), f"step={SUPPLY / STEPS!r}", drive="pair")
    board.do("flip 0")

    def turns(sentence):
        board.do("put 0.3 0 0.3 0" if "theta" in sentence else "put 0.3 0 0 0", "hold", "run 20")
        return True

    found = up.rig_doctor(described(board.port), clear=True, pulse=False, hand=turns)
    assert [f.what for f in found.value.findings if f.good is False] == ["psi by hand"]


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
