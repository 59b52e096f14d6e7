"""When did the drive go off, whatever the log says?

An amplifier that trips leaves the logged command where it was, and the body coasts. The acceleration of the driven
coordinate tells: it is regressed on the command, speeds, the sign of the speed (dry friction) and positions, once with
the command as logged and once with a command that ends earlier, for every moment at which it may have ended. All
have gone through the same smoothing, so the moment is sharper than the smoothing is wide. No model is needed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.rig import Rig
from upright.identification.model.runs import Run
from upright.signals.trip_regression import LEAST, Regression, smoothing_width_for

Array = NDArray[np.float64]

CLEAR = 0.5, 0.1
"""A trip is believed when it leaves less than this share of what the logged command leaves unexplained.

First when the command has one level, then when it has several: a law's command follows the motion, and both are
then easily mistaken for each other (no closed-loop log of the ECP 205 and 210 goes below 0.17).
"""

POOR = 0.3
"""Share of the acceleration's variance that may stay unexplained with a trip; what explains less explains nothing."""

SLOW = 0.2
"""Share of the largest speed that a body needs when its drive trips; dry friction explains what stops slower."""


@dataclass(frozen=True, kw_only=True)
class Trip:
    """A command that acted for a shorter time than was logged.

    Attributes
    ----------
    at : float
        When it really ended (or began) [s from the run's first sample].
    error : float
        Its standard uncertainty [s].
    logged : float
        When the log says it ended (or began) [s from the run's first sample].
    late : bool
        Whether the command began late instead of ending early.
    before, after : float
        Mean acceleration of the driven coordinate just before and after [SI].
    unexplained, otherwise : float
        Share of the acceleration's variance left unexplained with the trip, and with the command as logged.
    """

    at: float
    error: float
    logged: float
    late: bool
    before: float
    after: float
    unexplained: float
    otherwise: float


def find_trips(rig: Rig, run: Run) -> list[Trip]:
    """A late begin and an early end of the first input's effect in one run, as far as its motion shows them.

    Nothing is said of runs whose driven coordinate was not measured, or whose law is simulated.
    """
    return _moments(rig, run)[0]


def _moments(rig: Rig, run: Run) -> tuple[list[Trip], bool]:
    """What `find_trips` says, and whether the command plainly acts until its logged end."""
    found: list[Trip] = []
    plain = False
    if not rig.plant.inputs or run.loop is not None:
        return found, plain
    on = rig.plant.inputs[0].on
    if on not in run.measured or on in run.held or not np.any(run.u[:, 0]):
        return found, plain
    quantum = dict(zip(run.measured, run.quanta, strict=True))
    signals = {c: run.y[:, k] for k, c in enumerate(run.measured)}
    signals |= {c: v for c, v in run.held.items() if isinstance(v, np.ndarray)}
    others = [signals[c.name] for c in rig.plant.coordinates if c.name in signals and c.name != on]
    gain = rig.parameters["actuator.gain"].value if "actuator.gain" in rig.parameters else 1.0
    for late in (False, True):
        u = cut(run, found).u[:, 0] * math.copysign(1.0, gain)
        trip, otherwise = _sought(run.t, u, signals[on], others, quantum=quantum[on], late=late)
        found += [trip] if trip is not None else []
        plain = plain or (not late and trip is None and otherwise < CLEAR[1])
    return found, plain


def find_trip(
    t: Array, u: Array, y: Array, others: Sequence[Array] = (), *, quantum: float = 0.0, late: bool = False
) -> Trip | None:
    """Early end, or late begin, of the effect of a command, None when the motion shows none.

    Parameters
    ----------
    t, u, y : (N,) arrays
        Uniform time [s], logged command, measured coordinate that it drives; a positive command pushes it up.
    others : sequence of (N,) arrays
        Coordinates that pull at it.
    quantum : float
        Resolution of `y`.
    late : bool
        Ask for a late begin instead of an early end.
    """
    return _sought(t, u, y, others, quantum=quantum, late=late)[0]


