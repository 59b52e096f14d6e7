"""Experiment 3: the far inertia follows a step through a flexible shaft, within effort and travel.

Identify, place the poles of Table 2, size the step, say beforehand what will happen, run it on the rig, and compare
with what PD control of the driven body can do.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upright.basis import SIMULATED
from upright.control import Trial, trial
from upright.control.effort import Effort, RestEffort, effort, rest_effort, rest_samples
from upright.control.score import StepFigures, step_figures
from upright.errors import BadInput
from upright.experiments.stand.known import Known
from upright.experiments.stand.stand import TestStand
from upright.experiments.stand.twin import TwinStand
from upright.experiments.tracking_3.laws import (
    AT,
    GainSearch,
    Tracker,
    by_poles,
    check_sets,
    far_pd,
    near_pd,
    paper_sets,
    tune,
    with_sum,
)
from upright.experiments.tracking_3.pulses import fitted, identify_shaft
from upright.identification.model.fit import Fit
from upright.progress import Progress, silent
from upright.records import Array
from upright.rig import Rig
from upright.rig.makes import MAKES, make_of, make_rig
from upright.rig.variation import DAILY
from upright.study.load import Study

RESERVE = 0.95
"""Share of the limit that the step may take from the strongest law."""
BEFORE, DWELL, PUSHED = 0.1, 2.0, 1.5
"""Time before the step, at the reference, and under the push that follows [s]."""
PUSH = -0.1
"""Steady push on the drive that comes after the step, as a share of the limit."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StepTrial:
    """One law on one rig: the trial and its figures.

    Attributes
    ----------
    trial : Trial
        As if nothing tripped.
    figures : StepFigures or None
        Of the far body; None where the rig trips or nothing moves.
    effort : Effort
        Of the step, up to the push.
    rest : RestEffort or None
        Of the last third of that, about what keeps the place; None where the run ended before.
    twist, travel : float
        Largest distance between the bodies, and from where they began, up to the push [m or rad].
    give : float
        How far the push moves the far body [m or rad].
    tripped : float
        When twist or travel is left and a person, a stop or a trip ends the run [s]; inf if never.
    """

    trial: Trial
    figures: StepFigures | None
    effort: Effort
    rest: RestEffort | None
    twist: float
    travel: float
    give: float
    tripped: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcome:
    """A law, what the fitted model says it will do, and what the rig did."""

    law: Tracker
    predicted: StepTrial
    measured: StepTrial

    @property
    def tried(self) -> bool:
        """Whether the rig was stepped with it; else the measured figures are the predicted ones."""
        return self.measured is not self.predicted

    @property
    def quiet(self) -> bool:
        """Whether the command is quiet once the step is done; a run that ended before says nothing of that."""
        return self.measured.rest is None or self.measured.rest.quiet

    @property
    def within(self) -> bool:
        """Whether the rig stayed within limit, travel and twist."""
        return math.isinf(self.measured.tripped) and self.measured.effort.saturated == 0


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """The step: its size [m or rad], why, and the largest that each bound allows."""

    size: float
    reason: str
    by_effort: float
    by_twist: float
    by_travel: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Tracking:
    """Experiment 3 as far as it came.

    Attributes
    ----------
    rig, model, true : Rig
        On the day of the trials, as the fit sees it, and when it was measured; all the same where only a fit was given.
    folder : Path
        Holds logs, study and fit; the fit itself where only that was given.
    study, fit : Study and Fit, or None where a fit was given.
    sets : tuple of Outcome
        State feedback, strongest last.
    summed : Outcome or None
        The strongest with a sum.
    pd, stiff, far : Outcome or None
        PD of the near encoder tuned, the same as stiff as the strongest set, and PD of the far encoder.
    search : GainSearch or None
        What the tuning tried.
    performed : str
        `basis.SIMULATED` where no rig was driven.
    """

    rig: Rig
    model: Rig
    true: Rig
    folder: Path
    study: Study | None
    fit: Fit | None
    step: Chosen
    sets: tuple[Outcome, ...]
    summed: Outcome | None = None
    pd: Outcome | None = None
    stiff: Outcome | None = None
    far: Outcome | None = None
    search: GainSearch | None = None
    performed: str = SIMULATED
    seconds: float = 0.0
    interrupted: bool = False

    @property
    def push(self) -> float:
        """Steady push after the step, in the command's unit."""
        return PUSH * self.rig.limit

    @property
    def simulated(self) -> bool:
        """Whether a twin stood in for the rig, so that its truth is known."""
        return self.fit is not None

    @property
    def tried(self) -> bool:
        """Whether anything was tried, beside what the model predicts."""
        return any(o.tried for o in self.outcomes)

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """Of all laws, as far as it came."""
        laws = (*self.sets, self.summed, self.pd, self.stiff, self.far)
        return tuple(o for o in laws if o is not None)


