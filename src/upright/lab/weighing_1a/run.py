"""What does a rig's first body weigh? Experiment 1a on the rig that the later experiments are run on.

Its pendulum or second body is locked or taken off, its masses are unbolted, and known ones are added one by one. What
is then mounted for the later experiments has a known inertia, so the body's inertia follows with its uncertainty.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from upright.control.rig import Rig
from upright.errors import BadInput
from upright.lab.rigs.makes import Make
from upright.lab.weighing_1a import twin as loadings
from upright.lab.weighing_1a.twin import MASS_RADIUS, RADIUS, Campaign, Kind
from upright.physics import CartPendulum, Furuta, added_inertia, added_mass
from upright.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Mounted:
    """What the later experiments add to the body that was weighed: its inertia [kg or kg m^2] and standard error."""

    pieces: int
    each: float
    rest: float = 0.0
    rest_error: float = 0.0


ARM = 2.9e-4
"""Inertia of the arm that carries the pendulum, from its drawing [kg m^2]."""
_MOUNTED = {
    "furuta": Mounted(pieces=2, each=added_inertia(1, 0.060, mass_radius=MASS_RADIUS), rest=ARM, rest_error=0.03 * ARM),
    "linear": Mounted(pieces=0, each=added_mass(1)),
    "rectilinear": Mounted(pieces=1, each=added_mass(1)),
    "torsional": Mounted(pieces=2, each=added_inertia(1, RADIUS, mass_radius=MASS_RADIUS)),
}


@dataclass(frozen=True, kw_only=True)
class Known:
    """A parameter of the rig that experiment 1a leaves known: value and standard error [SI]."""

    name: str
    value: float
    stderr: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Weighing:
    """Experiment 1a on a rig: the swings with their line, and what they say about the rig as it is used later."""

    rig: Rig
    make: Make
    folder: Path
    files: dict[str, str]
    campaign: Campaign
    known: tuple[Known, ...]


def make_of(rig: Rig) -> Make:
    """Which of the four makes a rig is."""
    if isinstance(rig.plant, Furuta):
        return "furuta"
    if isinstance(rig.plant, CartPendulum):
        return "linear"
    names = rig.plant.names()
    if {"m_1", "k_12"} <= set(names):
        return "rectilinear"
    if {"J_1", "k_12"} <= set(names):
        return "torsional"
    raise BadInput(f"experiment 1a knows carts, disks and pendulums on them, and no {type(rig.plant).__name__}.")


def body(rig: Rig) -> loadings.Rig:
    """The first body of a rig on a spring, its masses unbolted.

    A pendulum's cart sits between two springs, its disk below a clamped shaft; of two bodies the second is clamped, so
    that the spring is their own.
    """
    make = make_of(rig)
    kind: Kind = "rectilinear" if make in ("linear", "rectilinear") else "torsional"
    mass = "m_1" if kind == "rectilinear" else "J_1"
    truth, mounted = rig.plant.parameters(), _MOUNTED[make]
    rng = np.random.default_rng([rig.seed, 12])
    drawn = loadings.rig(rig.seed, kind)
    tolerance = loadings.MAKES[kind].tolerance if rig.seed else 0.0
    on = mounted.each * float(np.sum(1 + tolerance * rng.normal(size=mounted.pieces)))
    on += mounted.rest + rng.normal() * mounted.rest_error * bool(rig.seed)
    spring = {"k_1": truth["k_12"]} if "k_12" in truth else {}
    return replace(drawn, truth=drawn.truth.replace(**{mass: truth[_parameter(make)] - on}, **spring))


def _parameter(make: str) -> str:
    return {"furuta": "J_d", "linear": "m_c", "rectilinear": "m_1", "torsional": "J_1"}[make]


def run(rig: Rig, seed: int, folder: Path, progress: Progress | None = None) -> Weighing:
    """Weigh the first body of a rig; its logs are written to `folder`."""
    make = make_of(rig)
    on = body(replace(rig, seed=seed))
    done = loadings.weigh_body(on, progress)
    found, mounted = done.found, _MOUNTED[make]
    pieces = mounted.each * mounted.pieces
    spread = loadings.MAKES[on.kind].tolerance * mounted.each * math.sqrt(mounted.pieces)
    known = [
        Known(
            name=_parameter(make),
            value=found.bare.value + pieces + mounted.rest,
            stderr=math.hypot(found.bare.stderr, spread, mounted.rest_error),
        )
    ]
    if "k_12" in rig.plant.names():
        known.append(Known(name="k_12", value=found.k.value, stderr=found.k.stderr))
    return Weighing(
        rig=rig, make=make, folder=folder, files=loadings.write_logs(done, folder), campaign=done, known=tuple(known)
    )
