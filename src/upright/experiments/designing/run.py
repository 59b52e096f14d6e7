"""From an identified rig to gains, and what they are worth in the loop that a computer runs."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from upright.errors import BadInput
from upright.experiments.identified import IdentifiedRig
from upright.gains import (
    Estimator,
    Margins,
    Placement,
    Sampled,
    feedback,
    filtered,
    hold,
    kalman,
    lqr,
    margins,
    place,
    place_sampled,
    prefilter,
    shaken,
    weight_for_effort,
)
from upright.gains.loop import closed, command_noise, swing
from upright.gains.lqr import motion
from upright.gains.requests import Roots, poles_of
from upright.gains.sampled import to_s
from upright.laws import Law
from upright.physics import Linear
from upright.records import Array
from upright.study.description import RigDescription, turn_of

SPEEDS = ("plain", "filtered", "kalman")
"""Ways to the velocities: differences of encoders, plain or through a low pass, and a Kalman filter."""


@dataclass(frozen=True, kw_only=True)
class DesignRequest:
    """What is asked of the loop; SI units, the limit in the command's.

    `delay` is how late a command acts in all [samples]: that of the rig's file when None, or one where it has none.
    `lag` is the drive's [s], that of the rig's file when None.
    `poles` [1/s] or `weights` (diagonal of Q, with `R`, or with the limit and `start` from which R follows).
    `speed` is ``"plain"``, ``"filtered"`` or ``"kalman"``; `memory` is the filter's. With `sampled`, the gains are
    those whose sampled loop has the poles asked. `said` is what period, limit and quantum rest on, to be told.
    """

    at: str
    poles: Roots | None = None
    weights: tuple[float, ...] | None = None
    R: float | None = None
    period: float = 1e-3
    delay: float | None = None
    lag: float | None = None
    speed: str = "filtered"
    memory: float = 0.5
    quantum: tuple[float, ...] = ()
    limit: float | None = None
    start: tuple[float, ...] = ()
    track: str = ""
    sampled: bool = False
    said: RigDescription | None = None

    def __post_init__(self) -> None:
        if not 1e-6 <= self.period <= 10.0:
            raise BadInput(f"a loop is closed every 1e-6 to 10 s, got a period of {self.period:g} s.")
        if self.limit is not None and not 0 < self.limit < 1e9:
            raise BadInput(f"the largest command lies above 0 and below 1e9, got {self.limit:g}.")


@dataclass(frozen=True, kw_only=True)
class VelocityLoop:
    """One way to the velocities, with the loop that it makes; `margins` is None where the loop falls."""

    name: str
    speed_noise: Array
    command_noise: float | None
    margins: Margins | None
    poles: Roots


@dataclass(frozen=True, kw_only=True)
class Designed:
    """Gains and what they are worth.

    `peak` is the largest command that the start takes with continuous feedback, `peak_sampled` in the loop as it runs.
    K are the gains in force: the `continuous` ones of placement or least cost (`placement` is None then), or the
    `sampled_gains`, whose poles are met in the loop as it runs.
    """

    rig: IdentifiedRig
    wish: DesignRequest
    model: Linear
    sampled: Sampled
    K: Array
    continuous: Array
    placement: Placement | None
    sampled_gains: Array | None
    R: float | None
    law: Law
    poles: Roots
    ways: tuple[VelocityLoop, ...]
    k_pf: float | None
    peak: float
    peak_sampled: float
    swing: tuple[Array, Array, Array]
    chance: float | None
    cloud: Roots = field(default_factory=lambda: np.zeros(0, dtype=np.complex128))

    @property
    def chosen(self) -> VelocityLoop:
        """The way to the velocities that was asked for."""
        return self.ways[SPEEDS.index(self.wish.speed)]

    @property
    def verdict(self) -> str:
        """Whether this loop may be closed on a rig, in a sentence or two."""
        way, unit = self.chosen, self.rig.unit
        if way.margins is None:
            return (
                f"The sampled loop falls: with a period of {1e3 * self.wish.period:.4g} ms, "
                f"{self.sampled.delay:.3g} samples of delay and the {way.name} the gains do not stabilize. "
                "Sample faster, ask for slower poles, or design for the sampled loop (--sampled)."
            )
        m, chance = way.margins, 1.0 if self.chance is None else self.chance
        thin = [
            text
            for text, bad in (
                (f"distance to -1 is only {m.modulus:.2f}", m.modulus < 0.4),
                (f"a gain {100 * (1 - m.least_gain):.0f} % weaker lets it fall", m.least_gain > 0.7),
                (f"it bears only {1e3 * m.delay:.2g} ms more delay", m.delay < self.wish.period),
                (f"{100 * (1 - chance):.0f} % of the rigs that the fit allows fall", self.chance is not None
                 and self.chance < 0.99),
            )
            if bad
        ]  # fmt: skip
        head = "The loop stands, with reservations: " + "; ".join(thin) if thin else "The loop stands with margin"
        limit = self.wish.limit
        if limit is None:
            return f"{head}."
        share = self.peak_sampled / limit
        if share > 1:
            return (
                f"{head}. The start asked for needs {self.peak_sampled:.3g} {unit}, {100 * share:.0f} % of the limit: "
                f"the drive saturates; up to {100 / share:.0f} % of that start it does not."
            )
        return f"{head}; the start asked for takes {100 * share:.0f} % of the drive's limit."


def design_for(rig: IdentifiedRig, wish: DesignRequest) -> Designed:
    """Gains as wished, and their loop as a computer runs it.

    Raises
    ------
    BadInput
        When what is asked cannot be had; the sentence says why.
    """
    model = rig.linear(wish.at)
    start = np.array(wish.start) if wish.start else _tilt(rig)
    if model.B.shape[1] != 1:
        raise BadInput(f"upright design is for one input, and this plant has {model.B.shape[1]}; use place.")
    lag = rig.lag if wish.lag is None else wish.lag
    sampled = hold(model, wish.period, _late(rig, wish), lag)
    placement, R = None, wish.R
    if wish.poles is not None:
        placement = place(model.A, model.B, wish.poles)
        K = placement.K
    else:
        weights = wish.weights or (1.0,) * model.A.shape[0]
        if R is None:
            if wish.limit is None:
                raise BadInput(
                    "least cost needs a weight of the effort (--effort-weight) or a limit (--limit); give one."
                )
            R = weight_for_effort(model.A, model.B, weights, start, wish.limit, states=model.states)
        K = lqr(model.A, model.B, weights, R, states=model.states)
    quantum = wish.quantum or quanta(rig, rig.described(needs=("counts",), who="upright design"))
    if wish.limit is None and wish.speed == "kalman":
        raise BadInput(
            "a Kalman filter has to know how hard the rig is pushed, a tenth of what the drive can; give the largest "
            'command (--limit 10, or [actuator] limit = "10 V" in the study).'
        )
    ways = SPEEDS if wish.limit is not None else SPEEDS[:-1]
    estimators = [velocities(model, sampled, s, wish.memory, wish.limit or math.inf, quantum) for s in ways]
    estimator = estimators[SPEEDS.index(wish.speed)]
    wanted = placement.asked if placement is not None else poles_of(model.A - model.B @ K)
    gains = None if wish.speed == "kalman" else place_sampled(sampled, estimator, wanted)
    if wish.sampled and gains is None:
        raise BadInput("--sampled is for differenced encoders; with a Kalman filter the poles are met as they are.")
    used = gains if wish.sampled and gains is not None else K
    k_pf = None
    if wish.track:
        if wish.track not in model.outputs:
            raise BadInput(f"nothing called '{wish.track}' is measured; --track one of {', '.join(model.outputs)}.")
        k_pf = prefilter(model.A, model.B, model.C[model.outputs.index(wish.track)], used)
    law = feedback(estimator, used, k_pf or 0.0)
    back = motion(model.A, model.B, K, start)
    loops = tuple(_velocity_loop(model, sampled, e, used, quantum) for e in estimators)
    cloud, chance = _cloud(rig, wish, sampled, law)
    return Designed(
        rig=rig, wish=wish, model=model, sampled=sampled, K=used, continuous=K, placement=placement,
        sampled_gains=gains, R=R, law=law, poles=to_s(poles_of(closed(sampled, law)), wish.period), ways=loops,
        k_pf=k_pf, peak=float(np.abs(back[2]).max()), peak_sampled=_peak(sampled, law, start, float(back[0][-1])),
        swing=back, chance=chance, cloud=cloud,
    )  # fmt: skip


def _late(rig: IdentifiedRig, wish: DesignRequest) -> float:
    """How late a command acts [samples]; what was identified from a log holds the computer's share already."""
    if wish.delay is not None:
        return wish.delay
    return rig.delay / wish.period or 1.0


