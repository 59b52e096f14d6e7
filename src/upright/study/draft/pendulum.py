"""Draft of a study of pendulums and of plants of the user's own: which numbers are assumed, which are estimated.

Nothing is known that nobody measured: a placeholder is assumed, so that the fit says what rests on it.

A pendulum that stands falls away from where it is, one that hangs falls back: the sign of its acceleration per angle
tells, once what its hinge throws at it is taken into account. One that a loop keeps upright is predicted over short
horizons, and its numbers start from accelerations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields, replace

import numpy as np

from upright.physics import Plant, find
from upright.quantities import with_unit
from upright.readers.inspection import Inspection
from upright.records import Record
from upright.records.columns import ANGLES, LENGTHS
from upright.signals.regression import LeastSquares
from upright.signals.smoothing import acceleration_width, savitzky_golay, smoothed
from upright.study.draft.accelerating import HEAVY
from upright.study.draft.described import counts_of
from upright.study.draft.hinge import hinge_of
from upright.study.draft.plausible import implausible
from upright.study.draft.recognise import Recognised, per_reading, pushed_coordinate
from upright.study.draft.tables import (
    assumed,
    command_unit,
    drive_table,
    driven_runs,
    no_drive_table,
    parameters_left_at_zero,
    rig_toml,
    run_tables,
    sensor_table,
)
from upright.study.rig import per
from upright.study.text import TomlTable

G = 9.81
MANY = 40_000
"""Samples beyond which a coarser grid is proposed."""

SMALL = 0.6
"""Radians within which a pendulum that a loop keeps upright stays; beyond it, it falls."""

BUSY = 0.8
"""Share of the time in which the effort of a balancing loop is at work."""

SMOOTHED = 0.06, 0.2
"""Seconds over which accelerations are taken, at least and at most, as counts demand; all goes through the same."""

MASS = 0.1
"""Of a pendulum that nobody weighed [kg]."""

SCALE = "MEASURE: sets the scale of all forces"
SIMPLE = "with 0, l_cg is the length of the simple pendulum of equal period; MEASURE l_cg and give this a guess"


@dataclass(frozen=True, kw_only=True)
class Balanced:
    """A pendulum that a loop keeps upright.

    `rate` [rad/s]: square root of its acceleration per angle; `throw`: its acceleration per that of the first
    coordinate, negative where it is counted against the plant's angle; `pull`: acceleration of the first coordinate
    per unit of effort; `centre`: reading upright.
    """

    rate: float
    throw: float
    pull: float
    centre: float

    @property
    def length(self) -> float:
        """Of the simple pendulum of equal rate [m]."""
        return G / self.rate**2

    def arm(self) -> float:
        """Of the axis of a rotary pendulum from that of its arm [m], in keeping with the length."""
        return min(max(abs(self.throw), 0.3), 3.0) * self.length

    def inertia(self, plant: str) -> float:
        """That the effort moves, with the pendulum's mass taken for `MASS` [kg or kg m^2]."""
        return 5 * MASS if plant == "cart-pendulum" else 2 * MASS * self.arm() ** 2

    def gain(self, plant: str) -> float:
        """Force per unit of effort that moves this inertia as was seen."""
        return max(abs(self.pull), 1e-6) * self.inertia(plant)


@dataclass(frozen=True, kw_only=True)
class PendulumStarts:
    """Numbers of a plant in SI: `assumed` with the reason, `guesses` to estimate, `uncertain` with how much [%].

    `known` are those of which nobody is asked, with the reason. `most` are what guesses are sought below.
    """

    assumed: Mapping[str, tuple[float, str]]
    guesses: Mapping[str, float]
    uncertain: Mapping[str, tuple[float, str]] = field(default_factory=dict[str, tuple[float, str]])
    known: Mapping[str, tuple[float, str]] = field(default_factory=dict[str, tuple[float, str]])
    most: Mapping[str, float] = field(default_factory=dict[str, float])


def pendulum_tables(
    record: Record, inspection: Inspection, recognised: Recognised, file: str, label: str
) -> tuple[Recognised, list[TomlTable]]:
    """What is recognised in the end, and the tables of a study about it."""
    plant = find(recognised.plant)
    balanced = balance_of(record, recognised)
    if balanced:
        recognised = recognised_upright(recognised, balanced)
    starts = starts_upright(balanced, recognised.plant) if balanced else starts_hanging(recognised, plant)
    if recognised.accelerates:
        starts = _carried(starts, plant)
    remarks = implausible(plant, {**{n: v for n, (v, _) in starts.assumed.items()}, **starts.guesses}, scaled_by="")
    recognised = replace(recognised, doubts=(*recognised.doubts, *remarks))
    tables = [_rig(record, recognised, plant), _parameters(plant, starts), *_drive(recognised, plant, balanced)]
    tables += [_sensor(inspection, recognised, plant, name) for name in recognised.columns]
    return recognised, [
        *tables,
        _defaults(recognised, plant, balanced),
        *_runs(record, recognised, file, label),
    ]


