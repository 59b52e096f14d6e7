"""Draw a twin that swings up and stands, as one SVG that moves by itself: `python -m docs.moving_picture`.

The motion is that of `upright swing-up --rig furuta --seed 1`, drawn by the plant's own outline.
"""

from __future__ import annotations

import math
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import upright as up
from upright.report.drawing import BLUE, GREY, VERMILLION

Array = NDArray[np.float64]

OUT = Path(__file__).parent / "images" / "twin.svg"
SECONDS, FRAMES = 4.2, 126  # 30 a second
WIDTH, HEIGHT = 760, 300
AZIMUTH, ELEVATION, SCALE = math.radians(-35), math.radians(20), 330.0
AXES = {
    "theta": (330, 36, 400, 100, 0.0, 180.0, "pendulum, from hanging [deg]"),
    "u": (330, 178, 400, 84, -1.5, 1.5, "command [V]"),
}


def picture() -> str:
    """The SVG."""
    swing = up.swing_up(rig="furuta", seed=1).value
    trial = swing.ascent.trial
    at = np.linspace(0, SECONDS, FRAMES)
    psi, theta = (np.interp(at, trial.t, trial.x[:, column]) for column in (0, 2))
    plant = swing.truth.plant
    frames = [plant.outline(plant, [float(a), float(b)]) for a, b in zip(psi, theta, strict=True)]
    body = [_title(), *_rig(frames)]
    body += _trace(
        "theta", at, np.abs(np.degrees(np.interp(at, trial.t, trial.x[:, 2]))), VERMILLION
    )
    body += _trace("u", at, np.interp(at, trial.t, trial.u), BLUE)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        'font-family="sans-serif" role="img" aria-label="A simulated rotary pendulum swings up and stands">\n'
        f'<rect width="{WIDTH}" height="{HEIGHT}" rx="8" fill="white"/>\n'
        + "\n".join(body)
        + "\n</svg>\n"
    )


def _title() -> str:
    return (
        f'<text x="20" y="24" font-size="13" fill="{GREY}">SIMULATED: swing-up of an identified rig</text>'
        f'<text x="530" y="292" font-size="12" text-anchor="middle" fill="{GREY}">time [s]</text>'
    )


def _on_page(point: tuple[float, float, float]) -> tuple[float, float]:
    x, y, z = (float(v) for v in point)
    a, e = AZIMUTH, ELEVATION
    right = x * math.cos(a) + y * math.sin(a)
    above = z * math.cos(e) + (y * math.cos(a) - x * math.sin(a)) * math.sin(e)
    return 150 + SCALE * right, 165 - SCALE * above


def _rig(frames: list) -> list[str]:
    """Lines of the outline; what no coordinate moves stands still."""
    out = []
    for number, (name, _) in enumerate(frames[0]):
        paths = [
            " ".join("{:.1f},{:.1f}".format(*_on_page(p)) for p in frame[number][1])
            for frame in frames
        ]
        colour, width = {"theta": (VERMILLION, 6), "psi": (BLUE, 6)}.get(name, (GREY, 1.5))
        moves = "" if len(set(paths)) == 1 else _animate("points", paths)
        out.append(
            f'<polyline points="{paths[0]}" fill="none" stroke="{colour}" stroke-width="{width}" '
            f'stroke-linecap="round" stroke-linejoin="round">{moves}</polyline>'
        )
    return out


def _animate(attribute: str, values: list[str]) -> str:
    return f'<animate attributeName="{attribute}" dur="{SECONDS}s" repeatCount="indefinite" values="{";".join(values)}"/>'


def _trace(name: str, t: Array, values: Array, colour: str) -> list[str]:
    """Axes, the whole trace in grey, and a dot that follows the motion."""
    left, top, width, height, low, high, label = AXES[name]
    x = left + width * t / SECONDS
    y = top + height * (high - values) / (high - low)
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    length = sum(math.dist(a, b) for a, b in pairwise(zip(x, y, strict=True)))
    ticks = [
        f'<text x="{left - 6}" y="{top + height * (high - v) / (high - low) + 4:.0f}" font-size="11" '
        f'text-anchor="end" fill="{GREY}">{v:g}</text>'
        for v in (low, (low + high) / 2, high)
    ]
    if name == "u":
        ticks += [
            f'<text x="{left + width * s / SECONDS:.0f}" y="{top + height + 15}" font-size="11" '
            f'text-anchor="middle" fill="{GREY}">{s}</text>'
            for s in range(int(SECONDS) + 1)
        ]
    drawn = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    return [
        f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#cccccc"/>',
        f'<text x="{left}" y="{top - 6}" font-size="12" fill="{colour}">{label}</text>',
        *ticks,
        f'<polyline points="{line}" fill="none" stroke="#cccccc" stroke-width="1.5"/>',
        f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2" '
        f'stroke-dasharray="{length:.0f}" stroke-dashoffset="0">'
        + _animate("stroke-dashoffset", [f"{length - d:.0f}" for d in drawn])
        + "</polyline>",
        f'<circle r="4" cx="{x[-1]:.1f}" cy="{y[-1]:.1f}" fill="{colour}">'
        + _animate("cx", [f"{v:.0f}" for v in x])
        + _animate("cy", [f"{v:.1f}" for v in y])
        + "</circle>",
    ]


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else OUT
    target.write_text(picture(), encoding="utf-8")
    print(f"{target.name}: {target.stat().st_size / 1e3:.0f} kB")
