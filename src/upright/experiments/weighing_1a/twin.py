"""Twins of a cart and of a disk on a spring, as experiment 1a loads and steps them.

Both stick: dry friction, encoder counts, converter steps and amplifier limits are as on the rigs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from upright.experiments.makes import CONVERTER, OSCILLATORS, SERVO, Oscillator
from upright.physics import Plant
from upright.records import Record
from upright.records.record import of_twin

PIECES = 4  # 500 g masses that come with a rig
EVERY = 4  # servo periods per logged sample


@dataclass(frozen=True, kw_only=True)
class LoadedTwin:
    """One body on a spring: its true numbers, its true added pieces [kg or kg m^2], and the seed they come from."""

    design: Oscillator
    truth: Plant
    pieces: tuple[float, ...]
    seed: int

    @property
    def bare(self) -> float:
        """True inertia without additions."""
        return self.truth.parameters()[self.design.inertia]

    @property
    def stiffness(self) -> float:
        """True stiffness."""
        return self.truth.parameters()["k_1"]


def drawn_twin(seed: int = 0, kind: str = "rectilinear") -> LoadedTwin:
    """A twin of a kind; inertias and springs differ by some percent, friction by a fifth, pieces by their tolerance.

    Seed 0 is the rig as designed.
    """
    design = OSCILLATORS[kind]
    if seed == 0:
        return LoadedTwin(design=design, truth=design.plant, pieces=(design.piece,) * PIECES, seed=0)
    rng = np.random.default_rng([seed, 10, kind == "torsional"])
    spread = {design.inertia: 0.04, "k_1": 0.06, "c_1": 0.2, "f_1c": 0.2}
    values = design.plant.parameters()
    truth = design.plant.replace(**{n: values[n] * math.exp(rng.normal(0, s)) for n, s in spread.items()})
    pieces = tuple((design.piece * (1 + design.tolerance * rng.normal(size=PIECES))).tolist())
    return LoadedTwin(design=design, truth=truth, pieces=pieces, seed=seed)


def acquire(on: LoadedTwin, count: int, *, shot: int = 0, seconds: float = 3.0) -> Record:
    """Log of a step of the command and of its end, with `count` masses added; counts and volts.

    Friction differs by 13 % from run to run, and the body starts from wherever friction held it.
    """
    from upright.simulation import simulate

    design = on.design
    rng = np.random.default_rng([on.seed, 11, design.kind == "torsional", count, shot])
    friction = on.truth.parameters()["f_1c"] * math.exp(rng.normal(0, 0.13))
    plant = on.truth.replace(a_1=sum(on.pieces[:count]), f_1c=friction)
    held = friction / on.stiffness
    half = round(seconds / SERVO / EVERY)
    command = np.zeros(2 * half + 1)
    command[: half + 1] = round(design.step / CONVERTER) * CONVERTER
    start = plant.state() + np.array([rng.uniform(-0.5, 0.5) * held, 0.0])
    drive = {"actuator.gain": design.gain, "actuator.limit": design.limit, "actuator.lag": 2e-3}
    x = simulate(plant, drive, start, np.repeat(command, EVERY), SERVO, samples=command.size, every=EVERY)[:, 0, 0]
    column = plant.coordinates[0].name
    return Record(
        t=np.arange(command.size, dtype=np.float64) * (SERVO * EVERY),
        signals={"u": command, column: np.round((x - x[0]) * design.counts)},
        units={"u": "V", column: "counts"},
        inputs=("u",),
        outputs=(column,),
        provenance=of_twin(f"a {design.kind} rig", on.seed),
    )


def truth(on: LoadedTwin) -> dict[str, float]:
    """What only a twin can tell, by the symbols of the report."""
    name = on.design.inertia.replace("1", "0")
    return {"k": on.stiffness, name: on.bare, "c": on.truth.parameters()["c_1"]}
