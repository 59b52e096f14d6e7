"""Boards that the firmware is for, each with the ways to drive a motor and the tools that make its image."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from upright.errors import BadInput, nearest

ANALOG, PAIR, SIGN = "analog", "pair", "sign"
DRIVES: Mapping[str, str] = {
    ANALOG: "a converter of ±10 V (AD5761R) into a servo amplifier",
    PAIR: "an H-bridge with a PWM line for each way (BTS7960, DRV8871)",
    SIGN: "an H-bridge with one PWM line and the way on two others (VNH5019, L298N)",
}
"""Ways to drive a motor, each a build of its own."""


@dataclass(frozen=True, kw_only=True)
class BoardKind:
    """A board that a maker buys.

    Attributes
    ----------
    name, title : str
        As it is typed, and as its maker calls it.
    drives : tuple of str
        Of `DRIVES`.
    suffix : str
        Of an image: ``"hex"`` or ``"uf2"``.
    tools : mapping of str to str
        What builds an image, and Debian's package of each.
    logic : str
        Its supply for encoders, as its pins stand it.
    flasher : str
        Program that writes an image; empty where it is copied to the board's own drive.
    usb : tuple of tuple of int
        Vendor numbers of its USB, the board's own and those of the chips on copies.
    """

    name: str
    title: str
    drives: tuple[str, ...]
    suffix: str
    tools: Mapping[str, str]
    logic: str = "5 V"
    flasher: str = ""
    usb: tuple[int, ...] = ()

    def image(self, drive: str) -> str:
        """File name of an image.

        Raises
        ------
        BadInput
            When the board has no such drive.
        """
        if drive not in self.drives:
            raise BadInput(f"the {self.title} has no drive '{drive}'; choose with --drive: {', '.join(self.drives)}")
        return f"{self.name}-{drive}.{self.suffix}"


BOARDS: Mapping[str, BoardKind] = {
    board.name: board
    for board in (
        BoardKind(
            name="atmega2560", title="Arduino Mega 2560", drives=(ANALOG, PAIR, SIGN), suffix="hex",
            tools={"make": "make", "avr-gcc": "gcc-avr avr-libc"}, flasher="avrdude",
            usb=(0x2341, 0x2A03, 0x1A86, 0x0403, 0x10C4),
        ),
        BoardKind(
            name="pico", title="Raspberry Pi Pico", drives=(PAIR, SIGN), suffix="uf2",
            tools={"make": "make", "arm-none-eabi-gcc": "gcc-arm-none-eabi libnewlib-arm-none-eabi"},
            logic="3V3", usb=(0x0403, 0x10C4, 0x1A86),
        ),
    )
}  # fmt: skip
"""By name."""

_SAME = {"mega": "atmega2560", "mega2560": "atmega2560", "rp2040": "pico"}
_TOO_SMALL = ("uno", "nano", "leonardo", "micro", "atmega328p", "atmega32u4")


def board_of(name: str) -> BoardKind:
    """The board of a name.

    Raises
    ------
    BadInput
        When there is none, or it is one that is too small, with the reason.
    """
    word = name.lower()
    if word in _TOO_SMALL:
        raise BadInput(
            f"'{name}' is too small a board: frames, limits and the law need 3 kB of memory, and two encoders, the "
            "host and 20 kHz PWM need more timers and interrupts. Take an Arduino Mega 2560 (--board mega) or a "
            "Raspberry Pi Pico (--board pico)."
        )
    word = _SAME.get(word, word)
    if word not in BOARDS:
        raise BadInput(f"boards are {', '.join(BOARDS)}, got '{name}'; {nearest(name, BOARDS)}")
    return BOARDS[word]
