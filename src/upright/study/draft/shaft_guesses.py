"""Of what size are the masses, springs and friction of a chain? Starts of a search, from accelerations by regression.

Each body's acceleration is regressed on what acts on it; all have gone through the same smoothing. With a gain of 1
(or, for a free swing, an inertia of 1) the slopes are the numbers of the plant, roughly.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from upright.identification.problem.trips import find_trip
from upright.signals.smoothing import savitzky_golay
from upright.signals.trip_regression import smoothing_width_for
from upright.study.draft.rest_and_motion import swing_frequency
from upright.study.sensors import Array

RESOLVED = 0.003
"""Sample period [s] above which the braking of a drive, built up in some 30 ms, is not seen and not asked for."""

PASSES = 0.1
"""Share of its range that a converter's amplifier may pass when more is asked than the range; where a search begins."""


@dataclass(frozen=True, kw_only=True)
class Starts:
    """Where the search for each number of a chain begins, in SI.

    `numbers` by the plant's own names; `braked` [force per speed]: damping that acts with the volts on alone, 0 when
    they never go off; `trips`: whether the drive went off although it is logged as on; `limit`: of the command, 0 where
    it stays within reach; `fastest`: angular frequency [rad/s] of the fastest swing; `speed`: largest of body 1.
    """

    numbers: dict[str, float]
    braked: float
    trips: bool
    limit: float
    fastest: float
    speed: float


