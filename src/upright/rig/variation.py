"""Rigs that a fit allows: numbers of its covariance, friction close to rest, and dry friction of another day."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from upright.physics import Plant
from upright.records import Array
from upright.rig.drive import GAIN
from upright.rig.rig import Rig

DAILY = 0.13
"""Relative spread of dry friction from one run to the next, as between two runs of one day on an ECP 205."""
EXCESS = 0.5
"""Most by which friction close to rest exceeds sliding friction (Stribeck), as a share of that."""
STRIBECK_SPEEDS = {"rad": (0.05, 0.5), "m": (0.005, 0.05)}
"""Speeds between which that excess fades [rad/s or m/s]: a hundredth to a tenth of those of an identification."""


def allowed(rig: Rig, lanes: int, seed: int) -> Mapping[str, Array]:
    """Parameters of `lanes` rigs that the fit of a rig allows; of one without draws its friction alone varies."""
    rng = np.random.default_rng([seed, 53])
    out: dict[str, Array] = {}
    if rig.draws:
        rows = [rig.draws[i % len(rig.draws)] for i in range(lanes)]
        drawn = {n: np.array([getattr(plant, n) for plant, _ in rows]) for n in rig.plant.names()}
        drawn[GAIN] = np.array([gain for _, gain in rows])
        out = {name: values for name, values in drawn.items() if np.ptp(values) > 0}
    return of_the_day(rig.plant, close_to_rest(rig.plant, out, rng, lanes), rng, lanes)


def close_to_rest(
    plant: Plant, others: Mapping[str, Array], rng: np.random.Generator, lanes: int
) -> Mapping[str, Array]:  # fmt: skip
    """The same rigs with the friction that they may have close to rest, of which a fit of sliding friction is blind.

    A fit that knows of a break-away level says itself what it is.
    """
    units = {c.name: c.unit for c in plant.coordinates}
    out = dict(others)
    for joint in plant.joints:
        names = (joint.coulomb, joint.stiction, joint.stribeck_speed)
        sliding, known = (getattr(plant, n) if n else 0.0 for n in names[:2])
        if not all(names) or not sliding or known:
            continue
        low, high = STRIBECK_SPEEDS[units.get(joint.on, "rad")]
        excess = rng.uniform(0.0, EXCESS, lanes)
        out[joint.stiction] = (1 + excess) * out.get(joint.coulomb, np.full(lanes, sliding))
        out[joint.stribeck_speed] = np.exp(rng.uniform(math.log(low), math.log(high), lanes))
    return out


def of_the_day(
    plant: Plant, others: Mapping[str, Array], rng: np.random.Generator, lanes: int
) -> Mapping[str, Array]:  # fmt: skip
    """The same rigs, each joint with the dry friction of its day, close to rest as well as sliding."""
    out = dict(others)
    for joint in plant.joints:
        names = [n for n in (joint.coulomb, joint.stiction) if n and (n in out or getattr(plant, n))]
        today = np.exp(rng.normal(0, DAILY, lanes)) if names else np.ones(lanes)
        out |= {n: today * out.get(n, np.full(lanes, getattr(plant, n))) for n in names}
    return out
