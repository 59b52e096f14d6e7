"""Draft of a study of carts on springs or disks on a shaft, and where the search for its numbers starts.

Nobody measured how hard the drive pushes: 1 N/V (N m/V) is assumed, and masses, springs and friction follow from the
motion: each body's acceleration is regressed on the columns of its equation, all through the same smoothing. With a
gain of 1 (or, for a free swing, an inertia of 1) the slopes are the numbers of the plant, roughly.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from upright.physics import Plant, find
from upright.physics.regressor import regressor
from upright.quantities import with_unit
from upright.readers.inspection import DAC_COUNTS_PER_VOLT, Column
from upright.records import Array, Record
from upright.records.columns import ANGLES, LENGTHS
from upright.signals.regression import LeastSquares
from upright.signals.smoothing import acceleration_width, savitzky_golay, smoothed
from upright.signals.stretches import pieces
from upright.signals.trips import find_trip
from upright.study.draft.chain_log import ChainLog
from upright.study.draft.plausible import implausible
from upright.study.draft.recognise import Recognised, in_dac_counts, swing_frequency
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

REACH = 10.0
"""Volts that ECP's converter can put out; its log shows what the program requested."""

RESOLVED = 0.003
"""Sample period [s] above which the braking of a drive, built up in some 30 ms, is neither seen nor estimated."""

RESTS = 0.01
"""Share of its travel by which a body at rest may creep."""

FAR = 50.0
"""Steps of a sensor from which a ratio of two displacements is known to some percent."""

LAGS = 0.95
"""Share of its neighbour's displacement above which dry friction may hold a body back as well as a spring."""

PASSES = 0.1
"""Share of its range that a converter's amplifier may pass when a command exceeds the range; where a search begins."""


@dataclass(frozen=True, kw_only=True)
class ChainStarts:
    """Where the search for each number of a chain begins, in SI.

    `numbers` by the plant's own names; `braked` [force per speed]: damping that acts with the volts on alone, 0 when
    they never go off; `trips`: whether the drive went off although it is logged as on; `limit`: of the command, 0 where
    it stays within reach; `fastest`: angular frequency [rad/s] of the fastest swing; `grounded`: where the last body
    rests beside its neighbour under a constant command, None where it does not lag behind.
    """

    numbers: dict[str, float]
    braked: float
    trips: bool
    limit: float
    fastest: float
    grounded: float | None = None


def chain_tables(record: Record, log: ChainLog, file: str, label: str) -> tuple[Recognised, list[TomlTable]]:
    """What is recognised in the end, and the tables of a study about it."""
    plant = find(log.recognised.plant)
    start = _starts_of(record, log, plant)
    runs = [(f"{label} {i + 1}", a, b, "fit") for i, (a, b) in enumerate(log.windows)]
    if len(log.windows) == 1:
        drive = None if log.loop else log.recognised.drive
        runs = driven_runs(record, drive, log.windows[0], start.fastest, label)
    tail = len(log.windows) == 1 and len(runs) > 1
    doubts = implausible(plant, start.numbers, scaled_by="the assumed 1 N (N m) per volt")
    if start.grounded is not None:
        doubts.append(
            f"Under a constant command the last body rests at {start.grounded:.2f} of its neighbour's place: a spring"
            " to ground is estimated for it."
        )
    tables = [
        _rig(record, log, plant, start),
        _parameters(log, plant, start),
        *_drive(log, plant, start),
        *(_sensor(log, plant, name) for name in log.recognised.columns),
        _defaults(log, start, waits=not tail),
        *_runs(log, file, runs, waits=tail),
    ]
    return replace(log.recognised, doubts=(*log.recognised.doubts, *doubts)), tables


def _unit(plant: type[Plant], name: str) -> str:
    return next(k.unit for k in plant.coordinates if k.name == name)


def _factor(log: ChainLog, plant: type[Plant], name: str) -> float:
    """SI per unit of a column."""
    c = log.recognised.columns[name]
    if c.guess == "counts":
        return 2 * np.pi / log.counts["rad"][0] if _unit(plant, name) == "rad" else 1 / log.counts["m"][0]
    return (ANGLES | LENGTHS).get(c.guess, 1.0)


def _volts(c: Column) -> tuple[str, float]:
    """Unit of the command and its factor on the column: a loop's output in counts is the converter's."""
    unit, scale = command_unit(c)
    return ("V", 1 / DAC_COUNTS_PER_VOLT) if _of_converter(c) else (unit or "V", scale)


def _of_converter(c: Column) -> bool:
    return in_dac_counts(c) or (c.guess == "counts" and not re.search("pwm|duty", c.name, re.IGNORECASE))


