"""Runs whose drive went off, or came on, at another moment than logged: reported, and guessed where it is estimated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from upright.identification.model.grey_box import GreyBox
from upright.identification.model.runs import Run
from upright.physics.regressor import regressor
from upright.signals.trips import CLEAR, Driven, Terms, Trip, linear


def find_trips(rig: GreyBox, run: Run) -> list[Trip]:
    """A late begin and an early end of the first input's effect in one run, as far as its motion shows them.

    Runs are left out whose driven coordinate was not measured, or whose law is simulated.
    """
    return _moments(rig, run)[0]


class Moments:
    """What is known of when the input of a rig's runs really acted; every motion is looked at once.

    A run with guesses, or with another label, is the same motion.
    """

    def __init__(self, rig: GreyBox) -> None:
        self.rig = rig
        self._observed: dict[tuple[int, int], tuple[Run, tuple[list[Trip], bool]]] = {}

    def of(self, run: Run) -> tuple[list[Trip], bool]:
        """Trips of a run, and whether the command plainly acts until its logged end."""
        key = id(run.y), id(run.u)  # of a run that is kept here, so that no other takes its place
        if key not in self._observed:
            self._observed[key] = run, _moments(self.rig, run)
        return self._observed[key][1]


def _moments(rig: GreyBox, run: Run) -> tuple[list[Trip], bool]:
    """What `find_trips` says, and whether the command plainly acts until its logged end."""
    trips: list[Trip] = []
    plain = False
    if not rig.plant.inputs or run.loop is not None:
        return trips, plain
    on = rig.plant.inputs[0].on
    if on not in run.measured or on in run.held or not np.any(run.u[:, 0]):
        return trips, plain
    resolution = dict(zip(run.measured, run.quanta, strict=True))
    signals = {c: run.y[:, k] for k, c in enumerate(run.measured)}
    signals |= {c: v for c, v in run.held.items() if isinstance(v, np.ndarray)}
    signals |= {c: np.full(run.t.size, v) for c, v in run.held.items() if not isinstance(v, np.ndarray)}
    others = {c.name: signals[c.name] for c in rig.plant.coordinates if c.name in signals and c.name != on}
    driven = Driven.by(
        run.t, signals[on], [*others.values()], resolution=resolution[on], terms=_terms(rig, [on, *others])
    )
    gain = rig.parameters["actuator.gain"].value if "actuator.gain" in rig.parameters else 1.0
    for late in (False, True):
        u = silenced(run, trips).u[:, 0] * math.copysign(1.0, gain)
        trip, otherwise = driven.trip_or_misfit(u, late=late)
        trips += [trip] if trip is not None else []
        plain = plain or (not late and trip is None and otherwise < CLEAR[1])
    return trips, plain


def _terms(rig: GreyBox, measured: list[str]) -> Terms:
    """What acts on the first coordinate by its equation of motion, which needs the motion of all."""
    coordinates = [c.name for c in rig.plant.coordinates]
    acting = {n for n, p in rig.parameters.items() if p.value or p.estimate}
    equations, driven = regressor(rig.plant, frozenset(rig.plant.optional) - acting), coordinates.index(measured[0])
    if set(coordinates) - set(measured) or equations.own(driven) is None:
        return linear
    order = [measured.index(c) for c in coordinates]
    return lambda motion: list(equations.acting(driven, motion.q[order], motion.v[order], motion.a[order]))


def trip_sentence(run: Run, trip: Trip) -> str:
    """The sentence that tells a reader of the fit."""
    t = float(run.t[0])
    what, until = ("come on only", "from") if trip.late else ("gone off", "until")
    name = "input_start" if trip.late else "input_end"
    listed = ", ".join(f'"{n}"' for n in (*run.unknown, name))
    return (
        f"In run '{run.label}' the drive seems to have {what} at {t + trip.at:.4g} s although the command is logged "
        f"{until} {t + trip.logged:.4g} s (acceleration {trip.before:.3g} before, {trip.after:.3g} after): "
        f"declare unknown = [{listed}]."
    )


def with_trip_guesses(rig: GreyBox, run: Run, moments: Moments | None = None) -> Run:
    """The run with guesses of when its input really began and ended, for those of the two that are estimated.

    Where the motion plainly follows the command until its logged end, the guess is what the log says.
    """
    wanted = [n for n in ("input_start", "input_end") if n in run.unknown and n not in run.guesses]
    if not wanted:
        return run
    trips, plain = (moments or Moments(rig)).of(run)
    guesses = {"input_start" if trip.late else "input_end": trip.at for trip in trips}
    if plain:  # a sample inside: at the logged moment itself nothing changes with it
        guesses["input_end"] = run.period * float(np.flatnonzero(run.u[:, 0])[-1])
    return replace(run, guesses={**{n: guesses[n] for n in wanted if n in guesses}, **run.guesses})


def unasked_trips(rig: GreyBox, runs: Sequence[Run], moments: Moments | None = None) -> list[str]:
    """Sentences on drives that went off or came on where the moment is not estimated."""
    if any(n in rig.estimated for n in ("actuator.start", "actuator.end")):
        return []
    sentences: list[str] = []
    moments = moments or Moments(rig)
    for run in runs:
        for trip in moments.of(run)[0]:
            if ("input_start" if trip.late else "input_end") not in run.unknown:
                sentences.append(trip_sentence(run, trip))
    return sentences


def silenced(run: Run, trips: Sequence[Trip]) -> Run:
    """The run with its command put to zero where it did not act."""
    since = run.t - run.t[0]
    off = np.zeros(run.t.size, dtype=bool)
    for trip in trips:
        off |= since < trip.at if trip.late else since >= trip.at
    return replace(run, u=np.where(off[:, None], 0.0, run.u))
