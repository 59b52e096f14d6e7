"""Experiment 4, from release to fits, drift and the balance of energy."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upright.control.rig import ServoRig
from upright.experiments.free_swing_4.drift import DriftPath, drift_paths
from upright.experiments.free_swing_4.release import carrier, freed, motion
from upright.experiments.free_swing_4.studies import Answer, fit_question, write_questions
from upright.experiments.makes import SERVO, Make, make_of
from upright.experiments.weighing_1a.run import Known
from upright.physics import Plant
from upright.progress import Progress, silent

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Balance:
    """Energy of the release over time: time (N,) [s], what is still there and what each friction took [J]."""

    t: Array
    stored: Array
    taken: Mapping[str, Array]


@dataclass(kw_only=True, eq=False)
class FreeSwing:
    """What has been found so far; it is filled step by step, so that an interrupted one can be reported."""

    rig: ServoRig
    folder: Path
    weighed: Known | None = None
    answers: dict[str, Answer] = field(default_factory=dict[str, Answer])
    drifts: tuple[DriftPath, ...] = ()
    balance: Balance | None = None
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
    rig: ServoRig,
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
    rig : ServoRig
        Its drive is put out of the way first.
    seed : int
        Of guesses, and of what a hand and a ruler do.
    folder : Path
        Takes logs and studies.
    progress : callable, optional
        Told the step at work and the share of the experiment done.
    stopped : callable, optional
        Asked after each fit whether to stop there; a fit may finish on its best so far when Ctrl-C is pressed.
    weighed : Known, optional
        Inertia of disk or cart as experiment 1a found it.
    """
    began = time.perf_counter()
    done = FreeSwing(rig=freed(replace(rig, seed=seed)), folder=folder, weighed=weighed)
    with _kept(done):
        progress("releasing the pendulum", 0.0)
        asked = write_questions(done.rig, folder, weighed)
        for i, (question, path) in enumerate(asked):
            base, part = 0.05 + 0.85 * i / len(asked), 0.85 / len(asked)
            found = fit_question(question, path, lambda step, share, b=base, p=part: progress(step, b + p * share))
            done.answers[question.name] = found
            if found.fit.interrupted or stopped():
                raise KeyboardInterrupt
        progress("following the body that carries it", 0.9)
        done.drifts = drift_paths(done.rig)
        done.balance = balance(done)
    done.seconds = time.perf_counter() - began
    return done


@contextmanager
def _kept(done: FreeSwing) -> Generator[None]:
    with suppress(KeyboardInterrupt):
        done.interrupted = True
        yield
        done.interrupted = False


def balance(done: FreeSwing) -> Balance:
    """Where the energy of the first release went, as the fitted model tells it."""
    fit = done.answers["free_swing"].fit
    values = {n: p.value for n, p in fit.rig.parameters.items() if n in fit.rig.plant.names()}
    values |= {n: e.value for n, e in fit.estimates.items() if n in values}
    model = done.rig.plant.replace(**values)
    t, x = motion(replace(done.rig, plant=model), seconds=12.0, every=1)
    stored = model.energy(x) - float(model.energy(model.state()))
    taken = losses(model, t, x)
    every = max(1, round(0.02 / SERVO))
    return Balance(t=t[::every], stored=stored[::every], taken={n: e[::every] for n, e in taken.items()})


def losses(plant: Plant, t: Array, x: Array) -> dict[str, Array]:
    """Energy [J] that each kind of friction has taken since the first sample, shape (N,) each, by a readable name.

    Viscous power is Rayleigh's, joint by joint where a coordinate has its own; dry friction takes F_c |v|, quadratic
    drag c |v|^3. Stiction takes nothing while it holds. Integrated by the trapezoid rule, so the samples must be
    close to each other.
    """
    taken: dict[str, Array] = {}
    values = plant.parameters()
    taken["viscous friction"] = _running(t, plant.power_lost(x))
    for joint in plant.joints:
        i = plant.state_names().index(f"{joint.on}_dot")
        speed = np.abs(x[:, i])
        for kind, name, power in (("Coulomb friction", joint.coulomb, speed), ("drag", joint.quadratic, speed**3)):
            if name and values[name] > 0:
                taken[f"{kind} of {joint.on}"] = _running(t, values[name] * power)
    return {name: energy for name, energy in taken.items() if energy[-1] > 0}


def _running(t: Array, power: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.diff(t) * (power[1:] + power[:-1]) / 2)])
