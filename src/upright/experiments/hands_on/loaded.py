"""Experiment 1a at a rig: a body on a spring is stepped, known masses are bolted to it, and it is stepped again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upright.errors import BadInput
from upright.experiments.hands_on.hanging import GROWTH, OF_TRAVEL, REACH, SHARE, STILL, travel_of
from upright.experiments.hands_on.rig import RigAtHand
from upright.experiments.weighing_1a.from_logs import inertia_of, weigh
from upright.identification.loadings import Loadings
from upright.physics import Plant
from upright.progress import Progress
from upright.readers import read
from upright.records import Record
from upright.rig.makes import OSCILLATORS

SWINGS = 10
"""Periods, by the guesses and with all masses on, for which it swings after each step."""
STEPS = (1.0, 0.0, -1.0, 0.0)
"""Commands of a run, one swing each: to either side and back."""
PROBE = 0.3
"""Of the step that the guesses call for: what comes of it says how large a step may be."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Weighed:
    """The logs of experiment 1a at a rig with what follows from them.

    Attributes
    ----------
    rig : RigAtHand
    kind : {"rectilinear", "torsional"}
    loadings : Loadings
    logs : dict of str to Record
        By label.
    files : dict of str to str
        Names of the logs, by label.
    left_out : tuple of str
        Why some logs did not count.
    """

    rig: RigAtHand
    kind: str
    loadings: Loadings
    logs: dict[str, Record]
    files: dict[str, str]
    left_out: tuple[str, ...]


def kind_of(plant: Plant) -> str:
    """Whether it is one cart or one disk on a spring, which can be weighed; empty of any other."""
    on_spring = (k for k, o in OSCILLATORS.items() if isinstance(plant, type(o.plant)))
    return next((k for k in on_spring if plant.parameters()["k_1"] > 0), "")


def run_loaded(rig: RigAtHand, folder: Path, progress: Progress) -> Weighed:
    """Ask for one loading after another, and step the rig with each; leaves a log of each in a folder.

    Raises
    ------
    BadInput
        When RIG.toml names loadings of another kind, or fewer than two.
    NotIdentifiable
        When too few swings can be seen.
    RigStopped
        When the rig was stopped by a limit, or was not loaded.
    """
    kind, values = kind_of(rig.model.plant), _added(rig)
    truly = _bolted(rig, values)
    seconds = SWINGS * 2 * math.pi / _slowest(rig, max(values))
    (name,), wanted = rig.names, _wanted(rig)
    level = PROBE * min(SHARE * rig.model.limit, wanted * _stiffness(rig))
    logs: dict[str, Record] = {}
    files: dict[str, str] = {}
    runs = list(zip(rig.file.added, truly, strict=True))
    runs.insert(0, runs[0])  # the probe
    for i, (text, true) in enumerate(runs):
        progress(f"stepping with {text} added", i / len(runs))
        rig.requested(
            f"Bolt on what makes {text} in all and nothing else, and let {name} rest on its spring with room to either "
            f"side; steps follow for {len(STEPS) * seconds:.0f} s."
        )
        signal = _steps(level, seconds, rig.model.period)
        log = rig.put_out(signal, folder, f"loaded_{i}" if i else "probe", bolted=true)
        record = read(log)
        if i == 0:
            seen = float(np.ptp(record[name])) / 4  # a step swings to twice where it rests, to either side
            level = min(SHARE * rig.model.limit, GROWTH / PROBE * level, level * wanted / max(seen, 1e-12))
            continue
        label = text if text not in logs else f"{text}, run {i}"
        logs[label], files[label] = record, log.name
    found, left_out = weigh(
        logs, values, dict.fromkeys(logs, name), dict.fromkeys(logs, "u_applied"), tolerance=rig.file.tolerance
    )
    return Weighed(rig=rig, kind=kind, loadings=found, logs=logs, files=files, left_out=left_out)


def _added(rig: RigAtHand) -> list[float]:
    """Loadings of RIG.toml [kg or kg m^2]."""
    kind = kind_of(rig.model.plant)
    said = [inertia_of(text) for text in rig.file.added]
    if {k for _, k in said if k} == {kind} and len({a for a, _ in said}) > 1:
        return [a for a, _ in said]
    unit, piece = OSCILLATORS[kind].unit, OSCILLATORS[kind].piece
    raise BadInput(
        f"{rig.file.path}: experiment 1a needs two or more different loadings in {unit}, such as [loadings] "
        f'added = ["0 {unit}", "{piece:.3g} {unit}", "{2 * piece:.3g} {unit}"], got {", ".join(rig.file.added)}.'
    )


def _bolted(rig: RigAtHand, values: Sequence[float]) -> list[float]:
    """What a twin's hands truly bolt on: pieces of the smallest loading, each off by its tolerance; of hardware, 0."""
    if rig.file.hardware:
        return [0.0] * len(values)
    piece = min(v for v in values if v > 0)
    count = math.ceil(max(values) / piece)
    off = np.random.default_rng([rig.file.seed, 71]).normal(0.0, rig.file.tolerance, count)
    return np.interp(values, piece * np.arange(count + 1), np.append(0.0, np.cumsum(piece * (1 + off)))).tolist()


def _wanted(rig: RigAtHand) -> float:
    """How far a step is to put it [m or rad]; it swings twice as far."""
    return min(REACH[rig.model.plant.coordinates[0].unit], OF_TRAVEL * travel_of(rig, 0))


def _stiffness(rig: RigAtHand) -> float:
    """Command per displacement, by the guesses."""
    return rig.model.plant.parameters()["k_1"] / abs(rig.model.gain)


def _slowest(rig: RigAtHand, added: float) -> float:
    """Natural frequency with that added, by the guesses [rad/s]."""
    p, inertia = rig.model.plant.parameters(), rig.model.plant.names()[0]
    return math.sqrt(p["k_1"] / (p[inertia] + p["a_1"] + added))


def _steps(level: float, seconds: float, period: float) -> list[float]:
    each = math.ceil(seconds / period)
    return np.concatenate([np.zeros(math.ceil(STILL / period)), np.repeat(level * np.array(STEPS), each)]).tolist()
