"""Does the walk through a first power-up name what is wired wrongly, and switch nothing on before it is mended?"""

from __future__ import annotations

import math
import tomllib

import pytest

import upright as up
from benchmarks.boards import plant
from tests.firmware.test_laboratory import GAIN, RIG, STUDY, TRUTH
from tests.firmware.test_pwm import MEGA_STEP, SUPPLY
from upright.rigs.rigfile import read_rig_file
from upright.running.doctor import check_up
from upright.running.rig import model_and_truth

KNOWN = STUDY.replace('gain = { guess = "0.5 N m/V", min = 0 }', f'gain = "{GAIN} N m/V"')
for _guess, _true in (("8.5e-3", "7.1e-3"), ("5e-4", "6.1e-4"), ("3e-3 N", "2e-3 N"), ("2e-5 N", "4e-5 N")):
    KNOWN = KNOWN.replace(_guess, _true)
"""The study of a rig that is known as it is."""


class Maker:
    """A person beside an emulated board, who does what the sentences ask for."""

    def __init__(self, board, *, supplied=True, button=True, turns=1.0, agrees=True):
        self.board, self.said = board, []
        self._supplied, self._button, self._turns, self._agrees = supplied, button, turns, agrees

    def __call__(self, sentence):
        self.said.append(sentence)
        hang = ("put 0 0 0 0", "release", "run 200")  # simavr shows no more than 80 edges in a millisecond
        if sentence.startswith("Write the"):
            return self._agrees
        if sentence.startswith("Does the bridge have"):
            return self._supplied
        if "Move psi" in sentence:
            self.board.do(f"put {math.pi / 2} 0 0 0", "hold", "run 200")
        elif "Move theta" in sentence:
            self.board.do(f"put 0 0 {self._turns * math.tau} 0", "hold", "run 200")
        elif "press the stop button" in sentence:
            self.board.do(*hang, *(["motor 0"] if self._button else []))
        elif "Release" in sentence:
            self.board.do("motor 1")
        elif "Push psi" in sentence:
            self.board.do("put 0 3 0 0", "release")
        else:
            self.board.do(*hang)
        return True


@pytest.fixture(params=["process", pytest.param("Mega", marks=pytest.mark.slow)])
def walked(request, tmp_path):
    """Walks through the power-up of a board with something wrong: the check-up, and the person."""

    def walk(*wrong, dead=0.0, **person):
        rig, more = plant(TRUTH.parameters(), GAIN), [f"dead={dead}"]
        text, study = RIG, KNOWN
        if request.param == "Mega":
            board = request.getfixturevalue("avr")(*rig, *more, f"step={MEGA_STEP!r}", drive="pair")
            text = text.replace("[board]", f"[board]\nfull_scale = {SUPPLY}\nlockstep = true")
            study = study.replace('converter = "0.00030517578125 V"', f'converter = "{MEGA_STEP} V"')
        else:
            board = request.getfixturevalue("host")(*rig, *more)
        (tmp_path / "study.toml").write_text(study, encoding="utf-8")
        (tmp_path / "RIG.toml").write_text(text.format(port=board.port), encoding="utf-8")
        board.do(*wrong)
        maker = Maker(board, **person)
        checkup = check_up(
            tmp_path / "RIG.toml", hand=maker, wait=lambda seconds: board.do(f"run {round(1e3 * seconds)}"), clear=True
        )
        return checkup, maker

    return walk


def wrongs(checkup):
    return {f.what: f.observed for f in checkup.findings if f.good is False}


def test_a_rig_that_is_wired_well_passes_every_step(walked):
    checkup, maker = walked()
    assert checkup.sound, checkup.verdict
    assert [f.what for f in checkup.findings if f.good is not True] == []
    names = [f.what for f in checkup.findings]
    assert names[-6:] == [
        "the drive, forward", "a small pulse", "the drive, backward", "stop button", "end of travel", "watchdog"
    ]  # fmt: skip
    # nothing is switched on before every encoder was moved by hand
    first_on = next(i for i, s in enumerate(maker.said) if "Supply on" in s)
    assert [("Move psi" in s, "Move theta" in s) for s in maker.said[first_on - 2 : first_on]] == [
        (True, False), (False, True)
    ]  # fmt: skip


