"""Is the pendulum of this log kept upright? What a draft then says: horizons, offsets, starts from accelerations.

A pendulum that stands falls away from where it is, one that hangs falls back: the sign of its acceleration per angle
tells, once what its hinge throws at it is taken into account.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from upright.physics import Plant
from upright.records import Record
from upright.signals.smoothing import savitzky_golay
from upright.signals.trip_regression import smoothing_width_for
from upright.study.draft.recognise import Recognised
from upright.study.sensors import Array

SMALL = 0.6
"""Radians within which a pendulum that a loop keeps upright stays; beyond it, it falls."""

BUSY = 0.8
"""Share of the time in which the effort of a balancing loop is at work."""

SMOOTHED = 0.06, 0.2
"""Seconds over which accelerations are taken, at least and at most, as counts demand; all goes through the same."""

MASS = 0.1
"""Of a pendulum that nobody weighed [kg]."""

_G = 9.81


@dataclass(frozen=True, kw_only=True)
class Standing:
    """A pendulum near upright.

    `rate` [rad/s]: square root of its acceleration per angle; `throw`: its acceleration per that of the first
    coordinate; `pull`: acceleration of the first coordinate per unit of effort; `centre`: reading upright.
    """

    rate: float
    throw: float
    pull: float
    centre: float

    @property
    def length(self) -> float:
        """Of the simple pendulum of equal rate [m]."""
        return _G / self.rate**2

    def arm(self) -> float:
        """Of the axis of a rotary pendulum from that of its arm [m], in keeping with the length."""
        return min(max(abs(self.throw), 0.3), 3.0) * self.length

    def inertia(self, plant: str) -> float:
        """That the effort moves, with the pendulum's mass taken for `MASS` [kg or kg m^2]."""
        return 5 * MASS if plant == "cart-pendulum" else 2 * MASS * self.arm() ** 2

    def gain(self, plant: str) -> float:
        """Force per unit of effort that moves this inertia as was seen."""
        return max(abs(self.pull), 1e-6) * self.inertia(plant)


def standing(record: Record, found: Recognised) -> Standing | None:
    """How a pendulum stands, None when it hangs, or swings, or nothing works to keep it up."""
    if found.plant not in ("cart-pendulum", "furuta") or found.drive is None or len(found.columns) < 2:
        return None
    first, last = (record[c.name] * _si(c.guess) for c in found.columns.values())
    u = record[found.drive.name]
    centre = float(np.median(last))
    tilt = last - centre
    if np.abs(tilt).max() > SMALL or np.mean(np.abs(u) > 1e-3 * np.abs(u).max()) < BUSY:
        return None
    dt = float(record.t[-1] - record.t[0]) / (record.t.size - 1)
    steps = [(c.quantum.step or 0.0) * _si(c.guess) for c in found.columns.values()]
    wide = max(smoothing_width_for(x, dt, step) for x, step in zip((first, tilt), steps, strict=True))
    width = max(7, int(min(max(wide, SMOOTHED[0] / dt), SMOOTHED[1] / dt)) | 1)
    if record.t.size < 30 * width:
        return None
    arm, pendulum = (savitzky_golay(x, dt, width) for x in (first, tilt))
    push = savitzky_golay(u, dt, width).q
    inside = slice(width, -width)
    throw, away = _slopes(pendulum.a, [arm.a, pendulum.q], inside)
    pull, *_ = _slopes(arm.a, [push, pendulum.q, arm.v, np.sign(arm.v), np.ones_like(push)], inside)
    if away <= 0:
        return None
    without = _residual(pendulum.a, [arm.a], inside)
    if _residual(pendulum.a, [arm.a, pendulum.q], inside) > 0.9 * without:
        return None
    return Standing(rate=math.sqrt(away), throw=throw, pull=pull, centre=centre)


def upright_recognised(found: Recognised, how: Standing) -> Recognised:
    """What was recognised, with signs and the reading of the pendulum's zero, half a turn from upright.

    Hanging, an arm throws its pendulum forward and a cart backward (fig. 3a and eq. (A1)); upright it is the reverse.
    """
    throw = how.throw * (1 if found.plant == "furuta" else -1)
    mirrored = throw > 0
    last = list(found.columns)[-1]
    scale = _si(found.columns[last].guess)
    zero = (how.centre + (math.pi if mirrored else -math.pi)) / scale
    return replace(
        found, reversed=how.pull < 0, mirrored=mirrored, rest={**found.rest, last: zero},
        window=found.window, frequency=how.rate,
        doubts=(*found.doubts, "The pendulum falls away from where it is kept: it was taken for balanced upright, and"
                " is predicted 50 and 200 ms ahead.") ,
    )  # fmt: skip


def upright_starts(
    how: Standing, plant: str
) -> tuple[dict[str, tuple[float, str]], dict[str, float], dict[str, tuple[float, str]]]:
    """Known numbers and why, asked ones, and those known about with their uncertainty."""
    scale = "MEASURE: sets the scale of all forces"
    known = {"m_p": (MASS, scale), "J_p": (0.0, "with 0, l_cg is the length of the simple pendulum of equal period")}
    inertia = how.inertia(plant)
    asked = {"l_cg": how.length, "b_1": 2 * inertia, "b_1c": 0.02 * how.gain(plant)}
    if plant == "cart-pendulum":
        return known | {"m_c": (inertia, "MEASURE")}, asked, {}
    return known, asked | {"J_d": inertia / 2, "k_psi": 2 * inertia}, {"r": (how.arm(), "30 %")}


def upright_defaults(plant: type[Plant]) -> str:
    """Keys of [defaults] for a balanced pendulum."""
    last = plant.coordinates[-1].name
    return (
        'horizon = ["50 ms", "200 ms"]   # a free run of an unstable plant tells nothing\n'
        f'unknown = ["offset.{last}", "input_offset"]   # where the counter was zeroed; what leans on the first body'
    )


def _si(unit: str) -> float:
    return {"deg": math.pi / 180, "mm": 1e-3, "counts": 2 * math.pi / 4096}.get(unit, 1.0)


def _slopes(a: Array, columns: list[Array], inside: slice) -> list[float]:
    slopes, *_ = np.linalg.lstsq(np.column_stack(columns)[inside], a[inside], rcond=None)
    return [float(s) for s in slopes]


def _residual(a: Array, columns: list[Array], inside: slice) -> float:
    table = np.column_stack(columns)[inside]
    slopes, *_ = np.linalg.lstsq(table, a[inside], rcond=None)
    return float(np.sum((a[inside] - table @ slopes) ** 2))
