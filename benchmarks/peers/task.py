"""What every peer is asked: the same samples, the same known numbers, the same starts, the same model."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.study import load_study

Array = NDArray[np.float64]

STUDIES = Path(__file__).parents[2] / "examples" / "studies"
TAILS = ("uw_pendulum_tail", "aau_pendulum_tail")
"""Public logs of a free swing whose first 30 s are fitted and whose rest is predicted."""
KNOWN = {"m_p": 0.135, "l_cg": 0.19, "r": 0.16, "g": 9.81}
"""Numbers of the Furuta twins that everyone is given."""
CENTRE = {"J_d": 0.011, "J_p": 6e-4, "b_1": 0.015, "b_1c": 0.03, "b_2": 2e-4, "b_2c": 1e-3, "gain": 0.12}
"""Numbers about which the twins' are drawn, and the names that every Furuta's have."""
PUBLIC = 2e-3
"""Time between samples of a public Furuta, whose own vary from 1.5 to 4.6 ms [s]."""
SWEEP = (0.35, 0.8, 1.3, 2.1)
"""Frequencies of a twin's command [Hz]."""
NOISE, MEMORY = 3e-3, 0.9
"""Noise of a twin's sensors as a share of how its signals vary, and what one sample's keeps of the last one's."""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """One run: times (N,) [s], command (N,), angles (N, q) [rad]; scores count from `score_from` seconds on."""

    t: Array
    u: Array
    y: Array
    score_from: float = 0.0

    @property
    def scored(self) -> NDArray[np.bool_]:
        """Which samples count."""
        return self.t >= self.t[0] + self.score_from - 1e-9

    @property
    def before(self) -> Samples:
        """What a start may be refitted to: the samples before those that count, or all where all count."""
        first = int(np.argmax(self.scored))
        return self.part(0, first) if first else self

    def part(self, first: int, last: int) -> Samples:
        """Samples from first to before last, timed from zero."""
        return Samples(t=self.t[first:last] - self.t[first], u=self.u[first:last], y=self.y[first:last])


@dataclass(frozen=True, kw_only=True)
class Task:
    """A rig to identify.

    `guesses` has a start for each number asked, `known` what everyone is given, `truth` the numbers of a twin; `offset`
    says that the sensor's zero is asked too, `steps` how many integration steps a sample takes.
    """

    name: str
    plant: str
    known: Mapping[str, float]
    guesses: Mapping[str, float]
    fitted: Samples
    held_out: Mapping[str, Samples] = field(default_factory=dict[str, Samples])
    truth: Mapping[str, float] = field(default_factory=dict[str, float])
    offset: bool = False
    steps: int = 1


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What a peer says: intervals of 95 % by number (none where it gives none), its runs, seconds, its own words."""

    values: Mapping[str, float] = field(default_factory=dict[str, float])
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    predicted: Mapping[str, Array] = field(default_factory=dict[str, Array])
    seconds: float = math.nan
    says: str = ""


def spent() -> float:
    """Processor seconds of this process and of those that it has waited for, compilers among them."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def fit_percent(run: Samples, predicted: Array) -> list[float]:
    """Fit percent of each signal over what is scored, 100 (1 - |y - y_hat| / |y - mean y|)."""
    y, y_hat = run.y[run.scored], predicted[run.scored]
    missed, moved = np.linalg.norm(y - y_hat, axis=0), np.linalg.norm(y - y.mean(axis=0), axis=0)
    return (100 * (1 - missed / moved)).tolist()


def tail(study: str, data: Path) -> Task:
    """The task of one of `TAILS`, with the samples as upright cleans them."""
    loaded = load_study(STUDIES / f"{study}.toml", data=data)
    runs = {
        run.label: Samples(t=run.t - run.t[0], u=np.zeros(run.t.size), y=run.y, score_from=run.score_from)
        for run in loaded.runs
    }
    parameters = loaded.model.parameters
    return Task(
        name=study.partition("_")[0], plant="pendulum",
        known={n: parameters[n].value for n in ("m_p", "l_cg", "g")},
        guesses={n: parameters[n].value for n in ("J_p", "b_2", "b_2c", "b_2q")},
        fitted=runs.pop("first 30 s"), held_out=runs, offset="aau" in study, steps=4 if "aau" in study else 1,
    )  # fmt: skip


