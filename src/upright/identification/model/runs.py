"""A run: one stretch of data in SI, and what is estimated for it beside the rig's own parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.structures import ClosedLoop

Array = NDArray[np.float64]

PER_RUN = ("initial", "offset", "gain", "friction", "input_offset", "input_start", "input_end")
"""What may differ from run to run: initial state, sensor offsets, actuator gain (a factor), dry and viscous friction
of every joint (one common factor), a constant added to the command, when the command really began and ended to act [s
from the first sample]. "offset.theta" means the offset of one sensor, "scale.theta" its gain (a factor)."""

FOR_GROUPS = ("gain", "friction", "input_offset")
"""Of these a group of runs may share one value; of sensor offsets and gains too."""

SPREADS = {"friction": 0.3, "gain": 1.0, "scale": 1.0}
"""One sigma of the logarithm of a run's factor, unless the run says otherwise.

Friction of two runs of one day differed by 13 %, an actuator's gain by a factor of 3.2.
"""

FITTED_SHARE = 2 / 3
"""Share of every run that models are fitted on where its rest judges them."""

LEAST_RUN = 200
"""Runs with fewer samples are not cut."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """One stretch of data in SI.

    Attributes
    ----------
    label : str
        Name in reports.
    role : {"fit", "predict"}
        Whether the estimator may see it.
    refit : bool
        Whether a run that was predicted is then fitted too, where the fitted ones leave a number undetermined.
    t : (N,) array
        Uniform time [s].
    u : (N, inputs) array
        Commands in the actuator's unit; zeros for a free run.
    y : (N, len(measured)) array
        Measured coordinates, sign and scale applied.
    measured : tuple of str
        Names of the coordinates in the columns of `y`.
    resolution : tuple of float
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
        the state of a Kalman filter that knows the past alone; see `upright.identification.problem.simulated`.
    score_from : float
        Seconds after the first sample before which the run is simulated but not scored (a held-out tail).
    loop : ClosedLoop or None
        The law that closed the loop, when it is simulated too.
    repeats, source : str
        Label of the runs that repeat this one, when their commands do not show it; file, window and hash.
    record : (float, float), optional
        First and last time [s] of the record that it is a part of.
    """

    label: str
    role: Literal["fit", "predict"]
    t: Array
    u: Array
    y: Array
    measured: tuple[str, ...]
    resolution: tuple[float, ...] = ()
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
    repeats: str | None = None
    source: str = ""
    record: tuple[float, float] | None = None
    refit: bool = False

    @property
    def horizons(self) -> tuple[float, ...]:
        """Horizons [s], the shortest first; none for a free run."""
        if self.horizon is None:
            return ()
        return tuple(sorted(self.horizon)) if isinstance(self.horizon, tuple) else (self.horizon,)

    @property
    def filtered(self) -> bool:
        """Whether a Kalman filter predicts the run."""
        return self.restart == "kalman" and self.horizon is not None

    @property
    def quanta(self) -> tuple[float, ...]:
        """Resolution of each column of `y`, 0 where nobody says."""
        return self.resolution or (0.0,) * len(self.measured)

    @property
    def free(self) -> list[int]:
        """Columns of `y` whose coordinates moved freely."""
        return [k for k, c in enumerate(self.measured) if c not in self.held]

    @property
    def period(self) -> float:
        """Sample period [s]."""
        return float((self.t[-1] - self.t[0]) / (self.t.size - 1))

    def first_part(self, share: float = FITTED_SHARE) -> Run:
        """The beginning of the run; a short run whole."""
        if self.t.size < LEAST_RUN:
            return self
        return self.samples(slice(int(self.t.size * share)))

    def samples(self, part: slice) -> Run:
        """Some of the samples; a law that closed the loop stays as it was."""
        held = {c: v[part] if isinstance(v, np.ndarray) else v for c, v in self.held.items()}
        return replace(self, t=self.t[part], u=self.u[part], y=self.y[part], held=held)
