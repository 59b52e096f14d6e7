"""What is found: a number with its interval, a pole, what rests on an assumption, how well one run is explained."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """What the data say about one number.

    `status` is "firm", "weak" (interval wider than the value, or two models differ), "unseen" (the data cannot tell),
    "at bound" or "known".
    """

    value: float
    stderr: float
    interval: tuple[float, float]
    unit: str
    status: str


@dataclass(frozen=True, kw_only=True)
class Pole:
    """A pole of the linear model at an equilibrium, real and imaginary part [1/s]; of a pair the upper one."""

    real: Estimate
    imag: Estimate


@dataclass(frozen=True, kw_only=True)
class Assumption:
    """A number taken as given without knowing it, and what would follow it.

    `follows` are percent by which each estimate would change per percent of it, `without` the estimates proportional
    to it, per unit of the command and of the encoders.
    """

    name: str
    value: float
    unit: str
    follows: Mapping[str, float]
    without: Mapping[str, Estimate]


@dataclass(frozen=True, kw_only=True)
class RunScore:
    """How well one run is explained: fit percent per signal, over which horizon, and the simulated signals.

    Scores count from `score_from` seconds after the first sample on.
    `naive` is the fit percent that holding the measured speed reaches from the same restarts, empty for a free run: a
    horizon at which the model is hardly better tells nothing about the model.
    `adapted` names what was estimated from the run itself: a prediction that chose its own gain is less of one.
    `ahead` is the fit percent by horizon [s] and signal of samples predicted exactly so far ahead, from a filter that
    knows the past alone; empty for other runs. Then `horizon`, `fit_percent` and the signals are the shortest's.
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
    adapted: tuple[str, ...] = ()
    ahead: Mapping[float, Mapping[str, float]] = field(default_factory=dict[float, Mapping[str, float]])