def _starts_of(record: Record, log: ChainLog, plant: type[Plant]) -> ChainStarts:
    a, b = log.windows[0]
    rows = (record.t >= a) & (record.t <= b)
    columns, drive = log.recognised.columns, log.recognised.drive
    factors = {n: _factor(log, plant, n) for n in columns}
    u, reach = None, np.inf
    if drive is not None:
        scale = _volts(drive)[1]
        u = record[drive.name][rows] * (-scale if log.recognised.reversed else scale)
        reach = REACH if _of_converter(drive) else np.inf
    return starts(
        record.t[rows],
        u,
        [(record[c.name][rows] - log.recognised.rest[n]) * factors[n] for n, c in columns.items()],
        [n not in log.fixed for n in columns],
        plant=plant,
        quanta=[(c.resolution.step or 0.0) * factors[n] for n, c in columns.items()],
        loop=log.reference is not None,
        reach=reach,
    )


def _rig(record: Record, log: ChainLog, plant: type[Plant], start: ChainStarts) -> TomlTable:
    every = int(2 * np.pi / start.fastest / 120 / record.period)
    coarse = not log.loop and every > 1
    return rig_toml(log.recognised.plant, plant, record, min(every, 4) * record.period if coarse else 0.0)


def _parameters(log: ChainLog, plant: type[Plant], start: ChainStarts) -> TomlTable:
    driven, carts = log.recognised.drive is not None, not log.disks
    stuck = [c.name in log.fixed for c in plant.coordinates]
    table = TomlTable("[parameters]")
    left: list[str] = []
    scaled = driven
    for name in plant.names():
        what = plant.quantity(name)
        value = start.numbers.get(name)
        body = int(tail[-1]) - 1 if (tail := name.rstrip("cqs"))[-1].isdigit() else -1
        inertia = name[:2] in ("m_", "J_")
        if inertia and stuck[body]:
            table.key(name, assumed(start.numbers[name], what.unit), f"{what.meaning}; held, so it does not matter")
        elif inertia and not scaled:
            scaled = True
            why = "MEASURE: a free swing sees only ratios"
            table.key(name, assumed(start.numbers[name], what.unit), f"{what.meaning}; {why}")
        elif name.startswith("k_") and len(name) == 4 and all(stuck[int(end) - 1] for end in name[2:]):
            table.key(name, assumed(1, what.unit), f"{what.meaning}; both held, so it does not matter")
        elif carts and name == "k_12" and driven and len(stuck) == 2 and stuck[1]:
            why = "MEASURE: with body 2 held, only k_1 + k_12 is seen"
            table.key(name, assumed(start.numbers["k_1"] / 2, what.unit), f"{what.meaning}; {why}")
        elif carts and name == "k_1" and stuck[0] and len(stuck) > 1:
            table.key(name, assumed(0, what.unit), f"{what.meaning}; pulls at the hand")
        elif name.startswith("delta_") and not driven and not stuck[body]:
            # a free swing ends in small reversals, which tell how far a body moves before its friction is whole
            coordinate = plant.coordinates[body].name
            c = log.recognised.columns[coordinate]
            least = max(3 * (c.resolution.step or 0.0), 1e-4 * (c.high - c.low)) * _factor(log, plant, coordinate)
            guess = {"guess": with_unit(5 * least, what.unit, 2), "min": with_unit(least, what.unit, 2)}
            table.key(name, guess, what.meaning)
        elif value is not None:
            half = 0.5 if carts and name == "k_1" and len(stuck) == 2 and stuck[1] else 1.0
            table.key(name, {"guess": with_unit(half * value, what.unit), "min": 0}, what.meaning)
        else:
            left.append(name)
    parameters_left_at_zero(table, plant, left)
    return table


def _drive(log: ChainLog, plant: type[Plant], start: ChainStarts) -> list[TomlTable]:
    c, force = log.recognised.drive, plant.inputs[0]
    if c is None:
        return [no_drive_table()]
    unit, scale = _volts(c)
    damping = per(force.unit, f"{_unit(plant, force.on)}/s")
    actuator = TomlTable("[actuator]")
    why = f"{force.meaning} per command: not measured, so masses, springs and friction are per that"
    actuator.key("gain", assumed(1, per(force.unit, unit)), why)
    braked = {"guess": with_unit(start.braked, damping), "min": 0}
    actuator.key("damping", braked, "of the drive while commanded", off=not start.braked)
    if start.braked:
        relaxation = {"guess": "30 ms", "min": 0, "max": "2 s"}
        actuator.key("relaxation", relaxation, "time in which that builds up and fades")
    if start.limit:
        actuator.key("limit", {"guess": with_unit(start.limit, unit), "min": 0}, "more does not reach the bodies")
    actuator.key("delay", {"guess": "2 ms", "max": "50 ms"}, off=not log.disks or bool(log.loop))
    return [drive_table(c, unit, scale, reversed_=log.recognised.reversed), actuator]


