"""Drawings of docs/tutorials/own_rig.md: wires from the firmware's own tables, and what of a rig's body matters, with its symbols."""

from __future__ import annotations

from html import escape
from pathlib import Path

from upright.rigs.firmware import BOARDS, pins, wiring

IMAGES = Path(__file__).parent / "images"
_LINE, _BODY, _MEASURE = "#222222", "#0072b2", "#d55e00"


def drawings() -> dict[str, str]:
    """SVG by file name."""
    wires = {
        f"wiring-{board.name}-{drive}.svg": wiring(board, drive, pins(board, drive))
        for board in BOARDS.values()
        for drive in board.drives
    }
    return {**wires, "rig-furuta.svg": furuta(), "rig-cart.svg": cart()}


def furuta() -> str:
    """A rotary pendulum from the side, hanging."""
    return _page(
        "Rotary (Furuta) pendulum, seen from the side, hanging",
        800,
        470,
        _box(150, 330, 90, 90, "motor with encoder 1"),
        _line(195, 330, 195, 150, _LINE, 6),
        _line(195, 150, 470, 150, _BODY, 12),
        _box(440, 128, 60, 44, ""),
        _text(530, 68, "encoder 2; its shaft is the hinge,"),
        _text(530, 86, "it points along the arm"),
        _line(500, 150, 516, 150, _LINE, 4),
        _line(516, 150, 516, 400, _BODY, 8),
        '<circle cx="516" cy="290" r="6" fill="white" stroke="#222222" stroke-width="2"/>',
        _text(500, 294, "centre of gravity of rod and tip", anchor="end"),
        _measure(195, 108, 516, 108, "r: axis of the motor to the plane of the rod, 12 to 20 cm"),
        _measure(560, 150, 560, 290, "l_cg, 10 to 15 cm"),
        _measure(690, 150, 690, 400, "25 to 30 cm"),
        _text(210, 250, "ψ: turn of the arm, counted by encoder 1"),
        _text(330, 440, "θ: from hanging, counted by encoder 2", anchor="start"),
        _line(40, 420, 330, 420, _LINE, 3),
        _text(40, 444, "a heavy base, or a clamp"),
        _text(60, 190, "cable in a loop,", anchor="start"),
        _text(60, 208, "±1.5 turns", anchor="start"),
    )


def cart() -> str:
    """A pendulum on a cart, hanging."""
    return _page(
        "Pendulum on a cart, seen from the side, hanging",
        760,
        420,
        _line(60, 150, 700, 150, _LINE, 6),
        _text(70, 178, "rail (linear bearing, MGN12)"),
        _box(300, 100, 120, 44, "cart"),
        _line(360, 144, 360, 350, _BODY, 8),
        '<circle cx="360" cy="250" r="6" fill="white" stroke="#222222" stroke-width="2"/>',
        '<circle cx="360" cy="144" r="12" fill="white" stroke="#222222" stroke-width="2"/>',
        _text(300, 86, "encoder 2; its shaft is the hinge, across the rail"),
        _text(376, 254, "centre of gravity"),
        '<circle cx="80" cy="122" r="22" fill="none" stroke="#222222" stroke-width="2"/>',
        _text(40, 78, "motor with encoder 1, pulley"),
        '<circle cx="680" cy="122" r="14" fill="none" stroke="#222222" stroke-width="2"/>',
        _line(80, 100, 680, 108, _LINE, 1.5),
        _line(80, 144, 680, 136, _LINE, 1.5),
        _text(560, 178, "belt, GT2"),
        _text(376, 330, "θ: from hanging, counted by encoder 2"),
        _text(376, 350, "rod of 25 to 30 cm"),
        _text(60, 380, "x: from the middle of the rail, counted by encoder 1"),
        _measure(520, 144, 520, 250, "l_cg, 10 to 15 cm"),
        _measure(120, 216, 300, 216, "free travel, 30 cm each way"),
        _text(60, 404, "bumpers of rubber at both ends, and the rail screwed down"),
    )


def _page(title: str, width: int, height: int, *parts: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'font-family="sans-serif">\n<rect width="{width}" height="{height}" fill="white"/>\n'
        + "\n".join((_text(24, 32, title, size=16, weight="bold"), *parts))
        + "\n</svg>\n"
    )


def _text(
    x: float, y: float, text: str, *, size: int = 13, weight: str = "normal", anchor: str = "start"
) -> str:
    return (
        f'<text x="{x}" y="{y}" font-size="{size}" font-weight="{weight}" text-anchor="{anchor}" fill="#111111">'
        f"{escape(text)}</text>"
    )


def _line(x1: float, y1: float, x2: float, y2: float, colour: str, width: float) -> str:
    return (
        f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="{colour}" stroke-width="{width}" '
        'stroke-linecap="round"/>'
    )


def _box(x: float, y: float, width: float, height: float, text: str) -> str:
    within = len(text) < 12
    at = (x + width / 2, y + height / 2 + 4) if within else (x + width + 10, y + height / 2)
    label = _text(*at, text, anchor="middle" if within else "start")
    return (
        f'<rect x="{x}" y="{y}" width="{width}" height="{height}" fill="#f2f2f2" stroke="{_LINE}" stroke-width="2"/>'
        + (label if text else "")
    )


def _measure(x1: float, y1: float, x2: float, y2: float, text: str) -> str:
    """A measure with its ends."""
    upright = x1 == x2
    ends = [_line(x - 6 * upright, y - 6 * (not upright), x + 6 * upright, y + 6 * (not upright), _MEASURE, 2)
            for x, y in ((x1, y1), (x2, y2))]  # fmt: skip
    where = (x1 + 10, (y1 + y2) / 2 + 4) if upright else ((x1 + x2) / 2, y1 - 10)
    return "".join((_line(x1, y1, x2, y2, _MEASURE, 2), *ends,
                    _text(*where, text, anchor="start" if upright else "middle")))  # fmt: skip