def run_tracking(
    rig: str | Rig, seed: int, folder: Path, progress: Progress = silent,
    stopped: Callable[[], bool] = lambda: False, *, which: Sequence[int] = (1, 2, 3, 4),
    poles: NDArray[np.complex128] | None = None, step: float | None = None, weighed: Sequence[Known] = (),
) -> Tracking:  # fmt: skip
    """Run the experiment on a twin: identify its shaft by pulses, design on the fit, try on another day.

    Parameters
    ----------
    rig : str or Rig
        A make, or a rig with two inertias; the make of a pendulum's rig stands for the rig without it.
    seed : int
        Which rig of the make, and the guesses of the fit.
    folder : Path
        Takes logs, study and fit.
    progress : callable, optional
        Called with the current step and the share completed.
    stopped : callable, optional
        Asked between trials whether to stop there.
    which : sequence of int
        Sets of Table 2.
    poles : array, optional
        Poles [1/s] of one further set.
    step : float, optional
        Size of the step [m or rad], chosen when omitted.
    weighed : sequence of Known
        What experiment 1a leaves known of the shaft.
    """
    check_sets(which, poles)
    began = time.perf_counter()
    true = make_rig(MAKES[rig].shaft if rig in MAKES else rig, seed) if isinstance(rig, str) else rig
    progress("pulsing the shaft", 0.0)
    study, fit = identify_shaft(true, seed, folder, lambda what, share: progress(what, 0.05 + 0.25 * share), weighed)
    result = track_on(
        fitted(true, fit),
        TwinStand(rig=another_day(true, seed), make=make_of(true.plant)),
        folder,
        study,
        fit,
        progress,
        stopped,
        which=which,
        poles=poles,
        step=step,
    )
    return replace(
        result, true=true, seconds=time.perf_counter() - began, interrupted=result.interrupted or fit.interrupted
    )


def another_day(rig: Rig, seed: int) -> Rig:
    """The same rig when its dry friction has changed as between runs of real rigs."""
    rng = np.random.default_rng([seed, 31])
    dry = {n: rig.plant.parameters()[n] for n in ("f_1c", "f_2c")}
    return rig.changed(**{n: v * math.exp(rng.normal(0, DAILY)) for n, v in dry.items()})


def track_on(
    model: Rig, stand: TestStand | None, folder: Path, study: Study | None, fit: Fit | None, progress: Progress,
    stopped: Callable[[], bool] = lambda: False, *, which: Sequence[int] = (1, 2, 3, 4),
    poles: NDArray[np.complex128] | None = None, step: float | None = None,
) -> Tracking:  # fmt: skip
    """Design on the model and try on the rig; without a rig only the prediction is reported. See `run_tracking`.

    Pole sets of Table 2 are for the makers' rigs; those of one's own are as much faster as the shaft swings faster.

    Raises
    ------
    RigStopped
        When a run on a live rig did not begin.
    """
    check_sets(which, poles)
    laws = list(paper_sets(model, which, 1.0 if stand is None or stand.make is not None else _times_as_fast(model)))

    def outcome(law: Tracker) -> Outcome:
        predicted = attempt(model, law, chosen.size)
        measured = None if stand is None else _tried(stand, law, predicted, chosen.size, folder)
        return Outcome(law=law, predicted=predicted, measured=measured or predicted)

    if poles is not None:
        laws.append(by_poles(model, "own set", poles))
    rig = model if stand is None else stand.rig
    chosen = choose_step(model, laws, step)
    progress("stepping", 0.35)
    result = Tracking(
        rig=rig, model=model, true=rig, folder=folder, study=study, fit=fit, step=chosen,
        sets=tuple(outcome(law) for law in laws),
        performed=SIMULATED if stand is None else stand.performed,
    )  # fmt: skip
    if stopped():
        return replace(result, interrupted=True)
    strongest = laws[int(np.argmax([law.k_pf for law in laws]))]
    result = replace(result, summed=outcome(with_sum(model, strongest, "with a sum")))
    progress("tuning a PD", 0.55)
    pd, search = tune(model, chosen.size, RESERVE * model.limit)
    result = replace(result, pd=outcome(pd), search=search)
    if stopped():
        return replace(result, interrupted=True)
    progress("comparing", 0.9)
    stiff = stiffest_damped(model, strongest.k_pf)
    far = far_pd(model, "PD, far encoder", pd.k_pf, float(pd.K[1]))
    return replace(result, stiff=outcome(stiff), far=outcome(far))


def stiffest_damped(model: Rig, kp: float) -> Tracker:
    """PD of the near encoder with this kp, and the kd for which its slowest pole decays fastest."""
    tried = [near_pd(model, "PD, as stiff", kp, kp * rate) for rate in np.geomspace(5e-3, 0.2, 25).tolist()]
    return max(tried, key=lambda law: law.decay)