def driven(data: Path) -> Task:
    """A public Furuta pendulum: its arm shaken by a sine of 4 V is fitted, one of 2 V predicted.

    The encoders are zeroed where the rig hangs, and everyone gets the samples every 2 ms. The study also has a lean of
    the base and a lag of the drive; nobody is given these here.
    """
    loaded = load_study(STUDIES / "furuta_sines.toml", data=data)
    parameters = loaded.model.parameters
    runs: dict[str, Samples] = {}
    for run in loaded.runs[:2]:
        t = np.arange(run.t[0], run.t[-1], PUBLIC)
        y = np.column_stack([np.interp(t, run.t, column - column[0]) for column in run.y.T])
        held = np.searchsorted(run.t, t, side="right") - 1
        runs[run.label] = Samples(t=t - t[0], u=np.ravel(run.u)[held], y=y)
    return Task(
        name="macstepien", plant="furuta",
        known={n: parameters[n].value for n in ("m_p", "l_cg", "r", "g")},
        guesses={n: parameters["actuator.gain" if n == "gain" else n].value for n in CENTRE},
        fitted=runs.pop("sine 4 V"), held_out=runs,
    )  # fmt: skip


def twin(seed: int, *, stribeck: float = 0.0) -> Task:
    """A driven Furuta pendulum from a simulator of nobody's, with guesses 20 to 40 % off.

    Breaking away takes `stribeck` more than sliding; no peer models that.
    """
    rng = np.random.default_rng([11, seed])
    dt, count = 2e-3, 4001
    t = np.arange(count) * dt
    truth = {n: float(v * rng.uniform(0.8, 1.25)) for n, v in CENTRE.items()}
    u = sum(rng.uniform(0.8, 1.6) * np.sin(2 * np.pi * f * t + rng.uniform(0, 2 * np.pi)) for f in SWEEP)
    off = [float(rng.choice([rng.uniform(0.6, 0.8), rng.uniform(1.25, 1.4)])) for _ in truth]
    noise = rng.standard_normal((count, 2))
    for k in range(1, count):
        noise[k] = MEMORY * noise[k - 1] + math.sqrt(1 - MEMORY**2) * noise[k]
    y = _simulated(truth, np.asarray(u), dt, stribeck)
    run = Samples(t=t, u=np.asarray(u), y=y + NOISE * y.std(axis=0) * noise)
    return Task(
        name=f"twin {seed}", plant="furuta", known=KNOWN, truth=truth,
        guesses={n: v * f for (n, v), f in zip(truth.items(), off, strict=True)}, fitted=run,
    )  # fmt: skip


def _simulated(p: Mapping[str, float], u: Array, dt: float, stribeck: float) -> Array:
    """Angles by the classical Runge-Kutta method in steps of 10 us, dry friction rounded over 0.5 mrad/s."""
    from benchmarks.peers.by_hand import furuta

    numbers = np.array([p[n] for n in ("J_d", "J_p", "b_1", "b_1c", "b_2", "b_2c", "gain")])
    known = np.array(list(KNOWN.values()))
    return furuta(numbers, known, np.array([0.0, 0.05]), u, dt, 200, 5e-4, stribeck)


def study_text(task: Task) -> str:
    """The study that a user of upright writes for a task; its logs are called as its runs, ``fitted.csv``."""
    units = {"m_p": "kg", "l_cg": "m", "r": "m", "g": "m/s^2", "J_p": "kg m^2", "J_d": "kg m^2", "b_1": "N m s/rad",
             "b_2": "N m s/rad", "b_1c": "N m", "b_2c": "N m", "b_2q": "N m s^2/rad^2"}  # fmt: skip
    numbers: dict[str, Any] = {n: json.dumps(f"{v!r} {units[n]}") for n, v in task.known.items()}
    numbers |= {
        n: f"{{ guess = {json.dumps(f'{v!r} {units[n]}')}, min = 0 }}" for n, v in task.guesses.items() if n in units
    }
    lines = ["[rig]", f'plant = "{task.plant}"', f"substeps = {task.steps}", "", "[parameters]"]
    lines += [f"{n} = {v}" for n, v in numbers.items()]
    if "gain" in task.guesses:
        lines += ["", "[actuator]", f'gain = {{ guess = "{task.guesses["gain"]!r} N m/V", min = 0 }}']
        lines += ["", "[drive]", 'column = "u"', 'unit = "V"', "", "[sensors.psi]", 'unit = "rad"']
    lines += ["", "[sensors.theta]", 'unit = "rad"', "", "[defaults]"]
    lines += ["initial = { psi_dot = 0, theta_dot = 0 }"] if task.plant == "furuta" else []
    lines += [f"unknown = {json.dumps(['initial', *(['offset'] if task.offset else [])])}"]
    for label, run in {"fitted": task.fitted, **task.held_out}.items():
        lines += ["", "[[runs]]", f'label = "{label}"', f'file = "{label}.csv"']
        lines += [] if label == "fitted" else ['role = "predict"', f'score_from = "{run.score_from:g} s"']
    return "\n".join(lines) + "\n"
