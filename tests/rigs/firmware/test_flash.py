"""Is a board found, asked about, written and read back, and does nothing wait for one that is not there?"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import upright as up
from upright.errors import BadInput, RigStopped
from upright.rigs import firmware
from upright.rigs.firmware import Flashed, Image, board_of, flash

module = sys.modules[flash.__module__]
in_time = module.in_time

MEGA, IMAGE = board_of("mega"), Path("atmega2560-pair.hex")
ARDUINO, OTHER = 0x2341, 0x1234


class Flasher:
    """avrdude, whose calls fail as they are told to."""

    def __init__(self, *codes: int) -> None:
        self.codes, self.calls = list(codes), []

    def __call__(self, command, seconds):
        self.calls.append((command, seconds))
        return subprocess.CompletedProcess(
            command, self.codes.pop(0), "", "avrdude: ser_open(): can't open device\n\navrdude done.  Thank you.\n"
        )


def flashed(flasher, *, port="", there=None, hand=lambda _: True, greet=lambda port: f"firmware at {port}"):
    return flash(MEGA, IMAGE, port, hand=hand, run=flasher, greet=greet, there=lambda: there or {})


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda tool: f"/usr/bin/{tool}")


def test_the_only_arduino_is_found_asked_about_written_and_greeted():
    flasher, asked = Flasher(0, 0), []
    done = flashed(flasher, there={"/dev/ttyS0": OTHER, "/dev/ttyACM0": ARDUINO}, hand=lambda s: not asked.append(s))
    assert (done.port, done.greeting) == ("/dev/ttyACM0", "firmware at /dev/ttyACM0")
    look, write = (command for command, _ in flasher.calls)
    assert "-n" in look  # writes nothing
    assert "-U" not in look
    assert write[-2:] == ["-U", "flash:w:atmega2560-pair.hex:i"]
    assert "-V" not in write  # which would leave reading back out
    assert "What is on it is lost" in asked[0]


@pytest.mark.parametrize(
    ("there", "why"),
    [
        ({}, r"no Arduino Mega 2560 is plugged in; check its cable"),
        ({"/dev/ttyS0": OTHER}, r"\(there are /dev/ttyS0, of other makers\)"),
        ({"COM3": ARDUINO, "COM4": ARDUINO}, "at COM3, COM4; say which with --port"),
    ],
)
def test_without_one_board_nothing_is_started(there, why):
    flasher = Flasher()
    with pytest.raises(BadInput, match=why):
        flashed(flasher, there=there)
    assert not flasher.calls


USB_IDS = {
    "Arduino SA": 0x2341, "dog hunter AG": 0x2A03, "QinHeng Electronics": 0x1A86,
    "Future Technology Devices International": 0x0403, "Silicon Labs": 0x10C4,
}  # fmt: skip
"""Vendors in the list of http://www.linux-usb.org/usb.ids: both Arduino makers, and the chips of copies and cables."""


@pytest.mark.parametrize("vendor", USB_IDS)
def test_a_mega_is_known_by_the_usb_of_its_makers_and_of_the_chips_on_copies(vendor):
    done = flashed(Flasher(0, 0), there={"COM1": 0x8086, "COM7": USB_IDS[vendor]})  # Intel's is none
    assert done.port == "COM7"


@pytest.mark.parametrize("vendor", ["QinHeng Electronics", "Future Technology Devices International", "Silicon Labs"])
def test_a_pico_answers_behind_a_cable_with_one_of_the_three_chips(vendor):
    """Its own USB is not used: the host is at its UART."""
    assert module.port_of(board_of("pico"), "", {"COM1": ARDUINO, "COM7": USB_IDS[vendor]}) == "COM7"


def test_a_board_that_does_not_answer_is_left_within_seconds():
    flasher = Flasher(1)
    with pytest.raises(RigStopped, match=r"No Arduino Mega 2560 answers at COM3: avrdude: ser_open\(\): can't open"):
        flashed(flasher, port="COM3")
    assert flasher.calls[0][1] <= 10.0


def test_a_no_writes_nothing():
    flasher = Flasher(0)
    with pytest.raises(RigStopped, match="Nothing was written"):
        flashed(flasher, port="COM3", hand=lambda _: False)
    assert len(flasher.calls) == 1


def test_an_image_that_is_not_read_back_as_it_was_written_is_told():
    with pytest.raises(RigStopped, match="not written completely"):
        flashed(Flasher(0, 1), port="COM3")


def test_a_program_that_does_not_end_is_ended():
    done = in_time([sys.executable, "-c", "while True: pass"], 0.3)
    assert done.returncode == 1
    assert "did not end within 0.3 s" in done.stderr


def test_without_the_flasher_it_is_named(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda tool: None)
    with pytest.raises(BadInput, match="sudo apt install avrdude"):
        flashed(Flasher(), port="COM3")


def test_a_pico_is_a_drive_that_gets_its_image(tmp_path, monkeypatch):
    image = tmp_path / "pico-pair.uf2"
    image.write_bytes(b"image")
    pico = board_of("pico")
    (tmp_path / "RPI-RP2").mkdir()
    (tmp_path / "RPI-RP2" / "INFO_UF2.TXT").write_text("UF2 Bootloader v3.0", encoding="utf-8")
    monkeypatch.setattr(module, "drives", lambda: [tmp_path / "RPI-RP2"])
    with pytest.raises(RigStopped, match="Nothing was written"):
        flash(pico, image, hand=lambda _: False)
    done = flash(pico, image, "COM5", greet=lambda port: f"firmware at {port}")
    assert (tmp_path / "RPI-RP2" / "pico-pair.uf2").read_bytes() == b"image"
    assert done.greeting == "firmware at COM5"
    assert flash(pico, image).greeting == ""  # nobody was asked
    monkeypatch.setattr(module, "drives", list)
    with pytest.raises(BadInput, match=r"hold BOOTSEL while you plug it in.*drives here: none"):
        flash(pico, image)


@pytest.mark.parametrize("answers", ["", "upright firmware, RP2040, two PWM lines on COM5"])
def test_a_board_answers_where_it_was_asked_and_not_otherwise(answers, tmp_path, monkeypatch):
    """A drive takes a file and says nothing of the firmware in it."""
    image = Image(path=tmp_path / "pico-pair.uf2", ready=True)
    flashed_now = Flashed(port="COM5", image=image.path, greeting=answers)
    monkeypatch.setattr(firmware, "build_image", lambda *_: image)
    monkeypatch.setattr(firmware, "flash", lambda *_, **__: flashed_now)
    chapter = up.firmware_flash(board="pico", drive="pair", out=tmp_path).chapter
    assert ("answers" in chapter.verdict) is bool(answers)
    assert "read back" not in chapter.detail