def _sensor(log: ChainLog, plant: type[Plant], name: str) -> TomlTable:
    coordinate = next(k for k in plant.coordinates if k.name == name)
    counts, whose = log.counts[coordinate.unit]
    sentence = f"{whose}; what is in V, s and counts does not depend on it"
    driven = log.recognised.drive is not None
    return sensor_table(
        coordinate, log.recognised.columns[name], log.recognised.rest[name], (counts, sentence), driven=driven
    )


def _runs(log: ChainLog, file: str, runs: list[tuple[str, float, float, str]], *, waits: bool) -> list[TomlTable]:
    tables = run_tables(file, runs)
    if waits:
        _waits(log, tables[0])
    return tables


def _waits(log: ChainLog, table: TomlTable) -> None:
    """Bodies that rest at first."""
    still = [n for n in log.still if n not in log.fixed]
    if still:
        table.key("initial", {f"{n}_dot": 0 for n in still}, "they wait for the first command")


def _defaults(log: ChainLog, start: ChainStarts, *, waits: bool) -> TomlTable:
    table = TomlTable("[defaults]")
    if log.held:
        table.key("held", log.held, "their measured motion is prescribed")
    if log.locked:
        table.key("locked", log.locked)
    if waits:
        _waits(log, table)
    unknown = ["initial"]
    if "ki =" in log.loop:
        unknown.append("input_offset")  # what the loop had summed up before the window
    elif not log.disks or log.fixed:
        unknown.append("offset")
    unknown += ["friction"] if len(log.windows) > 2 else []
    unknown += ["input_end"] if start.trips else []
    table.key("unknown", unknown, "estimated for each run alone")
    if log.loop:
        table.line(log.loop, "read off the log")
    return table


