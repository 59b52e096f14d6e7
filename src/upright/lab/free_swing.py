"""Experiment 4: lift the pendulum to horizontal, let go, and find the rig's numbers in what the encoders saw.

Every step leaves files that anyone can work on: logs (CSV) and study files (TOML) that `upright identify` takes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from upright.identification.model import Fit
from upright.identification.study import Study
from upright.lab.drift import SPRING, TILT
from upright.lab.twin import COUNTS, Release, Twin, acquire
from upright.physics import Furuta
from upright.records import Record
from upright.report.experiment import Recovered

FRICTION = ("b_1", "b_1c", "b_2", "b_2c")
_UNITS = {name: Furuta.quantity(name).unit for name in Furuta.names()}

Progress = Callable[[str, float], None]
"""Told which step is at work and how far it is, 0 to 1."""


@dataclass(frozen=True, kw_only=True)
class Question:
    """One fit of the experiment: what it shows, which logs it sees, what is known and asked."""

    name: str
    title: str
    fitted: str
    predicted: str = ""
    known: Mapping[str, tuple[float, float]]
    asked: Mapping[str, float]
    bounds: Mapping[str, tuple[float, float]]
    unknown: tuple[str, ...] = ("initial",)
    method: str = "auto"


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer:
    """A question with its fit and the study that repeats it."""

    question: Question
    study: Study
    fit: Fit


def logs(rig: Twin) -> dict[str, Record]:
    """The releases of the experiment by the name of their file: level, out of level, and anchored by a spring."""
    leaning = rig.changed(tilt_y=math.sin(TILT))
    return {
        "release_90.csv": acquire(rig, shot=1),
        "release_60.csv": acquire(rig, Release(angle=math.radians(-60)), shot=2),
        "release_90_tilted.csv": acquire(leaning, shot=3),
        "release_60_tilted.csv": acquire(leaning, Release(angle=math.radians(-60)), shot=4),
        "release_90_spring.csv": acquire(leaning.changed(k_psi=SPRING), shot=5),
        "release_60_spring.csv": acquire(leaning.changed(k_psi=SPRING), Release(angle=math.radians(-60)), shot=6),
    }


def bench(rig: Twin) -> dict[str, tuple[float, float]]:
    """What was measured beforehand: value and standard uncertainty [SI].

    The disk's inertia comes from experiment 1, the lengths from a ruler and from balancing the rod on an edge; the
    rod's axial inertia, 0.2 % of the disk's, from a drawing.
    """
    rng = np.random.default_rng([rig.seed, 41])
    spread = {"J_d": 0.01 * rig.truth.J_d, "l_cg": 0.5e-3, "r": 0.3e-3}
    measured = {n: (getattr(rig.truth, n) + rng.normal(0, s), s) for n, s in spread.items()}
    return {**measured, "J_a": (rig.truth.J_a, 0.0)}


def questions(rig: Twin) -> tuple[Question, ...]:
    """The fits of the experiment, all from guesses that are 30 % off."""
    rng = np.random.default_rng([rig.seed, 42])
    guess = {n: getattr(rig.truth, n) * rng.choice([0.7, 1.3]) for n in ("m_p", "J_p", *FRICTION)}
    known = bench(rig)
    blind = {n: v for n, v in known.items() if n not in ("J_d", "J_a")}
    tilt = {"tilt_x": (-0.1, 0.1), "tilt_y": (-0.1, 0.1)}
    spring = {**known, "k_psi": (SPRING, 0.01 * SPRING)}

    def ask(name: str, title: str, log: str, known: Mapping[str, tuple[float, float]], **more: float) -> Question:
        return Question(
            name=name,
            title=title,
            fitted=f"release_90{log}.csv",
            predicted=f"release_60{log}.csv",
            known=known,
            asked={**guess, **more},
            bounds={n: b for n, b in tilt.items() if n in more},
        )

    return (
        ask("free_swing", "Large free swing of a level rig", "", known),
        ask(
            "no_scale",
            "The same swing, no inertia given",
            "",
            blind,
            J_d=1.3 * known["J_d"][0],
            J_a=0.7 * known["J_a"][0],
        ),
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


def study_text(q: Question, rig: Twin) -> str:
    """The question as a study file."""
    lines = [
        f'title = "{q.title}"',
        f'source = "digital twin of ECP 205 + A51, seed {rig.seed}: simulated, no rig was touched"',
        "",
        "[rig]",
        'plant = "furuta"',
        "",
        "[parameters]",
    ]
    for name, (value, spread) in q.known.items():
        number = _with_unit(name, value)
        lines.append(
            f"{name} = {{ value = {number}, uncertainty = {_with_unit(name, spread)} }}"
            if spread
            else f"{name} = {number}"
        )
    for name, guess in q.asked.items():
        low, high = q.bounds.get(name, (0.0, math.inf))
        limits = f", min = {low:g}" + (f", max = {high:g}" if math.isfinite(high) else "")
        lines.append(f"{name} = {{ guess = {_with_unit(name, guess)}{limits} }}")
    for name in ("psi", "theta"):
        lines += ["", f"[sensors.{name}]", f'column = "{name}"', 'unit = "counts"', f"counts_per_rev = {COUNTS}"]
    for role, file in (("fit", q.fitted), ("predict", q.predicted)):
        if file:
            lines += ["", "[[runs]]", f'label = "{file.removesuffix(".csv").replace("_", " ")}"', f'file = "{file}"']
            lines += [f'role = "{role}"']
    lines += ["", "[defaults]", "initial = { psi_dot = 0.0, theta_dot = 0.0 }  # released from rest"]
    lines += [f"unknown = {list(q.unknown)}".replace("'", '"')]
    return "\n".join(lines) + "\n"


def _with_unit(name: str, value: float) -> str:
    return f'"{value:.6g} {_UNITS[name]}"' if _UNITS[name] != "1" else f"{value:.6g}"


def write(rig: Twin, folder: Path) -> tuple[tuple[Question, Path], ...]:
    """Write logs and studies; gives back each question with its study file."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, record in logs(rig).items():
        record.to_csv(folder / name)
    made: list[tuple[Question, Path]] = []
    for q in questions(rig):
        path = folder / f"{q.name}.toml"
        path.write_text(study_text(q, rig), encoding="utf-8")
        made.append((q, path))
    return tuple(made)


def answer(q: Question, study: Path, progress: Progress | None = None) -> Answer:
    """Fit one question from its files, as `upright identify` would."""
    from upright.identification.estimate import identify
    from upright.identification.study import load_study

    loaded = load_study(study)

    def tell(stage: str, done: float, cost: float, evaluations: int) -> None:
        if progress:
            progress(f"{q.title}: {stage}", done)

    return Answer(question=q, study=loaded, fit=identify(loaded.rig, loaded.runs, method=q.method, progress=tell))


def recovered(rig: Twin, fit: Fit) -> tuple[Recovered, ...]:
    """The estimates of a fit beside the truth that only a twin can tell."""
    truth = rig.truth.parameters()
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
        if n in truth and n in fit.rig.parameters and e.status != "known"
    )
