"""Will this law stabilise that rig? Predicted by the model, before anything moves.

Margins and noise come from the linear sampled loop. Everything else is simulated on the nonlinear model as identified,
with dry friction, encoder counts, converter, limit, delay and lag: the run that is requested, the same run on every rig
that the identification allows, and how far the pendulum may lean or be tapped.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from upright.basis import Basis
from upright.control.effort import FELT, RestEffort
from upright.control.score import Score, Scores, effort_at_rest, outcomes, score
from upright.control.trial import Trial, trial
from upright.errors import BadInput
from upright.gains import Margins, margins
from upright.gains.loop import closed, command_noise
from upright.gains.requests import poles_of
from upright.laws import Law
from upright.progress import Progress, silent
from upright.records import Array
from upright.rig import Rig
from upright.systems import StateSpace
from upright.workers import HERE, Workers

STABILISED, SATURATED, BUSY = "stabilised", "stabilised with saturation", "stabilised with excessive effort"
WORDS = (STABILISED, SATURATED, BUSY, "does not settle", "leaves its travel", "falls")
"""What a run can come to, the best first; see `words`."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """What a law has to do.

    Attributes
    ----------
    start : tuple of float
        Deviation from the equilibrium when the law is switched on, state by state.
    at : str
        Equilibrium to hold.
    hand : tuple of float
        Standard deviation of the start, as a hand holds it; none when empty.
    """

    start: tuple[float, ...]
    at: str = "inverted"
    seconds: float = 6.0
    hand: tuple[float, ...] = ()

    def starts(self, lanes: int, rng: np.random.Generator) -> Array:
        """Starts as a hand would give them, shape (lanes, states)."""
        wide = np.array(self.hand) if self.hand else np.zeros(len(self.start))
        return np.array(self.start) + rng.normal(size=(lanes, wide.size)) * wide


@dataclass(frozen=True, kw_only=True, eq=False)
class Preflight:
    """What is expected of a law.

    Attributes
    ----------
    margins : Margins or None
        Of the sampled loop; None when the linear loop falls already.
    noise : float or None
        Standard deviation of the command from the encoders' counts [its unit]; None as above.
    run, score : Trial, Score
        The run on the model as identified.
    rest : RestEffort
        What holding takes at its end.
    tilt, push : float
        Largest tilt [rad] and largest speed from a tap [rad/s] of the last coordinate, each alone, that it recovers.
    drawn : Scores
        The run on the rigs that the identification allows, from starts as a hand gives them.
    words : dict of str to float
        Share of those runs that come to each of `WORDS`.
    """

    margins: Margins | None
    noise: float | None
    run: Trial
    score: Score
    rest: RestEffort
    tilt: float
    push: float
    drawn: Scores
    words: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def share(self) -> float:
        """Share of the simulated rigs that are stabilised to the end."""
        return float(np.mean(self.drawn.held))

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the share, by Wilson, from how many rigs were simulated."""
        from scipy.stats import binomtest

        ends = binomtest(int(np.sum(self.drawn.held)), self.drawn.held.size).proportion_ci(method="wilson")
        return float(ends.low), float(ends.high)

    @property
    def chance(self) -> float:
        """Probability that the rig is stabilised to the end: the `share`, where the model is worth it.

        Raises
        ------
        BadInput
            When the model is not trusted.
        """
        if not self.basis.supports:
            raise BadInput(
                "no probability of stabilisation is supported by a model that is not trusted; identify the rig so that "
                "it is. What the simulated rigs came to is `share`."
            )
        return self.share

    @property
    def basis(self) -> Basis:
        """The model that all of this rests on."""
        return self.run.rig.basis

    @property
    def quiet_share(self) -> float:
        """Share of the simulated rigs that are stabilised and settle by a command that is quiet at rest."""
        return self.words[STABILISED] + self.words[SATURATED]

    @property
    def rest_rms(self) -> float:
        """Rms of the command at rest, as a share of the limit, that 95 % of the rigs held do not exceed."""
        held = self.drawn.rest_rms[self.drawn.held]
        return float(np.quantile(held, 0.95)) if held.size else self.rest.rms

    @property
    def word(self) -> str:
        """What most of them come to."""
        return max(WORDS, key=lambda w: self.words[w])


