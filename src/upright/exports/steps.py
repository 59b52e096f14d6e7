"""How long a step may be for the fastest motion of a rig."""

from __future__ import annotations

import math

import numpy as np

from upright.rig import Rig

TURN = 0.25
"""Longest Runge-Kutta step, in radians of the fastest mode at rest: it errs by ``TURN**5/120``, 8e-6 of that mode."""

_ASIDE = 1e-6
"""So far off an equilibrium is a rig that rests on a kink."""


def substeps(rig: Rig, period: float) -> int:
    """Runge-Kutta steps in a period [s]."""
    models = (rig.linear(at, side=side) for at in rig.plant.equilibria for side in (-_ASIDE, _ASIDE))
    fastest = max(np.abs(np.linalg.eigvals(model.A)).max() for model in models)
    return max(1, math.ceil(period * fastest / TURN))
