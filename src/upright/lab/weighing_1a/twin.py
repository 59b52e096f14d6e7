"""What stands in for the rigs of experiment 1a? Twins of a cart and of a disk on a spring, to be loaded and stepped.

Cart 1 of the ECP 210 between two springs to ground, and the lower disk of the ECP 205 with its shaft clamped above.
Both stick: dry friction, encoder counts, converter steps and amplifier limits are as on the rigs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from upright.errors import NotIdentifiable
from upright.identification.loadings.fit import Loaded, Loadings, swings, weigh
from upright.lab.rigs.twin import COUNTS, SERVO
from upright.physics import Plant, added_inertia, added_mass, chain
from upright.progress import Progress
from upright.records import Provenance, Record

Kind = Literal["rectilinear", "torsional"]

PIECES = 4  # 500 g masses that come with a rig
RADIUS = 0.065  # m, bolt circle on the disk
MASS_RADIUS = 0.025  # m, of one brass mass
EVERY = 4  # servo periods per logged sample


@dataclass(frozen=True, kw_only=True)
class Make:
    """A kind of rig: the plant as designed, and what stands between its coordinate and the log."""

    plant: Plant
    coordinate: str
    counts: float
    """Encoder counts per m or rad."""
    gain: float
    """N or N m per V."""
    limit: float
    """Largest command [V]."""
    converter: float
    """Smallest step of the command [V]."""
    step: float
    """Command of a step [V]."""
    tolerance: float
    """Relative standard uncertainty of the inertia of one added piece."""


_CART: Any = chain(1, "rectilinear")
_DISK: Any = chain(1, "torsional")
MAKES: dict[str, Make] = {
    "rectilinear": Make(
        plant=_CART(m_1=0.77, k_1=390.0, c_1=1.2, f_1c=0.2),  # two springs of 195 N/m
        coordinate="x_1", counts=16_000 / 0.0706, gain=5.25, limit=5.0, converter=10 / 32768, step=1.0,
        tolerance=2e-3,
    ),
    "torsional": Make(
        plant=_DISK(J_1=3.0e-3, k_1=2.7, c_1=5e-3, f_1c=0.012),  # disk 2.5e-3, motor and belt 5e-4
        coordinate="theta_1", counts=COUNTS / (2 * math.pi), gain=0.65, limit=10.0, converter=10 / 32768, step=0.7,
        tolerance=4e-3,  # 0.2 % of the mass and 0.1 mm of the bolt circle
    ),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Rig:
    """One rig of a make: its true numbers, its true added pieces [kg or kg m^2], and the seed they were drawn with."""

    kind: Kind
    truth: Plant
    pieces: tuple[float, ...]
    seed: int

    @property
    def bare(self) -> float:
        """True inertia without additions."""
        return float(getattr(self.truth, "m_1" if self.kind == "rectilinear" else "J_1"))

    @property
    def stiffness(self) -> float:
        """True stiffness."""
        return float(getattr(self.truth, "k_1"))  # noqa: B009  the class is made at run time


def nominal_piece(kind: Kind) -> float:
    """Inertia [kg or kg m^2] that one mass is said to add."""
    return added_mass(1) if kind == "rectilinear" else added_inertia(1, RADIUS, mass_radius=MASS_RADIUS)


def rig(seed: int = 0, kind: Kind = "rectilinear") -> Rig:
    """A rig of the make; inertias and springs differ by some percent, friction by a fifth, pieces by their tolerance.

    Seed 0 is the rig as designed.
    """
    make, piece = MAKES[kind], nominal_piece(kind)
    if seed == 0:
        return Rig(kind=kind, truth=make.plant, pieces=(piece,) * PIECES, seed=0)
    rng = np.random.default_rng([seed, 10, kind == "torsional"])
    spread = {"m_1": 0.04, "J_1": 0.04, "k_1": 0.06, "c_1": 0.2, "f_1c": 0.2}
    changed = {
        n: getattr(make.plant, n) * math.exp(rng.normal(0, s)) for n, s in spread.items() if n in make.plant.names()
    }
    pieces = tuple((piece * (1 + make.tolerance * rng.normal(size=PIECES))).tolist())
    return Rig(kind=kind, truth=make.plant.replace(**changed), pieces=pieces, seed=seed)


def acquire(on: Rig, count: int, *, shot: int = 0, seconds: float = 3.0) -> Record:
    """Log of a step of the command and of its end, with `count` masses added; counts and volts.

    Friction differs by 13 % from run to run, and the body starts from wherever friction held it.
    """
    from upright.simulation import simulate

    make = MAKES[on.kind]
    rng = np.random.default_rng([on.seed, 11, on.kind == "torsional", count, shot])
    plant = on.truth.replace(a_1=sum(on.pieces[:count]))
    friction = plant.parameters()["f_1c"] * math.exp(rng.normal(0, 0.13))
    plant = plant.replace(f_1c=friction)
    held = friction / on.stiffness
    half = round(seconds / SERVO / EVERY)
    command = np.zeros(2 * half + 1)
    volts = round(make.step / make.converter) * make.converter
    command[: half + 1] = volts
    start = plant.state() + np.array([rng.uniform(-0.5, 0.5) * held, 0.0])
    drive = {"actuator.gain": make.gain, "actuator.limit": make.limit, "actuator.lag": 2e-3}
    x = simulate(plant, drive, start, np.repeat(command, EVERY), SERVO, samples=command.size, every=EVERY)[:, 0, 0]
    column = "x_1" if on.kind == "rectilinear" else "theta_1"
    return Record(
        t=np.arange(command.size, dtype=np.float64) * (SERVO * EVERY),
        signals={"u": command, column: np.round((x - x[0]) * make.counts)},
        units={"u": "V", column: "counts"},
        inputs=("u",),
        outputs=(column,),
        provenance=Provenance(
            reader="twin",
            rig=f"digital twin of a {on.kind} rig, seed {on.seed}",
            notes=("This log was simulated; no rig was touched.",),
        ),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Campaign:
    """The logs of experiment 1a on one rig with what follows from them."""

    on: Rig
    logs: dict[str, Record]
    added: dict[str, float]
    found: Loadings
    left_out: tuple[str, ...]
    """Why some logs did not count: friction may leave too few swings."""


def run(
    seed: int = 0, kind: Kind = "rectilinear", *, counts: tuple[int, ...] = (0, 1, 2, 3, 4), shots: int = 2
) -> Campaign:
    """Step a rig of the make with every count of masses, `shots` times each, and weigh it."""
    return weigh_body(rig(seed, kind), counts=counts, shots=shots)


def weigh_body(
    on: Rig, progress: Progress | None = None, *, counts: tuple[int, ...] = (0, 1, 2, 3, 4), shots: int = 2
) -> Campaign:
    """Step a body with every count of masses, `shots` times each, and weigh it."""
    piece = nominal_piece(on.kind)
    logs: dict[str, Record] = {}
    added: dict[str, float] = {}
    loaded: list[Loaded] = []
    left_out: list[str] = []
    for i, count in enumerate(counts):
        if progress:
            progress(f"stepping with {count} masses", i / len(counts))
        for shot in range(shots):
            name = f"{count} masses, run {shot + 1}"
            record = acquire(on, count, shot=shot)
            logs[name], added[name] = record, count * piece
            column = record.outputs[0]
            try:
                loaded += swings(record, added=count * piece, label=name, signal=column, command="u", quantum=1.0)
            except NotIdentifiable as error:
                left_out.append(str(error))
    found = weigh(loaded, tolerance=MAKES[on.kind].tolerance, piece=piece)
    return Campaign(on=on, logs=logs, added=added, found=found, left_out=tuple(left_out))


def write_logs(done: Campaign, folder: Path) -> dict[str, str]:
    """Write every log as CSV; gives back its file by its label."""
    folder.mkdir(parents=True, exist_ok=True)
    files: dict[str, str] = {}
    for label, record in done.logs.items():
        files[label] = label.replace(" masses, run ", "x500g_run") + ".csv"
        record.to_csv(folder / files[label])
    return files


def truth(on: Rig) -> dict[str, float]:
    """What only a twin can tell, by the symbols of the report."""
    name = "m_0" if on.kind == "rectilinear" else "J_0"
    return {"k": on.stiffness, name: on.bare, "c": on.truth.parameters()["c_1"]}
