"""Scales of encoders that may lie, from the hanging rig before a loop is closed, and a watch beside a running loop.

A command that swings the model to about 100 degrees is put out blindly, then the rig coasts. What the encoders show is
compared with the motion of the model, whose numbers may move as far as they are known: s of ``reading = s motion`` is
what an encoder shows over what is true. Nothing but physics can fix it: the period of a large swing tells its true
amplitude (a pendulum at 90 degrees is 18 % slower than at 10), momentum what the driven body does for that swing, and
the sign of the drive that of both. How the driven body drifts meanwhile says nothing: a rig out of level, a command's
offset and dry friction all make it.

In the running loop each suspicion, such as "theta shows twice what is true", is a model with a Kalman filter of its
own. At every sample each filter gives the likelihood of the new reading; the logarithms of the ratios add up and slowly
fade (Wald's sequential test of several hypotheses, with a memory). Where a suspicion has become `ODDS` times as likely
as sound sensors, something is wrong. What it is shows a little later, since two sensors seen only beside each other
cannot tell which of them is wrong: the drive is switched off once one suspicion leads the others, or the pendulum
leaves `SAFE`, or `PATIENCE` is over.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.control.bank import TEXT
from upright.control.swing_up import SwingUp
from upright.control.trial import SUBSTEPS, Trial, logged, trial
from upright.gains import process_noise
from upright.laws import Law
from upright.records import Array, Record
from upright.rig import Rig
from upright.simulation import simulate
from upright.simulation.lowering.routine import Routine

SWING = math.radians(100)
"""Angle to which the model is swung [rad]."""
PUMP, COAST = 2.5, 4.0
"""How long the rig may be driven blindly, and is watched coasting [s]."""
TOLERATED = 0.05
"""Error of a scale that is not spoken of; a loop bears a gain wrong by as much."""
SURE = 4.0
"""Standard errors by which a scale must be off as well."""
KNOWN = {"m": 0.02, "l": 0.02, "r": 0.02, "J": 0.03, "b": 0.2}
"""How well a plant's numbers are known where no fit says so, by their first letter; relative standard errors."""
GAIN_KNOWN, LAG_KNOWN = 0.03, 0.5
_FINE = 1e-3  # s in which `SUBSTEPS` suffice
_SAMPLED = 7e-3  # s between the samples that are looked at


@dataclass(frozen=True, kw_only=True, eq=False)
class Scales:
    """What each encoder shows over what is true.

    Attributes
    ----------
    names : tuple of str
        Coordinates.
    value, error : array, shape (coordinates,)
        Scales with their standard errors.
    explained : array, shape (coordinates,)
        Share of each signal that the model with these scales explains, 1 for all.
    shown, motion : array, shape (N, coordinates)
        Readings, and the model's motion times the scales; t, shape (N,), is their time [s].
    """

    names: tuple[str, ...]
    value: Array
    error: Array
    explained: Array
    t: Array
    shown: Array
    motion: Array

    @property
    def wrong(self) -> tuple[str, ...]:
        """Coordinates whose encoder is not to be trusted."""
        off = np.abs(self.value - 1.0)
        bad = ((off > TOLERATED) & (off > SURE * self.error)) | (self.explained < 0.8)
        return tuple(n for n, b in zip(self.names, bad, strict=True) if b)

    @property
    def sound(self) -> bool:
        """Whether the loop may be closed."""
        return not self.wrong

    @property
    def verdict(self) -> str:
        """What the encoders are worth, in a sentence or two."""
        rows = dict(zip(self.names, zip(self.value, self.error, self.explained, strict=True), strict=True))
        if self.sound:
            figures = ", ".join(f"{n} {v:.4f} ± {2 * e:.1g}" for n, (v, e, _) in rows.items())
            return f"The encoders show what is true ({figures} of it, 95 %)."
        return " ".join(encoder_sentence(n, *rows[n]) for n in self.wrong)


def encoder_sentence(name: str, value: float, error: float, explained: float) -> str:
    """What is wrong with one encoder, and how to mend it."""
    if explained < 0.8:
        return (
            f"The motion of {name} is not that of the model ({100 * explained:.0f} % explained), whatever its scale: "
            "look for a slipping encoder, a cable or a number of the model that is far off; do not close the loop."
        )
    size = f"{abs(value):.4g} (± {2 * error:.1g}) times what is true"
    if value > 0:
        what, remedy = f"shows {size}", f"multiply its counts per unit by {value:.4g}"
    elif abs(value + 1.0) <= TOLERATED:
        what, remedy = "counts the wrong way round", "swap its two channels"
    else:
        what, remedy = f"counts the wrong way round, {size}", f"multiply its counts per unit by {value:.4g}"
    return f"The encoder of {name} {what}: {remedy} before the loop is closed."


