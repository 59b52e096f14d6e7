"""What a log shows without a description of the rig: plant, columns, stretches, rest levels, period."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from upright.errors import BadInput
from upright.physics import PLANTS, Plant, find
from upright.readers.inspection import Column, Inspection, effort_unit, is_supply
from upright.records import Array, Record
from upright.records.columns import ANGLES, LENGTHS, bare_name
from upright.signals.regression import LeastSquares
from upright.signals.release import free_from, free_swings
from upright.signals.smoothing import savitzky_golay, smoothed, white_noise
from upright.study.draft.accelerating import acceleration_command
from upright.study.draft.hinge import hinge_of
from upright.units import same_dimension

RATE = re.compile(r"velocity|speed|rate|_dot\b|omega|\bqd|accel", re.IGNORECASE)
_EFFORT = re.compile(r"effort|volt|current|torque|force|plant_input|cmd|duty|^(u|v|i)$", re.IGNORECASE)
REFERENCE = re.compile(r"target|reference|\bref\b|commanded|set.?point", re.IGNORECASE)
_ARM = re.compile(r"arm|psi|joint0|base|motor", re.IGNORECASE)
_CART = re.compile(r"cart|pos|^[xz]\d?$|distance|displacement", re.IGNORECASE)
_PENDULUM = re.compile(r"pend|pole", re.IGNORECASE)
_TURNS = re.compile(r"pend|angle|theta|pole|tilt", re.IGNORECASE)
_SI = ANGLES | LENGTHS
_COORDINATES = ("psi", "theta", "x")
"""Of the rigs that carry a pendulum."""
_DISK = re.compile(r"disk|disc|theta\s*_?[123]\b", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class Recognised:
    """What a log shows.

    Attributes
    ----------
    plant : str
        Plant that fits the columns.
    columns : mapping of str to Column
        Column per coordinate of the plant.
    rest : mapping of str to float
        Reading of each at rest, in the column's unit.
    drive : Column or None
        What commands the rig.
    reversed : bool
        Whether a positive command first moves the driven column down.
    throw : float
        Acceleration of the hanging pendulum per that of its hinge, negative where its column counts against the
        coordinate; 0 where the data do not tell.
    window : tuple of float
        Where something happens [s].
    frequency : float
        Of the slowest swing of the last coordinate [rad/s]; 0 when it does not swing.
    settled : bool
        Whether the last coordinate's zero was read where it lies still.
    doubts : tuple of str
        Sentences about what was guessed.
    earlier : tuple of (float, float)
        Where it swung before, until a hand brought it back [s].
    accelerates : bool
        Whether the drive commands the acceleration of its body, and not a force.
    """

    plant: str
    columns: dict[str, Column]
    rest: dict[str, float]
    drive: Column | None
    reversed: bool
    throw: float
    window: tuple[float, float]
    frequency: float
    settled: bool
    doubts: tuple[str, ...]
    earlier: tuple[tuple[float, float], ...] = ()
    accelerates: bool = False

    @property
    def mirrored(self) -> bool:
        """Whether the pendulum's column counts against the coordinate, judged by how the hinge's motion throws it."""
        return self.throw < 0


def recognise(record: Record, inspection: Inspection, plant: str = "") -> Recognised:
    """What is recognised in a record and its inspection; `plant` overrides the guess.

    Raises
    ------
    BadInput
        When nothing in the log moves.
    """
    positions = position_columns(record, inspection)
    if not positions:
        raise BadInput(
            f"{inspection.file}: no column moves like an angle, a position or a count; `upright show` lists all."
            f"{_of_sensors(inspection)}"
        )
    drive = drive_column(record, inspection)
    doubts: list[str] = []
    if not plant:
        plant, doubt = plant_of(positions, drive)
        doubts += [doubt] if doubt else []
    columns, missing = _assign(find(plant), positions)
    follows = acceleration_command(record, inspection, find(plant), columns)
    accelerates = follows is not None and (drive is None or drive.name == follows.name)
    if accelerates and follows is not None:
        drive, body = follows, columns[pushed_coordinate(plant, columns)].name
        doubts.append(
            f"'{drive.name}' is the acceleration of '{body}': taken for the command of a drive that follows it "
            f"whatever hangs there, as a stepper does."
        )
    elif drive is not None and not drive.drive and not record.inputs:
        doubts.append(f"'{drive.name}' is the only column in V or A beside what moves: taken for the command.")
    degrees = [c.name for c in columns.values() if c.guess == "deg" and inspection.column(c.name).guess == "rad"]
    doubts += [f"'{name}' swings to and fro by more than half a turn in rad: taken for degrees." for name in degrees]
    doubts += [
        f"'{c.name}' begins again after {c.counts_per_turn} counts: taken for one turn." for c in columns.values()
        if c.guess == "counts" and c.counts_per_turn
    ]  # fmt: skip
    doubts += [f"No column was found for {name}; lock it, leave it unmeasured or name its column." for name in missing]
    last = record[list(columns.values())[-1].name]
    pushed = plant in ("cart-pendulum", "furuta") and len(columns) > 1
    window = moving_window(record, inspection, [record[c.name] for c in columns.values()], drive, pushed=pushed)
    inside = (record.t >= window[0]) & (record.t <= window[1])
    stated = {n for place in find(plant).equilibria.values() for n in place}
    rest = {
        n: zero_reading(
            record, inspection, c, drive, window, hangs=n == "theta", anywhere=bool(stated) and n not in stated
        )
        for n, c in columns.items()
    }
    centre = rest[list(columns)[-1]]
    driven = record[next(iter(columns.values())).name]
    pushed_column = record[columns[pushed_coordinate(plant, columns)].name]
    earlier: tuple[tuple[float, float], ...] = ()
    turned = ANGLES.get(columns[list(columns)[-1]].guess, 0.0)
    if drive is None and turned and list(columns)[-1] == "theta":
        angle = turned * (last - centre)
        small = swing_frequency(record.t[inside], angle[inside])
        start = free_from(record.t, angle, small, window[0], driven if pushed else None)
        if start < window[1]:
            window = start, window[1]
        swings = free_swings(record.t, angle, driven if pushed else None)
        if len(swings) > 1:  # a hand has brought it back
            window, earlier = swings[-1], tuple(swings[:-1])
        inside = (record.t >= window[0]) & (record.t <= window[1])
    throw = 0.0
    if pushed and all(c.guess in (*ANGLES, "counts") or name == "x" for name, c in columns.items()):
        first, hanging = (per_reading(c) for c in columns.values())
        angle = hanging * (last[inside] - centre)
        throw = coupling(find(plant), record.t[inside], first * driven[inside], angle)
    return Recognised(
        plant=plant,
        columns=columns,
        rest=rest,
        drive=drive,
        reversed=drive is not None and moves_against(record.t, record[drive.name], pushed_column),
        throw=throw,
        window=window,
        frequency=swing_frequency(record.t[inside], last[inside] - centre),
        settled=bool(inspection.rests) or (drive is not None and _starts_still(last, record[drive.name])),
        doubts=tuple(doubts),
        earlier=earlier,
        accelerates=accelerates,
    )


def per_reading(c: Column) -> float:
    """What one unit of a column is [SI]; one count is that of a usual encoder, where no turn of the sensor was seen."""
    return 2 * math.pi / (c.counts_per_turn or 4096) if c.guess == "counts" else _SI.get(c.guess, 1.0)


def _of_sensors(inspection: Inspection) -> str:
    """What to try where only voltages and the like move."""
    moves = [c for c in inspection.columns if c.unit and not c.constant and not c.drive and not is_supply(c.name)]
    if not moves:
        return ""
    name, unit = moves[-1].name, moves[-1].unit
    return f" Where '{name}' is a sensor's reading, say what one {unit} of it is: --scale \"{name}=30 deg/{unit}\"."


def pushed_coordinate(plant: str, columns: Mapping[str, Column]) -> str:
    """The coordinate on which the drive acts, the first where none of the columns is that one's."""
    inputs = find(plant).inputs
    return inputs[0].on if inputs and inputs[0].on in columns else next(iter(columns))