def starts(
    t: Array,
    u: Array | None,
    bodies: list[Array],
    free: list[bool],
    *,
    disks: bool,
    quanta: list[float],
    loop: bool,
    reach: float = np.inf,
) -> Starts:
    """Starts for a chain.

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
    disks : bool
        Whether no spring ties body 1 to ground.
    quanta : list of float
        Resolution of each [SI].
    loop : bool
        Whether `u` follows from the motion: trips are not looked for.
    reach : float
        Largest command that can be put out at all.
    """
    dt = float(t[-1] - t[0]) / (t.size - 1)
    moving = max((x for x, f in zip(bodies, free, strict=True) if f), key=lambda x: float(np.ptp(x)))
    k = next(i for i, x in enumerate(bodies) if x is moving)
    width = min(smoothing_width_for(moving, dt, quanta[k]), max(t.size // 12, 9) | 1)
    m = "J" if disks else "m"
    command = u if u is not None else np.zeros(t.size)
    motion = [savitzky_golay(y, dt, width) for y in bodies]
    limit = PASSES * reach if u is not None and np.abs(u).max() > reach else 0.0
    command = np.clip(command, -limit, limit) if limit else command
    push = savitzky_golay(command, dt, width).q if u is not None else None
    numbers: dict[str, float] = {}
    w = _frequencies(t, bodies, free)
    inertia = 1.0
    braked = 0.0
    trips = False
    for i, (mo, is_free) in enumerate(zip(motion, free, strict=True)):
        n = str(i + 1)
        if not is_free:
            numbers[f"{m}_{n}"] = inertia
            continue
        driven = i == 0 and push is not None
        names, columns = ["friction", "c"], [-np.sign(mo.v) * (np.abs(mo.v) > 0.02 * np.abs(mo.v).max()), -mo.v]
        if i > 0:
            names, columns = [*names, "k_left"], [*columns, motion[i - 1].q - mo.q]
        if i + 1 < len(motion) and free[i + 1]:
            names, columns = [*names, "k_right"], [*columns, motion[i + 1].q - mo.q]
        if i == 0 and (not disks or (len(motion) > 1 and not free[1]) or len(motion) == 1):
            names, columns = [*names, "k"], [*columns, -mo.q]
        if driven:
            assert push is not None
            on = savitzky_golay(np.where(command != 0, savitzky_golay(bodies[0], dt, width).v, 0.0), dt, width).q
            names, columns = [*names, "u"], [*columns, push]
            if 0.1 < float(np.mean(command != 0)) < 0.95 and not loop and dt < RESOLVED:
                names, columns = [*names, "on"], [*columns, -on]
        names, columns = [*names, "constant"], [*columns, np.ones_like(mo.a)]
        edge = slice(mo.edge, -mo.edge or None)
        slopes, errors = _regress(np.column_stack(columns)[edge], mo.a[edge], width)
        value = dict(zip(names, slopes.tolist(), strict=True))
        error = dict(zip(names, errors.tolist(), strict=True))
        if driven:
            inertia = (
                1 / value["u"] if value["u"] > 2 * error["u"] and not limit else _by_first_motion(t, command, bodies[0])
            )
            # braking that builds up late looks like none, so it is asked wherever the volts go off
            braked = inertia * max(value["on"], 0.2 * abs(value["c"]), 0.1 * w) if "on" in value else 0.0
        if i > 0 and numbers.get(f"k_{i}{n}") and value["k_left"] > 0:
            inertia = numbers[f"k_{i}{n}"] / value["k_left"]
        own = inertia
        numbers[f"{m}_{n}"] = own
        stiff = own * w**2
        if "k_right" in value:
            numbers[f"k_{n}{i + 2}"] = own * value["k_right"] if value["k_right"] > 0 else stiff
        if i > 0 and f"k_{i}{n}" not in numbers:
            numbers[f"k_{i}{n}"] = own * value["k_left"] if value["k_left"] > 0 else stiff
        if "k" in value:
            total = own * value["k"] if value["k"] > 0 else stiff
            numbers["k_1" if not disks else "k_12"] = total
        numbers[f"c_{n}"] = own * max(value["c"], 0.01 * w)
        speed = float(np.abs(mo.v).max())
        numbers[f"f_{n}c"] = own * max(value["friction"], 0.01 * w * speed)
    if u is not None and not loop and free[0]:
        others = [y for y, f in zip(bodies[1:], free[1:], strict=True) if f]
        trips = find_trip(t, u, bodies[0], others, quantum=quanta[0]) is not None
    return Starts(
        numbers=numbers, braked=braked, trips=trips,
        limit=limit, fastest=w, speed=float(np.abs(motion[0].v).max()),
    )  # fmt: skip


def _frequencies(t: Array, bodies: list[Array], free: list[bool]) -> float:
    """Angular frequency of the fastest swing that is seen, in the bodies or between them; 6 rad/s when none is."""
    seen: list[float] = []
    signals = [y for y, f in zip(bodies, free, strict=True) if f]
    signals += [b - a for a, b in pairwise(signals)]
    for y in signals:
        late = (
            y
            - np.convolve(np.pad(y, y.size // 10, "edge"), np.ones(y.size // 5) / (y.size // 5), "same")[
                y.size // 10 : y.size // 10 + y.size
            ]
        )
        seen.append(swing_frequency(t, late))
    found = [w for w in seen if w > 0]
    return max(found) if found else 6.0


def _by_first_motion(t: Array, u: Array, x: Array) -> float:
    """Inertia that a constant push gives the first motion: x = u t^2/(2 m)."""
    at = int(np.argmax(u != 0))
    far = np.flatnonzero(np.abs(x[at:] - x[at]) > 0.1 * float(np.ptp(x)))
    if not far.size or far[0] < 2:
        return 1.0
    stop = at + int(far[0])
    push = abs(float(np.mean(u[at:stop])))
    return max(push, 1e-9) * float(t[stop] - t[at]) ** 2 / 2 / max(abs(float(x[stop] - x[at])), 1e-12)


def _regress(columns: Array, a: Array, width: int) -> tuple[Array, Array]:
    """Slopes and their standard errors, with as many independent samples as there are smoothing widths."""
    size = np.linalg.norm(columns, axis=0)
    size[size == 0] = 1.0
    slopes, *_ = np.linalg.lstsq(columns / size, a, rcond=1e-9)
    left = a - columns / size @ slopes
    independent = max(a.size / width - slopes.size, 1.0)
    variance = float(left @ left) / independent
    inverse = np.linalg.pinv((columns / size).T @ (columns / size))
    return slopes / size, np.sqrt(np.maximum(np.diag(inverse) * variance, 0.0)) / size