def choose_step(model: Rig, laws: Sequence[Tracker], step: float | None = None) -> Chosen:
    """The largest step of two digits that keeps every law within effort, twist and travel, by the linear model."""
    most = RESERVE * model.limit / max(abs(law.k_pf) for law in laws)
    free = model.replace(twist=math.inf, travel=math.inf)  # a trip would cut short what is to be scaled
    unit = [attempt(free, law, 0.5 * most) for law in laws]
    twist = 0.6 * model.twist * 0.5 * most / max(r.twist for r in unit)
    travel = 0.6 * model.travel * 0.5 * most / max(r.travel for r in unit)
    bounds = {"effort": most, "twist": twist, "travel": travel}
    what = min(bounds, key=lambda name: bounds[name])
    size, reason = bounds[what], f"bounded by {what}"
    digits = 10.0 ** (math.floor(math.log10(size)) - 1)
    size = float(f"{math.floor(size / digits + 1e-9) * digits:.2g}")
    if step is not None:
        size, reason = step, "as requested"
    return Chosen(size=size, reason=reason, by_effort=most, by_twist=twist, by_travel=travel)


def _times_as_fast(model: Rig) -> float:
    swings = [float(p.linear(AT).poles().imag.max()) for p in (model.plant, make_of(model.plant).rig.plant)]
    return swings[0] / swings[1]


def _tried(stand: TestStand, law: Tracker, expected: StepTrial, step: float, folder: Path) -> StepTrial | None:
    """The law on the rig; None where it is predicted to leave a live rig's bounds."""
    safe = math.isinf(expected.tripped) and law.decay > 0 and not expected.effort.saturated
    if not (safe or stand.may_fall):
        return None
    stand.ask(
        f"Next is {law.name}. Let everything rest with {stand.names[0]} in the middle of its "
        "travel; a small pulse comes first, then the step, then a steady push of the drive."
    )
    reference, pushes = levels_of(stand.rig, step)
    stem = f"tracking_{law.name.replace(' ', '_').replace(',', '')}"
    seconds = (reference.size - 1) * stand.rig.period
    run = stand.hold(law.law, AT, folder, stem, seconds, reference=reference, pushes=pushes)
    return figured(run.trial, step)


def levels_of(rig: Rig, step: float) -> tuple[Array, Array]:
    """Reference and push, sample by sample: zero, the step, then a steady push while the reference stays."""
    before, at, end = _ticks(rig)
    reference, pushes = np.zeros(end + 1), np.zeros(end + 1)
    reference[before:], pushes[at:] = step, PUSH * rig.limit
    return reference, pushes


def _ticks(rig: Rig) -> tuple[int, int, int]:
    before, at, end = (round(s / rig.period) for s in (BEFORE, BEFORE + DWELL, BEFORE + DWELL + PUSHED))
    return before, at, end


def attempt(rig: Rig, law: Tracker, step: float) -> StepTrial:
    """A law on a simulated rig."""
    reference, pushes = levels_of(rig, step)
    start = np.zeros(2 * len(rig.plant.coordinates))
    return figured(
        trial(rig, law.law, at=AT, start=start, seconds=(reference.size - 1) * rig.period, reference=reference,
              pushes=pushes), step,
    )  # fmt: skip


def _rest(t: Array, u: Array, limit: float) -> RestEffort:
    """Command at rest about its mean, which a spring to ground may take to hold a place."""
    return rest_effort(t, u - float(np.mean(rest_samples(u))), limit)


def figured(trial: Trial, step: float) -> StepTrial:
    """Figures of a trial, which may have ended before its time."""
    rig = trial.rig
    before, at, end = _ticks(rig)
    q = trial.x[:, ::2]
    apart, away = np.abs(q[:, -1] - q[:, 0]), np.abs(q).max(axis=1)
    beyond = np.flatnonzero((apart > rig.twist) | (away > rig.travel))
    first = int(beyond[0]) if beyond.size else trial.t.size - 1
    ended = bool(beyond.size) or trial.t.size <= end
    tripped = float(trial.t[first]) if ended else math.inf
    last = min(at, first)
    y = trial.record[trial.record.outputs[-1]]
    figures = None
    if not ended:
        try:
            figures = step_figures(
                trial.t[before:at], y[before:at], before=0.0, reference=step, resolution=float(rig.resolution[-1])
            )
        except BadInput:  # friction held it where it was
            figures = None
    return StepTrial(
        trial=trial, figures=figures, effort=effort(trial.u[before : last + 1], rig.limit, rig.converter),
        rest=None if ended else _rest(trial.t[before:at], trial.u[before:at], rig.limit),
        twist=float(apart[: last + 1].max()), travel=float(away[: last + 1].max()),
        give=math.inf if ended else float(abs(np.mean(y[-50:]) - np.mean(y[at - 50 : at]))), tripped=tripped,
    )  # fmt: skip
