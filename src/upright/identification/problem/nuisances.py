"""Nuisances, which differ from run to run: where the search for each starts, and what it does to a simulated run.

A nuisance belongs to one run, or to all runs that give it the same label in `Run.shared`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.rig import Rig
from upright.identification.model.runs import SPREADS, Run
from upright.identification.model.unknowns import Unknown, matters
from upright.identification.problem.tracks import Track
from upright.signals.smoothing import State

Array = NDArray[np.float64]

CHANGES = {"input_offset": "actuator.offset", "input_start": "actuator.start", "input_end": "actuator.end"}
"""Parameters of the actuator that a nuisance moves although they may stand at their defaults."""

MOMENT = 0.1
"""A change of the moment [s] at which a drive trips that would matter."""

NEAR = 2.5
"""How far from the logged moment it is sought where the motion plainly follows the log, in such changes."""

INITIAL_SPREAD = (0.02, 0.1)
"""Least sigma of a measured first coordinate and velocity, as a share of how much each varies over the run."""


def run_unknowns(rig: Rig, index: int, run: Run, start: State) -> list[Unknown]:
    """What is sought for one run alone; `start` is its measured first state and its uncertainty."""
    found: list[Unknown] = []
    wanted = {*run.unknown, *run.shared}

    def add(name: str, value: float, scale: float, prior: tuple[float, float] | None = None,
            lower: float = -math.inf, upper: float = math.inf, *, log: bool = False) -> None:  # fmt: skip
        found.append(
            Unknown(name=name, runs=(index,), value=value, lower=lower, upper=upper, log=log, scale=scale,
                    prior=prior, group=run.shared.get(name, ""))
        )  # fmt: skip

    def factor(name: str) -> None:
        sigma = run.spread.get(name, SPREADS[name.partition(".")[0]])
        add(name, 1.0, 1.0, (0.0, sigma), lower=0.0, log=True)

    names = rig.plant.state_names()
    if "initial" in wanted and run.horizon is None:
        for i, name in enumerate(names):
            coordinate = names[i - i % 2]
            if coordinate not in run.held and name not in run.initial:
                # measured to a few percent; more freedom would excuse a wrong model
                size, measured = float(start.spread[i]), float(start.x[i])
                sigma = max(INITIAL_SPREAD[i % 2] * size, 2 * float(start.error[i]))
                sure = coordinate in run.measured and f"scale.{coordinate}" not in wanted
                add(f"initial.{name}", measured, size, (measured, sigma) if sure else None)
    for name in run.measured:
        if name in run.held:
            continue
        every = "offset" in wanted and (run.loop is not None or matters(rig, name))
        if every or f"offset.{name}" in wanted:
            add(f"offset.{name}", 0.0, float(start.spread[names.index(name)]))
        if f"scale.{name}" in wanted:
            factor(f"scale.{name}")
    for name in ("gain", "friction"):
        if name in wanted:
            factor(name)
    if "input_offset" in wanted:
        size = float(np.std(run.u)) if run.u.size else 0.0
        add("input_offset", 0.0, size or 1.0)
    live = np.flatnonzero(_commanded(run))
    if live.size:
        dt = run.period
        first, last = live[0] * dt, (live[-1] + 1) * dt
        # at the logged ends themselves nothing changes with the moment: begin a sample inside
        for name, logged in (("input_start", first + dt), ("input_end", last - dt)):
            if name in wanted:
                guess = float(np.clip(run.guesses.get(name, logged), first, last))
                # where the command plainly acted as logged, a trip would only excuse wrong parameters
                near = NEAR * MOMENT if name in run.guesses and abs(guess - logged) < dt else math.inf
                add(name, guess, MOMENT, lower=max(first, guess - near), upper=min(last, guess + near))
    return found


def _commanded(run: Run) -> NDArray[np.bool_]:
    """Samples (N,) at which something is asked of the drive; by a loop, from the first change of its reference on."""
    asked = np.asarray(run.u.any(axis=1), dtype=bool)
    if run.loop is not None:
        r = run.loop.law.signal()[: run.t.size]
        changed = np.flatnonzero((r != r[:1]).any(axis=1))
        asked[int(changed[0]) if changed.size else 0 :] = True
    return asked


@dataclass(frozen=True, kw_only=True)
class Setting:
    """What one run is simulated with: parameters by name, first states (states, W, lanes), and what its sensors make
    of the motion, ``y = scale q + offset``, each (outputs, lanes); a scale of None is 1.
    """

    values: dict[str, float | Array]
    x0: Array
    offsets: Array
    scales: Array | None


def setting(
    rig: Rig, track: Track, values: dict[str, float | Array], own: Mapping[str, Array], friction: tuple[str, ...],
    lanes: int,
) -> Setting:  # fmt: skip
    """Put a run's own numbers `own` (name to (lanes,)) into the parameters `values` and its first states.

    `friction` names the parameters that a friction factor multiplies.
    """
    run, names = track.run, rig.plant.state_names()
    x0 = np.repeat(track.x0.T[:, :, None], lanes, axis=2)
    offsets = np.zeros((len(track.columns), lanes))
    scales: Array | None = None
    for k, (c, column) in enumerate(zip(run.measured, track.columns, strict=True)):
        if f"offset.{c}" in own:
            offsets[k] = own[f"offset.{c}"]
            x0[column] -= offsets[k]
        if f"scale.{c}" in own:
            scales = np.ones_like(offsets) if scales is None else scales
            scales[k] = own[f"scale.{c}"]
            x0[column : column + 2] /= scales[k]
    for name, value in run.initial.items():
        x0[names.index(name), 0] = value
    for name, value in own.items():
        if name.startswith("initial."):
            x0[names.index(name.removeprefix("initial."))] = value
    if "gain" in own:
        values["actuator.gain"] = values["actuator.gain"] * own["gain"]
    if "input_offset" in own:
        values["actuator.offset"] = values["actuator.offset"] + own["input_offset"]
    for name in ("start", "end"):
        if f"input_{name}" in own:
            values[f"actuator.{name}"] = own[f"input_{name}"]
    if "friction" in own:
        for name in friction:
            values[name] = values[name] * own["friction"]
    return Setting(values=values, x0=x0, offsets=offsets, scales=scales)