def _sought(
    t: Array, u: Array, y: Array, others: Sequence[Array], *, quantum: float, late: bool
) -> tuple[Trip | None, float]:
    """What `find_trip` says, and what is left unexplained with the command as logged, infinite if nobody can say."""
    live = np.flatnonzero(u)
    if t.size < 100 or live.size < 10:
        return None, math.inf
    dt = float(t[-1] - t[0]) / (t.size - 1)
    width = smoothing_width_for(y, dt, quantum)
    if t.size < LEAST * width:
        return None, math.inf
    table = Regression.of(u, y, others, dt, width, late=late)
    if table is None:
        return None, math.inf
    first, last = int(live[0]), int(live[-1]) + 1
    low, high = first + width // 4, last - width // 4
    if low >= high:
        return None, math.inf
    costs: dict[int, float] = {}
    at, step = 0, high - low
    while step > 1:  # three combs, each ten times finer than the one before
        step = max(1, step // (100 if not costs else 10))
        around = (
            range(low, high, step) if not costs else range(max(low, at - 10 * step), min(high, at + 10 * step), step)
        )
        costs |= {m: table.missed(m, late=late) for m in around}
        at = min(costs, key=lambda m: costs[m])
    least = costs[at]
    logged = table.missed(first if late else last, late=late, backwards=True)
    hardly = abs(table.speed[at]) < SLOW * float(np.abs(table.speed).max()) and not late
    if not (least < (CLEAR[1] if table.levels else CLEAR[0]) * logged and least < POOR) or hardly:
        return None, logged
    before, after = table.around(at, first if not late else last, last if not late else first)
    trip = Trip(
        at=at * dt, error=_uncertainty(costs, at, t.size / width) * dt,
        logged=(first if late else last) * dt, late=late, before=before, after=after,
        unexplained=least, otherwise=logged,
    )  # fmt: skip
    return trip, logged


def _uncertainty(costs: Mapping[int, float], at: int, independent: float) -> float:
    """Samples within which the misfit is no larger than chance allows, half the range of two deviations."""
    inside = [abs(m - at) for m, cost in costs.items() if cost < costs[at] * (1 + 4 / independent)]
    return max(1.0, float(max(inside))) / 2


def doubt(run: Run, trip: Trip) -> str:
    """The sentence that tells a reader of the fit."""
    t = float(run.t[0])
    what, until = ("come on only", "from") if trip.late else ("gone off", "until")
    name = "input_start" if trip.late else "input_end"
    asked = ", ".join(f'"{n}"' for n in (*run.unknown, name))
    return (
        f"In run '{run.label}' the drive seems to have {what} at {t + trip.at:.4g} s although the command is logged "
        f"{until} {t + trip.logged:.4g} s (acceleration {trip.before:.3g} before, {trip.after:.3g} after): "
        f"declare unknown = [{asked}]."
    )


def located(rig: Rig, run: Run) -> Run:
    """The run with guesses of when its input really began and ended, for those of the two that are asked.

    Where the motion plainly follows the command until its logged end, the guess is what the log says.
    """
    asked = [n for n in ("input_start", "input_end") if n in run.unknown and n not in run.guesses]
    if not asked:
        return run
    trips, plain = _moments(rig, run)
    found = {"input_start" if trip.late else "input_end": trip.at for trip in trips}
    if plain:  # a sample inside: at the logged moment itself nothing changes with it
        found["input_end"] = run.period * float(np.flatnonzero(run.u[:, 0])[-1])
    return replace(run, guesses={**{n: found[n] for n in asked if n in found}, **run.guesses})


def untold(rig: Rig, runs: Sequence[Run]) -> list[str]:
    """Sentences on drives that went off or came on where nobody asked when."""
    if any(n in rig.estimated for n in ("actuator.start", "actuator.end")):
        return []
    said: list[str] = []
    for run in runs:
        for trip in find_trips(rig, run):
            if ("input_start" if trip.late else "input_end") not in run.unknown:
                said.append(doubt(run, trip))
    return said


def cut(run: Run, trips: Sequence[Trip]) -> Run:
    """The run with its command put to zero where it did not act."""
    since = run.t - run.t[0]
    off = np.zeros(run.t.size, dtype=bool)
    for trip in trips:
        off |= since < trip.at if trip.late else since >= trip.at
    return replace(run, u=np.where(off[:, None], 0.0, run.u))
