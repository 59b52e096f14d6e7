"""How strongly to excite a rig whose numbers are guesses: well within the drive's limit and travel, step by step."""

from __future__ import annotations

import math
from collections.abc import Iterable

REACH = {"rad": math.radians(12), "m": 0.02}
"""Amplitude that is wanted of a coordinate of a rig that nobody makes."""
OF_TRAVEL = 0.25
"""Most amplitude of the driven coordinate, as a share of its travel."""
SHARE = 0.8
"""Of the drive's limit."""
GROWTH = 3.0
"""Most by which a run is stronger than the one before."""
STILL = 0.5
"""Time at rest before a signal [s]."""


def swinging(poles: Iterable[complex]) -> list[complex]:
    """Those that are of a swing, both of each pair."""
    return [p for p in poles if abs(p.imag) > 1e-3 * abs(p)]
