"""Does an exported sketch hold its limits, stop, and take what it missed for missed?"""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.exports.test_law import PASSED, needs, said, written
from upright.exports.controller import of_law
from upright.exports.targets import TARGETS
from upright.exports.vector import self_test
from upright.laws import Law, state_feedback

BOARD = Path(__file__).parent / "arduino"
COUNTS, PERIOD = 1000.0, 2e-3
LIMIT = 6.0
PULL = replace(
    state_feedback([-2.0, 0.0, 1.0, 0.0], PERIOD, limit=LIMIT), measured=("psi", "theta"), resolution=1 / COUNTS,
    begin=None,
)  # fmt: skip
"""2 V against a radian of the first encoder, of 1000 counts per rad."""
pytestmark = pytest.mark.skipif(shutil.which("g++") is None, reason="g++ is not on this machine")


class Sketch:
    """The sketch of a law as a process."""

    def __init__(self, program: Path) -> None:
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8")

    def do(self, *lines: str) -> None:
        for line in lines:
            self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def run(self, milliseconds: float) -> tuple[int, bool, int]:
        """Samples that gave a command, whether the drive is enabled, and its duty of 255 with its sign."""
        self.do(f"run {round(1e3 * milliseconds)}")
        samples, enabled, duty, way = (int(word) for word in self.process.stdout.readline().split())
        return samples, bool(enabled), duty * way

    def printed(self) -> str:
        self.do("printed")
        out = ""
        while (line := self.process.stdout.readline()) != ".\n":
            out += line
        return out

    def started(self) -> None:
        self.do("type g")
        assert self.run(100 * PERIOD * 1e3)[:2] == (100, True)
        assert self.printed().endswith("started\n")


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    made, folder = of_law(PULL), tmp_path_factory.mktemp("sketch")
    for file, text in TARGETS["arduino"].write(made, self_test(made), False).items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(text, encoding="utf-8")
    law = folder / "law"
    said("gcc", "-std=c99", "-O1", "-c", law / "law.c", "-o", law / "law.o")
    options = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-Wno-cpp", "-Wno-unused-function"]
    said("g++", *options, f"-I{law}", f"-I{BOARD}", BOARD / "main.cpp", law / "law.o", "-o", law / "sketch")
    return law / "sketch"


@pytest.fixture
def sketch(program):
    made = Sketch(program)
    yield made
    made.process.stdin.close()
    made.process.wait(10)
    made.process.stdout.close()


def test_nothing_moves_before_it_is_told_to(sketch):
    assert PASSED in sketch.printed()
    sketch.do("turn 0 100")
    _, enabled, duty = sketch.run(500)
    assert not enabled
    assert duty == 0


def test_the_law_drives_against_what_the_encoder_counts(sketch):
    sketch.started()
    sketch.do("turn 0 20")
    sketch.run(20)
    sketch.do("turn 0 30")  # 0.05 rad in all: 0.1 V of 6, forward by K = -2
    _, _, duty = sketch.run(20)
    assert duty == int(round(2.0 * 0.05 / LIMIT * 800) * 255 / 800)
    sketch.do("turn 0 -70", "run 2000", "turn 0 -30")
    sketch.process.stdout.readline()
    assert sketch.run(20)[2] == -int(round(2.0 * 0.05 / LIMIT * 800) * 255 / 800)


@pytest.mark.parametrize(("periods", "goes_on"), [(1.5, True), (2.5, True), (10, False)])
def test_samples_that_a_stall_cost_are_not_made_up_for_in_a_burst(sketch, periods, goes_on):
    """As many as the time leaves, however many are due: one, then one in each period."""
    sketch.started()
    sketch.do(f"stall {round(1e6 * PERIOD * periods)}")
    samples, enabled, _ = sketch.run(PERIOD * 1e3)
    assert enabled == goes_on
    assert samples <= 2 if goes_on else samples >= 1  # what stops it writes a zero
    if goes_on:
        assert sketch.run(10 * PERIOD * 1e3)[0] in (10, 11)
    else:
        assert sketch.printed() == "stopped: a sample came too late\n"


@pytest.mark.parametrize(
    ("what", "why"),
    [
        ("type s", "by hand"),
        ("type x", "by hand"),
        ("button 1", "stop button"),
        ("jump 0", "a transition that no encoder makes"),
        ("turn 0 400", "faster than its limit"),
        ("turn 1 -400", "faster than its limit"),
    ],
)
def test_it_stops_and_says_why(sketch, what, why):
    """400 counts are 0.4 rad in a period of 2 ms: 200 rad/s."""
    sketch.started()
    sketch.do(what)
    _, enabled, duty = sketch.run(2 * PERIOD * 1e3)
    assert not enabled
    assert duty == 0
    assert sketch.printed() == f"stopped: {why}\n"
    assert not sketch.run(100)[1]  # and stays so


