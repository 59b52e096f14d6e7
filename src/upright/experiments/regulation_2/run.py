"""Experiment 2: the rig held upright with the numbers it was identified by, and beforehand what will come of it.

Gains come from the identified model, the verdict per pole set from the rigs that its covariance allows; then the law
runs on the rig itself, here the twin's truth, and what came is put beside what was told.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from upright.control import Score, Trial, score, trial
from upright.control.preflight import STABILISED, Preflight, Task, preflight, word
from upright.designing.run import SPEEDS, velocities
from upright.errors import BadInput
from upright.experiments.frequency_1b.run import run_frequency
from upright.gains import Margins, Placement, feedback, margins, place
from upright.gains.loop import closed, command_noise
from upright.gains.requests import Roots, poles_of, read_poles
from upright.laws import Law
from upright.paper.reproduce import TABLE_1
from upright.progress import Progress, part, silent
from upright.records import Array
from upright.rig import Rig
from upright.rig.makes import PENDULUMS, make_of_vendor
from upright.rig.variation import allowed
from upright.study.stored_rig import read_stored_rig
from upright.systems import StateSpace
from upright.workers import HERE, Workers

START = (math.radians(5), 0.0)
"""Tilt [rad] and speed [rad/s] with which a pendulum is let go where nobody says and no make has its own."""
HAND = (0.01, 0.1)
"""What a hand gets wrong: half a degree, and 0.1 rad/s."""
DRAWS = 200
SETS = {f"set {i}": text for i, text in enumerate(TABLE_1, start=1)}


@dataclass(frozen=True, kw_only=True)
class RegulationRequest:
    """What is asked: poles by name [1/s], the way to the velocities, and the start (see `START` when None)."""

    poles: Mapping[str, Roots] = field(default_factory=lambda: {n: read_poles(text) for n, text in SETS.items()})
    speed: str = "filtered"
    memory: float = 0.5
    tilt: float | None = None
    push: float | None = None
    seconds: float = 6.0
    draws: int = DRAWS

    def __post_init__(self) -> None:
        if self.speed not in SPEEDS:
            raise BadInput(f"velocities come from {', '.join(SPEEDS)}, got '{self.speed}'.")
        if not 0 < self.seconds <= 120:
            raise BadInput(f"a run takes more than 0 and at most 120 s, got {self.seconds:g} s.")
        if self.draws < 1:
            raise BadInput(f"draws needs a whole number of at least 1, got {self.draws}.")


@dataclass(frozen=True, kw_only=True, eq=False)
class Came:
    """What came of a law: the run with its figures, and why it ended early, as a sentence."""

    trial: Trial
    score: Score
    ended: str = ""


Try = Callable[[str, Law, Preflight], Came | None]
"""Runs a law, by its name and with what is expected of it; None where it is not run."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Attempt:
    """One pole set: gains, what was told beforehand, and what came of it; None where nothing was run."""

    name: str
    placement: Placement
    law: Law
    before: Preflight
    came: Came | None

    @property
    def after(self) -> Trial | None:
        """The run itself."""
        return None if self.came is None else self.came.trial

    @property
    def score(self) -> Score | None:
        """Its figures."""
        return None if self.came is None else self.came.score

    @property
    def word(self) -> str:
        """What it came to, in one of `preflight.WORDS`; empty when nothing was run."""
        return "" if self.score is None else word(self.score)

    @property
    def title(self) -> str:
        """Its name and what it came to, or what is expected where nothing was run."""
        return f"{self.name}: {self.word or self.before.word}"


