"""Experiment 1a: the inertia of a rig's first body, and its spring, from steps with known masses added.

The rig's pendulum or second body is locked or taken off, its masses are unbolted, and known ones are added one by one.
What is then mounted for the later experiments has a known inertia, so the body's inertia follows with its uncertainty.

On a live rig, which is one cart or disk, its owner names what is bolted on, a person does it, and a first step shows
how large the others may be.

The twins of cart and disk stick: dry friction, encoder counts, converter steps and amplifier limits are as on the rigs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from upright.errors import BadInput
from upright.experiments.stand.known import Known
from upright.experiments.stand.stand import APPLIED, TestStand, file_of
from upright.experiments.stand.strength import GROWTH, OF_TRAVEL, REACH, SHARE, STILL
from upright.experiments.weighing_1a.loadings import inertia_of, weigh
from upright.identification.loadings import Loadings
from upright.physics import Plant
from upright.progress import Progress, silent
from upright.records import Record
from upright.records.record import of_twin
from upright.rig import Rig
from upright.rig.makes import BODIES, BodyOnSpring, Make, make_of

PIECES = 4  # 500 g masses that come with a rig
EVERY = 4  # servo periods per logged sample
SWINGS = 10
"""Periods, by the guesses and with all masses on, for which it swings after each step."""
STEPS = (1.0, 0.0, -1.0, 0.0)
"""Commands of a run, one swing each: to either side and back."""
PROBE = 0.3
"""Of the step that the guesses call for: what comes of it says how large a step may be."""


@dataclass(frozen=True, kw_only=True)
class LoadedRig:
    """The true rig of a body on its spring, with the added inertias that its pieces truly have [kg or kg m^2]."""

    body: BodyOnSpring
    rig: Rig
    pieces: tuple[float, ...]

    @property
    def bare(self) -> float:
        """True inertia without additions."""
        return self.rig.plant.parameters()[self.body.inertia]

    @property
    def stiffness(self) -> float:
        """True stiffness."""
        return self.rig.plant.parameters()["k_1"]


def drawn_twin(seed: int, kind: str) -> LoadedRig:
    """A twin of a kind; inertias and springs differ by some percent, friction by a fifth, pieces by their tolerance.

    Seed 0 is the rig as designed.
    """
    body = BODIES[kind]
    if seed == 0:
        return LoadedRig(body=body, rig=body.rig, pieces=(body.piece,) * PIECES)
    rng = np.random.default_rng([seed, 10, kind == "torsional"])
    spread = {body.inertia: 0.04, "k_1": 0.06, "c_1": 0.2, "f_1c": 0.2}
    values = body.rig.plant.parameters()
    rig = replace(body.rig.changed(**{n: values[n] * math.exp(rng.normal(0, s)) for n, s in spread.items()}), seed=seed)
    pieces = tuple((body.piece * (1 + body.tolerance * rng.normal(size=PIECES))).tolist())
    return LoadedRig(body=body, rig=rig, pieces=pieces)


def step_log(on: LoadedRig, count: int, *, shot: int = 0, seconds: float = 3.0) -> Record:
    """Log of a step of the command and of its end, with `count` masses added; counts and volts.

    Friction differs by 13 % from run to run, and the body starts from wherever friction held it.
    """
    from upright.simulation import simulate

    rig = on.rig
    rng = np.random.default_rng([rig.seed, 11, on.body.kind == "torsional", count, shot])
    friction = rig.plant.parameters()["f_1c"] * math.exp(rng.normal(0, 0.13))
    plant = rig.plant.replace(a_1=sum(on.pieces[:count]), f_1c=friction)
    held = friction / on.stiffness
    half = round(seconds / rig.period / EVERY)
    command = np.zeros(2 * half + 1)
    command[: half + 1] = round(on.body.step / rig.converter) * rig.converter
    start = plant.state() + np.array([rng.uniform(-0.5, 0.5) * held, 0.0])
    drive = {n: v for n, v in rig.drive.items() if n != "actuator.delay"}  # its steps begin when they begin
    x = simulate(
        plant, drive, start, np.repeat(command, EVERY), rig.period,
        samples=command.size, every=EVERY,
    )[:, 0, 0]  # fmt: skip
    column = plant.coordinates[0].name
    return Record(
        t=np.arange(command.size, dtype=np.float64) * (rig.period * EVERY),
        signals={"u": command, column: np.round((x - x[0]) * rig.per_unit[0])},
        units={"u": "V", column: "counts"},
        inputs=("u",),
        outputs=(column,),
        provenance=of_twin(rig.name, rig.seed),
    )


def twin_truth(on: LoadedRig) -> dict[str, float]:
    """What only a twin can tell, by the symbols of the report."""
    return {"k": on.stiffness, on.body.bare: on.bare, "c": on.rig.plant.parameters()["c_1"]}


@dataclass(frozen=True, kw_only=True, eq=False)
class Campaign:
    """The logs of experiment 1a on one body with what follows from them.

    Attributes
    ----------
    kind : {"rectilinear", "torsional"}
    logs : dict of str to Record
        By label.
    added : dict of str to float
        Inertia that was bolted on, by label [kg or kg m^2].
    left_out : tuple of str
        Why some logs did not count: friction may leave too few swings.
    truth : mapping of str to float
        What only a twin can tell, by the symbols of the report; empty of hardware.
    files : dict of str to str
        Names of the logs, by label, where they were written.
    on : LoadedRig or None
        The body itself, where its true numbers are known.
    """

    kind: str
    logs: dict[str, Record]
    added: dict[str, float]
    loadings: Loadings
    left_out: tuple[str, ...]
    truth: Mapping[str, float]
    files: Mapping[str, str] = field(default_factory=dict[str, str])
    on: LoadedRig | None = None

    def written(self, folder: Path) -> Campaign:
        """The same with every log as CSV in a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        files: dict[str, str] = {}
        for label, record in self.logs.items():
            files[label] = label.replace(" masses, run ", "x500g_run") + ".csv"
            record.to_csv(folder / files[label])
        return replace(self, files=files)