@pytest.mark.parametrize(("counts", "goes_on"), [(2_990, True), (3_010, False)])
def test_it_stops_beyond_its_travel(sketch, counts, goes_on):
    sketch.started()
    for _ in range(counts // 10):
        sketch.do("turn 0 10", "run 2000")
        sketch.process.stdout.readline()
    assert sketch.run(4)[1] == goes_on
    assert sketch.printed() == ("" if goes_on else "stopped: beyond its travel\n")


def test_it_stops_at_its_largest_command_for_too_long(sketch):
    """Theta by 6.5 rad asks for 6.5 V of 6, which it may have for 2 s; theta itself may turn over."""
    sketch.started()
    for _ in range(650):
        sketch.do("turn 1 10", "run 2000")
        sketch.process.stdout.readline()
    assert sketch.run(1500)[1]
    assert not sketch.run(1000)[1]
    assert sketch.printed() == "stopped: at its limit for too long\n"


def test_it_starts_near_its_target_only(sketch):
    sketch.do("turn 0 300", "type g")
    assert not sketch.run(20)[1]
    assert sketch.printed().endswith("not started: outside its start window\n")
    sketch.do("turn 0 -200", "button 1", "type g")
    assert not sketch.run(20)[1]
    assert sketch.printed() == "not started: the stop button is open\n"
    sketch.do("button 0", "type g")
    assert sketch.run(20)[1]


@needs("avr-g++")
def test_an_uno_is_refused_with_the_reason(tmp_path):
    folder = written("filtered", "arduino", tmp_path) / "law"
    done = subprocess.run(
        ["avr-g++", "-mmcu=atmega328p", "-fsyntax-only", "-x", "c++", folder / "board.h"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode
    assert "interrupts on two pins only; take a Mega 2560" in done.stderr


def test_a_law_of_several_commands_is_not_taken_for_one_drive():
    law = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((2, 0)), np.ones((2, 1)), period=PERIOD)
    made = of_law(law)
    texts = TARGETS["arduino"].write(made, self_test(made), False)
    assert "#error" in texts["law/law.ino"]


@pytest.mark.parametrize(("unit", "refused"), [("mm/s^2", True), ("rad/s^2", True), ("V", False), ("N m", False)])
def test_a_law_that_commands_an_acceleration_is_not_put_out_as_a_duty(unit, refused):
    made = replace(of_law(state_feedback([1.0, 2.0, 3.0, 4.0], PERIOD)), command_unit=unit)
    sketch = TARGETS["arduino"].write(made, self_test(made), False)["law/law.ino"]
    assert ("#error" in sketch) is refused
    assert ("speed += command" in sketch) is refused


def set_up(text: str) -> dict[str, str]:
    """What stands between the braces of each table that the owner of a rig sets."""
    return dict(re.findall(r"(\w+)\[[^;]*\] = \{(.*?)\};", text))


def test_a_cart_s_sketch_has_limits_in_its_metres_and_wires_at_interrupts_of_a_mega():
    """attachInterrupt() takes 2, 3, 18, 19, 20 and 21 on a Mega, by its reference: three encoders, and no fourth."""
    law = replace(
        state_feedback([1.0] * 8, PERIOD), measured=("x", "theta", "x_2", "theta_2"), resolution=[1e-4, 0.0, 2e-4, 0.0],
        target=[0.0, 3.5, 0.0, 0.0],
    )  # fmt: skip
    made = replace(of_law(law), reading_units=("m", "rad", "m", "rad"), command_unit="A")
    texts = TARGETS["arduino"].write(made, self_test(made), False)
    found = set_up(texts["law/law.ino"])
    assert found["TRAVEL"] == "0.3, 0, 0, 0"  # only the driven body has an end
    assert found["SPEED"] == "3, 40, 3, 40"
    assert found["START"] == "0.02, 0.2, 0.02, 0.2"
    assert found["TARGET"] == "0.0, 3.5, 0.0, 0.0"
    steps = found["STEP"].split(", ")
    assert [step.startswith("LAW_STEP_") for step in steps] == [True, False, True, False]
    assert steps[1] == "1 /* FILL IN: reading per count */"
    assert "LIMIT = 12.0 /* FILL IN */;" in texts["law/law.ino"]
    assert "largest command [A]" in texts["law/law.ino"]
    assert set_up(texts["law/board.h"])["ENCODER_PINS"] == "{2, 3}, {18, 19}, {20, 21}, {-1, -1}"
