"""What a fit says: numbers with their intervals, poles, scores of the runs, and what rests on an assumption."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.bands import NORMAL, Bands
from upright.identification.model.grey_box import GreyBox
from upright.physics import Plant

Array = NDArray[np.float64]

EXACT = 1e-12
"""An interval narrower than this share of its value is rounding's."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """What the data say about one number.

    `status` is "well determined" (to half its value or better, `half` says how well), "poorly determined" (wider, two
    models differ, or the model explains less than nothing), "tied to b_2c" (known only together with that), "rests on
    m_p", "unseen" (the data cannot tell), "at bound", "nuisance" (a level of noise), "known", "assumed" or "left out".
    `rests_on` names assumed numbers that it would move with: its interval holds what their ranges make of it, and
    `given` is the interval it would have if they were right.
    """

    value: float
    stderr: float
    interval: tuple[float, float]
    unit: str = ""
    status: str = "well determined"
    rests_on: tuple[str, ...] = ()
    given: tuple[float, float] | None = None

    @property
    def qualified(self) -> str:
        """Status, and which assumed numbers it is a number of; whatever rests on one is never well determined."""
        rests = f"rests on {', '.join(self.rests_on)}"
        if not self.rests_on or self.status.startswith("rests on"):
            return self.status
        return rests if self.status == "well determined" else f"{self.status}, {rests}"

    @property
    def half(self) -> float:
        """How far the farther end of its interval lies from its value, relative to that."""
        low, high = self.interval
        return max(high - self.value, self.value - low) / abs(self.value) if self.value else math.inf

    @property
    def zero_wide(self) -> bool:
        """Whether its interval is narrower than any measurement's, as where a motion depends on it without bound."""
        low, high = self.interval
        return high - low <= EXACT * abs(self.value)

    @classmethod
    def within(cls, value: float, stderr: float, half: float, unit: str = "") -> Estimate:
        """An estimate with an interval of `half` its width on either side."""
        return cls(value=value, stderr=stderr, interval=(value - half, value + half), unit=unit)


@dataclass(frozen=True, kw_only=True)
class Pole:
    """A pole of the linear model at an equilibrium, real and imaginary part [1/s]; of a pair the upper one."""

    real: Estimate
    imag: Estimate


@dataclass(frozen=True, kw_only=True)
class Assumption:
    """A number taken as given without knowing it, and what would follow it.

    `follows` are percent by which each estimate would change per percent of its `size`, not a number where that was not
    evaluated, `without` the estimates proportional to it, per unit of the command and of the encoders. The size is its
    absolute value; of one assumed to be zero, what changes the runs as much as the most influential estimate does.
    Nobody measured it, so it may lie anywhere in its `range`. `ratios` are known whatever it is, by what they are
    called: estimates per what they are proportional to, ``b_2/m_p`` or ``b_2/(m_p l_cg)``, and what an estimate is
    worth beside a number assumed to be zero, ``J_A/(m_p l_cg)``.
    """

    name: str
    value: float
    unit: str
    follows: Mapping[str, float]
    without: Mapping[str, Estimate]
    size: float = 0.0
    range: tuple[float, float] = (-math.inf, math.inf)
    ratios: Mapping[str, Estimate] = field(default_factory=dict[str, Estimate])


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """One of the questions that a verdict answers: "yes", "in part", "no", "not tested" or "not asked".

    The headline says it with its numbers, `advice` what to do, `reasons` why. It would be another with other values of
    the assumed numbers that it `rests_on`.
    """

    question: str
    answer: str
    headline: str
    advice: str = ""
    reasons: tuple[str, ...] = ()
    rests_on: tuple[str, ...] = ()

    def text(self) -> str:
        """All of it, the headline first."""
        first = f"{self.question} {self.answer.capitalize()}. {self.headline}"
        return " ".join(filter(None, (first, self.advice, *self.reasons)))


