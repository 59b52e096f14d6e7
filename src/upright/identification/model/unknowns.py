"""Which numbers are sought? Parameters that all runs share, and what may differ from run to run.

Numbers that can only be positive are sought by their logarithm, so that masses never change sign on the way;
levels of friction are sought as they are, because zero must be reachable.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.model import NOISE, Parameter, Rig
from upright.physics.actuator import ACTUATOR

Array = NDArray[np.float64]

SHARED: tuple[int, ...] = ()
"""Runs of a number that all runs share."""

FAR = 1e9
"""A positive number ends within this factor of its guess."""


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """One number sought.

    Attributes
    ----------
    name : str
        ``"J_p"``, ``"actuator.gain"``; for some runs ``"initial.theta_dot"``, ``"offset.theta"``, ``"friction"``, ...
    runs : tuple of int
        Places of the runs it belongs to, or `SHARED` for all.
    value, lower, upper : float
        Start and bounds, SI.
    log : bool
        Whether its logarithm is the coordinate in which it is sought.
    scale : float
        A change that would matter, in that coordinate.
    prior : tuple of float or None
        Mean and standard deviation known beforehand, in that coordinate.
    asked : bool
        Whether the answer was asked for; a known number with an uncertainty is sought but not asked.
    group : str
        Label of the runs that share it, empty for a number of one run or of all.
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

    def inside(self, value: float) -> float:
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
    found: list[Unknown] = []
    for p in rig.parameters.values():
        if p.estimate or p.uncertainty > 0:
            found.append(_shared(rig, p))
    return found


def _shared(rig: Rig, p: Parameter) -> Unknown:
    lower, upper = p.lower, p.upper
    positive = False
    if p.name in rig.plant.names():
        q = rig.plant.quantity(p.name)
        lower, upper = max(lower, q.lower), min(upper, q.upper)
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
    from upright.physics.evaluate import evaluate

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


def base_values(rig: Rig) -> dict[str, float]:
    """Value of every parameter of plant and actuator, defaults filled in.

    Raises
    ------
    BadInput
        When the plant needs a parameter that the rig does not name.
    """
    from dataclasses import MISSING, fields

    from upright.errors import BadInput

    values = {n: what.default for n, what in ACTUATOR.items()}
    for f in fields(rig.plant):  # type: ignore[arg-type]
        if f.default is not MISSING:
            values[f.name] = float(f.default)
    values |= {n: p.value for n, p in rig.parameters.items()}
    missing = [n for n in rig.plant.names() if n not in values]
    if missing:
        raise BadInput(
            f"{rig.plant.__name__} needs a value or a guess of {', '.join(missing)}, none came; "
            f"add {'it' if len(missing) == 1 else 'them'} to the parameters of the rig."
        )
    return values
