"""Which unit and which role does a column most likely have, when the log does not say?"""

from __future__ import annotations

import re

import numpy as np

from upright.readers.quantum import Quantum
from upright.records import Array

_ANGLE = re.compile(r"theta|phi|psi|alpha|beta|angle|arm|joint.*position|pend", re.IGNORECASE)
_RATE = re.compile(r"velocity|speed|rate|_dot|omega|qd", re.IGNORECASE)
_COUNTS = re.compile(r"enc|count|cart\d*pos|\bpos\b", re.IGNORECASE)
_LENGTH = re.compile(r"^(z|x|pos(ition)?|distance|displacement)\d*$", re.IGNORECASE)
_VOLTS = re.compile(r"volt|plant_input|control_output|feedforward|^(u|v)$", re.IGNORECASE)
_DRIVE = re.compile(
    r"^(u|v|i)$|effort|control|command|cmd|input|volt|current|torque|target|duty|feedforward|pwm|ref", re.IGNORECASE
)


def guess_unit(name: str, values: Array, step: Quantum) -> str:
    """Unit from name and step; empty when neither tells."""
    whole = bool((values == np.round(values)).all()) and np.ptp(values) > 0
    if _RATE.search(name):
        return "" if whole else "rad/s" if _ANGLE.search(name) or "joint" in name else ""
    if whole and (np.ptp(values) >= 20 or _COUNTS.search(name)):
        return "counts"
    if step.counts_per_rev:
        return "rad"
    if _ANGLE.search(name) and float(np.abs(values).max()) < 2000 and "effort" not in name:
        return "rad"
    if _VOLTS.search(name):
        return "V"
    return "m" if _LENGTH.search(name) else ""


def is_drive(name: str, values: Array, unit: str) -> bool:
    """Whether a column drives rather than is measured: by name, or because it moves in a few steps only."""
    if _DRIVE.search(name):
        return True
    changes = int(np.count_nonzero(np.diff(values)))
    levels = np.unique(values).size
    return unit not in ("rad", "m", "counts") and 2 <= levels <= 5 and 0 < changes <= 0.1 * values.size
