"""The run of a law on a rig as a servo sees it: drive with its limit, encoders with their counts, servo period.

Fig. 6 of the paper: counts, velocities from counts, gains, saturation, servo period; the law may be any sampled linear
one. The rig is nonlinear and has dry friction.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from upright.basis import DESCRIBED, Basis
from upright.control.encoders import Mounting
from upright.errors import BadInput
from upright.laws import Law, Rule
from upright.physics import Linear, Plant
from upright.records import Array, Record
from upright.records.record import of_twin
from upright.simulation import simulate

GAIN = "actuator.gain"


@dataclass(frozen=True, kw_only=True)
class ServoRig:
    """A plant with one input as a servo sees it.

    Attributes
    ----------
    name : str
        As a reader of the report knows it.
    plant : Plant
    gain : float
        Force per unit of command.
    limit : float
        Largest command, in its unit.
    converter : float
        Smallest step of the command.
    delay : float
        From a sample of the encoders to its command at work, computation included [s].
    lag : float
        Time constant of the drive [s].
    offset : float
        Command that the drive adds by itself.
    unit : str
        Of the command.
    counts : tuple of float
        Encoder counts per m or rad, one for each coordinate.
    scales : tuple of float
        What the encoders show over what is true; 1 where the counts per unit are as said.
    mounting : Mounting, optional
        What else the encoders show: play and shafts off centre. Logs have both; a loop, which stays about one point,
        has the error and the slope that a shaft off centre has there.
    period : float
        Servo period [s].
    travel : float
        How far the driven coordinate may go either way before a stop or a cable ends it [m or rad].
    speed_limit : float
        Speed of the driven coordinate at which the drive trips [m/s or rad/s].
    twist : float
        How far the last coordinate may go from the first before the shaft between them trips the rig [m or rad].
    more : mapping of str to float
        What else the drive does: numbers of `physics.actuator.ACTUATOR`, such as ``"actuator.force_limit"``.
    sources : mapping of str to str
        What limit, counts and so on rest on, in a word or two by name; empty for a twin.
    seed : int
        Which rig of the make; 0 is the one as designed.
    basis : Basis
        Where its numbers come from, and how far they can be trusted.
    """

    name: str
    plant: Plant
    gain: float
    limit: float
    counts: tuple[float, ...]
    period: float
    converter: float = 0.0
    delay: float = 0.0
    lag: float = 0.0
    offset: float = 0.0
    unit: str = "V"
    scales: tuple[float, ...] = ()
    mounting: Mounting | None = None
    travel: float = math.inf
    speed_limit: float = math.inf
    twist: float = math.inf
    more: Mapping[str, float] = field(default_factory=dict[str, float])
    sources: Mapping[str, str] = field(default_factory=dict[str, str])
    seed: int = 0
    basis: Basis = DESCRIBED

    def __post_init__(self) -> None:
        n = len(self.plant.coordinates)
        if len(self.plant.inputs) != 1:
            raise BadInput(f"a rig is driven by one input; {self.name} has {len(self.plant.inputs)}.")
        if len(self.counts) != n or any(not c > 0 for c in self.counts):
            raise BadInput(f"a rig with {n} coordinates needs {n} positive numbers of counts, got {self.counts}.")
        if self.scales and len(self.scales) != n:
            raise BadInput(f"a rig with {n} coordinates needs {n} scales of its encoders, got {self.scales}.")
        for name in ("limit", "period"):
            if not (getattr(self, name) > 0 and math.isfinite(getattr(self, name))):
                raise BadInput(f"the {name} of a rig must be positive and finite, got {getattr(self, name):g}.")

    @property
    def drive(self) -> Mapping[str, float]:
        """The actuator by the names of `upright.simulation.simulate`."""
        return {
            **self.more,
            "actuator.gain": self.gain,
            "actuator.limit": self.limit,
            "actuator.delay": self.delay,
            "actuator.lag": self.lag,
            "actuator.offset": self.offset,
        }

    @property
    def saturation(self) -> float:
        """Smallest command at which the drive gives all that it can, at rest: that of its command or of its force."""
        return saturation(self.drive)

    @property
    def quantum(self) -> Array:
        """Resolution of each encoder [m or rad], shape (coordinates,)."""
        return 1.0 / np.array(self.counts)

    @property
    def shown(self) -> Array:
        """What each encoder shows over what is true, shape (coordinates,)."""
        return np.array(self.scales) if self.scales else np.ones(len(self.counts))

    def linear(self, at: str) -> Linear:
        """Model about an equilibrium, from the command to the coordinates; dry friction, lag and counts left out."""
        return driven(self.plant, {**self.more, GAIN: self.gain}, at)

    def changed(self, **parameters: float) -> ServoRig:
        """The same rig with other parameters of its plant."""
        return replace(self, plant=self.plant.replace(**parameters))


def driven(plant: Plant, drive: Mapping[str, float], at: str, *, side: float = 0.0) -> Linear:
    """Model about an equilibrium from the command to the coordinates, with what the drive takes for speed.

    The drive gives gain u less its slope and its braking, times the speed of what it drives; that braking is at work
    while a loop runs.
    """
    model = plant.linear(at, side=side)
    A, names = model.A, plant.state_names()
    taken = sum(drive.get(f"actuator.{n}", 0.0) for n in ("slope", "damping", "standby"))
    if taken:
        A = A.copy()
        for i, force in enumerate(plant.inputs):
            A[:, names.index(force.on) + 1] -= taken * model.B[:, i]
    return replace(model, A=A, B=model.B * drive[GAIN])


def full_command(drive: Mapping[str, float]) -> float:
    """Command at which the force of a drive at rest meets its limit; infinite for a drive without one."""
    force, gain = drive.get("actuator.force_limit", math.inf), abs(drive[GAIN])
    left = gain - force * drive.get("actuator.droop", 0.0) if math.isfinite(force) else 0.0
    return force / left if left > 0 else math.inf


def saturation(drive: Mapping[str, float]) -> float:
    """Smallest command at which a drive gives all that it can, at rest: that of its command or of its force."""
    return min(drive["actuator.limit"], full_command(drive))


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
    """What the encoders show [m or rad] of motions, shape (N, ..., coordinates)."""
    step = rig.quantum / rig.shown  # a count is what its true length is; the program multiplies by the said one
    felt = np.asarray(q, dtype=np.float64) if rig.mounting is None else rig.mounting.felt(q)
    return np.floor(felt / step + 0.5) * rig.quantum


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
    point, scale = np.asarray(rest, dtype=np.float64), rig.shown
    offset = -point
    if rig.mounting is not None:
        scale = rig.shown * rig.mounting.slope(point)
        offset = rig.shown * rig.mounting.turned(point) - scale * point - point
    made = law.in_units(scale, offset, 1.0)
    return replace(
        made, references=law.references if reference is None else reference, delay=0.0,
        quantum=np.abs(rig.quantum / scale), command_quantum=rig.converter,
    )  # fmt: skip


def logged(rig: ServoRig, t: Array, x: Array, u: Array, reference: ArrayLike | None = None) -> Record:
    """What a program at the rig could log of states x, shape (N, states), and commands u, shape (N,)."""
    log = twin_log(rig, t, readings(rig, x[:, 0::2]), u)
    signals = {name: log[name] for name in (*log.outputs, "u")}
    if reference is not None:
        asked = np.asarray(reference, dtype=np.float64)
        signals["reference"] = asked[np.minimum(np.arange(t.size), asked.size - 1)]
    return log.replace(signals=signals)


def twin_log(rig: ServoRig, t: Array, y: Array, u: Array | None = None, *, unit: str = "") -> Record:
    """Log of a twin: commands u, (N,), if any, and readings y, (N, coordinates), in SI or a `unit` of all."""
    of = {c.name: unit or c.unit for c in rig.plant.coordinates}
    signals = {name: y[:, i] for i, name in enumerate(of)}
    driven = {} if u is None else {"u": u}
    return Record(
        t=t, signals=driven | signals, units=({"u": rig.unit} if driven else {}) | of, inputs=tuple(driven),
        outputs=tuple(of), provenance=of_twin(rig.name, rig.seed),
    )  # fmt: skip
