"""Experiment 1a at a rig: a body on a spring is stepped, known masses are bolted to it, and it is stepped again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upright.errors import BadInput
from upright.experiments.hands_on.hanging import GROWTH, OF_TRAVEL, REACH, SHARE, STILL
from upright.experiments.stand.live import LiveStand
from upright.experiments.stand.protocol import APPLIED, file_of
from upright.experiments.weighing_1a.from_logs import inertia_of, weigh
from upright.identification.loadings import Loadings
from upright.physics import Plant
from upright.progress import Progress
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
    stand : LiveStand
    kind : {"rectilinear", "torsional"}
    loadings : Loadings
    logs : dict of str to Record
        By label.
    files : dict of str to str
        Names of the logs, by label.
    left_out : tuple of str
        Why some logs did not count.
    """

    stand: LiveStand
    kind: str
    loadings: Loadings
    logs: dict[str, Record]
    files: dict[str, str]
    left_out: tuple[str, ...]


def kind_of(plant: Plant) -> str:
    """Whether it is one cart or one disk on a spring, which can be weighed; empty of any other."""
    on_spring = (k for k, o in OSCILLATORS.items() if isinstance(plant, type(o.plant)))
    return next((k for k in on_spring if plant.parameters()["k_1"] > 0), "")


def run_loaded(stand: LiveStand, folder: Path, progress: Progress) -> Weighed:
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
    kind, values = kind_of(stand.rig.plant), _added(stand)
    truly = _bolted(stand, values)
    seconds = SWINGS * 2 * math.pi / _slowest(stand, max(values))
    (name,), wanted = stand.names, _wanted(stand)
    level = PROBE * min(SHARE * stand.rig.limit, wanted * _stiffness(stand))
    logs: dict[str, Record] = {}
    files: dict[str, str] = {}
    runs = list(zip(stand.file.added, truly, strict=True))
    runs.insert(0, runs[0])  # the probe
    for i, (text, true) in enumerate(runs):
        progress(f"stepping with {text} added", i / len(runs))
        stand.ask(
            f"Bolt on what makes {text} in all and nothing else, and let {name} rest on its spring with room to either "
            f"side; steps follow for {len(STEPS) * seconds:.0f} s."
        )
        signal = _steps(level, seconds, stand.rig.period)
        record = stand.run(signal, folder, f"loaded_{i}" if i else "probe", bolted=true)
        if i == 0:
            seen = float(np.ptp(record[name])) / 4  # a step swings to twice where it rests, to either side
            level = min(SHARE * stand.rig.limit, GROWTH / PROBE * level, level * wanted / max(seen, 1e-12))
            continue
        label = text if text not in logs else f"{text}, run {i}"
        logs[label], files[label] = record, file_of(record)
    found, left_out = weigh(
        logs, values, dict.fromkeys(logs, name), dict.fromkeys(logs, APPLIED), tolerance=stand.file.tolerance
    )
    return Weighed(stand=stand, kind=kind, loadings=found, logs=logs, files=files, left_out=left_out)


def _added(stand: LiveStand) -> list[float]:
    """Loadings of RIG.toml [kg or kg m^2]."""
    kind = kind_of(stand.rig.plant)
    said = [inertia_of(text) for text in stand.file.added]
    if {k for _, k in said if k} == {kind} and len({a for a, _ in said}) > 1:
        return [a for a, _ in said]
    unit, piece = OSCILLATORS[kind].unit, OSCILLATORS[kind].piece
    raise BadInput(
        f"{stand.file.path}: experiment 1a needs two or more different loadings in {unit}, such as [loadings] "
        f'added = ["0 {unit}", "{piece:.3g} {unit}", "{2 * piece:.3g} {unit}"], got {", ".join(stand.file.added)}.'
    )


def _bolted(stand: LiveStand, values: Sequence[float]) -> list[float]:
    """What a twin's hands truly bolt on: pieces of the smallest loading, each off by its tolerance; of hardware, 0."""
    if stand.file.hardware:
        return [0.0] * len(values)
    piece = min(v for v in values if v > 0)
    count = math.ceil(max(values) / piece)
    off = np.random.default_rng([stand.file.seed, 71]).normal(0.0, stand.file.tolerance, count)
    return np.interp(values, piece * np.arange(count + 1), np.append(0.0, np.cumsum(piece * (1 + off)))).tolist()


def _wanted(stand: LiveStand) -> float:
    """How far a step is to put it [m or rad]; it swings twice as far."""
    return min(REACH[stand.rig.plant.coordinates[0].unit], OF_TRAVEL * stand.travel)


def _stiffness(stand: LiveStand) -> float:
    """Command per displacement, by the guesses."""
    return stand.rig.plant.parameters()["k_1"] / abs(stand.rig.gain)


def _slowest(stand: LiveStand, added: float) -> float:
    """Natural frequency with that added, by the guesses [rad/s]."""
    p, inertia = stand.rig.plant.parameters(), stand.rig.plant.names()[0]
    return math.sqrt(p["k_1"] / (p[inertia] + p["a_1"] + added))


def _steps(level: float, seconds: float, period: float) -> list[float]:
    each = math.ceil(seconds / period)
    return np.concatenate([np.zeros(math.ceil(STILL / period)), np.repeat(level * np.array(STEPS), each)]).tolist()
