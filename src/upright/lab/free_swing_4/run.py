"""How does experiment 4 go, from release to report?"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upright.control.rig import Rig
from upright.lab.free_swing_4 import drift, energy
from upright.lab.free_swing_4 import studies as free_swing
from upright.lab.free_swing_4.studies import Answer
from upright.lab.rigs.twin import SERVO, Twin, freed, motion
from upright.lab.weighing_1a.run import Known
from upright.progress import Progress

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

    rig: Twin
    folder: Path
    weighed: Known | None = None
    answers: dict[str, Answer] = field(default_factory=dict[str, Answer])
    wanders: tuple[drift.Wander, ...] = ()
    balance: Balance | None = None
    interrupted: bool = False
    seconds: float = 0.0

    @property
    def body(self) -> str:
        """What carries the pendulum."""
        return "disk" if self.rig.base == "psi" else "cart"


def run(
    rig: Rig,
    seed: int,
    folder: Path,
    progress: Progress | None = None,
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
        Told the step at work and the share of the experiment done.
    stopped : callable, optional
        Asked after each fit whether to stop there; a fit may finish on its best so far when Ctrl-C is pressed.
    weighed : Known, optional
        Inertia of disk or cart as experiment 1a found it.
    """  # fmt: skip
    began = time.perf_counter()
    done = FreeSwing(rig=freed(replace(rig, seed=seed)), folder=folder, weighed=weighed)
    tell = progress or (lambda step, share: None)
    with _kept(done):
        tell("releasing the pendulum", 0.0)
        asked = free_swing.write(done.rig, folder, weighed)
        for i, (question, path) in enumerate(asked):
            base, part = 0.05 + 0.85 * i / len(asked), 0.85 / len(asked)
            found = free_swing.answer(question, path, lambda step, share, b=base, p=part: tell(step, b + p * share))
            done.answers[question.name] = found
            if found.fit.interrupted or stopped():
                raise KeyboardInterrupt
        tell("following the body that carries it", 0.9)
        done.wanders = drift.study(done.rig)
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
    model = done.rig.truth.replace(**values)
    t, x = motion(replace(done.rig, truth=model), seconds=12.0, every=1)
    stored = model.energy(x) - float(model.energy(model.state()))
    taken = energy.losses(model, t, x)
    every = max(1, round(0.02 / SERVO))
    return Balance(t=t[::every], stored=stored[::every], taken={n: e[::every] for n, e in taken.items()})
