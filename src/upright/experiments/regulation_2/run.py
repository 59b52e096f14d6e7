"""Experiment 2: the rig held upright with the numbers it was identified by, and beforehand what will come of it.

Gains come from the identified model, the verdict per pole set from the rigs that its covariance allows; then the law
runs on the rig itself, here the twin's truth, and is compared with its prediction.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from upright.basis import SIMULATED, in_percent
from upright.control import Score, Trial, score, trial
from upright.control.preflight import STABILISED, Preflight, Task, preflight, word
from upright.designing.run import SPEEDS, velocities
from upright.errors import BadInput
from upright.experiments.frequency_1b.run import run_frequency
from upright.experiments.stand.stand import StandRun, TestStand
from upright.gains import Margins, Placement, feedback, margins, place
from upright.gains.loop import closed, command_noise
from upright.gains.requests import Roots, poles_of, read_poles
from upright.laws import Law
from upright.paper.reproduce import TABLE_1
from upright.progress import Progress, part, silent
from upright.records import Array
from upright.rig import Rig
from upright.rig.makes import MAKES, PENDULUMS, make_of_vendor
from upright.rig.variation import allowed
from upright.study.stored_rig import read_stored_rig
from upright.systems import StateSpace
from upright.workers import HERE, Workers, one_thread

START = (math.radians(5), 0.0)
"""Tilt [rad] and speed [rad/s] with which a pendulum is let go where nobody says and no make has its own."""
HAND = (0.01, 0.1)
"""What a hand gets wrong: half a degree, and 0.1 rad/s."""
BY_HAND = (math.radians(4), 0.0)
"""The same where a person brings the pendulum up."""
SECONDS, SECONDS_BY_HAND = 6.0, 10.0
"""Length of a run."""
AT_LEAST = 0.5
"""Chance of being held below which a set is not run on a live rig: what falls hits something."""
DRAWS = 200
SETS = {f"set {i}": text for i, text in enumerate(TABLE_1, start=1)}


@dataclass(frozen=True, kw_only=True)
class RegulationRequest:
    """Request: poles by name [1/s], the velocity estimator, and the start (see `START` when None)."""

    poles: Mapping[str, Roots] = field(default_factory=lambda: {n: read_poles(text) for n, text in SETS.items()})
    speed: str = "filtered"
    memory: float = 0.5
    tilt: float | None = None
    push: float | None = None
    seconds: float = SECONDS
    draws: int = DRAWS

    def __post_init__(self) -> None:
        if self.speed not in SPEEDS:
            raise BadInput(f"velocities come from {', '.join(SPEEDS)}, got '{self.speed}'.")
        if not 0 < self.seconds <= 120:
            raise BadInput(f"a run takes more than 0 and at most 120 s, got {self.seconds:g} s.")
        if self.draws < 1:
            raise BadInput(f"draws needs a whole number of at least 1, got {self.draws}.")


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredRun:
    """What came of a law: the run with its figures, and why it ended early, as a sentence."""

    trial: Trial
    score: Score
    ended: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Attempt:
    """One pole set: gains, prediction, and measurement (None where nothing was run)."""

    name: str
    placement: Placement
    law: Law
    before: Preflight
    measured: MeasuredRun | None

    @property
    def after(self) -> Trial | None:
        """The run itself."""
        return None if self.measured is None else self.measured.trial

    @property
    def score(self) -> Score | None:
        """Its figures."""
        return None if self.measured is None else self.measured.score

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
        The rig on which the laws ran, where its true numbers are known.
    attempts : tuple of Attempt
    ways : tuple of Way
        For the recommended set, on the truth, or on the model where there is no truth.
    uncertain : bool
        Whether the identification has a covariance.
    source : str
        What `upright regulate` is given to do this again.
    performed : str
        `basis.SIMULATED` where no rig was driven.
    seconds : float
        Computing time.
    """

    rig: Rig
    truth: Rig | None
    task: Task
    request: RegulationRequest
    attempts: tuple[Attempt, ...]
    ways: tuple[VelocityRun, ...]
    uncertain: bool
    source: str
    seed: int
    performed: str = SIMULATED
    interrupted: bool = False
    seconds: float = 0.0

    @property
    def ran(self) -> tuple[Attempt, ...]:
        """The sets that were run."""
        return tuple(a for a in self.attempts if a.measured is not None)

    @property
    def best(self) -> Attempt:
        """The set to recommend beforehand: the surest to stabilise without saturation or excessive effort.

        Then the surest to stabilise with saturation, or at all; of equals the one with the quietest command at rest,
        to a hundredth of the limit, and of those the one that recovers from the hardest tap.
        """
        return max(self.attempts, key=_rank)


