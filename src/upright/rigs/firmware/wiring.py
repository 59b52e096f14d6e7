"""The wires of a board as a drawing, made of the table that its firmware is compiled with."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from itertools import groupby

from upright.rigs.firmware.boards import DRIVES, BoardKind
from upright.rigs.firmware.pins import Pin

_ROW, _TOP, _GAP = 24, 70, 16
_BOARD, _DEVICE = (24, 190), (420, 470)
"""Left edge and width of the board, and of what it is wired to."""
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")
"""Okabe and Ito's, distinguishable by the colour-blind too."""


def wiring(board: BoardKind, drive: str, wires: Sequence[Pin]) -> str:
    """SVG: the board at the left, what each pin goes to at the right, a line for each wire; below, the motor's supply.

    Parameters
    ----------
    wires : sequence of Pin
        As `pins` gives them.
    """
    y, parts, lines = _TOP, list[str](), list[str]()
    for k, (device, group) in enumerate(groupby(wires, lambda pin: pin.device)):
        rows = [(f"{pin.number}", f"{pin.name}", pin.terminal) for pin in group] + [("GND", "", "ground")]
        if rows[0][2].endswith("USB") or device.endswith("board"):
            rows.pop()  # by the cable, or soldered
        if device.startswith("encoder"):
            rows.append((board.logic, "", "supply, and 2.2 kΩ to A and to B where they are open collectors"))
        if device == "H-bridge":
            rows.append((board.logic, "", "VCC, its logic's supply, where it has one (BTS7960, VNH5019)"))
        top, colour = y, _COLOURS[k % len(_COLOURS)]
        y += _ROW
        for number, name, terminal in rows:
            middle = y + _ROW / 2
            shade = {"GND": "#777777", board.logic: "#bb0000"}.get(number, colour)
            lines.append(
                f'<line x1="{sum(_BOARD)}" y1="{middle}" x2="{_DEVICE[0]}" y2="{middle}" stroke="{shade}" '
                f'stroke-width="2"/>'
            )
            parts += [
                _text(sum(_BOARD) - 8, middle, label(number, name), anchor="end"),
                _text(_DEVICE[0] + 10, middle, terminal),
            ]
            y += _ROW
        parts += [
            f'<rect x="{_DEVICE[0]}" y="{top}" width="{_DEVICE[1]}" height="{y - top}" fill="none" '
            f'stroke="{colour}" stroke-width="1.5" rx="5"/>',
            _text(_DEVICE[0] + 10, top + _ROW / 2, device, weight="bold"),
        ]
        y += _GAP
    board_ends, motor = y - _GAP, "amplifier" if drive == "analog" else "bridge"
    power = (
        "motor, past the board", f"supply's plus → fuse → stop button → the {motor}'s supply (B+, VM, Vs)",
        f"supply's minus → the {motor}'s ground, where all grounds meet", f"the {motor}'s outputs → motor (twisted)",
    )  # fmt: skip
    parts.append(
        f'<rect x="{_DEVICE[0]}" y="{y}" width="{_DEVICE[1]}" height="{len(power) * _ROW}" fill="none" '
        'stroke="#111111" stroke-width="1.5" stroke-dasharray="5 4" rx="5"/>'
    )
    for k, text in enumerate(power):
        parts.append(_text(_DEVICE[0] + 10, y + _ROW / 2, text, weight="normal" if k else "bold"))
        y += _ROW
    height, width = y + 8, sum(_DEVICE) + 24
    body = [
        _text(_BOARD[0], 24, f"{board.title}: {DRIVES[drive]}", weight="bold", size=16),
        _text(_BOARD[0], 46, "number on the board, pin of the processor", size=12),
        f'<rect x="{_BOARD[0]}" y="{_TOP}" width="{_BOARD[1]}" height="{board_ends - _TOP}" fill="#f2f2f2" '
        'stroke="#333333" stroke-width="1.5" rx="8"/>',
        _text(_BOARD[0] + 10, _TOP + 18, board.title.split(maxsplit=1)[-1], weight="bold"),
        *lines, *parts,
    ]  # fmt: skip
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'font-family="sans-serif">\n<rect width="{width}" height="{height}" fill="white"/>\n'
        + "\n".join(body) + "\n</svg>\n"
    )  # fmt: skip


def label(number: str, name: str) -> str:
    """A pin, as the board and the processor call it."""
    return name if name == f"GP{number}" else f"{number}  {name}".strip()


def _text(x: float, y: float, text: str, *, anchor: str = "start", weight: str = "normal", size: int = 13) -> str:
    return (
        f'<text x="{x:g}" y="{y + 0.35 * size:g}" font-size="{size}" text-anchor="{anchor}" font-weight="{weight}" '
        f'fill="#111111" xml:space="preserve">{escape(text)}</text>'
    )
