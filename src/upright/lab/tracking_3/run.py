"""Experiment 3: make the far inertia follow a step through a flexible shaft, within effort and travel.

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

from upright.control import Rig
from upright.identification import Fit
from upright.lab.rigs.makes import make_rig
from upright.lab.tracking_3.laws import Tracker, by_poles, check, paper_sets, with_sum
from upright.lab.tracking_3.pd import Search, far_pd, near_pd, tune
from upright.lab.tracking_3.shaft import fitted, weigh
from upright.lab.tracking_3.trials import PUSH, Outcome, outcome, twist_of
from upright.lab.weighing_1a.run import Known
from upright.progress import Progress
from upright.study.load import Study

Array = NDArray[np.float64]

RESERVE = 0.95
"""Share of the limit that the step may take from the strongest law."""
INSTEAD = {"linear": "rectilinear", "furuta": "torsional"}
"""The rig without its pendulum, a second inertia on the shaft instead."""


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
    step : Chosen
    sets : tuple of Outcome
        State feedback, strongest last.
    summed : Outcome or None
        The strongest with a sum.
    pd, stiff, far : Outcome or None
        PD of the near encoder tuned, the same as stiff as the strongest set, and PD of the far encoder.
    search : Search or None
        What the tuning tried.
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
    search: Search | None = None
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


def run(
    rig: str | Rig, seed: int, folder: Path, progress: Progress | None = None,
    stopped: Callable[[], bool] = lambda: False, *, which: Sequence[int] = (1, 2, 3, 4),
    poles: NDArray[np.complex128] | None = None, step: float | None = None, weighed: Sequence[Known] = (),
) -> Tracking:  # fmt: skip
    """Run the experiment on a twin.

    Parameters
    ----------
    rig : str or Rig
        A make, or a rig with two inertias; the make of a pendulum's rig stands for the rig without it.
    seed : int
        Which rig of the make, and the guesses of the fit.
    folder : Path
        Takes logs, study and fit.
    progress : callable, optional
        Told the step at work and the share done.
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
    check(which, poles)
    began, tell = time.perf_counter(), progress or (lambda what, share: None)
    true = make_rig(INSTEAD.get(rig, rig), seed) if isinstance(rig, str) else rig
    tell("pulsing the shaft", 0.0)
    study, fit = weigh(true, seed, folder, lambda what, share: tell(what, 0.05 + 0.25 * share), weighed)
    done = follow(
        another_day(true, seed),
        fitted(true, fit),
        folder,
        study,
        fit,
        tell,
        stopped,
        which=which,
        poles=poles,
        step=step,
    )
    return replace(
        done, true=true, seconds=time.perf_counter() - began, interrupted=done.interrupted or fit.interrupted
    )


def another_day(rig: Rig, seed: int) -> Rig:
    """The same rig when its dry friction has changed, by 13 % as between runs of real rigs."""
    rng = np.random.default_rng([seed, 31])
    dry = {n: rig.plant.parameters()[n] for n in ("f_1c", "f_2c")}
    return rig.changed(**{n: v * math.exp(rng.normal(0, 0.13)) for n, v in dry.items()})


def follow(
    rig: Rig, model: Rig, folder: Path, study: Study | None, fit: Fit | None, tell: Progress,
    stopped: Callable[[], bool] = lambda: False, *, which: Sequence[int] = (1, 2, 3, 4),
    poles: NDArray[np.complex128] | None = None, step: float | None = None,
) -> Tracking:  # fmt: skip
    """Design on the model, try on the rig; see `run`."""
    check(which, poles)
    laws = list(paper_sets(model, which))
    if poles is not None:
        laws.append(by_poles(model, "own set", poles))
    chosen = choose(model, laws, step)
    tell("stepping", 0.35)
    done = Tracking(
        rig=rig, model=model, true=rig, folder=folder, study=study, fit=fit, step=chosen,
        sets=tuple(outcome(rig, model, law, chosen.size) for law in laws),
    )  # fmt: skip
    if stopped():
        return replace(done, interrupted=True)
    strongest = laws[int(np.argmax([law.k_pf for law in laws]))]
    done = replace(done, summed=outcome(rig, model, with_sum(model, strongest, "with a sum"), chosen.size))
    tell("tuning a PD", 0.55)
    pd, search = tune(model, chosen.size, RESERVE * model.limit)
    done = replace(done, pd=outcome(rig, model, pd, chosen.size), search=search)
    if stopped():
        return replace(done, interrupted=True)
    tell("comparing", 0.9)
    stiff = stiffest_damped(model, strongest.k_pf)
    far = far_pd(model, "PD, far encoder", pd.k_pf, float(pd.K[1]))
    return replace(
        done, stiff=outcome(rig, model, stiff, chosen.size), far=outcome(rig, model, far, chosen.size)
    )  # fmt: skip


def stiffest_damped(model: Rig, kp: float) -> Tracker:
    """PD of the near encoder with this kp, and the kd for which its slowest pole decays fastest."""
    tried = [near_pd(model, "PD, as stiff", kp, kp * rate) for rate in np.geomspace(5e-3, 0.2, 25).tolist()]
    return max(tried, key=lambda law: law.decay)


def choose(model: Rig, laws: Sequence[Tracker], step: float | None = None) -> Chosen:
    """The largest step of two digits that keeps every law within effort, twist and travel, by the linear model."""
    most = RESERVE * model.limit / max(abs(law.k_pf) for law in laws)
    unit = [outcome(model, model, law, 0.5 * most).found for law in laws]
    twist = 0.6 * twist_of(model) * 0.5 * most / max(r.twist for r in unit)
    travel = 0.6 * model.travel * 0.5 * most / max(r.travel for r in unit)
    bounds = {"effort": most, "twist": twist, "travel": travel}
    what = min(bounds, key=lambda name: bounds[name])
    size, reason = bounds[what], f"bounded by {what}"
    digits = 10.0 ** (math.floor(math.log10(size)) - 1)
    size = float(f"{math.floor(size / digits + 1e-9) * digits:.2g}")
    if step is not None:
        size, reason = step, "as asked"
    return Chosen(size=size, reason=reason, by_effort=most, by_twist=twist, by_travel=travel)
