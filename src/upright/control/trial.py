"""What happens when a law is switched on at a rig? Its encoders, converter, limit and delay included.

Fig. 6 of the paper: counts, velocities from counts, gains, saturation, servo period; the law may be any sampled linear
one. The rig is nonlinear and has dry friction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.control.rig import ServoRig
from upright.errors import BadInput
from upright.laws import Law, Rule
from upright.records import Provenance, Record
from upright.simulation import simulate

Array = NDArray[np.float64]

SUBSTEPS = 2
"""Runge-Kutta steps per servo period: of 0.4 ms, where the fastest motion of these rigs takes some 10 ms."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """One run of a closed loop.

    Attributes
    ----------
    rig : ServoRig
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

    rig: ServoRig
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


def trial(
    rig: ServoRig,
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
    rig : ServoRig
        As it truly is.
    law : Law or Rule
        A law on deviations from rest, whose own encoder and converter steps and delay are replaced by the rig's; or a
        rule on readings, which brings the rig's encoders and converter itself.
    at : str
        Equilibrium to hold.
    start : array, shape (states,)
        Where the rig is when the law is switched on, as deviation from the equilibrium.
    seconds : float
    reference : array, shape (T,), optional
        Reference at the samples; its last value is held.
    pushes : array, shape (T,), optional
        What disturbs the drive, added to the law's command before its limit, sample by sample.
    rest : array, shape (coordinates,), optional
        What the law takes for the readings at the equilibrium; without it the plant's own numbers, which the encoders
        show when they were zeroed where the coordinates are zero and are scaled as said.
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
    given = law if isinstance(law, Rule) else at_work(rig, law, held, reference)
    late = None
    if pushes is not None:
        late = np.zeros(count)
        kicks = np.asarray(pushes, dtype=np.float64)[:count]
        late[: kicks.size] = kicks
    drive = dict(rig.drive) if math.isinf(off) else {**rig.drive, "actuator.end": off}
    found = simulate(
        rig.plant, drive, x0, late, rig.period, samples=count, substeps=SUBSTEPS, loop=given
    )[:, :, 0]  # fmt: skip
    n = x0.size
    x, t = found[:, :n], np.arange(count, dtype=np.float64) * rig.period
    u = np.where(t < off, found[:, n], 0.0)
    return Trial(rig=rig, at=at, t=t, x=x, u=u, rest=held, record=logged(rig, t, x, u, reference))


def readings(rig: ServoRig, q: ArrayLike) -> Array:
    """What the encoders show [m or rad] at coordinates, shape (..., coordinates)."""
    step = rig.quantum / rig.shown  # a count is what its true length is; the program multiplies by the said one
    return np.floor(np.asarray(q, dtype=np.float64) / step + 0.5) * rig.quantum


def at_work(rig: ServoRig, law: Law, rest: ArrayLike, reference: ArrayLike | None = None) -> Law:
    """The law with the rig's encoders and converter about it.

    Parameters
    ----------
    rig : ServoRig
    law : Law
    rest : array, shape (coordinates,)
        What it takes for the readings at the equilibrium.
    reference : array, shape (T,), optional
    """
    made = law.in_units(rig.shown, -np.asarray(rest, dtype=np.float64), 1.0)
    return replace(
        made, references=law.references if reference is None else reference, delay=0.0,
        quantum=np.abs(rig.quantum / rig.shown), command_quantum=rig.converter,
    )  # fmt: skip


def logged(rig: ServoRig, t: Array, x: Array, u: Array, reference: ArrayLike | None = None) -> Record:
    """What a program at the rig could log of states x, shape (N, states), and commands u, shape (N,)."""
    seen = readings(rig, x[:, 0::2])
    names = [c.name for c in rig.plant.coordinates]
    signals = {name: seen[:, i] for i, name in enumerate(names)} | {"u": u}
    units = {c.name: c.unit for c in rig.plant.coordinates} | {"u": rig.unit}
    if reference is not None:
        asked = np.asarray(reference, dtype=np.float64)
        signals["reference"] = asked[np.minimum(np.arange(t.size), asked.size - 1)]
    return Record(
        t=t,
        signals=signals,
        units=units,
        inputs=("u",),
        outputs=tuple(names),
        provenance=Provenance(
            reader="twin",
            rig=f"digital twin of {rig.name}, seed {rig.seed}",
            notes=("This log was simulated; no rig was touched.",),
        ),
    )
