"""Are the wires that are told those of the board, and are all of them drawn?"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

from docs.drawings import IMAGES, drawings
from upright.rigs.firmware import BOARDS, pins, wiring

EVERY = [(board, drive) for board in BOARDS.values() for drive in board.drives]
MEGA = {
    0: "PE0", 1: "PE1", 4: "PG5", 6: "PH3", 7: "PH4", 8: "PH5", 9: "PH6", 10: "PB4", 11: "PB5", 12: "PB6", 13: "PB7",
    51: "PB2", 52: "PB1", 53: "PB0",
}  # fmt: skip
"""Arduino's own table, ArduinoCore-avr, variants/mega/pins_arduino.h."""


@pytest.mark.parametrize(("board", "drive"), EVERY, ids=lambda v: getattr(v, "name", v))
def test_no_pin_has_two_wires_and_a_board_reads_two_encoders_and_its_host_alone(board, drive):
    """As docs/reference/firmware.md has it: neither an index nor a current."""
    wires = pins(board, drive)
    assert len({pin.number for pin in wires}) == len(wires)
    read = {"ENCODER_1_A", "ENCODER_1_B", "ENCODER_2_A", "ENCODER_2_B", "HOST_RX"}
    told = {"analog": {"SCLK", "SDI", "SYNC"}, "pair": {"FORWARD", "REVERSE"}, "sign": {"PWM", "SIDE_A", "SIDE_B"}}
    assert {p.signal for p in wires} == read | {"HOST_TX", "POWER_STAGE", "LED"} | told[drive]


@pytest.mark.parametrize("drive", BOARDS["atmega2560"].drives)
def test_numbers_on_a_mega_are_arduino_s(drive):
    for pin in pins(BOARDS["atmega2560"], drive):
        assert MEGA[pin.number] == pin.name


def test_numbers_of_a_pico_can_do_what_they_are_for():
    """RP2040's data sheet, table 2 (functions of GP0, GP1, GP16, GP17), and the Pico's, 2.1 (GP25 is its LED)."""
    by_signal = {pin.signal: pin for pin in pins(BOARDS["pico"], "pair")}
    assert {n: by_signal[n].number for n in ("HOST_TX", "HOST_RX", "FORWARD", "REVERSE", "LED")} == {
        "HOST_TX": 0, "HOST_RX": 1, "FORWARD": 16, "REVERSE": 17, "LED": 25,
    }  # fmt: skip
    assert all(pin.name == f"GP{pin.number}" for pin in by_signal.values())


@pytest.mark.parametrize(("board", "volts"), [("atmega2560", "5 V"), ("pico", "3V3")])
def test_encoders_are_drawn_at_the_supply_that_the_pins_stand(board, volts):
    """An RP2040's pin stands 3.63 V (data sheet, 5.5.3)."""
    drawn = wiring(BOARDS[board], "pair", pins(BOARDS[board], "pair"))
    assert drawn.count(f">{volts}<") == 3  # both encoders, and the logic of the bridge that these pins drive
    assert ("5 V" in drawn) == (volts == "5 V")


def test_the_drawings_of_the_page_are_those_of_the_tables():
    for name, svg in drawings().items():
        assert (IMAGES / name).read_text(encoding="utf-8") == svg, f"{name} is out of date; run python -m docs"


@pytest.mark.parametrize(("board", "drive"), EVERY, ids=lambda v: getattr(v, "name", v))
def test_every_wire_is_drawn_between_its_pin_and_its_terminal(board, drive):
    wires = pins(board, drive)
    root = ET.fromstring(wiring(board, drive, wires))
    kind = "{http://www.w3.org/2000/svg}"
    texts = {(t.text, float(t.get("y"))): t for t in root.iter(f"{kind}text")}
    heights = {float(line.get("y1")) for line in root.iter(f"{kind}line")}
    assert all(line.get("y1") == line.get("y2") for line in root.iter(f"{kind}line"))
    for pin in wires:
        (y,) = [at for text, at in texts if text in (f"{pin.number}  {pin.name}", f"GP{pin.number}")]
        assert (pin.terminal, y) in texts
        assert any(abs(height - y) < 6 for height in heights)  # of letters