@dataclass(frozen=True, kw_only=True, eq=False)
class Weighing:
    """Experiment 1a on a rig: the swings with their line, and what they say about the rig as it is used later.

    `make` says what the later experiments add to the body; None where it is used as it was weighed.
    """

    rig: Rig
    make: Make | None
    folder: Path
    campaign: Campaign
    known: tuple[Known, ...]
    tolerance: float = 0.0


def measure_body(
    on: LoadedRig, progress: Progress = silent, *, counts: tuple[int, ...] = (0, 1, 2, 3, 4), shots: int = 2
) -> Campaign:
    """Step a body with every count of masses, `shots` times each, and weigh it."""
    design = on.body
    logs: dict[str, Record] = {}
    values: list[float] = []
    for i, count in enumerate(counts):
        progress(f"stepping with {count} masses", i / len(counts))
        for shot in range(shots):
            logs[f"{count} masses, run {shot + 1}"] = step_log(on, count, shot=shot)
            values.append(count * design.piece)
    signals = {label: record.outputs[0] for label, record in logs.items()}
    loadings, left_out = weigh(
        logs, values, signals, dict.fromkeys(logs, "u"), tolerance=design.tolerance, piece=design.piece
    )  # fmt: skip
    return Campaign(
        kind=design.kind, logs=logs, added=dict(zip(logs, values, strict=True)), loadings=loadings, left_out=left_out,
        truth=twin_truth(on), on=on,
    )  # fmt: skip


def first_body(rig: Rig) -> LoadedRig:
    """The first body of a rig on a spring, its masses unbolted.

    A pendulum's cart sits between two springs, its disk below a clamped shaft; of two bodies the second is clamped, so
    that the spring is their own.
    """
    make = _make(rig)
    design, mounted, true = make.on_spring, make.mounted, rig.plant.parameters()
    rng = np.random.default_rng([rig.seed, 12])
    tolerance = design.tolerance if rig.seed else 0.0
    on = mounted.each * float(np.sum(1 + tolerance * rng.normal(size=mounted.pieces)))
    on += mounted.rest + rng.normal() * mounted.rest_error * bool(rig.seed)
    spring = {"k_1": true["k_12"]} if "k_12" in true else {}
    drawn = drawn_twin(rig.seed, design.kind)
    return replace(drawn, rig=drawn.rig.changed(**{design.inertia: true[make.body] - on}, **spring))


def _make(rig: Rig) -> Make:
    return make_of(
        rig.plant, f"experiment 1a knows carts, disks and pendulums on them, and no {type(rig.plant).__name__}."
    )


