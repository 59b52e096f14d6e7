"""Experiment 1a: the inertia of a rig's first body, and its spring, from steps with known masses added.

The rig's pendulum or second body is locked or taken off, its masses are unbolted, and known ones are added one by one.
What is then mounted for the later experiments has a known inertia, so the body's inertia follows with its uncertainty.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from upright.control.rig import ServoRig
from upright.errors import NotIdentifiable
from upright.experiments.makes import Make, make_of
from upright.experiments.weighing_1a.twin import LoadedTwin, acquire, drawn_twin
from upright.identification.loadings import Loaded, Loadings, fit_loadings, swings
from upright.progress import Progress, silent
from upright.records import Record


@dataclass(frozen=True, kw_only=True, eq=False)
class Campaign:
    """The logs of experiment 1a on one body with what follows from them."""

    on: LoadedTwin
    logs: dict[str, Record]
    added: dict[str, float]
    found: Loadings
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

    rig: ServoRig
    make: Make
    folder: Path
    files: dict[str, str]
    campaign: Campaign
    known: tuple[Known, ...]


def weigh_body(
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
    return Campaign(on=on, logs=logs, added=added, found=found, left_out=tuple(left_out))


def first_body(rig: ServoRig) -> LoadedTwin:
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


def _make(rig: ServoRig) -> Make:
    return make_of(
        rig.plant, f"experiment 1a knows carts, disks and pendulums on them, and no {type(rig.plant).__name__}."
    )


def run_weighing(rig: ServoRig, seed: int, folder: Path, progress: Progress = silent) -> Weighing:
    """Weigh the first body of a rig; its logs are written to `folder`."""
    make = _make(rig)
    done = weigh_body(first_body(replace(rig, seed=seed)), progress)
    found, mounted = done.found, make.mounted
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
