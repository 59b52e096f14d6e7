"""Which numbers does a drive have, and at which values do they do nothing?"""

from __future__ import annotations

import math

ACTUATOR_DEFAULTS = {
    "gain": 1.0,
    "offset": 0.0,
    "limit": math.inf,
    "lag": 0.0,
    "delay": 0.0,
    "slope": 0.0,
    "start": -math.inf,
    "end": math.inf,
    "damping": 0.0,
    "standby": 0.0,
    "knee": math.inf,
    "fade": 0.0,
    "relaxation": 0.0,
}
"""Actuator parameters of each input, in the kernel's order, with the values at which they do nothing."""

ACTUATOR = tuple(ACTUATOR_DEFAULTS)