def preflight(
    rig: Rig,
    model: StateSpace,
    sampled: StateSpace,
    law: Law,
    task: Task,
    *,
    parameters: Mapping[str, ArrayLike],
    lanes: int,
    seed: int,
    workers: Workers = HERE,
    progress: Progress = silent,
) -> Preflight:
    """Say beforehand what a law will come to.

    Parameters
    ----------
    rig : Rig
        As identified.
    model, sampled : StateSpace
        Its linear model about the equilibrium, and the same as the law was designed on; margins and noise count the
        rig's lag as well.
    parameters : mapping of str to array, shape (lanes,)
        Parameters of other rigs that the identification allows; empty when it tells of none.
    lanes : int
        How many runs the chance is taken from.
    seed : int
        Of the hand's errors.
    workers : Workers, optional
        Who computes the runs that the chance is taken from.
    """
    driven = model.to_sampled(sampled.period, sampled.delay, rig.lag)  # whatever the law was designed on
    stands = bool(np.abs(poles_of(closed(driven, law))).max() < 1)
    run = trial(rig, law, at=task.at, start=task.start, seconds=task.seconds)
    starts = task.starts(lanes, np.random.default_rng([seed, 52]))
    drawn = outcomes(
        rig, law, at=task.at, starts=starts, seconds=task.seconds, parameters=parameters, workers=workers,
        progress=progress,
    )  # fmt: skip
    verdicts = words(drawn)
    last = np.zeros(len(task.start))
    tilted, tapped = last.copy(), last.copy()
    tilted[-2], tapped[-1] = 1.0, 1.0
    return Preflight(
        margins=margins(driven, law) if stands else None,
        noise=command_noise(driven, law, rig.resolution) if stands else None,
        run=run,
        score=score(run),
        rest=effort_at_rest(run),
        tilt=largest(rig, law, task.at, tilted, most=np.pi / 2) if stands else 0.0,
        push=largest(rig, law, task.at, tapped, most=20.0) if stands else 0.0,
        drawn=drawn,
        words={w: float(np.mean([t == w for t in verdicts])) for w in WORDS},
    )


def words(scores: Scores) -> list[str]:
    """What each run came to.

    It *falls*; the driven body *leaves its travel*; it *does not settle* when dry friction or the law keep the
    pendulum swinging; it is stabilised *with excessive effort* when the command at rest is not quiet (`effort.quiet`),
    *with saturation* when it is, but the limit was met for longer than `FELT`.
    """
    out: list[str] = []
    for fell, ran_out, settled, full, calm in zip(
        scores.fell.tolist(), scores.ran_out.tolist(), scores.settled.tolist(), scores.at_limit.tolist(),
        scores.quiet.tolist(), strict=True,
    ):  # fmt: skip
        if fell < ran_out:
            out.append("falls")
        elif np.isfinite(ran_out):
            out.append("leaves its travel")
        elif np.isinf(settled):
            out.append("does not settle")
        elif not calm:
            out.append(BUSY)
        else:
            out.append(SATURATED if full > FELT else STABILISED)
    return out


def word(score: Score) -> str:
    """The same of one run."""
    return words(Scores(**{n: np.asarray(v)[..., None] for n, v in vars(score).items()}))[0]


def largest(rig: Rig, law: Law, at: str, direction: ArrayLike, *, most: float, seconds: float = 3.0) -> float:
    """How far along a direction of the states the rig may start and still be held; `most` when nothing less fails.

    Sixty-four starts side by side find the first that fails, three times, each between the neighbours of the last.

    Parameters
    ----------
    direction : array, shape (states,)
    most : float
        Largest factor on the direction to be tried.
    seconds : float
        Long enough for a run to be decided.
    """
    way = np.asarray(direction, dtype=np.float64)
    if not way.any() or not most > 0:
        raise BadInput("a direction needs one state that is not zero, and most must be above 0.")
    low, high = 0.0, most
    for _ in range(3):
        steps = np.linspace(low, high, 65)[1:]
        held = outcomes(rig, law, at=at, starts=steps[:, None] * way, seconds=seconds).held
        if held.all():
            return high
        first = int(np.argmin(held))
        low, high = (steps[first - 1] if first else low), steps[first]
    return float(low)