def run_weighing(stand: TestStand, seed: int, folder: Path, progress: Progress = silent) -> Weighing:
    """Weigh the first body of a rig; its logs are written to `folder`.

    A twin's body is freed and stepped whatever is built on it, a live rig must be that body alone.

    Raises
    ------
    BadInput
        When a twin is of no make, or the loadings named for a live rig are of another kind or fewer than two.
    NotIdentifiable
        When too few swings can be seen.
    RigStopped
        When a live rig was stopped by a limit, or was not loaded.
    """
    rig = stand.rig
    if not stand.starts_anywhere:
        result = step_stand(stand, folder, progress)
        bare = result.loadings.bare
        known = (Known(name=BODIES[result.kind].inertia, value=bare.value, stderr=bare.stderr),)
        return Weighing(rig=rig, make=None, folder=folder, campaign=result, known=known, tolerance=stand.tolerance)
    make = _make(rig)
    result = measure_body(first_body(replace(rig, seed=seed)), progress).written(folder)
    loadings, mounted = result.loadings, make.mounted
    spread = make.on_spring.tolerance * mounted.each * math.sqrt(mounted.pieces)
    body = Known(
        name=make.body,
        value=loadings.bare.value + mounted.each * mounted.pieces + mounted.rest,
        stderr=math.hypot(loadings.bare.stderr, spread, mounted.rest_error),
    )
    spring = "k_12" in rig.plant.names()
    known = (body, Known(name="k_12", value=loadings.k.value, stderr=loadings.k.stderr)) if spring else (body,)
    return Weighing(rig=rig, make=make, folder=folder, campaign=result, known=known)


def kind_of(plant: Plant) -> str:
    """Whether it is one cart or one disk on a spring, which can be weighed; empty of any other."""
    on_spring = (k for k, o in BODIES.items() if isinstance(plant, type(o.rig.plant)))
    return next((k for k in on_spring if plant.parameters()["k_1"] > 0), "")


def step_stand(stand: TestStand, folder: Path, progress: Progress = silent) -> Campaign:
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
    runs = list(zip(stand.added, truly, strict=True))
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
            amplitude = float(np.ptp(record[name])) / 4  # a step swings to twice where it rests, to either side
            level = min(SHARE * stand.rig.limit, GROWTH / PROBE * level, level * wanted / max(amplitude, 1e-12))
            continue
        label = text if text not in logs else f"{text}, run {i}"
        logs[label], files[label] = record, file_of(record)
    loadings, left_out = weigh(
        logs, values, dict.fromkeys(logs, name), dict.fromkeys(logs, APPLIED), tolerance=stand.tolerance
    )
    body, true = BODIES[kind], stand.truth
    truth = {"k": true["k_1"], body.bare: true[body.inertia], "c": true["c_1"]} if true else {}
    return Campaign(
        kind=kind, logs=logs, added=dict(zip(logs, values, strict=True)), loadings=loadings, left_out=left_out,
        truth=truth, files=files,
    )  # fmt: skip


def _added(stand: TestStand) -> list[float]:
    """Loadings of RIG.toml [kg or kg m^2]."""
    kind = kind_of(stand.rig.plant)
    stated = [inertia_of(text) for text in stand.added]
    if {k for _, k in stated if k} == {kind} and len({a for a, _ in stated}) > 1:
        return [a for a, _ in stated]
    unit, piece = BODIES[kind].unit, BODIES[kind].piece
    raise BadInput(
        f"experiment 1a needs two or more different loadings in {unit}, such as, in RIG.toml, [loadings] "
        f'added = ["0 {unit}", "{piece:.3g} {unit}", "{2 * piece:.3g} {unit}"], got {", ".join(stand.added)}.'
    )


def _bolted(stand: TestStand, values: Sequence[float]) -> list[float]:
    """What a twin's hands truly bolt on: pieces of the smallest loading, each off by its tolerance; of hardware, 0."""
    if not stand.performed:
        return [0.0] * len(values)
    piece = min(v for v in values if v > 0)
    count = math.ceil(max(values) / piece)
    off = np.random.default_rng([stand.twin.seed, 71]).normal(0.0, stand.tolerance, count)
    return np.interp(values, piece * np.arange(count + 1), np.append(0.0, np.cumsum(piece * (1 + off)))).tolist()


def _wanted(stand: TestStand) -> float:
    """How far a step is to put it [m or rad]; it swings twice as far."""
    return min(REACH[stand.rig.plant.coordinates[0].unit], OF_TRAVEL * stand.travel)


def _stiffness(stand: TestStand) -> float:
    """Command per displacement, by the guesses."""
    return stand.rig.plant.parameters()["k_1"] / abs(stand.rig.gain)


def _slowest(stand: TestStand, added: float) -> float:
    """Natural frequency with that added, by the guesses [rad/s]."""
    p, inertia = stand.rig.plant.parameters(), stand.rig.plant.names()[0]
    return math.sqrt(p["k_1"] / (p[inertia] + p["a_1"] + added))


def _steps(level: float, seconds: float, period: float) -> list[float]:
    each = math.ceil(seconds / period)
    return np.concatenate([np.zeros(math.ceil(STILL / period)), np.repeat(level * np.array(STEPS), each)]).tolist()