def balance_of(record: Record, recognised: Recognised) -> Balanced | None:
    """How a pendulum is balanced, None when it hangs, or swings, or nothing works to keep it up."""
    if recognised.plant not in ("cart-pendulum", "furuta") or recognised.drive is None or len(recognised.columns) < 2:
        return None
    first, last = (record[c.name] * per_reading(c) for c in recognised.columns.values())
    u = command_unit(recognised.drive)[1] * record[recognised.drive.name]
    centre = float(np.median(last))
    tilt = last - centre
    if np.abs(tilt).max() > SMALL or np.mean(np.abs(u) > 1e-3 * np.abs(u).max()) < BUSY:
        return None
    dt = float(record.t[-1] - record.t[0]) / (record.t.size - 1)
    steps = [(c.resolution.step or 0.0) * per_reading(c) for c in recognised.columns.values()]
    wide = max(acceleration_width(x, dt, step) for x, step in zip((first, tilt), steps, strict=True))
    width = max(7, int(min(max(wide, SMOOTHED[0] / dt), SMOOTHED[1] / dt)) | 1)
    if record.t.size < 30 * width:
        return None
    motion = smoothed([first, math.pi + tilt], dt, width)
    push = savitzky_golay(u, dt, width).q
    inside = slice(width, -width)
    hinge = hinge_of(find(recognised.plant), motion, inside)
    if hinge.gravity <= 0 or hinge.left > 0.9 * hinge.weightless:
        return None
    # close to upright all that the pendulum does to the first coordinate goes with its angle
    speed = motion.v[0]
    table = np.column_stack([push, motion.q[1], speed, np.sign(speed), np.ones_like(push)])[inside]
    pull = LeastSquares.of(table, motion.a[0][inside]).slopes[0]
    return Balanced(rate=math.sqrt(hinge.gravity), throw=hinge.throw, pull=float(pull), centre=centre)


def recognised_upright(recognised: Recognised, balanced: Balanced) -> Recognised:
    """What was recognised, with signs and the reading of the pendulum's zero, half a turn from upright."""
    mirrored = balanced.throw < 0
    last = list(recognised.columns)[-1]
    scale = per_reading(recognised.columns[last])
    zero = (balanced.centre + (math.pi if mirrored else -math.pi)) / scale
    return replace(
        recognised, reversed=balanced.pull < 0, throw=balanced.throw, rest={**recognised.rest, last: zero},
        window=recognised.window, frequency=balanced.rate,
        doubts=(*recognised.doubts, "The pendulum falls away from where it is kept: it was taken for balanced upright,"
                " and is predicted 50 and 200 ms ahead.") ,
    )  # fmt: skip


def starts_upright(balanced: Balanced, plant: str) -> PendulumStarts:
    """Numbers of a balanced pendulum on a cart or an arm."""
    assumed = {"m_p": (MASS, SCALE), "J_p": (0.0, SIMPLE)}
    inertia = balanced.inertia(plant)
    guesses = {"l_cg": balanced.length, "b_1": 2 * inertia, "b_1c": 0.02 * balanced.gain(plant)}
    # near upright gravity pulls by little, so that a hinge that rubs by a hundredth of it is felt
    guesses |= {"b_2": 0.002 * balanced.rate * MASS * balanced.length**2, "b_2c": 0.001 * G * MASS * balanced.length}
    if plant == "cart-pendulum":
        return PendulumStarts(assumed=assumed | {"m_c": (inertia, "MEASURE")}, guesses=guesses)
    return PendulumStarts(assumed=assumed, guesses=guesses | {"J_d": inertia / 2, "k_psi": 2 * inertia},
                  uncertain={"r": (balanced.arm(), "30 %")})  # fmt: skip


