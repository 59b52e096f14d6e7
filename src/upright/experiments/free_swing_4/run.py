"""Experiment 4, from release to fits, drift and the balance of energy.

Every step leaves files that anyone can work on: logs (CSV) and study files (TOML) that `upright identify` takes.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from upright.experiments.free_swing_4.release import (
    TILT,
    DriftPath,
    Release,
    anchored,
    carrier,
    drift_paths,
    freed,
    motion,
    release_log,
)
from upright.experiments.stand.known import Known
from upright.files import replace_file
from upright.identification.model.fit import Fit
from upright.physics import Plant
from upright.progress import Progress, part, silent
from upright.quantities import with_unit
from upright.records import Array, Record
from upright.rig import Rig
from upright.rig.makes import MOTOR_AND_BELT, SERVO, Make, make_of
from upright.study.load import Study
from upright.study.text import TomlTable, counted_sensor, study_text, table

FRICTION = ("b_1", "b_1c", "b_2", "b_2c")


@dataclass(frozen=True, kw_only=True)
class Question:
    """One fit of the experiment: what it shows, which logs it sees, what is known and estimated."""

    name: str
    title: str
    fitted: str
    predicted: str
    known: Mapping[str, tuple[float, float]]
    guesses: Mapping[str, float]
    bounds: Mapping[str, tuple[float, float]]
    unknown: tuple[str, ...] = ("initial",)
    method: str = "auto"


@dataclass(frozen=True, kw_only=True, eq=False)
class QuestionFit:
    """A question with its fit and the study that repeats it."""

    question: Question
    study: Study
    fit: Fit


@dataclass(frozen=True, kw_only=True)
class Recovered:
    """One number: truth of the twin, what the fit says, and whether the truth lies in its interval."""

    name: str
    unit: str
    truth: float
    value: float
    interval: tuple[float, float]
    inside: bool


def logs(rig: Rig) -> dict[str, Record]:
    """The releases of the experiment by the name of their file: level, out of level, and anchored by a spring.

    A cart does without the last two: a lean too small to see does not move what sticks.
    """
    low = Release(angle=math.radians(-60))
    out = {"release_90.csv": release_log(rig, shot=1), "release_60.csv": release_log(rig, low, shot=2)}
    if carrier(rig) == "psi":
        leaning = rig.changed(tilt_y=math.sin(TILT))
        out["release_90_tilted.csv"] = release_log(leaning, shot=3)
        out["release_60_tilted.csv"] = release_log(leaning, low, shot=4)
        out["release_90_spring.csv"] = release_log(anchored(leaning), shot=5)
        out["release_60_spring.csv"] = release_log(anchored(leaning), low, shot=6)
    return out


def measured_beforehand(rig: Rig, weighed: Known | None = None) -> dict[str, tuple[float, float]]:
    """What was measured beforehand: value and standard uncertainty [SI].

    The inertia of disk or cart comes from experiment 1a (`weighed`; 1 % without it), the lengths from a ruler and from
    balancing the rod on an edge; the rod's axial inertia, 0.2 % of the disk's, from a drawing.
    """
    rng = np.random.default_rng([rig.seed, 41])
    truth = rig.plant.parameters()
    body = make_of(rig.plant).body
    spread = {body: 0.01 * truth[body], "l_cg": 0.5e-3, "r": 0.3e-3}
    measured = {n: (truth[n] + rng.normal(0, s), s) for n, s in spread.items() if n in truth}
    if weighed and weighed.name == body:
        off = MOTOR_AND_BELT if body == "J_d" else 0.0
        measured[body] = (weighed.value - off, weighed.stderr)
    return measured | ({"J_a": (truth["J_a"], 0.0)} if "J_a" in truth else {})


def questions(rig: Rig, weighed: Known | None = None) -> tuple[Question, ...]:
    """The fits of the experiment, all from guesses that are 30 % off."""
    rng = np.random.default_rng([rig.seed, 42])
    guess = {n: getattr(rig.plant, n) * rng.choice([0.7, 1.3]) for n in ("m_p", "J_p", *FRICTION)}
    known = measured_beforehand(rig, weighed)
    scale = {"J_d": 1.3, "J_a": 0.7, "m_c": 1.3}
    blind = {n: v for n, v in known.items() if n not in scale}
    tilt = {"tilt_x": (-0.1, 0.1), "tilt_y": (-0.1, 0.1)}

    def ask(name: str, title: str, log: str, known: Mapping[str, tuple[float, float]], **more: float) -> Question:
        return Question(
            name=name,
            title=title,
            fitted=f"release_90{log}.csv",
            predicted=f"release_60{log}.csv",
            known=known,
            guesses={**guess, **more},
            bounds={n: b for n, b in tilt.items() if n in more},
        )

    free = {n: share * known[n][0] for n, share in scale.items() if n in known}
    both = (
        ask("free_swing", "Large free swing of a level rig", "", known),
        ask("no_scale", "The same swing, no inertia given", "", blind, **free),
    )
    if carrier(rig) != "psi":
        return both
    anchor = make_of(rig.plant).anchor
    spring = {**known, "k_psi": (anchor, 0.01 * anchor)}
    return (
        *both,
        # no friction term helps a model that cannot lean, so none is tried one by one
        replace(
            ask("level_model", "A rig out of level, explained as if it were level", "_tilted", known),
            method="least-squares",
        ),
        ask("tilt_model", "A rig out of level, its lean estimated too", "_tilted", known, tilt_x=0.0, tilt_y=0.0),
        replace(
            ask("spring", "A rig out of level, anchored by a soft spring, as if it were level", "_spring", spring),
            method="least-squares",
            unknown=("initial", "offset"),  # the spring's own zero lies where the lean lets it
        ),
    )


def question_text(q: Question, rig: Rig) -> str:
    """The question as a study file."""
    kind, source = type(rig.plant), f"digital twin of {rig.name}, seed {rig.seed}: simulated, no rig was touched"

    def wearing_unit(name: str, value: float) -> float | str:
        unit = kind.quantity(name).unit
        return value if unit == "1" else with_unit(value, unit, 6)

    parameters = TomlTable("[parameters]")
    for name, (value, spread) in q.known.items():
        known, uncertainty = wearing_unit(name, value), wearing_unit(name, spread)
        parameters.key(name, {"value": known, "uncertainty": uncertainty} if spread else known)
    for name, guess in q.guesses.items():
        low, high = q.bounds.get(name, (0.0, math.inf))
        bounds = {"min": low} | ({"max": high} if math.isfinite(high) else {})
        parameters.key(name, {"guess": wearing_unit(name, guess), **bounds})
    defaults = TomlTable("[defaults]")
    defaults.key("initial", {f"{carrier(rig)}_dot": 0.0, "theta_dot": 0.0}, "released from rest")
    defaults.key("unknown", q.unknown)
    return study_text(
        (
            table("", title=q.title, source=source),
            table("[rig]", plant=make_of(rig.plant).plant_name, vendor=make_of(rig.plant).vendor),
            parameters,
            *(counted_sensor(c.name, c.unit, n) for c, n in zip(rig.plant.coordinates, rig.per_unit, strict=True)),
            *(
                table("[[runs]]", label=file.removesuffix(".csv").replace("_", " "), file=file, role=role)
                for role, file in (("fit", q.fitted), ("predict", q.predicted))
            ),
            defaults,
        )
    )


def write_questions(rig: Rig, folder: Path, weighed: Known | None = None) -> tuple[tuple[Question, Path], ...]:
    """Write logs and studies; gives back each question with its study file."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, record in logs(rig).items():
        record.to_csv(folder / name)
    made: list[tuple[Question, Path]] = []
    for q in questions(rig, weighed):
        path = folder / f"{q.name}.toml"
        replace_file(path, question_text(q, rig).encode())
        made.append((q, path))
    return tuple(made)


