"""First motions of a rig whose wiring nobody has checked: how it answers its drive, found out without hands.

The rig hangs at rest. A command that grows slowly shows when the driven body breaks away, to either side, and to which
side it goes; short kicks, each stronger than the last, show to which side the pendulum then goes. Knowing both signs as
the encoders show them, the drive swings the pendulum until it shows `SWING`, brakes the body, lets all coast, and calms
it again. The driven body is kept within `ROOM` of its travel: an encoder that shows a quarter of what is true still
leaves it inside.
"""

from __future__ import annotations

import math
from math import cos
from typing import Any

import numpy as np

from upright.control.swing_up import body
from upright.laws import Rule
from upright.rig import Rig

ROOM = 0.15
"""Amplitude of the driven body, as a share of its travel."""
WIDEST = {"rad": 0.6, "m": 0.06}
"""Most of that amplitude [rad or m]."""
SWING = math.radians(70)
"""Shown angle to which the pendulum is swung [rad]; true are 150 degrees where half is shown, and still no turn."""
SECONDS = 18.0
"""All of it [s]."""
FILTER, SLOW = 0.006, 0.05
"""Of the differences that give speeds, and of those that tell where something goes by itself [s]."""
WAITS, RISES, RESTS, FALLS, STOPS, KICKS, PUMPS, BRAKES, COASTS, CALMS, ENDS = range(11)
"""What it is doing, the first of what it remembers."""


def explore(t: float, y: Any, r: Any, z: Any, p: Any) -> tuple[Any, Any]:
    """One sample, as a `laws.Rule`; everything in what the encoders show."""
    period, memory, slowly, moved, leant, bound, most, reach, calm, centre, swing, end = p
    mode, since, q0, h0, v0, w0, marked, q1, h1, v, w, v_slow, w_slow, side, sign, level, gain, up, down, way, began = z
    q, h = y[0], y[1]
    v = memory * v + (1.0 - memory) * (q - q1) / period
    w = memory * w + (1.0 - memory) * (h - h1) / period
    v_slow, w_slow = slowly * v_slow + (1.0 - slowly) * v, slowly * w_slow + (1.0 - slowly) * w
    u, a, lasted, before = 0.0, 0.0, t - since, mode
    ramp = min(most * (lasted / 4.0) * (lasted / 4.0) * (lasted / 4.0), most)
    # beyond where it goes without a push: a body without dry friction coasts on
    further, lean = q - q0 - v0 * (t - marked), h - h0 - w0 * (t - marked)
    goes, leans = abs(further) > moved, abs(h) > 0.15
    if mode < 0.5:
        mode = 1.0 if lasted > 0.3 else mode
    elif mode < 1.5:
        u = ramp
        if goes or leans or lasted > 4.0:
            up, mode, u = ramp, 2.0, 0.0
            side = (1.0 if further > 0.0 else 0.0 - 1.0) if goes else 0.0
    elif mode < 2.5:
        mode = 3.0 if lasted > 0.5 else mode
    elif mode < 3.5:
        u = 0.0 - ramp
        if (further * side < 0.0 - 2.0 * moved) or (side == 0.0 and goes) or leans or lasted > 4.0:
            down, mode, u = ramp, 4.0, 0.0
    elif mode < 4.5:
        if lasted > 0.5:
            level, way, began = min(1.5 * max(up, down), most), 1.0, t
            mode = 5.0 if side != 0.0 else 10.0
    elif mode < 5.5:
        u = way * level if lasted < 0.2 else 0.0
        if lasted < 0.2 and abs(further) > 4.0 * moved and abs(lean) > 2.0 * leant:
            sign = 1.0 if further * lean > 0.0 else 0.0 - 1.0
            gain = 2.0 * abs(further) / ((level - 0.8 * max(up, down)) * lasted * lasted)
            mode, level = 6.0, 1.0
        elif lasted > 0.4:
            level, way, since, marked = min(2.0 * level, most), 0.0 - way, t, t - 1.0
        if t - began > 4.0 and mode < 5.5:
            mode = 10.0
    elif mode < 6.5:
        a = level * reach * min(max(sign * w * cos(h) / 0.3, 0.0 - 1.0), 1.0)
        level = level * (1.0 + (0.6 if abs(q) < 0.8 * bound else 0.0 - 3.0) * period)
        if abs(h) > swing or lasted > 7.0:
            mode = 7.0
    elif mode < 7.5:
        a = 0.0 - 4.0 * centre * v
        if lasted > 0.3:
            mode = 8.0
    elif mode < 8.5:
        if lasted > 3.0 or abs(q) > 1.5 * bound:
            mode = 9.0
    elif mode < 9.5:
        a = min(max(0.0 - sign * calm * w * cos(h), 0.0 - reach), reach)
    if mode > 5.5 and (mode < 7.5 or 8.5 < mode < 9.5):
        a = a - centre * centre * q - 1.5 * centre * v
        u = side * (a / gain + 0.9 * max(up, down) * min(max(20.0 * a / reach, 0.0 - 1.0), 1.0))
        u = min(max(u, 0.0 - most), most)
    if mode != before:
        since, marked = t, t - 1.0
    if (mode < 4.5 and t - marked > 0.2) or t - marked > 0.9:
        q0, h0, v0, w0, marked = q, h, v_slow, w_slow, t
    if t > end:
        mode, u = 10.0, 0.0
    return (u,), (
        mode,
        since,
        q0,
        h0,
        v0,
        w0,
        marked,
        q,
        h,
        v,
        w,
        v_slow,
        w_slow,
        side,
        sign,
        level,
        gain,
        up,
        down,
        way,
        began,
    )


def exploration(model: Rig, travel: float) -> Rule:
    """The law `explore` for a rig of which its encoders' counts and its largest command are known.

    Parameters
    ----------
    model : Rig
        As its owner describes it.
    travel : float
        How far the driven body may go from where it is [m or rad].
    """
    counts, b = np.abs(model.resolution), body(model)
    bound = min(ROOM * travel, WIDEST[model.plant.coordinates[0].unit])
    numbers = (
        model.period, math.exp(-model.period / FILTER), math.exp(-model.period / SLOW),
        max(6.0 * float(counts[0]), 0.03 * bound), max(6.0 * float(counts[1]), 0.01), bound, model.limit,
        min(0.5 * b.weight / abs(b.kappa), 0.5 * bound * b.omega**2), 0.6 * b.omega * b.J / abs(b.kappa),
        0.45 * b.omega, SWING, SECONDS - 0.3,
    )  # fmt: skip
    return Rule(function=explore, parameters=numbers, initial=np.zeros(21), period=model.period)