def starts_hanging(recognised: Recognised, plant: type[Plant]) -> PendulumStarts:
    """Numbers of a pendulum that swings about where it hangs; any other plant has sizes that swing as slowly."""
    w = recognised.frequency or 6.0
    length = G / w**2
    assumed = {"m_p": (1.0, f"{SCALE}; a swing alone shows only ratios"), "J_p": (0.0, SIMPLE)}
    if recognised.plant == "pendulum":
        friction = {"b_2": 0.002 * w * length**2, "b_2c": 0.002 * G * length, "b_2q": 0.002 * length**2}
        return PendulumStarts(assumed=assumed, guesses={"l_cg": length, **friction})
    if recognised.plant in ("cart-pendulum", "furuta"):
        assumed["m_p"] = (MASS, assumed["m_p"][1])
        guesses = {"l_cg": length, "b_2": 0.002 * w * MASS * length**2, "b_2c": 0.001 * G * MASS * length}
        moves = plant.coordinates[0].name in recognised.columns
        driven = recognised.drive is not None and moves
        # one mass sets the scale of all forces; what the pendulum does to what carries it tells the rest
        if recognised.plant == "cart-pendulum":
            if driven:
                guesses["m_c"] = 1.0
            else:
                assumed["m_c"] = (1.0, "MEASURE; not seen while the cart is held or locked")
        else:
            if moves:
                guesses["r"] = min(max(abs(recognised.throw) * length, 0.02), 2.0) if recognised.throw else 0.1
            else:
                assumed["r"] = (0.1, "MEASURE; not seen while the arm is locked")
            if driven:
                guesses["J_d"] = 1e-3
            else:
                assumed["J_d"] = (1e-3, "MEASURE; not seen while the arm is held or locked")
        if driven:
            guesses |= {"b_1": INERTIA[recognised.plant] * 1.0, "b_1c": INERTIA[recognised.plant] * 0.1}
        most = {"l_cg": LONGER * length, "r": 5.0} if recognised.frequency else {}
        return PendulumStarts(assumed=assumed, guesses=guesses, most={n: v for n, v in most.items() if n in guesses})
    required = [f.name for f in fields(plant) if f.default is MISSING]  # type: ignore[arg-type]
    sizes = {"m": length, "kg m^2": length**2, "N m/rad": (w * length) ** 2, "N/m": w**2}
    viscous = {"N m s/rad": 0.002 * w * length**2, "N s/m": 0.002 * w}
    rubbed = {n: viscous[unit] for n in plant.names() if (unit := plant.quantity(n).unit) in viscous}
    dry = [j.coulomb for j in plant.joints if j.coulomb]
    rubbed |= {n: 0.002 * G * (1.0 if plant.quantity(n).unit == "N" else length) for n in dry}
    return PendulumStarts(
        assumed=dict.fromkeys(required[:1], (1.0, "MEASURE")),
        guesses={n: sizes.get(plant.quantity(n).unit, 1.0) for n in required[1:]} | rubbed,
    )


def _carried(starts: PendulumStarts, plant: type[Plant]) -> PendulumStarts:
    """The same on a body that goes where it is commanded to: too heavy to be moved, its friction not asked for."""
    inertia, value = HEAVY[plant.inputs[0].on]
    gone = {inertia, "b_1", "b_1c", "k_psi"}
    return replace(
        starts, known={inertia: (value, "the drive commands its acceleration: so heavy that nothing on it moves it")},
        assumed={n: v for n, v in starts.assumed.items() if n not in gone},
        guesses={n: v for n, v in starts.guesses.items() if n not in gone},
    )  # fmt: skip


LONGER = 4.0
"""Times the length of its period that a pendulum may have: one of 76 m stands still, and explains its cart alone."""

INERTIA = {"furuta": 2e-3, "cart-pendulum": 1.1}
"""What the drive moves, where the search begins [kg m^2, kg]."""


def _rig(record: Record, recognised: Recognised, plant: type[Plant]) -> TomlTable:
    period = 0.0
    if (recognised.window[1] - recognised.window[0]) / record.period > MANY and recognised.frequency:
        period = max(1, int(2 * np.pi / recognised.frequency / 200 / record.period)) * record.period
    return rig_toml(recognised.plant, plant, record, period)


def _parameters(plant: type[Plant], starts: PendulumStarts) -> TomlTable:
    table = TomlTable("[parameters]")
    left: list[str] = []
    for name in plant.names():
        what = plant.quantity(name)
        if name in starts.known:
            value, why = starts.known[name]
            table.key(name, with_unit(value, what.unit), f"{what.meaning}; {why}")
        elif name in starts.assumed:
            value, why = starts.assumed[name]
            table.key(name, assumed(value, what.unit, 4), f"{what.meaning}; {why}")
        elif name in starts.uncertain:
            value, percent = starts.uncertain[name]
            table.key(name, {"value": with_unit(value, what.unit), "uncertainty": percent}, f"{what.meaning}; MEASURE")
        elif name in starts.guesses:
            most = {"max": with_unit(starts.most[name], what.unit)} if name in starts.most else {}
            table.key(name, {"guess": with_unit(starts.guesses[name], what.unit)} | most, what.meaning)
        elif name != "g":
            left.append(name)
    parameters_left_at_zero(table, plant, left)
    return table


