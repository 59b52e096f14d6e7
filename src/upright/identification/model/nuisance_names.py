"""What may differ from run to run, by the names that studies and fits use."""

from __future__ import annotations

PER_RUN = ("initial", "offset", "gain", "friction", "input_offset", "input_start", "input_end")
"""What may differ from run to run: initial state, sensor offsets, actuator gain (a factor), dry and viscous friction
of every joint (one common factor), a constant added to the command, when the command really began and ended to act [s
from the first sample]. "offset.theta" means the offset of one sensor,
"scale.theta" its gain (a factor)."""


FOR_GROUPS = ("gain", "friction", "input_offset")
"""Of these a group of runs may share one value; of sensor offsets and gains too."""

SPREADS = {"friction": 0.3, "gain": 1.0, "scale": 1.0}
"""One sigma of the logarithm of a run's factor, unless the run says otherwise.

Friction of two runs of one day differed by 13 %, an actuator's gain by a factor of 3.2 (DESIGN 9).
"""