def fit_question(q: Question, study: Path, progress: Progress = silent) -> QuestionFit:
    """Fit one question from its files, as `upright identify` would."""
    from upright.identification.estimate import identify
    from upright.study.load import load_study

    loaded = load_study(study)
    tell = part(progress, 0.0, 1.0, q.title)
    return QuestionFit(
        question=q, study=loaded, fit=identify(loaded.model, loaded.runs, method=q.method, progress=tell)
    )


def recovered(rig: Rig, fit: Fit) -> tuple[Recovered, ...]:
    """The estimates of a fit beside the truth that only a twin can tell."""
    truth = rig.plant.parameters()
    return tuple(
        Recovered(
            name=n,
            unit=e.unit,
            truth=truth[n],
            value=e.value,
            interval=e.interval,
            inside=e.interval[0] <= truth[n] <= e.interval[1],
        )
        for n, e in fit.estimates.items()
        if n in truth and n in fit.model.parameters and e.status != "known"
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class EnergyBalance:
    """Energy of the release over time: time (N,) [s], what is still there and what each friction took [J]."""

    t: Array
    stored: Array
    dissipated: Mapping[str, Array]


@dataclass(kw_only=True, eq=False)
class FreeSwing:
    """What has been found so far; it is filled step by step, so that an interrupted one can be reported."""

    rig: Rig
    folder: Path
    weighed: Known | None = None
    answers: dict[str, QuestionFit] = field(default_factory=dict[str, QuestionFit])
    drifts: tuple[DriftPath, ...] = ()
    balance: EnergyBalance | None = None
    interrupted: bool = False
    seconds: float = 0.0

    @property
    def make(self) -> Make:
        """Make of the rig."""
        return make_of(self.rig.plant)

    @property
    def body(self) -> str:
        """What carries the pendulum."""
        return "disk" if carrier(self.rig) == "psi" else "cart"


def run_free_swing(
    rig: Rig,
    seed: int,
    folder: Path,
    progress: Progress = silent,
    stopped: Callable[[], bool] = lambda: False,
    *,
    weighed: Known | None = None,
) -> FreeSwing:
    """Run the experiment on a pendulum rig; Ctrl-C stops it and keeps what is there.

    Parameters
    ----------
    rig : Rig
        Its drive is put out of the way first.
    seed : int
        Of guesses, and of what a hand and a ruler do.
    folder : Path
        Takes logs and studies.
    progress : callable, optional
        Called with the current step and the share of the experiment completed.
    stopped : callable, optional
        Asked after each fit whether to stop there; a fit may finish on its best so far when Ctrl-C is pressed.
    weighed : Known, optional
        Inertia of disk or cart as experiment 1a found it.
    """
    began = time.perf_counter()
    result = FreeSwing(rig=freed(replace(rig, seed=seed)), folder=folder, weighed=weighed)
    try:
        progress("releasing the pendulum", 0.0)
        questions = write_questions(result.rig, folder, weighed)
        for i, (question, path) in enumerate(questions):
            base, part = 0.05 + 0.85 * i / len(questions), 0.85 / len(questions)
            answer = fit_question(question, path, lambda step, share, b=base, p=part: progress(step, b + p * share))
            result.answers[question.name] = answer
            if answer.fit.interrupted or stopped():
                raise KeyboardInterrupt
        progress("following the body that carries it", 0.9)
        result.drifts = drift_paths(result.rig)
        result.balance = balance(result)
    except KeyboardInterrupt:
        result.interrupted = True
    result.seconds = time.perf_counter() - began
    return result


def balance(result: FreeSwing) -> EnergyBalance:
    """Where the energy of the first release went, as the fitted model tells it."""
    fit = result.answers["free_swing"].fit
    values = {n: p.value for n, p in fit.model.parameters.items() if n in fit.model.plant.names()}
    values |= {n: e.value for n, e in fit.estimates.items() if n in values}
    model = result.rig.plant.replace(**values)
    t, x = motion(replace(result.rig, plant=model), seconds=12.0, every=1)
    stored = model.energy(x) - float(model.energy(model.state()))
    dissipated = losses(model, t, x)
    every = max(1, round(0.02 / SERVO))
    return EnergyBalance(
        t=t[::every], stored=stored[::every], dissipated={n: e[::every] for n, e in dissipated.items()}
    )


def losses(plant: Plant, t: Array, x: Array) -> dict[str, Array]:
    """Energy [J] that each kind of friction has taken since the first sample, shape (N,) each, by a readable name.

    Viscous power is Rayleigh's, joint by joint where a coordinate has its own; dry friction takes F_c |v|, quadratic
    drag c |v|^3. Stiction takes nothing while it holds. Integrated by the trapezoid rule, so the samples must be
    close to each other.
    """
    from scipy.integrate import cumulative_trapezoid

    powers = {"viscous friction": plant.power_lost(x)}
    values = plant.parameters()
    for joint in plant.joints:
        speed = np.abs(x[:, 1::2] @ joint.direction([c.name for c in plant.coordinates]))
        for kind, name, power in (("Coulomb friction", joint.coulomb, speed), ("drag", joint.quadratic, speed**3)):
            if name and values[name] > 0:
                powers[f"{kind} of {joint.on}"] = values[name] * power
    dissipated = {name: np.asarray(cumulative_trapezoid(power, t, initial=0)) for name, power in powers.items()}
    return {name: energy for name, energy in dissipated.items() if energy[-1] > 0}
