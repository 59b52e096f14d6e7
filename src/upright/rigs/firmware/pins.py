"""The wires of a board, read from the header that its firmware is compiled with."""

from __future__ import annotations

import re
from dataclasses import dataclass

from upright.rigs.firmware.boards import BoardKind
from upright.rigs.firmware.images import sources

_PIN = re.compile(r"#define (\w+) ([\w, ]+?) +/\* (.+?): (.+?) \*/")
_WHEN = re.compile(r"#(?:el)?if DRIVE == DRIVE_(\w+)")


@dataclass(frozen=True, kw_only=True)
class Pin:
    """One wire.

    Attributes
    ----------
    number : int
        As it is printed on the board.
    name : str
        As the processor's data sheet calls it.
    signal : str
        As the firmware calls it.
    device, terminal : str
        What it goes to, and where on that.
    """

    number: int
    name: str
    signal: str
    device: str
    terminal: str


def pins(board: BoardKind, drive: str) -> tuple[Pin, ...]:
    """All wires of a board with a drive, in the table's order.

    Raises
    ------
    BadInput
        When the board has no such drive.
    """
    board.image(drive)
    out: list[Pin] = []
    mine = True
    for line in (sources() / f"pins_{board.name}.h").read_text(encoding="utf-8").splitlines():
        if when := _WHEN.match(line):
            mine = when[1].lower() == drive
        elif line.startswith("#endif"):
            mine = True
        elif mine and (match := _PIN.match(line)):
            *port, number = (word.strip() for word in match[2].split(","))
            out.append(
                Pin(
                    number=int(number), name=f"P{port[0]}{port[1]}" if port else f"GP{number}", signal=match[1],
                    device=match[3].replace("Ohm", "Ω"), terminal=match[4].replace("Ohm", "Ω"),
                )
            )  # fmt: skip
    return tuple(out)
