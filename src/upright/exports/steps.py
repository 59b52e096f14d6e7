"""How long a step may be for the fastest motion of a rig."""

from __future__ import annotations

import math

from upright.rig import Rig

TURN = 0.25
"""Longest Runge-Kutta step, in radians of the fastest mode at rest: it errs by ``TURN**5/120``, 8e-6 of that mode."""


def substeps(rig: Rig, period: float) -> int:
    """Runge-Kutta steps in a period [s]."""
    return max(1, math.ceil(period * rig.fastest_mode / TURN))
