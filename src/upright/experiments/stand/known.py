"""What is known of a rig before it is identified: by its design, from the bench, and from earlier experiments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from upright.identification import GreyBox, Parameter
from upright.rig import Rig
from upright.rig.makes import Make, make_rig

LAG = 1e-3
"""First guess of the drive's time constant [s]."""


@dataclass(frozen=True, kw_only=True)
class Known:
    """A parameter of the rig that an earlier experiment leaves known: value and standard error [SI]."""

    name: str
    value: float
    stderr: float


def bench_values(rig: Rig, make: Make) -> dict[str, float]:
    """What the bench says of the numbers that it tells, each off by its tolerance; exact for the rig as designed."""
    rng = np.random.default_rng([rig.seed, 43])
    true = rig.plant.parameters()
    off = rng.normal(size=len(make.bench)) * (rig.seed > 0)
    return {n: true[n] * (1 + s * z) for (n, s), z in zip(make.bench.items(), off, strict=True)}


def model_of(make: Make, known: Mapping[str, float], tolerance: Mapping[str, float]) -> GreyBox:
    """What a fit may know about a rig of a make: the design's numbers as guesses, and what is known, how well."""
    design, plant = make_rig(make.key), type(make.rig.plant)
    parameters: dict[str, Parameter] = {}
    for name, value in make.rig.plant.parameters().items():
        weighed, what = name in known, plant.quantity(name)
        parameters[name] = Parameter(
            name=name, unit=what.unit, meaning=what.meaning, value=known.get(name, value), lower=0.0,
            estimate=name in make.sought and not weighed,
            uncertainty=tolerance.get(name, 0.0) * known[name] if weighed else 0.0,
        )  # fmt: skip
    for name, value, unit, sought, meaning in (
        ("actuator.gain", make.rig.gain, make.gain_unit, True, "force per unit of command"),
        ("actuator.delay", design.delay, "s", False, "dead time"),
        ("actuator.lag", LAG, "s", True, "first-order lag"),
    ):
        parameters[name] = Parameter(name=name, value=value, unit=unit, meaning=meaning, estimate=sought, lower=0.0)
    return GreyBox(plant=plant, parameters=parameters)
