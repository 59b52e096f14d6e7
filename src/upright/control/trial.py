"""The run of a law on a rig as a servo sees it: drive with its limit, encoders with their counts, servo period.

Fig. 6 of the paper: counts, velocities from counts, gains, saturation, servo period; the law may be any sampled linear
one. The rig is nonlinear and has dry friction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from upright.errors import BadInput
from upright.laws import Law, Rule
from upright.records import Array, Record
from upright.records.record import of_twin
from upright.rig import Rig
from upright.simulation import simulate

LONGEST = 1e-3
"""Longest Runge-Kutta step of a trial [s]. Dry friction that turns within a step is found to a millionth of it."""
TURN = 0.05
"""The same in radians of the fastest mode: its phase errs by ``TURN**4/120``, 5e-8, of all that it turns."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """One run of a closed loop.

    Attributes
    ----------
    at : str
        Equilibrium that was to be held.
    t : array, shape (N,)
        Time since the law was switched on [s].
    x : array, shape (N, states)
        What the states truly were.
    u : array, shape (N,)
        Command as put out, rounded to the converter's steps and limited.
    rest : array, shape (coordinates,)
        What the law takes for the readings at the equilibrium.
    record : Record
        What a program at the rig could log: readings by coordinate [m or rad], ``u``, and ``reference`` if any.
    """

    rig: Rig
    at: str
    t: Array
    x: Array
    u: Array
    rest: Array
    record: Record

    @property
    def deviation(self) -> Array:
        """True coordinates less their values at the equilibrium, shape (N, coordinates)."""
        point = self.rig.plant.equilibrium(self.at)
        return self.x[:, 0::2] - np.array(list(point.values()))


def steps_in_period(rig: Rig) -> int:
    """Runge-Kutta steps in a servo period of a rig; their error is far below an encoder's count."""
    return max(math.ceil(rig.period / LONGEST - 1e-9), math.ceil(rig.period * rig.fastest_mode / TURN), 1)


def trial(
    rig: Rig,
    law: Law | Rule,
    *,
    at: str,
    start: ArrayLike,
    seconds: float,
    reference: ArrayLike | None = None,
    pushes: ArrayLike | None = None,
    rest: ArrayLike | None = None,
    off: float = math.inf,
) -> Trial:
    """Run a law on a rig.

    Parameters
    ----------
    rig : Rig
        As it truly is.
    law : Law or Rule
        A law on deviations from rest, whose own encoder and converter steps and delay are replaced by the rig's; or a
        rule on readings, which brings the rig's encoders and converter itself.
    at : str
        Equilibrium to hold.
    start : array, shape (states,)
        Where the rig is when the law is switched on, as deviation from the equilibrium.
    reference : array, shape (T,), optional
        Reference at the samples; its last value is held.
    pushes : array, shape (T,), optional
        What disturbs the drive, added to the law's command before its limit, sample by sample.
    rest : array, shape (coordinates,), optional
        What the law takes for the readings at the equilibrium; without it the plant's own numbers, which the encoders
        show when they were zeroed where the coordinates are zero and are scaled as described.
    off : float
        When the drive is switched off [s].

    Raises
    ------
    BadInput
        When shapes do not fit together.
    """
    count = round(seconds / rig.period) + 1
    if not count > 1:
        raise BadInput(f"a trial needs some time, got {seconds:g} s.")
    point = np.array(list(rig.plant.equilibrium(at).values()))
    held = point if rest is None else np.asarray(rest, dtype=np.float64)
    x0 = rig.plant.state(at) + np.asarray(start, dtype=np.float64)
    loop = law if isinstance(law, Rule) else law_on_rig(rig, law, held, reference)
    late = None
    if pushes is not None:
        late = np.zeros(count)
        kicks = np.asarray(pushes, dtype=np.float64)[:count]
        late[: kicks.size] = kicks
    drive = dict(rig.drive) if math.isinf(off) else {**rig.drive, "actuator.end": off}
    motion = simulate(
        rig.plant, drive, x0, late, rig.period, samples=count, substeps=steps_in_period(rig), loop=loop
    )[:, :, 0]  # fmt: skip
    n = x0.size
    x, t = motion[:, :n], np.arange(count, dtype=np.float64) * rig.period
    u = np.where(t < off, motion[:, n], 0.0)
    return Trial(rig=rig, at=at, t=t, x=x, u=u, rest=held, record=logged(rig, t, x, u, reference))


def readings(rig: Rig, q: ArrayLike) -> Array:
    """What the encoders show [m or rad] of motions, shape (N, ..., coordinates)."""
    step = rig.resolution / rig.shown  # a count is what its true length is; the program multiplies by the said one
    felt = np.asarray(q, dtype=np.float64) if rig.mounting is None else rig.mounting.felt(q)
    return np.floor(felt / step + 0.5) * rig.resolution


def law_on_rig(rig: Rig, law: Law, rest: ArrayLike, reference: ArrayLike | None = None) -> Law:
    """The law with the rig's encoders and converter about it.

    Parameters
    ----------
    rest : array, shape (coordinates,)
        What it takes for the readings at the equilibrium.
    reference : array, shape (T,), optional
    """
    point, scale = np.asarray(rest, dtype=np.float64), rig.shown
    offset = -point
    if rig.mounting is not None:
        scale = rig.shown * rig.mounting.slope(point)
        offset = rig.shown * rig.mounting.turned(point) - scale * point - point
    made = law.in_units(scale, offset, 1.0)
    return replace(
        made, references=law.references if reference is None else reference, delay=0.0,
        resolution=np.abs(rig.resolution / scale), command_resolution=rig.converter,
    )  # fmt: skip


def logged(rig: Rig, t: Array, x: Array, u: Array, reference: ArrayLike | None = None) -> Record:
    """What a program at the rig could log of states x, shape (N, states), and commands u, shape (N,)."""
    log = twin_log(rig, t, readings(rig, x[:, 0::2]), u)
    signals = {name: log[name] for name in (*log.outputs, "u")}
    if reference is not None:
        r = np.asarray(reference, dtype=np.float64)
        signals["reference"] = r[np.minimum(np.arange(t.size), r.size - 1)]
    return log.replace(signals=signals)


def twin_log(rig: Rig, t: Array, y: Array, u: Array | None = None, *, unit: str = "") -> Record:
    """Log of a twin: commands u, (N,), if any, and readings y, (N, coordinates), in SI or a `unit` of all."""
    of = {c.name: unit or c.unit for c in rig.plant.coordinates}
    signals = {name: y[:, i] for i, name in enumerate(of)}
    driven = {} if u is None else {"u": u}
    return Record(
        t=t, signals=driven | signals, units=({"u": rig.unit} if driven else {}) | of, inputs=tuple(driven),
        outputs=tuple(of), provenance=of_twin(rig.name, rig.seed),
    )  # fmt: skip