def _rank(a: Attempt) -> tuple[float, ...]:
    b = a.before
    sure = (b.words[STABILISED], b.quiet_share, b.share)
    return (*(round(share, 2) for share in sure), -round(b.rest_rms, 2), b.push)


def identify_make(key: str, seed: int, folder: Path, progress: Progress = silent, draws: int = DRAWS) -> Rig:
    """What experiment 1b makes of a rig of the make; its logs and `fit.json` go into the folder."""
    if key not in PENDULUMS:
        raise BadInput(f"there is no pendulum to hold upright on a '{key}'; take one of {', '.join(PENDULUMS)}.")
    run_frequency(key, seed, folder, progress)
    return read_stored_rig(folder / "fit.json", seed=seed, draws=draws)


def _check_upright(known: Rig) -> None:
    plant = known.plant
    if "inverted" not in plant.equilibria or len(plant.coordinates) != 2 or len(plant.inputs) != 1:
        raise BadInput(
            f"there is nothing to hold upright on a '{known.name}'; regulate is for one driven body with a pendulum "
            "on it (furuta, cart-pendulum, or your own with the equilibrium 'inverted'), upright design for all."
        )


def request_for(stand: TestStand, known: Rig) -> RegulationRequest:
    """Default request for a rig.

    The pole sets of Table 1 are for the makers' rigs; for one of one's own all are as much faster as it falls faster.
    """
    if stand.starts_anywhere:
        return RegulationRequest()
    tilt, push = BY_HAND
    request = RegulationRequest(tilt=tilt, push=push, seconds=SECONDS_BY_HAND)
    if stand.make is not None:
        return request
    falls = [float(p.linear("inverted").poles().real.max()) for p in (known.plant, MAKES["furuta"].rig.plant)]
    faster = falls[0] / falls[1]
    return replace(request, poles={f"{name} x{faster:.2g}": faster * p for name, p in request.poles.items()})


@one_thread()
def run_regulation(
    rig: Rig, stand: TestStand | None, seed: int, folder: Path, progress: Progress = silent,
    stopped: Callable[[], bool] = lambda: False, request: RegulationRequest | None = None, source: str = "FIT",
    workers: Workers = HERE,
) -> Regulation:  # fmt: skip
    """Design for the rig as identified, say what will come, and run on the rig itself.

    Parameters
    ----------
    rig : Rig
        As identified hanging, completed for a run.
    stand : TestStand, optional
        The rig itself; without it nothing is run, only predicted.
    seed : int
        Of the hand's errors and of the rigs drawn.
    folder : Path
        Takes the logs of the runs.
    progress : callable, optional
        Called with the current step and the share completed.
    stopped : callable, optional
        Asked after every set whether to stop there.
    request : RegulationRequest, optional
        What `request_for` says of the stand when omitted.
    source : str
        How a command line would name the fit.
    workers : Workers, optional
        Who simulates the rigs that the fit allows.

    Raises
    ------
    RigStopped
        When a run on a live rig did not begin.
    """
    began = time.perf_counter()
    request = request or (RegulationRequest() if stand is None else request_for(stand, rig))
    _check_upright(rig)
    make = make_of_vendor(rig.hardware.vendor, rig.plant)
    usual = make.start if make else START
    model = rig.linear("inverted")
    sampled = model.to_sampled(rig.period, rig.delay / rig.period)
    tilt, push = (w if w is not None else s for w, s in zip((request.tilt, request.push), usual, strict=True))
    task = Task(start=(0.0, 0.0, tilt, push), hand=(0.0, 0.0, *HAND), seconds=request.seconds)
    others = allowed(rig, request.draws, seed)
    attempts: list[Attempt] = []
    interrupted = False
    for i, (name, poles) in enumerate(request.poles.items()):
        whole = len(request.poles) + 1
        tell = part(progress, i / whole, (i + 1) / whole, f"regulating with {name}")
        tell("designing", 0.0)
        predicted = _predicted(name, poles, rig, model, sampled, task, others, request, seed, workers, tell)
        measured = None if stand is None else _run_attempt(stand, predicted, task, seed, folder)
        attempts.append(replace(predicted, measured=measured))
        if stopped():
            interrupted = True
            break
    result = Regulation(
        rig=rig, truth=None if stand is None else stand.exact, task=task, request=request,
        attempts=tuple(attempts), ways=(), uncertain=bool(rig.draws), source=source, seed=seed,
        performed=SIMULATED if stand is None or not any(a.measured for a in attempts) else stand.performed,
        interrupted=interrupted,
    )  # fmt: skip
    progress("comparing the ways to the velocities", len(request.poles) / (len(request.poles) + 1))
    ways = () if interrupted else tuple(_ways(result, model, sampled))
    for a in result.attempts:
        if a.after is not None:
            folder.mkdir(parents=True, exist_ok=True)
            a.after.record.to_csv(folder / f"{_stem(a)}.csv")
    return replace(result, ways=ways, seconds=time.perf_counter() - began)


