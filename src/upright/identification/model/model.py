"""What is asked of the data? A rig with known and unknown numbers, and the runs that speak about them.

These values are all that a study file says, in SI, with the columns already read; the estimator knows no file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.loop import ClosedLoop
from upright.identification.model.estimates import Assumption, Estimate, Pole, RunScore
from upright.physics import Plant

Array = NDArray[np.float64]

SEEN = 2 / 3
"""Share of every run that models are fitted on where its rest judges them."""

LEAST_RUN = 200
"""Runs with fewer samples are not cut."""

NOISE = "noise."
"""Before the name of a coordinate: root of the density of a random force on it, which a Kalman filter allows for."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One number of the rig: known, known to within `uncertainty` (one sigma), or to estimate from `value`.

    An `assumed` one is a convention: the report says what rests on it.
    """

    name: str
    value: float
    unit: str = "1"
    meaning: str = ""
    estimate: bool = False
    lower: float = -math.inf
    upper: float = math.inf
    uncertainty: float = 0.0
    assumed: bool = False


@dataclass(frozen=True, kw_only=True)
class Run:
    """One stretch of data in SI.

    Attributes
    ----------
    label : str
        Name in reports.
    role : {"fit", "predict"}
        Whether the estimator may see it.
    t : (N,) array
        Uniform time [s].
    u : (N, inputs) array
        Commands in the actuator's unit; zeros for a free run.
    y : (N, len(measured)) array
        Measured coordinates, sign and scale applied.
    measured : tuple of str
        Names of the coordinates in the columns of `y`.
    quantum : tuple of float
        Resolution of each column of `y` [SI], 0 when continuous.
    held : mapping of str to (N,) array or float
        Coordinates that did not move freely: their measured motion, or the constant they were locked at.
    known : mapping of str to float
        Parameters that differ in this run and are known, such as an added mass.
    unknown : tuple of str
        Which of `PER_RUN` are estimated for this run; "initial" is the rule.
    shared : mapping of str to str
        Names of what is estimated for a group of runs, and the group's label: all runs that give a name the same label
        have one value of it, as friction has on one day. These need not be in `unknown` as well.
    spread : mapping of str to float
        One sigma of the logarithm of this run's factors, where it is not the usual one: how far ``friction``, ``gain``
        and ``scale.theta`` may reasonably differ from 1.
    guesses : mapping of str to float
        Where the search for ``input_start`` and ``input_end`` begins; found from the motion when left out.
    initial : mapping of str to float
        States known at the first sample, by name; they are then not estimated.
    horizon : float, tuple of float or None
        Seconds ahead that are predicted from each measured state; None simulates freely from the first sample. Several
        horizons are explained together and need ``restart="kalman"``.
    restart : {"smooth", "kalman"}
        Where predictions start: at the smoothed measurement, which the samples of the window itself may move, or at
        the state of a Kalman filter that knows the past alone; see `upright.identification.problem.predictor`.
    score_from : float
        Seconds after the first sample before which the run is simulated but not scored (a held-out tail).
    loop : ClosedLoop or None
        The law that closed the loop, when it is simulated too.
    repeats, source : str
        Label of the runs that repeat this one, when their commands do not show it; file, window and hash.
    """

    label: str
    role: Literal["fit", "predict"]
    t: Array
    u: Array
    y: Array
    measured: tuple[str, ...]
    quantum: tuple[float, ...] = ()
    held: Mapping[str, Array | float] = field(default_factory=dict[str, "Array | float"])
    known: Mapping[str, float] = field(default_factory=dict[str, float])
    unknown: tuple[str, ...] = ("initial",)
    shared: Mapping[str, str] = field(default_factory=dict[str, str])
    spread: Mapping[str, float] = field(default_factory=dict[str, float])
    guesses: Mapping[str, float] = field(default_factory=dict[str, float])
    initial: Mapping[str, float] = field(default_factory=dict[str, float])
    horizon: float | tuple[float, ...] | None = None
    restart: Literal["smooth", "kalman"] = "smooth"
    score_from: float = 0.0
    loop: ClosedLoop | None = None
    repeats: str = ""
    source: str = ""

    @property
    def horizons(self) -> tuple[float, ...]:
        """Horizons [s], the shortest first; none for a free run."""
        if self.horizon is None:
            return ()
        return tuple(sorted(self.horizon)) if isinstance(self.horizon, tuple) else (self.horizon,)

    @property
    def period(self) -> float:
        """Sample period [s]."""
        return float((self.t[-1] - self.t[0]) / (self.t.size - 1))

    def first_part(self, share: float = SEEN) -> Run:
        """The beginning of the run; a short run whole."""
        n = int(self.t.size * share)
        if n < LEAST_RUN * share:
            return self
        held = {c: v[:n] if isinstance(v, np.ndarray) else v for c, v in self.held.items()}
        return replace(self, t=self.t[:n], u=self.u[:n], y=self.y[:n], held=held)


@dataclass(frozen=True, kw_only=True)
class Rig:
    """A plant with what is known and what is asked about its parameters and its actuator."""

    plant: type[Plant]
    parameters: Mapping[str, Parameter]
    substeps: int = 1

    @property
    def estimated(self) -> tuple[str, ...]:
        """Names of the parameters to estimate, in order."""
        return tuple(n for n, p in self.parameters.items() if p.estimate)

    def with_values(self, values: Mapping[str, float]) -> Rig:
        """The rig with every number known: `values` by name, the rest as it stands."""
        parameters = {
            n: replace(p, value=float(values.get(n, p.value)), estimate=False, uncertainty=0.0)
            for n, p in self.parameters.items()
        }
        return replace(self, parameters=parameters)


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A rig explained by its runs.

    `per_run` holds what was estimated run by run, by run label and name, `groups` what several runs share, by the
    group's label and name; `unseen` says in sentences which combinations the data cannot see and which number would
    fix it; `singular_values` belong to the scaled Jacobian, `directions` (rows) to them, in the order of `names`;
    `poles` are those at every equilibrium of the fitted plant.
    """

    rig: Rig
    estimates: Mapping[str, Estimate]
    per_run: Mapping[str, Mapping[str, Estimate]]
    groups: Mapping[str, Mapping[str, Estimate]] = field(default_factory=dict[str, Mapping[str, Estimate]])
    runs: Mapping[str, RunScore]
    verdict: str
    trusted: bool
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
    interrupted: bool = False
    assumptions: tuple[Assumption, ...] = ()
    poles: Mapping[str, tuple[Pole, ...]] = field(default_factory=dict[str, tuple[Pole, ...]])