def probe(model: Rig, law: SwingUp) -> Array:
    """Commands, shape (N,), that swing the model to `SWING`, as far as that takes no longer than `PUMP`; then none."""
    x0 = model.plant.state("hanging")
    rule = law.rule(model, x0)
    run = trial(model, rule, at="inverted", start=x0 - model.plant.state("inverted"), seconds=PUMP)
    energy = law.body.energy(run.x[:, 2], run.x[:, 3])
    there = np.flatnonzero(energy > -law.body.weight * (1.0 + math.cos(SWING)))
    pumped = int(there[0]) if there.size else run.u.size
    name = model.plant.coordinates[0].name
    while True:  # coasting, the driven body goes on; on the model it stays within the travel
        command = np.concatenate([run.u[:pumped], np.zeros(round(COAST / model.period))])
        if pumped < 100 or np.abs(shown_by_encoders(model, command)[name]).max() < 0.9 * law.travel:
            return command
        pumped = round(0.85 * pumped)


def shown_by_encoders(rig: Rig, command: Array) -> Record:
    """What the encoders of a hanging rig show under commands put out blindly."""
    x = simulate(
        rig.plant, rig.drive, rig.plant.state("hanging"), command, rig.period, samples=command.size + 1,
        substeps=SUBSTEPS,
    )[:, :, 0]  # fmt: skip
    u = np.append(command, 0.0)
    return logged(rig, np.arange(u.size, dtype=np.float64) * rig.period, x, u)


def scales(model: Rig, log: Record, known: Mapping[str, float] | None = None) -> Scales:
    """Scales of the encoders from a log of a hanging rig under known commands.

    The model's numbers move within what is known of them (least squares with that as a prior), since an error of theirs
    would pass for one of the encoders. Errors of fits are correlated over a swing, so every quarter of one counts once.

    Parameters
    ----------
    model : Rig
    log : Record
        Readings by coordinate [m or rad] and ``u``, from rest, evenly sampled.
    known : mapping of str to float, optional
        Relative standard error of a parameter, or of ``"gain"``; `KNOWN` where omitted.
    """
    names = tuple(c.name for c in model.plant.coordinates)
    model = model.replace(period=log.period)
    every = max(1, round(_SAMPLED / model.period))
    shown = np.column_stack([log[n] for n in names])[::every]
    known_sizes = _known(model, known or {})
    moving, size = tuple(known_sizes), np.array(list(known_sizes.values()))
    p, m, command = len(names), size.size, log["u"]
    drift = np.linspace(0.0, 1.0, len(shown))[:, None] ** np.arange(1, 4)
    z, step, J = np.zeros(m), 0.3, np.zeros((0, 0))
    s, wander, at = np.ones(p), np.zeros(3), shown
    part = math.ceil(0.4 * len(shown))
    for turn in range(12):  # first the beginning, then all: errors of the model grow with time
        y = _motion(model, command, every, moving, np.vstack([z, z + step * np.eye(m)]) * size)
        at, slopes = y[:, :, 0], (y[:, :, 1:] - y[:, :, :1]) / step
        if turn == 0:
            s, wander = _projected(shown[:part], at[:part], drift[:part])
        left = shown - s * at
        left[:, 0] -= drift @ wander
        left[part:] = 0.0
        quarters = max(8.0, 2.0 * float(np.sum(np.diff(np.sign(at[:, 1])) != 0)))
        sigma = np.maximum(np.sqrt(np.mean(left[:part] ** 2, axis=0)), model.resolution) * math.sqrt(
            len(shown) / quarters
        )
        # unknown: scales, drift of the driven body, numbers of the model in units of what is known of them
        J = np.zeros((p * len(shown) + m, p + 3 + m))
        for i in range(p):
            rows = slice(i * len(shown), i * len(shown) + part)
            J[rows, i], J[rows, p + 3 :] = at[:part, i] / sigma[i], s[i] * slopes[:part, i] / sigma[i]
            if i == 0:
                J[rows, p : p + 3] = drift[:part] / sigma[i]
        J[p * len(shown) :, p + 3 :] = np.eye(m)
        move = np.linalg.lstsq(J, np.concatenate([*(left / sigma).T, -z]), rcond=None)[0]
        s, wander, z = s + move[:p], wander + move[p : p + 3], np.clip(z + move[p + 3 :], -4.0, 4.0)
        if part == len(shown) and np.abs(move[p + 3 :]).max() < 1e-2:
            break
        if turn >= 4 or np.abs(move[p + 3 :]).max() < 0.1:
            part = len(shown)
    at = _motion(model, command, every, moving, (z * size)[None])[:, :, 0]
    s, wander = _projected(shown, at, drift)
    motion = s * at
    motion[:, 0] += drift @ wander
    spread = np.maximum(np.mean((shown - shown.mean(axis=0)) ** 2, axis=0), model.resolution**2)
    return Scales(
        names=names, value=s, error=np.sqrt(np.diag(np.linalg.inv(J.T @ J))[:p]),
        explained=1.0 - np.mean((shown - motion) ** 2, axis=0) / spread, t=log.t[::every], shown=shown, motion=motion,
    )  # fmt: skip