def _stem(attempt: Attempt) -> str:
    return f"regulation_{attempt.name.replace(' ', '_')}"


def actual_start(task: Task, seed: int) -> Array:
    """Where the hand really let go."""
    return task.starts(1, np.random.default_rng([seed, 54]))[0]


def _predicted(
    name: str, poles: Roots, rig: Rig, model: StateSpace, sampled: StateSpace, task: Task,
    others: Mapping[str, Array], request: RegulationRequest, seed: int, workers: Workers, progress: Progress,
) -> Attempt:  # fmt: skip
    placed = place(model.A, model.B, poles)
    law = feedback(velocities(model, sampled, request.speed, request.memory, rig.limit, rig.resolution), placed.K)
    predicted = preflight(
        rig, model, sampled, law, task, parameters=others, lanes=request.draws, seed=seed, workers=workers,
        progress=progress,
    )  # fmt: skip
    return Attempt(name=name, placement=placed, law=law, before=predicted, measured=None)


def _run_attempt(stand: TestStand, attempt: Attempt, task: Task, seed: int, folder: Path) -> MeasuredRun | None:
    """The law of an attempt on the rig; None where it is too likely that a live pendulum falls."""
    share, basis = attempt.before.share, attempt.before.basis
    if share < AT_LEAST and not stand.may_fall:
        return None
    driven, pendulum = stand.names
    stand.ask(
        f"Next is {attempt.name}, predicted probability of stabilisation "
        f"{basis.supported(in_percent(share))}. Let {pendulum} hang at "
        f"rest; after a small pulse bring it up with {driven} in the middle of its travel, hold both there until the "
        "loop takes them, and let go."
    )
    start = actual_start(task, seed)
    return scored(stand.hold(attempt.law, task.at, folder, _stem(attempt), task.seconds, start=start))


def scored(run: StandRun) -> MeasuredRun:
    """A run with its figures; one that a supervisor ended before anything could hit was lost there."""
    figures = score(run.trial)
    if run.ended:
        end = float(run.trial.t[-1])
        lost = {"ran_out": end} if run.overtravel else {"fell": end}
        figures = replace(figures, settled=math.inf, **lost)
    return MeasuredRun(trial=run.trial, score=figures, ended=run.ended)


def _ways(result: Regulation, model: StateSpace, sampled: StateSpace) -> list[VelocityRun]:
    on, K = result.truth or result.rig, result.best.placement.K
    driven = model.to_sampled(sampled.period, sampled.delay, result.rig.lag)
    out: list[VelocityRun] = []
    for speed in SPEEDS:
        way = velocities(model, sampled, speed, result.request.memory, result.rig.limit, result.rig.resolution)
        law = feedback(way, K)
        stands = bool(np.abs(poles_of(closed(driven, law))).max() < 1)
        went = trial(
            on, law, at=result.task.at, start=actual_start(result.task, result.seed), seconds=result.task.seconds
        )
        out.append(
            VelocityRun(
                name=way.name,
                noise=command_noise(driven, law, result.rig.resolution) if stands else None,
                margins=margins(driven, law) if stands else None,
                run=went,
                score=score(went),
                restless=float(np.sqrt(np.mean(np.diff(went.u[went.t <= 1.0]) ** 2))),
            )
        )
    return out