@dataclass(frozen=True, kw_only=True, eq=False)
class VelocityRun:
    """One way to the velocities, with the recommended set's gains."""

    name: str
    noise: float | None
    margins: Margins | None
    run: Trial
    score: Score
    restless: float
    """Root mean square of the command's changes from sample to sample over the first second [the command's unit]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Regulation:
    """What the experiment found.

    Attributes
    ----------
    rig : Rig
        As identified.
    truth : Rig or None
        The rig on which the laws ran.
    task : Task
    wish : Wish
    attempts : tuple of Attempt
    ways : tuple of Way
        For the recommended set, on the truth, or on the model where there is no truth.
    uncertain : bool
        Whether the identification told of its uncertainty.
    source : str
        What `upright regulate` is given to do this again.
    seed : int
    interrupted : bool
    seconds : float
        Computing time.
    """

    rig: Rig
    truth: Rig | None
    task: Task
    wish: RegulationRequest
    attempts: tuple[Attempt, ...]
    ways: tuple[VelocityRun, ...]
    uncertain: bool
    source: str
    seed: int
    interrupted: bool = False
    seconds: float = 0.0

    @property
    def ran(self) -> tuple[Attempt, ...]:
        """The sets that were run."""
        return tuple(a for a in self.attempts if a.came is not None)

    @property
    def simulated(self) -> bool:
        """Whether nothing of it came from a rig: the laws ran on a twin, or nothing was run."""
        return self.truth is not None or not self.ran

    @property
    def best(self) -> Attempt:
        """The set to recommend beforehand: the surest to stabilise without saturation or excessive effort.

        Then the surest to stabilise with saturation, or at all; of equals the one with the quietest command at rest,
        to a hundredth of the limit, and of those the one that recovers from the hardest tap.
        """
        return max(self.attempts, key=_rank)


def _rank(a: Attempt) -> tuple[float, ...]:
    b = a.before
    sure = (b.words[STABILISED], b.quiet_chance, b.chance)
    return (*(round(share, 2) for share in sure), -round(b.rest_rms, 2), b.push)


def identify_make(key: str, seed: int, folder: Path, progress: Progress = silent, draws: int = DRAWS) -> Rig:
    """What experiment 1b makes of a rig of the make; its logs and `fit.json` go into the folder."""
    if key not in PENDULUMS:
        raise BadInput(f"there is nothing to hold upright on the make '{key}'; take one of {', '.join(PENDULUMS)}.")
    run_frequency(key, seed, folder, progress)
    return read_stored_rig(folder / "fit.json", seed=seed, draws=draws)


def _check_upright(known: Rig) -> None:
    plant = known.plant
    if "inverted" not in plant.equilibria or len(plant.coordinates) != 2 or len(plant.inputs) != 1:
        raise BadInput(
            f"there is nothing to hold upright on a '{known.name}'; regulate is for one driven body with a pendulum "
            "on it (furuta, cart-pendulum, or your own with the equilibrium 'inverted'), upright design for all."
        )


def run_regulation(
    rig: Rig, truth: Rig | None, seed: int, folder: Path, progress: Progress = silent,
    stopped: Callable[[], bool] = lambda: False, wish: RegulationRequest | None = None, source: str = "FIT",
    workers: Workers = HERE, tried: Try | None = None,
) -> Regulation:  # fmt: skip
    """Design for the rig as identified, say what will come, and run on the rig itself.

    Parameters
    ----------
    rig : Rig
        As identified hanging, completed for a run.
    truth : Rig, optional
        The rig; without it nothing is run and only what is expected is told.
    seed : int
        Of the hand's errors and of the rigs drawn.
    folder : Path
        Takes the logs of the runs.
    progress : callable, optional
        Told the step at work and the share done.
    stopped : callable, optional
        Asked after every set whether to stop there.
    wish : Wish, optional
    source : str
        How a command line would name the fit.
    workers : Workers, optional
        Who simulates the rigs that the fit allows.
    tried : callable, optional
        Runs the laws in the place of `truth`.
    """
    began = time.perf_counter()
    wish = wish or RegulationRequest()
    _check_upright(rig)
    make = make_of_vendor(rig.hardware.vendor, rig.plant)
    usual = make.start if make else START
    model = rig.linear("inverted")
    sampled = model.to_sampled(rig.period, rig.delay / rig.period)
    tilt, push = (w if w is not None else s for w, s in zip((wish.tilt, wish.push), usual, strict=True))
    task = Task(start=(0.0, 0.0, tilt, push), hand=(0.0, 0.0, *HAND), seconds=wish.seconds)
    others = allowed(rig, wish.draws, seed)
    if tried is None and truth is not None:
        tried = partial(_on_twin, truth, task, seed)
    attempts: list[Attempt] = []
    interrupted = False
    for i, (name, poles) in enumerate(wish.poles.items()):
        whole = len(wish.poles) + 1
        tell = part(progress, i / whole, (i + 1) / whole, f"regulating with {name}")
        tell("designing", 0.0)
        attempts.append(_attempt(name, poles, rig, tried, model, sampled, task, others, wish, seed, workers, tell))
        if stopped():
            interrupted = True
            break
    done = Regulation(
        rig=rig, truth=truth, task=task, wish=wish, attempts=tuple(attempts), ways=(), uncertain=bool(rig.draws),
        source=source, seed=seed, interrupted=interrupted,
    )  # fmt: skip
    progress("comparing the ways to the velocities", len(wish.poles) / (len(wish.poles) + 1))
    ways = () if interrupted else tuple(_ways(done, model, sampled))
    for a in done.attempts:
        if a.after is not None:
            folder.mkdir(parents=True, exist_ok=True)
            a.after.record.to_csv(folder / f"regulation_{a.name.replace(' ', '_')}.csv")
    return replace(done, ways=ways, seconds=time.perf_counter() - began)


def actual_start(task: Task, seed: int) -> Array:
    """Where the hand really let go."""
    return task.starts(1, np.random.default_rng([seed, 54]))[0]


def _attempt(
    name: str, poles: Roots, rig: Rig, tried: Try | None, model: StateSpace, sampled: StateSpace, task: Task,
    others: Mapping[str, Array], wish: RegulationRequest, seed: int, workers: Workers, progress: Progress,
) -> Attempt:  # fmt: skip
    placed = place(model.A, model.B, poles)
    law = feedback(velocities(model, sampled, wish.speed, wish.memory, rig.limit, rig.quantum), placed.K)
    told = preflight(
        rig, model, sampled, law, task, parameters=others, lanes=wish.draws, seed=seed, workers=workers,
        progress=progress,
    )  # fmt: skip
    came = None if tried is None else tried(name, law, told)
    return Attempt(name=name, placement=placed, law=law, before=told, came=came)


def _on_twin(truth: Rig, task: Task, seed: int, _name: str, law: Law, _told: Preflight) -> Came:
    went = trial(truth, law, at=task.at, start=actual_start(task, seed), seconds=task.seconds)
    return Came(trial=went, score=score(went))


def _ways(done: Regulation, model: StateSpace, sampled: StateSpace) -> list[VelocityRun]:
    on, K = done.truth or done.rig, done.best.placement.K
    driven = model.to_sampled(sampled.period, sampled.delay, done.rig.lag)
    out: list[VelocityRun] = []
    for speed in SPEEDS:
        way = velocities(model, sampled, speed, done.wish.memory, done.rig.limit, done.rig.quantum)
        law = feedback(way, K)
        stands = bool(np.abs(poles_of(closed(driven, law))).max() < 1)
        went = trial(on, law, at=done.task.at, start=actual_start(done.task, done.seed), seconds=done.task.seconds)
        out.append(
            VelocityRun(
                name=way.name,
                noise=command_noise(driven, law, done.rig.quantum) if stands else None,
                margins=margins(driven, law) if stands else None,
                run=went,
                score=score(went),
                restless=float(np.sqrt(np.mean(np.diff(went.u[went.t <= 1.0]) ** 2))),
            )
        )
    return out
