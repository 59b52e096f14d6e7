"""The numbers sought: parameters that all runs share, each with the coordinate in which it is searched.

Numbers that can only be positive are sought by their logarithm, so that masses never change sign on the way;
levels of friction are sought as they are, because zero must be reachable.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.rig import NOISE, Parameter, Rig, base_values
from upright.physics.actuator import ACTUATOR

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
    deviation known beforehand. A known number with an uncertainty is sought but not `asked`.
    """

    name: str
    runs: tuple[int, ...]
    value: float
    lower: float
    upper: float
    log: bool
    scale: float
    prior: tuple[float, float] | None = None
    asked: bool = True
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


def shared_unknowns(rig: Rig) -> list[Unknown]:
    """Parameters to estimate, and known ones that carry an uncertainty."""
    return [_shared(rig, p) for p in rig.parameters.values() if p.estimate or p.uncertainty > 0]


def _shared(rig: Rig, p: Parameter) -> Unknown:
    lower, upper = rig.bounds(p.name)
    positive = False
    if p.name in rig.plant.names():
        q = rig.plant.quantity(p.name)
        positive = q.open_lower and q.lower == 0
    elif p.name == "actuator.slope" or (p.name in ACTUATOR and ACTUATOR[p.name].never_negative):
        lower = max(lower, 0.0)
        positive = p.name == "actuator.knee"
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
        asked=p.estimate,
    )  # fmt: skip


MOMENTS = ("actuator.start", "actuator.end")
"""Moments of a run: how late they are says nothing about the change that would matter."""

_FALLBACK = {"actuator.gain": 1.0, "actuator.lag": 5e-3, "actuator.delay": 5e-3, "actuator.offset": 1e-2}
_FALLBACK |= dict.fromkeys(MOMENTS, 0.1)


def friction_names(rig: Rig) -> tuple[str, ...]:
    """Parameters that a run's friction factor multiplies: viscous terms and every level of dry friction."""
    derived = rig.plant.derived()
    words = {w for text in derived.damping for w in re.findall(r"[A-Za-z_]\w*", text)}
    for joint in derived.joints:
        words |= {joint.coulomb, joint.quadratic, joint.stiction}
    return tuple(n for n in derived.parameters if n in words)


def matters(rig: Rig, coordinate: str) -> bool:
    """Whether a coordinate's own value, not only its changes, is felt: by gravity, a spring or the mass matrix.

    A constant error of the sensor cannot be told from the place where the run began otherwise.
    """
    from upright.physics.equations import evaluate

    derived = rig.plant.derived()
    values = base_values(rig)
    scope = {**values, **{n: 0.1 + values[n] for n in rig.estimated if n in values}}
    generator = np.random.default_rng(1)
    for c in derived.coordinates:
        scope[c], scope[f"{c}_dot"] = generator.normal(size=2)
    energies = [float(evaluate(text, scope)) for text in (derived.kinetic, derived.potential)]
    scope[coordinate] += 1.0
    moved = [float(evaluate(text, scope)) for text in (derived.kinetic, derived.potential)]
    return not np.allclose(energies, moved, rtol=1e-12, atol=0.0)