def position_columns(record: Record, inspection: Inspection) -> list[Column]:
    """Columns that measure a place and move, without speeds, drives, clocks and liars."""
    kinds = (*ANGLES, *LENGTHS, "counts", "")
    places = [c for c in inspection.columns if not c.drive and c.name not in record.inputs and c.guess in kinds]
    columns = [c for c in places if not (c.constant or _mislabelled(c, inspection))]
    columns = [
        c for c in columns if not RATE.search(c.name) and not _is_speed(record, c.name, [o.name for o in columns])
    ]
    columns = [_in_degrees(record, _as_angle(record, c, inspection)) for c in columns]
    columns = [c for c in columns if c.guess] or columns
    span = {c.name: c.high - c.low for c in columns}
    largest = {unit: max(span[c.name] for c in columns if c.guess == unit) for unit in {c.guess for c in columns}}
    # a locked arm still moves by some mrad; counts of a cart's encoder and of a pendulum's are not of one size
    return [
        c
        for c in columns
        if span[c.name] > 0.01 * largest[c.guess] or (c.guess == "counts" and bare_name(c.name) in _COORDINATES)
    ]


def _mislabelled(c: Column, inspection: Inspection) -> bool:
    """Whether a column is not what it is called; of two equal ones, it is the reference or the later one."""
    names = [o.name for o in inspection.columns]
    earlier = [f"the same as '{o.name}'" for o in inspection.columns[: names.index(c.name)] if not o.drive]
    return any(not remark.startswith("the same as") or remark in earlier for remark in c.remarks)


