"""Experiment 1a: the inertia of a rig's first body, and its spring, from steps with known masses added.

The rig's pendulum or second body is locked or taken off, its masses are unbolted, and known ones are added one by one.
What is then mounted for the later experiments has a known inertia, so the body's inertia follows with its uncertainty.

The twins of cart and disk stick: dry friction, encoder counts, converter steps and amplifier limits are as on the rigs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from upright.errors import NotIdentifiable
from upright.identification.loadings import Loaded, Loadings, fit_loadings, swings
from upright.physics import Plant
from upright.progress import Progress, silent
from upright.records import Record
from upright.records.record import of_twin
from upright.rig import Rig
from upright.rig.makes import CONVERTER, OSCILLATORS, SERVO, Make, Oscillator, make_of

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
    return {"k": on.stiffness, on.design.bare: on.bare, "c": on.truth.parameters()["c_1"]}


@dataclass(frozen=True, kw_only=True, eq=False)
class Campaign:
    """The logs of experiment 1a on one body with what follows from them."""

    on: LoadedTwin
    logs: dict[str, Record]
    added: dict[str, float]
    loadings: Loadings
    left_out: tuple[str, ...]
    """Why some logs did not count: friction may leave too few swings."""

    def write_logs(self, folder: Path) -> dict[str, str]:
        """Write every log as CSV; gives back its file by its label."""
        folder.mkdir(parents=True, exist_ok=True)
        files: dict[str, str] = {}
        for label, record in self.logs.items():
            files[label] = label.replace(" masses, run ", "x500g_run") + ".csv"
            record.to_csv(folder / files[label])
        return files


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


def measure_body(
    on: LoadedTwin, progress: Progress = silent, *, counts: tuple[int, ...] = (0, 1, 2, 3, 4), shots: int = 2
) -> Campaign:
    """Step a body with every count of masses, `shots` times each, and weigh it."""
    logs: dict[str, Record] = {}
    added: dict[str, float] = {}
    loaded: list[Loaded] = []
    left_out: list[str] = []
    for i, count in enumerate(counts):
        progress(f"stepping with {count} masses", i / len(counts))
        for shot in range(shots):
            name, inertia = f"{count} masses, run {shot + 1}", count * on.design.piece
            record = acquire(on, count, shot=shot)
            logs[name], added[name] = record, inertia
            try:
                loaded += swings(record, added=inertia, label=name, signal=record.outputs[0], command="u", quantum=1.0)
            except NotIdentifiable as error:
                left_out.append(str(error))
    found = fit_loadings(loaded, tolerance=on.design.tolerance, piece=on.design.piece)
    return Campaign(on=on, logs=logs, added=added, loadings=found, left_out=tuple(left_out))


def first_body(rig: Rig) -> LoadedTwin:
    """The first body of a rig on a spring, its masses unbolted.

    A pendulum's cart sits between two springs, its disk below a clamped shaft; of two bodies the second is clamped, so
    that the spring is their own.
    """
    make = _make(rig)
    design, mounted, true = make.oscillator, make.mounted, rig.plant.parameters()
    rng = np.random.default_rng([rig.seed, 12])
    tolerance = design.tolerance if rig.seed else 0.0
    on = mounted.each * float(np.sum(1 + tolerance * rng.normal(size=mounted.pieces)))
    on += mounted.rest + rng.normal() * mounted.rest_error * bool(rig.seed)
    spring = {"k_1": true["k_12"]} if "k_12" in true else {}
    drawn = drawn_twin(rig.seed, design.kind)
    return replace(drawn, truth=drawn.truth.replace(**{design.inertia: true[make.body] - on}, **spring))


def _make(rig: Rig) -> Make:
    return make_of(
        rig.plant, f"experiment 1a knows carts, disks and pendulums on them, and no {type(rig.plant).__name__}."
    )


def run_weighing(rig: Rig, seed: int, folder: Path, progress: Progress = silent) -> Weighing:
    """Weigh the first body of a rig; its logs are written to `folder`."""
    make = _make(rig)
    done = measure_body(first_body(replace(rig, seed=seed)), progress)
    found, mounted = done.loadings, make.mounted
    spread = make.oscillator.tolerance * mounted.each * math.sqrt(mounted.pieces)
    known = [
        Known(
            name=make.body,
            value=found.bare.value + mounted.each * mounted.pieces + mounted.rest,
            stderr=math.hypot(found.bare.stderr, spread, mounted.rest_error),
        )
    ]
    if "k_12" in rig.plant.names():
        known.append(Known(name="k_12", value=found.k.value, stderr=found.k.stderr))
    return Weighing(rig=rig, make=make, folder=folder, files=done.write_logs(folder), campaign=done, known=tuple(known))