def quanta(rig: IdentifiedRig, said: RigDescription) -> tuple[float, ...]:
    """Step of every encoder [m or rad], as described."""
    return tuple(turn_of(c.unit) / said.entries[f"counts.{c.name}"].value for c in rig.plant.coordinates)


def _peak(sampled: Sampled, law: Law, start: Array, seconds: float) -> float:
    """Largest command of the loop as it runs; infinite when it falls."""
    if np.abs(poles_of(closed(sampled, law))).max() >= 1:
        return math.inf
    samples = min(max(round(seconds / sampled.period), 100), 20_000)
    return float(np.abs(swing(sampled, law, start, samples)[1]).max())


def _tilt(rig: IdentifiedRig) -> Array:
    """Five degrees, or 5 cm, of the last coordinate."""
    x = np.zeros(2 * len(rig.plant.coordinates))
    x[-2] = math.radians(5) if rig.plant.coordinates[-1].unit == "rad" else 0.05
    return x


def velocities(
    model: Linear, sampled: Sampled, speed: str, memory: float, limit: float, quantum: ArrayLike
) -> Estimator:
    """States from encoders in one of the ways of `SPEEDS`.

    Parameters
    ----------
    model, sampled : Linear and Sampled
        From the command to the coordinates.
    speed : str
    memory : float
        Of the filtered difference.
    limit : float
        Largest command. For the Kalman filter every coordinate is shaken by itself as much as a tenth of it would:
        pushes, friction, what the model leaves out.
    quantum : float or array
        Step of each encoder [m or rad].
    """
    if speed == "kalman":
        shaking = shaken(sampled, 0.1 * limit * np.abs(model.B[1::2, 0]))
        return kalman(sampled, shaking, np.asarray(quantum) / math.sqrt(12))
    return filtered(sampled, memory if speed == "filtered" else 0.0)


def _velocity_loop(
    model: Linear, sampled: Sampled, estimator: Estimator, K: Array, quantum: tuple[float, ...]
) -> VelocityLoop:
    law = feedback(estimator, K)
    poles = poles_of(closed(sampled, law))
    stands = bool(np.abs(poles).max() < 1)
    return VelocityLoop(
        name=estimator.name,
        speed_noise=estimator.noise(quantum)[1 : model.A.shape[0] : 2],
        command_noise=command_noise(sampled, law, quantum) if stands else None,
        margins=margins(model, sampled, law) if stands else None,
        poles=to_s(poles, sampled.period),
    )


def _cloud(rig: IdentifiedRig, wish: DesignRequest, nominal: Sampled, law: Law) -> tuple[Roots, float | None]:
    """Poles [1/s] of the loop with these gains on every rig that the fit allows, and the share that stands."""
    rows = [
        poles_of(closed(hold(m, wish.period, nominal.delay, nominal.lag), law)) for m in rig.spread(wish.at)
    ]  # fmt: skip
    if not rows:
        return np.zeros(0, dtype=np.complex128), None
    z = np.array(rows)
    return to_s(z, wish.period).ravel(), float(np.mean(np.abs(z).max(axis=1) < 1))