def starts(
    t: Array,
    u: Array | None,
    bodies: list[Array],
    free: list[bool],
    *,
    plant: type[Plant],
    quanta: list[float],
    loop: bool,
    reach: float = np.inf,
) -> ChainStarts:
    """ChainStarts for a chain.

    Parameters
    ----------
    t : (N,) array
        Time of one stretch [s].
    u : (N,) array or None
        Command, signed so that it pushes body 1 up; None in free motion.
    bodies : list of (N,) arrays
        Coordinates, zero at rest [SI].
    free : list of bool
        Which of them nobody holds.
    plant : type of Plant
        The chain, as `upright.physics.chain` makes it.
    quanta : list of float
        Resolution of each [SI].
    loop : bool
        Whether `u` follows from the motion: trips are not looked for.
    reach : float
        Largest command that can be put out at all.
    """
    dt = float(t[-1] - t[0]) / (t.size - 1)
    k = max((i for i, f in enumerate(free) if f), key=lambda i: float(np.ptp(bodies[i])))
    width = min(acceleration_width(bodies[k], dt, quanta[k]), max(t.size // 12, 9) | 1)
    motion = smoothed(bodies, dt, width)
    command = u if u is not None else np.zeros(t.size)
    limit = PASSES * reach if np.abs(command).max() > reach else 0.0
    command = np.clip(command, -limit, limit) if limit else command
    switches = 0.1 < float(np.mean(command != 0)) < 0.95 and not loop and dt < RESOLVED
    w = _frequency(t, bodies, free)
    equations = regressor(plant, frozenset(plant.names()) - _sought(plant, free))
    acting = -equations.columns(motion.q, motion.v, motion.a)
    numbers: dict[str, float] = {}
    inertia, braked = 1.0, 0.0
    edge = slice(motion.edge, -motion.edge or None)
    for i, joint in enumerate(plant.joints):
        own = equations.own(i)
        assert own is not None  # a chain's mass matrix is diagonal
        if not free[i]:
            numbers[equations.base[own].text] = inertia
            continue
        v = motion.v[i]
        driven = i == 0 and u is not None
        columns = {b.text: acting[k, i] for k, b in enumerate(equations.base) if k != own and np.any(acting[k, i])}
        columns[joint.coulomb] = -np.sign(v) * (np.abs(v) > 0.02 * np.abs(v).max())
        if driven:
            columns["u"] = savitzky_golay(command, dt, width).q
            if switches:
                columns["on"] = -savitzky_golay(np.where(command != 0, v, 0.0), dt, width).q
        columns["constant"] = np.ones(t.size)
        answer = LeastSquares.of([c[edge] for c in columns.values()], -acting[own, i][edge])
        errors = answer.errors(answer.residual.size / width)  # as many independent samples as smoothing widths
        slope, error = (dict(zip(columns, x.tolist(), strict=True)) for x in (answer.slopes, errors))
        shared = next((n for n in columns if n in numbers and slope[n] > 0), "")
        if driven:
            clear = slope["u"] > 2 * error["u"] and not limit
            inertia = 1 / slope["u"] if clear else _by_first_motion(t, command, bodies[0])
            if switches:  # braking that builds up late looks like none, so it is asked wherever the volts go off
                braked = inertia * max(slope["on"], 0.2 * abs(slope[f"c_{i + 1}"]), 0.1 * w)
        elif shared:  # a spring pulls both its bodies alike
            inertia = numbers[shared] / slope[shared]
        numbers[equations.base[own].text] = inertia
        least = {f"c_{i + 1}": 0.01 * w, joint.coulomb: 0.01 * w * float(np.abs(v).max())}
        for name in columns.keys() & frozenset(plant.names()) - numbers.keys():
            numbers[name] = inertia * (max(slope[name], least[name]) if name in least else
                                       slope[name] if slope[name] > 0 else w**2)  # fmt: skip
    grounded = _lags_behind(command, bodies, quanta) if len(bodies) > 1 and free[-1] and free[-2] else None
    if grounded is not None:  # k_12 (x_1 - x_2) = k_2 x_2
        last = len(bodies)
        numbers[f"k_{last}"] = numbers[f"k_{last - 1}{last}"] * (1 / grounded - 1)
    trips = False
    if u is not None and not loop and free[0]:
        whole = regressor(plant)
        trips = find_trip(t, u, bodies[0], bodies[1:], resolution=quanta[0],
                          terms=lambda m: list(whole.acting(0, m.q, m.v, m.a))) is not None  # fmt: skip
    return ChainStarts(numbers=numbers, braked=braked, trips=trips, limit=limit, fastest=w, grounded=grounded)


def _sought(plant: type[Plant], free: list[bool]) -> frozenset[str]:
    """Parameters that act on bodies which nobody holds, but springs to ground: of carts, and of a lone disk, the first.

    Where the second cart is held, its spring pulls the first one as one to ground does, and is taken for that.
    """
    disks, n = plant.coordinates[0].unit == "rad", len(free)
    inertias = {f"{'J' if disks else 'm'}_{i + 1}" for i in range(n)}
    dashpots = {f"c_{i + 1}" for i in range(n) if free[i]}
    grounded = free[0] and (not disks or n == 1)
    springs = {f"k_{i + 1}{i + 2}" for i in range(n - 1) if free[i + 1] or (free[i] and not (i == 0 and grounded))}
    return frozenset(inertias | dashpots | springs | ({"k_1"} if grounded else set()))


def _lags_behind(u: Array, bodies: list[Array], quanta: list[float]) -> float | None:
    """Share of its neighbour's displacement at which the last body rests under a constant command; None for all of it.

    Springs between bodies alone take all of them equally far; one to ground holds the last one back.
    """
    for start, stop in pieces(np.diff(u) != 0):  # the longest first
        if stop - start < 10:
            break
        late = slice(stop - (stop - start) // 5, stop)
        near, far = (y[late] for y in bodies[-2:])
        still = all(
            np.ptp(y[late]) <= max(3 * q, RESTS * float(np.ptp(y)))
            for y, q in zip(bodies[-2:], quanta[-2:], strict=True)
        )
        away = abs(float(np.median(near))) > max(FAR * quanta[-2], 0.1 * float(np.ptp(bodies[-2])))
        if u[start] != 0 and still and away:
            share = float(np.median(far) / np.median(near))
            return share if 0.05 < share < LAGS else None
    return None


def _frequency(t: Array, bodies: list[Array], free: list[bool]) -> float:
    """Angular frequency of the fastest swing that is seen, in the bodies or between them; 6 rad/s when none is."""
    from scipy.ndimage import uniform_filter1d

    signals = [y for y, f in zip(bodies, free, strict=True) if f]
    signals += [b - a for a, b in pairwise(signals)]
    fastest = max(swing_frequency(t, y - uniform_filter1d(y, y.size // 5, mode="nearest")) for y in signals)
    return fastest if fastest > 0 else 6.0


def _by_first_motion(t: Array, u: Array, x: Array) -> float:
    """Inertia that a constant push gives the first motion: x = u t^2/(2 m)."""
    at = int(np.argmax(u != 0))
    far = np.flatnonzero(np.abs(x[at:] - x[at]) > 0.1 * float(np.ptp(x)))
    if not far.size or far[0] < 2:
        return 1.0
    stop = at + int(far[0])
    push = abs(float(np.mean(u[at:stop])))
    return max(push, 1e-9) * float(t[stop] - t[at]) ** 2 / 2 / max(abs(float(x[stop] - x[at])), 1e-12)