def _is_speed(record: Record, name: str, others: list[str]) -> bool:
    """Whether a column is the slope of another one."""
    step = max(record.t.size // 5000, 1)
    x = record[name]
    for other in others:
        if other != name:
            slope = np.gradient(record[other], record.t)
            width = max(step, 5)
            a, b = (np.convolve(v, np.ones(width) / width, "valid")[::step] for v in (slope, x))
            if a.std() > 0 and b.std() > 0 and np.corrcoef(a, b)[0, 1] > 0.97:
                return True
    return False


def _as_angle(record: Record, c: Column, inspection: Inspection) -> Column:
    """A nameless column that comes to rest half a turn from zero is an angle."""
    if c.guess or c.high - c.low < 0.3:
        return c
    rest = rest_level(record[c.name], inspection, record.t)
    return replace(c, guess="rad") if abs(abs(rest) - math.pi) < 0.1 else c


def _in_degrees(record: Record, c: Column) -> Column:
    """A column guessed to be an angle in rad that swings to and fro by more than half a turn is one in degrees."""
    if c.unit or c.guess != "rad" or c.resolution.counts_per_rev:  # its steps are whole parts of a turn in rad
        return c
    x = record[c.name] - np.median(record[c.name])
    far = x[np.abs(x) > math.pi]
    return replace(c, guess="deg") if np.count_nonzero(np.diff(np.signbit(far))) >= TO_AND_FRO else c


TO_AND_FRO = 4
"""Passages from beyond half a turn on one side to beyond it on the other that no pendulum in rad makes."""


def in_dac_counts(c: Column) -> bool:
    """Whether a column holds the command in counts of ECP's converter."""
    return any(remark.startswith("the command in DAC counts") for remark in c.remarks)


def drive_column(record: Record, inspection: Inspection) -> Column | None:
    """What commands the rig.

    That is the column in converter counts, else one called like an effort, else one that looks so, else the only one in
    V or A beside places whose unit is known; where the record states an input, it is that.
    """
    dac = next((c for c in inspection.columns if in_dac_counts(c)), None)
    if dac is not None:
        return dac
    candidates = [c for c in inspection.columns if c.drive and not c.constant]
    candidates = [
        c for c in candidates if all(remark.startswith("the first samples are outliers") for remark in c.remarks)
    ]
    candidates = [c for c in candidates if not REFERENCE.search(c.name)]
    effort = [c for c in candidates if _EFFORT.search(c.name) or effort_unit(c.name)]
    drive = (effort or candidates or _of_its_unit(record, inspection) or [None])[0]
    stated = [inspection.column(name) for name in record.inputs]
    if not stated or (drive is not None and drive.name in record.inputs):
        return drive
    return drive if stated[0].constant else stated[0]


def _of_its_unit(record: Record, inspection: Inspection) -> list[Column]:
    """The only column in volts or amperes: no supply, no tachometer, no potentiometer of a body."""
    places = [c.name for c in inspection.columns if c.unit in _SI and not c.constant]
    electric = [c for c in inspection.columns if c.unit and any(same_dimension(c.unit, unit) for unit in ("V", "A"))]
    body = any(pattern.search(c.name) for c in electric for pattern in (_TURNS, _PENDULUM, _CART, _DISK))
    if len(electric) != 1 or not places or electric[0].constant or electric[0].remarks or body:
        return []
    return [] if is_supply(electric[0].name) or _is_speed(record, electric[0].name, places) else electric


def plant_of(places: list[Column], drive: Column | None) -> tuple[str, str]:
    """Plant whose coordinates look like these columns, and how sure that is."""
    if named := named_after(places):
        return named, f"The columns have the names of the coordinates of {named}."
    lengths = [c for c in places if c.guess in LENGTHS]
    counts = [c for c in places if c.guess in ("counts", "")]
    angles = [c for c in places if c.guess in ANGLES]
    bodies = min(len(counts), 3)
    turning = [c.name for c in counts if _TURNS.search(bare_name(c.name)) and not _DISK.search(bare_name(c.name))]
    if turning and not angles and not lengths and len(counts) < 3:
        by_name = f"Counts of '{turning[0]}' were taken for the angle of a pendulum, by its name"
        others = [c.name for c in counts if c.name != turning[0]]
        if not others:
            return "pendulum", f"{by_name}; torsional-1 looks the same."
        if _CART.search(bare_name(others[0])):
            return "cart-pendulum", f"{by_name}, and those of '{others[0]}' for its cart's place."
        if _ARM.search(bare_name(others[0])) or _PENDULUM.search(turning[0]):
            return "furuta", f"{by_name}, and those of '{others[0]}' for its arm's; cart-pendulum looks the same."
    if counts and not angles and not lengths:
        kind = "torsional" if any(_DISK.search(bare_name(c.name)) for c in counts) else "rectilinear"
        other = "rectilinear" if kind == "torsional" else "torsional"
        what = f"Counts of {bodies} encoder{'s' if bodies > 1 else ''} were"
        if not all(c.guess for c in counts):
            first = next(c.name for c in counts if not c.guess)
            what = f"Column '{first}' says neither unit nor kind; it was"
        angle = "" if bodies > 1 else "; an angle that hangs would be --plant pendulum"
        return (
            f"{kind}-{bodies}",
            f"{what} taken for a {kind} chain; {other}-{bodies} looks the same{angle}.",
        )
    if lengths and angles:
        return "cart-pendulum", ""
    if lengths and turning:
        return "cart-pendulum", f"Counts of '{turning[0]}' were taken for the angle of a pendulum, by its name."
    if len(angles) >= 2:
        if all(_DISK.search(bare_name(c.name)) for c in angles):
            return f"torsional-{min(len(angles), 3)}", "Several angles were taken for disks on a shaft."
        return "furuta", "Two angles were taken for arm and pendulum of a Furuta pendulum."
    if lengths:
        return f"rectilinear-{min(len(lengths), 3)}", "Positions were taken for carts on springs."
    if drive is None:
        return "pendulum", ""
    one = angles[0]
    turns = ANGLES[one.guess] * (one.high - one.low) / (2 * math.pi)
    if turns > SPINS:
        return "torsional-1", f"'{one.name}' turns {turns:.0f} times: taken for a disk."
    return "pendulum", "One angle was taken for a pendulum on a fixed pivot."


SPINS = 3.0
"""Turns of a driven angle beyond which nothing hangs on it."""


def named_after(places: list[Column]) -> str:
    """The only plant whose coordinates have just the names of these columns; empty where there is none.

    Of our own only those that carry a pendulum: theta and alpha are arm and pendulum of Quanser's QUBE as well as hub
    and link of a flexible one.
    """
    names = {bare_name(c.name) for c in places}
    fitting = [n for n, plant in PLANTS.sound().items() if {c.name for c in plant.coordinates} == names]
    own = len(names) > 1 and names <= set(_COORDINATES)
    return fitting[0] if len(fitting) == 1 and (own or fitting[0] not in PLANTS.own) else ""


def _assign(plant: type[Plant], places: list[Column]) -> tuple[dict[str, Column], list[str]]:
    """Column per coordinate: by name, then by kind and order."""
    left, out, missing = list(places), dict[str, Column](), list[str]()
    for coordinate in plant.coordinates:
        kinds = ANGLES if coordinate.unit == "rad" else LENGTHS
        fitting = [c for c in left if c.guess in kinds] or [c for c in left if c.guess in ("counts", "")]
        pattern = {"psi": _ARM, "x": _CART}.get(coordinate.name)
        best = next((c for c in left if bare_name(c.name) == coordinate.name), None)
        best = best or next((c for c in fitting if pattern and pattern.search(bare_name(c.name))), None)
        best = best or (fitting[0] if fitting else None)
        if best is None:
            missing.append(coordinate.name)
        else:
            out[coordinate.name] = best
            left.remove(best)
    if not out:
        raise BadInput(f"no column looks like {plant.coordinates[0].meaning}; choose another --plant")
    return out, missing


def zero_reading(
    record: Record, inspection: Inspection, c: Column, drive: Column | None, window: tuple[float, float], *,
    hangs: bool, anywhere: bool = False,
) -> float:  # fmt: skip
    """Reading at which a coordinate is taken to be zero: before the first command, else where it comes to rest.

    One that `hangs` has its zero where it rests, and not where it is while it swings; an arm that may stand `anywhere`
    where its window begins, and not where a pendulum or a drive has taken it.
    """
    x = record[c.name]
    if drive is not None:
        u = record[drive.name]
        before = x[: _commanded_from(u)]
        angle = c.guess in ANGLES
        begins = float(x[np.searchsorted(record.t, window[0])])
        if angle and anywhere:
            return begins
        if before.size and not (hangs and not _starts_still(x, u)):
            return float(np.median(before[-50:]))
        return rest_level(x, inspection, record.t) if angle or hangs else begins
    return rest_level(x, inspection, record.t)


STILL = 0.05
"""Share of how much a signal varies that it may vary by where it rests."""


def _starts_still(x: Array, u: Array) -> bool:
    """Whether a signal lies still before the first command; where it moves its place is no zero."""
    before = x[: _commanded_from(u)]
    return before.size > 0 and float(np.ptp(before)) <= STILL * float(np.ptp(x))


def _commanded_from(u: Array) -> int:
    """First sample with a command, 0 where less than five without one come before it."""
    first = int(np.argmax(u != u[0]))
    return first if u[0] == 0 and first >= 5 else 0


def rest_level(x: Array, inspection: Inspection, t: Array) -> float:
    """Reading at rest: where it lies still at the end, else at the start, else the middle of the last swings."""
    for start, stop in reversed(inspection.rests):
        if stop >= t[-1] - 0.05 * (t[-1] - t[0]):
            return float(np.median(x[(t >= start) & (t <= stop)]))
    late = x[-max(x.size // 5, 2) :]
    middle = (float(late.max()) + float(late.min())) / 2
    start = next((span for span in inspection.rests if span[0] <= t[0] + 0.02 * (t[-1] - t[0])), None)
    held = float(np.median(x[(t >= start[0]) & (t <= start[1])])) if start else middle
    # lying still away from the middle is a hand that holds it before release
    return held if abs(held - middle) < 0.1 * float(np.ptp(x)) else middle


def moving_window(
    record: Record, inspection: Inspection, signals: list[Array], drive: Column | None, *, pushed: bool
) -> tuple[float, float]:
    """From shortly before the first command, or the release, to where everything has come to rest.

    `pushed`: something moved the first body, and no column says what; its first motion then counts.
    """
    t = record.t
    start, stop = float(t[0]), float(t[-1])
    length = stop - start
    last = next((span for span in reversed(inspection.rests) if span[1] >= stop - 0.05 * length), None)
    still = next((span for span in inspection.rests if span[0] <= start + 0.02 * length), None)
    if drive is not None:
        if still is not None and drive.switches:
            start = max(start, drive.switches[0][0] - 0.1)
    elif pushed:
        start = max(start, still[1] - 0.1) if still is not None else start
    else:
        x = signals[-1]
        swing = np.abs(x - rest_level(x, inspection, t))
        # a free swing only loses amplitude: it begins where it is last as large as ever
        start = float(t[np.flatnonzero(swing >= 0.95 * swing.max())[-1]])
        moving = np.flatnonzero(swing >= 0.03 * swing.max())[-1]
        stop = min(stop, float(t[moving]) + 0.5)
    if last is not None and last[0] > start + 0.1 * length:
        stop = min(stop, last[0] + 0.5)
    if stop - start < 0.1 * length and stop - start < 1.0:
        return float(t[0]), float(t[-1])
    return start, stop


def moves_against(t: Array, u: Array, x: Array) -> bool:
    """Whether the driven column is accelerated against the command; against the first one where that does not tell."""
    slope = _pushed(t, u, x)
    if slope:
        return slope < 0
    live = np.flatnonzero(u != u[0])
    if not live.size:
        return False
    i = int(live[0])
    changes = np.flatnonzero(np.sign(u[i:]) != np.sign(u[i]))
    most = max(int(2.0 / float(np.median(np.diff(t)))), 5)
    moved = x[i : i + min(int(changes[0]) if changes.size else most, most)] - x[i]
    far = np.flatnonzero(np.abs(moved) > 0.03 * np.ptp(x))
    return bool(far.size and moved[far[0]] * (u[i] - u[0]) < 0)


def _pushed(t: Array, u: Array, x: Array) -> float:
    """Acceleration of a column per command, place, speed and dry friction allowed for; 0 when the data do not tell."""
    step = max(float(np.median(np.diff(t))), float(t[-1] - t[0]) / 20_000)
    grid = np.arange(t[0], t[-1], step)
    width = max(7, int(0.05 / step) | 1)
    if grid.size < 10 * width:
        return 0.0
    motion = savitzky_golay(np.interp(grid, t, x), step, width)
    push = savitzky_golay(np.interp(grid, t, u), step, width).q
    both = np.column_stack([push, motion.q, motion.v, np.sign(motion.v), np.ones_like(push)])[width:-width]
    a = motion.a[width:-width]
    pushed, alone = LeastSquares.of(both, a), LeastSquares.of(both[:, 1:], a)
    return float(pushed.slopes[0]) if pushed.squares < CLEAR * alone.squares else 0.0


CLEAR = 0.9
"""What accelerations are missed by with the command, over what without, at most, for its sign to be believed."""


def swing_frequency(t: Array, x: Array) -> float:
    """Angular frequency [rad/s] of the last swings about zero, where they are small; 0 without three crossings."""
    if x.size < 2:
        return 0.0
    noisy = min(5 * white_noise(x), 0.5 * float(np.abs(x).max()))
    far = np.flatnonzero(np.abs(x) > max(0.3 * float(np.std(x)), noisy))  # hysteresis: noise about zero is no swing
    if far.size < 2:
        return 0.0
    turns = np.flatnonzero(np.diff(np.signbit(x[far])))
    if turns.size < 4:
        return 0.0
    before, after = far[turns], far[turns + 1]
    at = (t[before] * np.abs(x[after]) + t[after] * np.abs(x[before])) / (np.abs(x[before]) + np.abs(x[after]))
    half = float(np.median(np.diff(at[-21:])))
    return math.pi / half if half > 0 else 0.0


def coupling(plant: type[Plant], t: Array, x: Array, theta: Array) -> float:
    """Acceleration of a hanging pendulum per acceleration of its hinge, 0 when the data do not tell.

    Negative where one of both is counted against the plant's convention. Accelerations are slopes of fourth-order
    polynomials over 0.1 s.
    """
    step = max(float(np.median(np.diff(t))), 2e-3)
    grid = np.arange(t[0], t[-1], step)
    width = max(7, int(0.1 / step) | 1)
    if grid.size < 4 * width:
        return 0.0
    motion = smoothed([np.interp(grid, t, x), np.interp(grid, t, theta)], step, width)
    hinge = hinge_of(plant, motion, slice(width, -width))
    return hinge.throw if hinge.left < 0.7 * hinge.unthrown else 0.0