@dataclass(frozen=True, kw_only=True)
class Offer:
    """A factor of a run's own, on all friction or on the drive's gain, that mends its prediction, and its score then.

    The factor is estimated from the run itself, so that score is no prediction's.
    """

    name: str
    factor: Estimate
    fit_percent: Mapping[str, float]

    def sentence(self, label: str, before: Mapping[str, float]) -> str:
        """What would be reached, and what it costs."""
        what = "its friction" if self.name == "friction" else "the gain of its drive"
        low, high = self.factor.interval
        signal = min(before, key=lambda s: before[s])
        return (
            f"Run '{label}' is predicted at {before[signal]:.1f} % ({signal}); with {what} "
            f"{self.factor.value:.3g} times as large ({low:.3g} to {high:.3g}) it would be "
            f"{self.fit_percent[signal]:.1f} %. That factor comes from the run itself, so this is one number less "
            "foreseen."
        )


@dataclass(frozen=True, kw_only=True)
class RunScore:
    """How well one run is explained: fit percent per signal, over which horizon, and the simulated signals.

    Scores count from `score_from` seconds after the first sample on.
    `naive` is the fit percent that holding the measured speed reaches from the same restarts, empty for a free run: a
    horizon at which the model is hardly better tells nothing about the model.
    `black_box` is the fit percent that a black-box (ARX) baseline reaches, fitted to the same runs; empty for
    a run that was fitted, and where none was like it.
    `adapted` names what was estimated from the run itself: a prediction that chose its own gain is less of one.
    `offer` is a factor of the run's own that would mend a prediction which falls short.
    `ahead` is the fit percent by horizon [s] and signal of samples predicted exactly so far ahead, from a filter that
    knows the past alone; empty for other runs. Then `horizon` is as far as the run is judged, `fit_percent` and the
    signals are those of that horizon, and `ceiling` is what the start state allows of each, a percent alike: the
    sensors tell it no better, and what it misses grows as the plant falls.
    `band` is how far (N,) from a prediction 90 % of the samples should lie, by signal; empty for a run that was fitted,
    and where the fit does not say. `beyond` says in sentences how far the run goes beyond what was fitted.
    """

    role: str
    fit_percent: Mapping[str, float]
    horizon: float | None
    t: Array
    y: Array
    simulated: Array
    measured: tuple[str, ...]
    score_from: float = 0.0
    naive: Mapping[str, float] = field(default_factory=dict[str, float])
    black_box: Mapping[str, float] = field(default_factory=dict[str, float])
    adapted: tuple[str, ...] = ()
    offer: Offer | None = None
    ahead: Mapping[float, Mapping[str, float]] = field(default_factory=dict[float, Mapping[str, float]])
    ceiling: Mapping[float, Mapping[str, float]] = field(default_factory=dict[float, Mapping[str, float]])
    band: Mapping[str, Array] = field(default_factory=dict[str, Array])
    beyond: tuple[str, ...] = ()
    guess: Array | None = None

    @property
    def scored(self) -> NDArray[np.bool_]:
        """Which samples (N,) count."""
        return self.t >= self.t[:1] + self.score_from - 1e-9

    @property
    def moved(self) -> dict[str, float]:
        """Standard deviation of each signal, in its unit, where it moves at all."""
        scored = self.y[self.scored]
        return {
            s: float(np.std(scored[:, k])) for k, s in enumerate(self.measured) if len(scored) and np.ptp(scored[:, k])
        }

    @property
    def inside(self) -> dict[str, float]:
        """Percent of the scored samples inside the band, by signal; empty without one."""
        missed = {s: np.abs(self.y[:, k] - self.simulated[:, k]) for k, s in enumerate(self.measured)}
        return {s: 100 * float(np.mean((missed[s] <= half)[self.scored])) for s, half in self.band.items()}

    @property
    def expected(self) -> dict[str, float]:
        """Fit percent that the band leads to expect, by signal that moves."""
        moved = self.moved
        widths = {s: float(np.sqrt(np.mean(half[self.scored] ** 2))) / NORMAL for s, half in self.band.items()}
        return {s: 100 * (1 - width / moved[s]) for s, width in widths.items() if s in moved}


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A rig explained by its runs.

    `per_run` holds what was estimated run by run, by run label and name, `groups` what several runs share, by the
    group's label and name; `unseen` says in sentences which combinations the data cannot see and which number would
    fix it; `singular_values` belong to the scaled Jacobian, `directions` (rows) to them, in the order of `names`;
    `poles` are those at every equilibrium of the fitted plant. The `verdict` is what the `answers` say, one after
    another, and the model is `trusted` when none of the first two is "no". `bands` is what it
    promises of predictions, None when it was interrupted; `not_evaluated` names all that it then does not say. It
    `failed` when the motion runs away at the numbers or just beside them: these are where the search stopped, and no
    interval is known.
    `proposed` are numbers that the model leaves out and that would explain the runs far better. `path` are the mean
    squared residual, relative to how the signals vary, and the shared numbers after each accepted step of the search.
    """

    model: GreyBox
    estimates: Mapping[str, Estimate]
    per_run: Mapping[str, Mapping[str, Estimate]]
    groups: Mapping[str, Mapping[str, Estimate]] = field(default_factory=dict[str, Mapping[str, Estimate]])
    runs: Mapping[str, RunScore]
    verdict: str
    trusted: bool
    answers: tuple[Judgement, ...] = ()
    method: str
    evaluations: int
    seconds: float
    cost: float
    names: tuple[str, ...] = ()
    correlation: Array = field(default_factory=lambda: np.zeros((0, 0)))
    singular_values: Array = field(default_factory=lambda: np.zeros(0))
    directions: Array = field(default_factory=lambda: np.zeros((0, 0)))
    unseen: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    history: tuple[tuple[str, float, int], ...] = ()
    path: tuple[tuple[float, Mapping[str, float]], ...] = ()
    interrupted: bool = False
    not_evaluated: tuple[str, ...] = ()
    assumptions: tuple[Assumption, ...] = ()
    poles: Mapping[str, tuple[Pole, ...]] = field(default_factory=dict[str, tuple[Pole, ...]])
    bands: Bands | None = None
    failed: bool = False
    proposed: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def plant(self) -> Plant:
        """The plant with the numbers estimated and given."""
        values = {n: p.value for n, p in self.model.parameters.items()}
        values |= {n: e.value for n, e in self.estimates.items()}
        return self.model.plant(**{n: v for n, v in values.items() if n in self.model.plant.names()})

    def keyed(self) -> dict[str, float]:
        """Every number found, by the key that problems know it by, see `Problem.key`."""
        values = {n: e.value for n, e in self.estimates.items()}
        values |= {f"{label}: {n}": e.value for label, own in self.per_run.items() for n, e in own.items()}
        return values | {f"group {g}: {n}": e.value for g, own in self.groups.items() for n, e in own.items()}


def to_lmfit(fit: Fit) -> Any:
    """`lmfit.Parameters` of a fit: known numbers do not vary, estimated ones carry bounds, error and correlation.

    lmfit allows no dots in names: ``actuator.gain`` becomes ``actuator_gain``. A number the data cannot see has
    an infinite standard error, as here.
    """
    from lmfit import Parameters

    parameters = Parameters()
    names = {n: n.replace(".", "_") for n in {**fit.model.parameters, **fit.estimates}}
    for name, key in names.items():
        e, known = fit.estimates.get(name), fit.model.parameters.get(name)
        value = e.value if e is not None else known.value if known is not None else 0.0
        lower, upper = (-math.inf, math.inf) if known is None else fit.model.bounds(name)
        parameters.add(key, value=value, vary=e is not None and e.status != "left out", min=lower, max=upper)
        if e is not None:
            parameters[key].stderr = e.stderr
    for i, name in enumerate(fit.names):
        row = np.asarray(fit.correlation[i])
        parameters[names[name]].correl = {names[n]: float(row[j]) for j, n in enumerate(fit.names) if j != i}
    return parameters
