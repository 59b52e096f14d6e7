"""Lines of a rig in space, z up, of which plants make their drawings."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

Point = tuple[Any, Any, Any]
Outline = list[tuple[str, list[Point]]]
"""Each line with the coordinate that moves it, empty for what stands; points [m] are expressions in the coordinates."""


def tip(length: Any, angle: Any) -> Point:
    """End of a rod that hangs at angle 0 and swings towards +x."""
    from sympy import cos, sin

    return length * sin(angle), 0, -length * cos(angle)


def point_beyond(point: Point, by: Point) -> Point:
    """A point and a vector added."""
    return point[0] + by[0], point[1] + by[1], point[2] + by[2]


def box(x: Any, width: float, height: float) -> list[Point]:
    """Sides of a cart at x, so wide and high."""
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))
    return [(x + a * width / 2, 0, b * height / 2) for a, b in corners]


def circle(radius: Any, z: float) -> list[Point]:
    """A level circle about the vertical through the origin."""
    turns = [2 * math.pi * k / 24 for k in range(25)]
    return [(radius * math.cos(a), radius * math.sin(a), z) for a in turns]


def in_javascript(outline: Callable[[Sequence[Any]], Outline], coordinates: int) -> str:
    """JavaScript of ``(q) => [[coordinate, [[x, y, z], ...]], ...]``, lines of the rig [m]; empty where it has none."""
    from sympy import Symbol

    symbols = [Symbol(f"q{i}") for i in range(coordinates)]
    lines = outline(symbols)
    if not lines:
        return ""
    line = '["{}", [{}]]'
    body = ", ".join(line.format(name, ", ".join(_point(p) for p in points)) for name, points in lines)
    constants = "; ".join(f"const q{i} = q[{i}]" for i in range(len(symbols)))
    return f"(q) => {{ {constants}; return [{body}]; }}"


def _point(point: Sequence[Any]) -> str:
    from sympy import jscode

    return f"[{', '.join(str(jscode(x)) for x in point)}]"