def test_who_leaves_the_arm_where_the_turn_by_hand_ended_is_asked_to_bring_it_back(host, tmp_path):
    """The board refused to be armed there, latched START, and the walk said not to close a loop."""

    class Forgets(Maker):
        def __call__(self, sentence):
            if "Supply on" not in sentence:
                return super().__call__(sentence)
            self.said.append(sentence)
            self.board.do("put 1.6 0 0 0", "release", "run 200")
            return True

    board = host(*plant(TRUTH.parameters(), GAIN))
    (tmp_path / "study.toml").write_text(KNOWN, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text(RIG.format(port=board.port), encoding="utf-8")
    maker = Forgets(board)
    found = check_up(tmp_path / "RIG.toml", hand=maker, wait=lambda s: board.do(f"run {round(1e3 * s)}"), clear=True)
    assert found.sound, found.verdict
    again = [s for s in maker.said if "bring it back" in s]
    assert len(again) == 1
    assert "psi is 91.7 degrees from where it was at the beginning" in again[0]


WIRED = {
    "swapped leads": (["motor -1"], {}, "the drive, forward", "leads are swapped"),
    "no enable line": (["motor 0"], {}, "the drive, forward", "enable line"),
    "no supply": (["motor 0"], {"supplied": False}, "the drive, forward", "no supply"),
    "a weak supply": (["motor 0.5"], {}, "a small pulse", "the drive is weak"),
    "channels of psi": (["flip 0"], {}, "psi by hand", "counts the wrong way"),
    "channels of theta": (["flip 1"], {}, "theta by hand", "counts the wrong way"),
    "channels of theta, turned the other way": (["flip 1"], {"turns": -1.0}, "a small pulse", "theta went the wrong"),
    "lines for counts": (["scale 0 0.25"], {}, "psi by hand", "0.25 times"),
    "half the counts": (["scale 1 0.5"], {}, "theta by hand", "0.5 times"),
    "no encoder": (["dead 1"], {}, "theta by hand", "not connected"),
    "a button in the wrong wire": ([], {"button": False}, "stop button", "moved although the button is pressed"),
}  # fmt: skip


BRIEF = ("swapped leads", "a weak supply", "channels of psi", "channels of theta, turned the other way")


@pytest.mark.parametrize(
    "fault", [fault if fault in BRIEF else pytest.param(fault, marks=pytest.mark.slow) for fault in WIRED]
)
def test_a_wiring_fault_is_the_only_one_that_is_named_and_has_its_remedy(walked, fault):
    wrong, person, step, words = WIRED[fault]
    checkup, _ = walked(*wrong, **person)
    assert [*wrongs(checkup)] == [step]
    assert words in wrongs(checkup)[step]
    assert len(checkup.mends) == 1


@pytest.mark.parametrize("wrong", ["flip 0", "scale 1 0.5", "dead 0"])
def test_nothing_is_switched_on_while_an_encoder_is_wrong(walked, wrong):
    _, maker = walked(wrong)
    assert not [s for s in maker.said if "Supply on" in s]
    assert maker.board.say("state").split()[6] == "0"


@pytest.mark.slow
def test_the_dead_zone_is_between_the_two_commands_that_it_tells(walked, request, tmp_path):
    checkup, _ = walked(dead=0.4)
    below, first = checkup.dead_zone
    # an edge of the PWM may be 8 cycles of 800 late in simavr, which is as much as 8 steps
    jitter = 8 * MEGA_STEP if "Mega" in request.node.name else 0.0
    assert below - jitter - 1e-3 <= 0.4 <= first + jitter  # within a mV three counts do not show yet
    assert first <= 1.5 * below * (1 + 1e-9)
    lost, error = checkup.lost  # a true value anywhere between the two is within sqrt(3) standard errors
    assert abs(lost - 0.4) <= math.sqrt(3) * error + jitter + 1e-3
    assert checkup.sound, checkup.verdict
    text = (tmp_path / "RIG.toml").read_text(encoding="utf-8")
    assert text.startswith(RIG.partition("port")[0])  # the rest stays as its owner wrote it
    model, _ = model_and_truth(read_rig_file(tmp_path / "RIG.toml"))
    assert below <= model.more["actuator.dead_zone"] <= first  # its study knows of no dry friction


@pytest.mark.slow
def test_a_walk_with_the_dead_zone_written_finds_the_same_drive(host, tmp_path):
    board = host(*plant(TRUTH.parameters(), GAIN), "dead=0.4")
    (tmp_path / "study.toml").write_text(KNOWN, encoding="utf-8")
    path = tmp_path / "RIG.toml"
    path.write_text(RIG.format(port=board.port) + '[drive]\ndead_zone = "0.4 V"\n', encoding="utf-8")
    found = check_up(path, hand=Maker(board), wait=lambda s: board.do(f"run {round(1e3 * s)}"), clear=True)
    assert found.sound, found.verdict
    assert found.dead_zone[0] <= 0.4 <= found.dead_zone[1]


@pytest.mark.parametrize(("wrong", "counts"), [("flip 0", {"psi": -16000}), ("scale 1 0.5", {"theta": 8000})])
def test_counts_that_were_seen_are_written_and_the_next_walk_is_sound(walked, tmp_path, wrong, counts):
    checkup, _ = walked(wrong)
    assert checkup.counts == pytest.approx(counts)
    text = (tmp_path / "RIG.toml").read_text(encoding="utf-8")
    assert tomllib.loads(text)["counts"] == pytest.approx(counts)
    assert text.startswith(RIG.partition("port")[0])  # the rest stays as its owner wrote it
    assert "the drive, forward" not in {f.what for f in checkup.findings}


def test_a_corrected_encoder_counts_as_it_truly_moves(host, tmp_path):
    board = host(*plant(TRUTH.parameters(), GAIN))
    (tmp_path / "study.toml").write_text(KNOWN, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text(
        RIG.format(port=board.port) + "[counts]\npsi = -16000\ntheta = 8000\n", encoding="utf-8"
    )
    board.do("flip 0", "scale 1 0.5")
    found = up.rig_doctor(tmp_path / "RIG.toml", hand=Maker(board), clear=True, pulse=False).value
    assert {f.what: f.observed for f in found.findings if "by hand" in f.what} == {
        "psi by hand": "showed 90 degrees", "theta by hand": "showed 360 degrees"
    }  # fmt: skip


def test_who_does_not_agree_keeps_the_file(walked, tmp_path):
    checkup, maker = walked("flip 0", agrees=False)
    assert checkup.written is None
    assert (tmp_path / "RIG.toml").read_text(encoding="utf-8").count("[counts]") == 0
    assert "Write the" in maker.said[-1]