def _known(model: Rig, known: Mapping[str, float]) -> dict[str, float]:
    """Relative standard errors of the numbers that may move."""
    out = {"gain": known.get("gain", GAIN_KNOWN)} | ({"lag": LAG_KNOWN} if model.lag else {})
    for name, value in model.plant.parameters().items():
        if value != 0.0 and name != "g" and (size := known.get(name, KNOWN.get(name[0], 0.0))) > 0.0:
            out[name] = size
    return out


def _projected(shown: Array, motion: Array, drift: Array) -> tuple[Array, Array]:
    """Scales that bring the motion nearest to what is shown, and the drift of the driven body."""
    first = np.linalg.lstsq(np.column_stack([motion[:, 0], drift]), shown[:, 0], rcond=None)[0]
    rest = np.sum(shown[:, 1:] * motion[:, 1:], axis=0) / np.maximum(np.sum(motion[:, 1:] ** 2, axis=0), 1e-300)
    return np.array([first[0], *rest], dtype=np.float64), np.asarray(first[1:], dtype=np.float64)


def _motion(model: Rig, command: Array, every: int, names: Sequence[str], logs: Array) -> Array:
    """Coordinates of the model, shape (N, coordinates, lanes), for logarithms of factors, shape (lanes, names)."""
    values = model.plant.parameters() | {"gain": model.gain, "lag": model.lag}
    lanes = max(2, len(logs))  # two, so that one kernel serves all
    params = {n: np.resize(values[n] * np.exp(logs[:, i]), lanes) for i, n in enumerate(names)}
    drive = dict(model.drive) | {f"actuator.{n}": params.pop(n) for n in ("gain", "lag") if n in params}
    rows = -(-command.size // every)
    substeps = max(1, round(SUBSTEPS * model.period / _FINE))
    start = np.tile(model.plant.state("hanging"), (lanes, 1))
    x = simulate(
        model.plant, drive | params, start, command, model.period, samples=rows, every=every, substeps=substeps
    )
    return x[:, 0::2, : len(logs)]


def lifted(rig: Rig, shown: float) -> str:
    """What a hand that lifted the pendulum upright learns from its reading [rad]; "" when it is half a turn.

    The encoder was zeroed where the pendulum hangs. A sign cannot be determined, since half a turn either way is
    upright.
    """
    off = abs(abs(shown) - math.pi)
    if off <= math.radians(10):
        return ""
    return (
        f"The encoder of theta shows {math.degrees(shown):.0f} degrees for half a turn, {abs(shown) / math.pi:.3g} "
        "times what is true; the loop stays open. Correct its counts per turn, or zero it where the pendulum hangs."
    )


FACTORS = (-1.0, 0.25, 0.5, 2.0, 4.0)
"""What a suspected sensor may show over what is true: swapped channels, quadrature counted otherwise. A loop stands
with ten percent more or less, and so little is found by `sensors`, hanging."""
ODDS = 3e3
"""Ratio of likelihoods at which a suspicion is believed."""
UNKNOWN = 0.1
"""What the model does not know (dry friction, gain, the ratio of its inertias), as white accelerations of every
coordinate by itself, in shares of what the drive's limit gives it."""
NAMED = 100.0
"""Ratio of likelihoods at which the best suspicion leads the next."""
PATIENCE = 0.06
"""How long it may take to find out which [s]."""
SAFE = math.radians(6)
"""Deviation [rad] beyond which nobody waits to find out."""
FORGOTTEN = 0.4
"""Time constant with which evidence fades [s]: a little that the model always has wrong must not add up for ever."""
MOVED, WITHIN = 0.04, 0.1
"""A sample is evidence when a sensor moved, within so many seconds [s], by such a share of what the drive could have
moved it from rest. Close to rest dry friction, which the filters do not know, holds a pendulum that leans, and rounding
repeats itself: after two seconds of that, sound sensors looked as if they showed four times what is true."""
PLAINLY = 3.0
"""It is evidence too when the mean command of that time is so many times what dry friction takes: something had to
move, and an encoder that is dead shows that nothing did."""
SURPRISE = 15.0
"""Most that one sample counts against a suspicion. What the filters know brings more in one of 1800 (chi-square of two
readings: exp(-15/2)); a tap, of which they know nothing, brings hundreds, and says nothing of sensors."""
_SETTLING = 400


@dataclass(frozen=True, kw_only=True)
class Suspicion:
    """One sensor showing a factor times what is true; no sensor when all are sound."""

    name: str = ""
    factor: float = 1.0

    def __str__(self) -> str:
        """As a sentence has it."""
        if not self.name:
            return "all sensors sound"
        way = " the wrong way round" if self.factor == -1 else f" {abs(self.factor):g} times what is true"
        return f"{self.name} shown{way}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Alarm:
    """When a watch spoke, and of what, run by run.

    Attributes
    ----------
    sample : array of int, shape (lanes,)
        Sample at which it switches the drive off; -1 where it has no reason to.
    what : tuple of Suspicion
        The suspicion then; sound sensors where it kept still.
    odds : array, shape (N, lanes)
        Logarithm of the likelihood of the best suspicion over that of sound sensors.
    """

    sample: NDArray[np.int64]
    what: tuple[Suspicion, ...]
    odds: Array


def watched(
    watch: Watch, rig: Rig, law: Law, *, start: ArrayLike, seconds: float, rest: ArrayLike | None = None
) -> tuple[Trial, Alarm]:
    """Run a law on a rig beside a watch that switches the drive off, one sample after it has spoken.

    The run is made twice: until the watch speaks both are the same, sample for sample.

    Parameters
    ----------
    watch : Watch
    rig : Rig
        As it truly is.
    law : Law
    start, seconds, rest
        As of `trial`.
    """

    def run(off: float) -> Trial:
        return trial(rig, law, at=watch.at, start=start, seconds=seconds, rest=rest, off=off)

    free = run(math.inf)
    readings = np.column_stack([free.record[c.name] for c in rig.plant.coordinates]) - free.rest
    alarm = watch.over(readings, free.u)
    k = int(alarm.sample[0])
    return (free if k < 0 else run((k + 1) * rig.period)), alarm


def sticking(model: Rig) -> float:
    """Command that dry friction of what the drive moves takes, as far as the model knows of it."""
    on = model.plant.inputs[0].on
    names = [n for j in model.plant.joints if j.on == on for n in (j.coulomb, j.stiction) if n]
    return max((float(getattr(model.plant, n)) for n in names), default=0.0) / abs(model.gain)


class Watch:
    """Bank of Kalman filters about an equilibrium, for one loop or many lanes of it, fed sample by sample."""

    def __init__(
        self,
        model: Rig,
        at: str = "inverted",
        *,
        odds: float = ODDS,
        unknown: float = UNKNOWN,
        forgotten: float = FORGOTTEN,
    ) -> None:
        names = [c.name for c in model.plant.coordinates]
        self.model, self.at = model, at
        self.suspicions = (Suspicion(), *(Suspicion(name=n, factor=f) for f in FACTORS for n in names))
        linear = model.linear(at)
        sampled = linear.to_sampled(model.period, (model.delay + model.lag) / model.period)
        self._A, self._B, n = sampled.A.copy(), sampled.B[:, 0].copy(), sampled.A.shape[0]
        scales = np.ones((len(self.suspicions), len(names)))
        for i, s in enumerate(self.suspicions[1:], start=1):
            scales[i, names.index(s.name)] = s.factor
        self._C = scales[:, :, None] * sampled.C
        self._earlier = max(1, round(WITHIN / model.period))
        self._plain = max(0.005 * model.limit, PLAINLY * sticking(model))
        self._bound, self._kept = math.log(odds), math.exp(-model.period / forgotten)
        # in what is shown, all suspicions expect the same disturbance: they are told apart by motions, not by noise
        driven = model.limit * np.abs(linear.B[1::2, 0])
        self._moved = MOVED * driven * WITHIN**2 / 2
        # rounding repeats itself for as many samples as a count takes at the speeds that are evidence: as one sample
        repeated = np.maximum(1.0, model.resolution / (self._moved / WITHIN * model.period))
        noise = repeated * model.resolution**2 / 12
        shaking = unknown * driven / np.abs(scales)
        W = np.array([process_noise(sampled, a) for a in shaking])
        # the start is known to a rad or m, and at rest to a rad/s or m/s; commands on their way are known
        P = np.zeros((len(scales), n, n))
        P[:, range(4), range(4)] = np.repeat(scales, 2, axis=1) ** -2.0
        gains: list[Array] = []
        weights: list[Array] = []
        sizes: list[Array] = []
        for _ in range(_SETTLING):  # covariances depend on no reading
            CP = self._C @ P
            S = CP @ self._C.transpose(0, 2, 1) + np.diag(noise)
            L = np.linalg.solve(S, CP).transpose(0, 2, 1)
            gains.append(np.asarray(L, dtype=np.float64))
            weights.append(np.asarray(np.linalg.inv(S), dtype=np.float64))
            sizes.append(np.asarray(np.linalg.slogdet(S)[1], dtype=np.float64))
            P = self._A @ (P - L @ CP) @ self._A.T + W
            P = 0.5 * (P + P.transpose(0, 2, 1))
        self.gains, self._weights, self._sizes = np.array(gains), np.array(weights), np.array(sizes)
        self._begin(1)

    def _begin(self, lanes: int) -> None:
        """Forget all that was seen."""
        filters, coordinates, states = self._C.shape
        whole, patience = np.int64, PATIENCE / self.model.period
        numbers = np.array([self._plain, self._bound, self._kept, SURPRISE, math.log(NAMED), SAFE, patience])
        self._y, self._u = np.zeros((lanes, coordinates)), np.zeros(lanes)
        self.likelihood: Array = np.zeros((lanes, filters))
        self._odds, self._says, self._best = np.zeros(lanes), np.zeros(lanes, whole), np.zeros(lanes, whole)
        self._sample = Routine(
            TEXT, "see", np.zeros(1, whole), self._y, self._u, self._C, self._A, self._B, self.gains, self._weights,
            self._sizes, self._moved, numbers, np.zeros((lanes, filters, states)),
            np.zeros((self._earlier + 1, lanes, coordinates)), np.zeros((self._earlier, lanes)), self.likelihood,
            np.full(lanes, -1, whole), np.zeros(coordinates + states), self._odds, self._says, self._best,
        )  # fmt: skip

    def see(self, reading: Array | Sequence[Sequence[float]], command: ArrayLike) -> Array:
        """Take one reading, shape (lanes, coordinates), as deviation from rest, and the command put out after it.

        Returns
        -------
        array, shape (lanes,)
            Logarithm of the odds of the best suspicion.
        """
        if len(reading) != len(self._y):
            self._begin(len(reading))
        self._y[:], self._u[:] = reading, command
        self._sample()
        return self._odds.copy()

    def speaks(self) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Whether the drive is to be switched off after the last reading, and for which suspicion, lane by lane."""
        return self._says > 0, self._best.copy()

    def over(self, readings: Array, commands: Array) -> Alarm:
        """Watch whole runs: deviations from rest, shape (N, coordinates[, lanes]), and commands, shape (N[, lanes])."""
        y = readings[:, :, None] if readings.ndim == 2 else readings
        u = commands[:, None] if commands.ndim == 1 else commands
        lanes = y.shape[2]
        sample, which = np.full(lanes, -1, dtype=np.int64), np.zeros(lanes, dtype=np.int64)
        odds = np.empty((len(y), lanes))
        self._begin(lanes)
        for k in range(len(y)):
            odds[k] = self.see(y[k].T, u[k])
            alarm, best = self.speaks()
            now = (sample < 0) & alarm
            sample[now], which[now] = k, best[now]
        return Alarm(sample=sample, what=tuple(self.suspicions[i] for i in which.tolist()), odds=odds)