def _drive(recognised: Recognised, plant: type[Plant], balanced: Balanced | None) -> list[TomlTable]:
    if recognised.drive is None or not plant.inputs:
        return [no_drive_table()] if plant.inputs else []
    unit, scale = command_unit(recognised.drive)
    force, driven = plant.inputs[0], pushed_coordinate(recognised.plant, recognised.columns)
    guess = balanced.gain(recognised.plant) if balanced else _gain(recognised)
    speed = next(f"{k.unit}/s" for k in plant.coordinates if k.name == force.on)
    actuator = TomlTable("[actuator]")
    if recognised.accelerates:
        inertia, value = HEAVY[force.on]
        actuator.key("gain", with_unit(value, per(force.unit, unit)), f"{inertia} times the acceleration commanded")
    else:
        gain = {"guess": with_unit(guess, per(force.unit, unit) if unit else force.unit), "min": 0}
        actuator.key("gain", gain, f"{force.meaning} per command; moves {driven} up")
    idle = with_unit(0, unit or force.unit)
    actuator.key("offset", {"guess": idle}, "command that the drive adds by itself", off=True)
    actuator.key("slope", {"guess": with_unit(0, per(force.unit, speed))}, "force lost per speed", off=True)
    actuator.key("lag", {"guess": "5 ms", "max": "0.1 s"}, off=True)
    actuator.key("delay", {"guess": "1 ms", "max": "10 ms"}, off=balanced is None)
    return [drive_table(recognised.drive, unit, scale, reversed_=recognised.reversed), actuator]


def _gain(recognised: Recognised) -> float:
    """Force per command of the right size: what the start inertia needs to swing as far as was seen."""
    assert recognised.drive is not None
    c = recognised.columns[pushed_coordinate(recognised.plant, recognised.columns)]
    swing = (c.high - c.low) / 2 * {"counts": 4e-4, **ANGLES, **LENGTHS}.get(c.guess, 1.0)
    u = max(abs(recognised.drive.low), abs(recognised.drive.high)) or 1.0
    u *= command_unit(recognised.drive)[1]
    w = recognised.frequency or 6.0
    inertia = INERTIA.get(recognised.plant, (G / w**2) ** 2)  # of the 1 kg that is assumed
    return max(inertia * swing * w**2 / u, 1e-9)


def _sensor(inspection: Inspection, recognised: Recognised, plant: type[Plant], name: str) -> TomlTable:
    c = recognised.columns[name]
    coordinate = next(k for k in plant.coordinates if k.name == name)
    mirrored = recognised.mirrored and name == plant.coordinates[-1].name
    return sensor_table(
        coordinate,
        c,
        recognised.rest[name],
        counts_of(inspection, coordinate.unit),
        driven=recognised.drive is not None,
        mirrored=mirrored,
    )


def _defaults(recognised: Recognised, plant: type[Plant], balanced: Balanced | None) -> TomlTable:
    table = TomlTable("[defaults]")
    missing = [c.name for c in plant.coordinates if c.name not in recognised.columns]
    if missing:
        table.key("locked", missing, "no column was found; give them a sensor if they move")
    if recognised.drive is None and not missing and recognised.plant in ("cart-pendulum", "furuta"):
        why = "its measured motion is prescribed, since no column holds its command"
        table.key("held", [plant.coordinates[0].name], why)
    if balanced:
        table.key("horizon", ["50 ms", "200 ms"], "a free run of an unstable plant proves nothing")
        unknown = [f"offset.{plant.coordinates[-1].name}", "input_offset"]
        table.key("unknown", unknown, "where the counter was zeroed; a constant force on the first body")
    else:
        unknown = ["initial"] if recognised.drive is not None and recognised.settled else ["initial", "offset"]
        table.key("unknown", unknown, "estimated for each run alone")
    return table


def _runs(record: Record, recognised: Recognised, file: str, label: str) -> list[TomlTable]:
    """One run; of a long one, free or driven, the tail is kept for prediction, and of several swings the last one."""
    start, stop = recognised.window
    if recognised.earlier:
        runs = [(f"{label} {i + 1}", a, b, "fit") for i, (a, b) in enumerate(recognised.earlier)]
        return run_tables(file, [*runs, (f"{label} {len(runs) + 1}", start, stop, "predict")])
    split = start + 0.6 * (stop - start)
    if recognised.drive is None and recognised.frequency * (stop - start) / (2 * np.pi) > 12:
        return run_tables(file, [(f"{label} start", start, split, "fit"), (f"{label} tail", split, stop, "predict")])
    moved = recognised.drive if len(recognised.columns) > 1 else None
    return run_tables(file, driven_runs(record, moved, recognised.window, recognised.frequency, label))
