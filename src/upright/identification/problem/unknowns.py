"""The numbers sought, each with the coordinate in which it is searched: of all runs, of some, or of one.

Numbers that can only be positive are sought by their logarithm, so that masses never change sign on the way;
levels of friction are sought as they are, because zero must be reachable.

Nuisances differ from run to run: a nuisance belongs to one run, or to all runs that give it the same label in
`Run.shared`. Here stands where the search for each starts, and what it does to a simulated run.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.grey_box import NOISE, GreyBox, Parameter, base_values
from upright.identification.model.runs import SPREADS, Run
from upright.identification.problem.tracks import Track
from upright.physics.actuator import ACTUATOR
from upright.signals.smoothing import State

Array = NDArray[np.float64]

SHARED: tuple[int, ...] = ()
"""Runs of a number that all runs share."""

FAR = 1e9
"""A positive number ends within this factor of its guess."""


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """One number sought: ``"J_p"``, ``"actuator.gain"``; for some runs ``"initial.theta_dot"``, ``"offset.theta"``, ...

    `runs` are the places of the runs it belongs to, or `SHARED` for all, `group` the label of those that share it,
    empty for a number of one run or of all. Start and bounds are in SI; the coordinate in which it is sought is its
    logarithm if `log`. In that coordinate `scale` is a change that would matter and `prior` the mean and standard
    deviation known beforehand. A known number with an uncertainty is fitted but not `estimated`.
    """

    name: str
    runs: tuple[int, ...]
    value: float
    lower: float
    upper: float
    log: bool
    scale: float
    prior: tuple[float, float] | None = None
    estimated: bool = True
    group: str = ""

    @property
    def shared(self) -> bool:
        """Whether all runs share it."""
        return self.runs == SHARED

    def coordinate(self, value: float) -> float:
        """Coordinate in which the number is sought."""
        return math.log(value) if self.log else value

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds in the coordinate in which the number is sought."""
        if not self.log:
            return self.lower, self.upper
        lower = math.log(self.lower) if self.lower > 0 else -math.inf
        return lower, math.log(self.upper) if math.isfinite(self.upper) else math.inf


def shared_unknowns(rig: GreyBox) -> list[Unknown]:
    """Parameters to estimate, and known ones that carry an uncertainty."""
    return [_shared(rig, p) for p in rig.parameters.values() if p.estimate or p.uncertainty > 0]


def _shared(rig: GreyBox, p: Parameter) -> Unknown:
    lower, upper = rig.bounds(p.name)
    positive = False
    if p.name in rig.plant.names():
        q = rig.plant.quantity(p.name)
        positive = q.open_lower and q.lower == 0
    elif p.name == "actuator.slope" or (p.name in ACTUATOR and ACTUATOR[p.name].never_negative):
        lower = max(lower, 0.0)
        positive = p.name in ("actuator.knee", "actuator.force_limit")
    elif p.name.startswith(NOISE):
        lower, positive = max(lower, 0.0), True
    log = positive and p.value > 0
    value = min(max(p.value, lower), upper)
    if log:  # a number that the data do not see would otherwise run to 1e130
        lower, upper = max(lower, value / FAR), min(upper, value * FAR)
    prior = None
    if not p.estimate:
        prior = (math.log(p.value), p.uncertainty / p.value) if log else (p.value, p.uncertainty)
    size = 0.0 if p.name in MOMENTS else abs(value)
    scale = 1.0 if log else max(size, p.uncertainty) or _FALLBACK.get(p.name, 1e-3)
    return Unknown(
        name=p.name, runs=SHARED, value=value, lower=lower, upper=upper, log=log, scale=scale, prior=prior,
        estimated=p.estimate,
    )  # fmt: skip


MOMENTS = ("actuator.start", "actuator.end")
"""Moments of a run: how late they are says nothing about the change that would matter."""

_FALLBACK = {"actuator.gain": 1.0, "actuator.lag": 5e-3, "actuator.delay": 5e-3, "actuator.offset": 1e-2}
_FALLBACK |= dict.fromkeys(MOMENTS, 0.1)


def friction_names(rig: GreyBox) -> tuple[str, ...]:
    """Parameters that a run's friction factor multiplies: viscous terms and every level of dry friction."""
    derived = rig.plant.derived()
    words = {w for text in derived.damping for w in re.findall(r"[A-Za-z_]\w*", text)}
    for joint in derived.joints:
        words |= {joint.coulomb, joint.quadratic, joint.stiction}
    return tuple(n for n in derived.parameters if n in words)


def matters(rig: GreyBox, coordinate: str, by: float = 1.0) -> bool:
    """Whether a coordinate's own value, not only its changes, is felt: by gravity, a spring or the mass matrix.

    A constant error of the sensor cannot be separated from the place where the run began otherwise. Of an angle that
    comes round a change `by` one turn is not felt.
    """
    from upright.physics.equations import evaluated

    derived = rig.plant.derived()
    values = base_values(rig)
    scope = {**values, **{n: 0.1 + values[n] for n in rig.estimated if n in values}}
    generator = np.random.default_rng(1)
    for c in derived.coordinates:
        scope[c], scope[f"{c}_dot"] = generator.normal(size=2)
    energies = [float(evaluated(text, scope)) for text in (derived.kinetic, derived.potential)]
    scope[coordinate] += by
    moved = [float(evaluated(text, scope)) for text in (derived.kinetic, derived.potential)]
    return not np.allclose(energies, moved, rtol=1e-12, atol=1e-12 * max(map(abs, energies)))


CHANGES = {"input_offset": "actuator.offset", "input_start": "actuator.start", "input_end": "actuator.end"}
"""Parameters of the actuator that a nuisance moves although they may stand at their defaults."""

MOMENT = 0.1
"""A change of the moment [s] at which a drive trips that would matter."""

NEAR = 2.5
"""How far from the logged moment it is sought where the motion plainly follows the log, in such changes."""

INITIAL_SPREAD = (0.02, 0.1)
"""Least sigma of a measured first coordinate and velocity, as a share of how much each varies over the run."""


def run_unknowns(rig: GreyBox, index: int, run: Run, start: State) -> list[Unknown]:
    """What is sought for one run alone; `start` is its measured first state and its uncertainty."""
    unknowns: list[Unknown] = []
    wanted = {*run.unknown, *run.shared}

    def add(name: str, value: float, scale: float, prior: tuple[float, float] | None = None,
            lower: float = -math.inf, upper: float = math.inf, *, log: bool = False) -> None:  # fmt: skip
        unknowns.append(
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
    return unknowns


def _commanded(run: Run) -> NDArray[np.bool_]:
    """Samples (N,) at which the drive is commanded; by a loop, from the first change of its reference on."""
    commanded = np.asarray(run.u.any(axis=1), dtype=bool)
    if run.loop is not None:
        r = run.loop.law.signal()[: run.t.size]
        changed = np.flatnonzero((r != r[:1]).any(axis=1))
        commanded[int(changed[0]) if changed.size else 0 :] = True
    return commanded


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
    rig: GreyBox, track: Track, values: dict[str, float | Array], own: Mapping[str, Array], friction: tuple[str, ...],
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
