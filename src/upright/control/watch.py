"""What is wrong with a loop that holds a pendulum upright: an encoder, the drive, or nothing but a hand and friction?

Three witnesses say how what carries the pendulum is accelerated. With the model's rows about the equilibrium,
``psi'' = a_11 psi' + a_12 theta + a_13 theta' + b_1 u + d`` and ``theta'' = ... + (b_1 u + d)/rho + h``, where d is
friction or a hand at the body and h a hand at the pendulum,

    X = psi'' - a_11 psi' - ...          = b_1 u + d            what its own encoder shows
    Y = rho (theta'' - a_31 psi' - ...)  = b_1 u + d + rho h    what the pendulum on it shows
    Z = b_1 u                                                   what the command says,

each behind the same low-pass ``(w/(s + w))^2``, so that nothing is differentiated. A hand at the body parts Z from the
others and one at the pendulum parts Y, at any moment and as much as it likes: both are disturbances with heavy tails
(Student's t), and friction as far as it is known, times `HELD_BY`, costs nothing. A suspicion, such as "theta shows
half of what is true", scales one of the three for ever. The logarithms of the likelihood ratios add up and fade (Page's
test with a memory; Lorden, Ann. Math. Stat. 42 (1971) 1897: with independent samples of the law assumed a bound of b is
passed by chance once in e^b of them). Hands and taps are not that law, so the bounds are those of the largest of many
sound runs (Gumbel), by kind of suspicion: see `BOUNDS`.

What is slow moves none of that: a zero that drifts makes the pendulum lean, for what it shows, without what carries it
being accelerated. ``(Y - X)/kappa``, with kappa the stiffness of theta in Y - X, is that lean; it is judged by a
cumulative sum above what a frame out of level and encoders off centre explain. A body's own encoder whose zero drifts
steadily is a frame that moves steadily: but for friction no law of motion tells the two apart, and only an index mark
does.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.control.trial import Trial, trial
from upright.laws import Law
from upright.records import Array
from upright.rig import Rig

FACTORS = (0.0, -1.0, 0.25, 0.5, 2.0, 4.0)
"""What a suspected encoder may show over what is true: dead, swapped channels, quadrature counted otherwise."""
STRENGTHS = (0.25, 0.5)
"""What a suspected drive may give over what is asked of it: a supply that is down, a phase that is off."""
CORNER, SLOWEST, MEMORY = 60.0, 4.0, 0.5
"""Corner of the low-pass [rad/s]; motions slower than the second are not looked at for factors, since a hand that
leans on something is slow; and how long evidence is remembered [s]."""
TAIL, RELATIVE = 2.0, 0.1
"""Degrees of freedom of the disturbances, and the size of what the model has wrong, over the largest witness."""
LEVEL = math.radians(0.2)
"""Lean that nobody asks about [rad]."""
HELD_BY, DRY = 2.0, 0.003
"""A body is held at most by so many times the dry friction that the model knows of; where it knows of none, by such a
share of the largest command."""
BOUNDS = {
    ("body", 0.0): 8.0, ("body", -1.0): 6.0, ("body", 0.25): 7.5, ("body", 0.5): 6.0, ("body", 2.0): 20.0,
    ("body", 4.0): 20.0, ("other", 0.0): 12.0, ("other", -1.0): 7.0, ("other", 0.25): 19.0, ("other", 0.5): 19.0,
    ("other", 2.0): 5.5, ("other", 4.0): 7.0, ("drive", 0.25): 4.6, ("drive", 0.5): 4.6,
}  # fmt: skip
"""Logarithms of the odds at which a suspicion is believed: those that a Gumbel distribution of the largest in 50 s,
fitted to 0.8 hours of each of two rig models, non-ideal, tapped and pushed, passes once in some 300 hours; at least ln
100. A hand at the pendulum that a law answers looks as if theta showed too little, or the body too much: hence the four
high ones. `python -m benchmarks false_stops` is 10 hours of other rigs."""
LEADS = 4.0
"""Logarithm of the odds by which the best suspicion leads the next when it is named."""
PATIENCE = 0.3
"""How long it may take to find out which [s]."""
SAFE = math.radians(6)
"""Lean [rad] beyond which nobody waits to find out."""
OUT_OF_TRUE, DRIFTED = math.radians(1.4), math.radians(1.8)
"""Lean without acceleration that a sound rig may show [rad]: a frame 0.3 degrees out of level, seen from both sides,
encoders off centre and a finger of 0.6 rad/s^2; and the sum above it, at most as much again, that is believed [rad s].
"""
_EVERY = 5e-3  # s between looks at the evidence


@dataclass(frozen=True, kw_only=True)
class Suspicion:
    """One sensor showing a factor times what is true, or a drive giving it; a factor of 1 is a zero that moves.

    No name when all is sound.
    """

    name: str = ""
    factor: float = 1.0

    def __str__(self) -> str:
        """As a sentence has it."""
        if not self.name:
            return "all sensors sound"
        if self.name == "the drive":
            return f"the drive giving {self.factor:g} times what is asked"
        if self.factor == 1.0:
            return f"the zero of {self.name} moving"
        way = {-1.0: "the wrong way round", 0.0: "not at all"}
        return f"{self.name} shown {way.get(self.factor) or f'{abs(self.factor):g} times what is true'}"

    @property
    def advice(self) -> str:
        """What to look at, as a sentence."""
        if self.name == "the drive":
            return "Check its supply, its cable and its current limit"
        if self.factor == 1.0:
            return "Check that its encoder's coupling does not slip and its cable does not pull"
        return "Check that encoder's wiring and counts (upright rig doctor)"


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
    rig : Rig
        As it truly is.
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


def held_by(model: Rig, at: str) -> float:
    """Acceleration of the driven body that dry friction can take at most."""
    row = 2 * [c.name for c in model.plant.coordinates].index(model.plant.inputs[0].on) + 1
    drive = abs(float(model.linear(at).B[row, 0]))
    return drive * (HELD_BY * sticking(model) or DRY * model.limit)


class Watch:
    """The witnesses of one loop about an equilibrium, or of many lanes of it, fed sample by sample."""

    def __init__(self, model: Rig, at: str = "inverted") -> None:
        names = [c.name for c in model.plant.coordinates]
        self.model, self.at = model, at
        self._body = names.index(model.plant.inputs[0].on)
        self._other = 1 - self._body
        kinds = [("body", names[self._body], f) for f in FACTORS] + [("other", names[self._other], f) for f in FACTORS]
        kinds += [("drive", "the drive", f) for f in STRENGTHS]
        slips = Suspicion(name=names[self._other], factor=1.0)
        self.suspicions = (Suspicion(), *(Suspicion(name=n, factor=f) for _, n, f in kinds), slips)
        self._factor = {kind: np.array([[f if k == kind else 1.0] for k, _, f in kinds]) for kind in
                        ("body", "other", "drive")}  # fmt: skip
        self._bounds = np.array([[BOUNDS[kind, f]] for kind, _, f in kinds])
        A, B = model.linear(at).A, model.linear(at).B[:, 0]
        body, other = 2 * self._body + 1, 2 * self._other + 1
        self._drive, self._rho = float(B[body]), float(B[body] / B[other])
        # of the body's row and the other's: by speed of the body, by place and speed of the other
        self._rows = [[float(A[row, k]) for k in (body, other - 1, other)] for row in (body, other)]
        self._kappa = float(A[body, other - 1] - self._rho * A[other, other - 1])
        T = model.period
        self._late = 1 + round((model.delay + model.lag) / T)
        self._pass, self._look = CORNER * T, max(1, round(_EVERY / T))
        step = self._look * T
        self._slow, self._memory = SLOWEST * step, math.exp(-step / MEMORY)
        self._weight, self._step = CORNER * step / 2, step  # independent samples in a look
        self._friction = held_by(model, at)
        rounding = 0.3 * CORNER**2 * model.resolution
        level = abs(self._kappa) * LEVEL
        self._of_body = level + float(rounding[self._body])
        self._of_other = self._of_body + abs(self._rho) * float(rounding[self._other])
        self._begin(1)

    def _begin(self, lanes: int) -> None:
        """Forget all that was seen."""
        self._k = 0
        self._passed = np.zeros((2, 3, lanes))
        self._first: Array = np.zeros((3, lanes))
        self._commands: deque[Array] = deque([np.zeros(lanes)] * self._late, maxlen=self._late)
        self._mean = np.zeros((5, lanes))
        self.odds: Array = np.zeros((len(self._bounds), lanes))
        self._drift = np.zeros((2, lanes))
        self._since = np.full(lanes, -1)
        self._says, self._best = np.zeros(lanes, dtype=bool), np.zeros(lanes, dtype=np.int64)

    def see(self, reading: Array | Sequence[Sequence[float]], command: ArrayLike) -> Array:
        """Take one reading, shape (lanes, coordinates), as deviation from rest, and the command put out after it.

        Returns
        -------
        array, shape (lanes,)
            Logarithm of the odds of the best suspicion.
        """
        y = np.asarray(reading, dtype=np.float64)
        if len(y) != self.odds.shape[1]:
            self._begin(len(y))
        if self._k == 0:
            self._first[:2] = y[:, [self._body, self._other]].T
        now = np.array([y[:, self._body], y[:, self._other], self._commands[0]]) - self._first
        self._commands.append(np.broadcast_to(np.asarray(command, dtype=np.float64), len(y)))
        once, twice = self._passed
        once += self._pass * (now - once)
        twice += self._pass * (once - twice)
        self._k += 1
        if self._k % self._look == 0:
            self._weigh(now, once, twice)
        return self.odds.max(axis=0)

    def _weigh(self, now: Array, once: Array, twice: Array) -> None:
        acceleration = CORNER**2 * (now - 2 * once + twice)
        speed, place = CORNER * (once - twice), twice + self._first
        (a, b, c), (d, e, f) = self._rows
        parts = np.array([
            acceleration[0] - a * speed[0], -b * place[1] - c * speed[1],
            self._rho * (acceleration[1] - e * place[1] - f * speed[1]), -self._rho * d * speed[0],
            self._drive * twice[2],
        ])  # fmt: skip
        self._lean((parts[2] + parts[3] - parts[0] - parts[1]) / self._kappa)
        self._mean += self._slow * (parts - self._mean)
        costs = self._costs(parts - self._mean)
        gained = costs[0] - costs[1:]
        gained[0] = self._dead(parts)
        self.odds *= self._memory
        self.odds += self._weight * gained
        self.odds[0] = np.maximum(0.0, self.odds[0])  # of a counter that moved a moment ago nothing is held against it
        lean = np.abs(place[1])
        ranked = np.sort(self.odds, axis=0)
        beyond = (self.odds > self._bounds).any(axis=0)
        self._since = np.where(beyond, np.where(self._since < 0, self._k, self._since), -1)
        waited = (self._k - self._since) * self.model.period
        sure = (ranked[-1] - ranked[-2] > LEADS) | (lean > SAFE) | (waited >= PATIENCE)
        drifts = (self._drift > DRIFTED).any(axis=0)
        self._says = beyond & sure | drifts
        self._best = np.where(beyond, 1 + self.odds.argmax(axis=0), len(self.suspicions) - 1)

    def _lean(self, lean: Array) -> None:
        """Page's sums of a lean to either side."""
        excess = np.minimum(np.array([lean, -lean]), 2 * OUT_OF_TRUE) - OUT_OF_TRUE
        self._drift = np.maximum(0.0, self._drift + self._step * excess)

    def _costs(self, parts: Array) -> Array:
        """Minus logarithms of likelihoods of this look, shape (1 + suspicions, lanes); the first of sound sensors."""
        of_body, by_other, of_other, by_body, drive = parts
        X, Y, Z = of_body + by_other, of_other + by_body, drive
        largest = RELATIVE * np.abs(np.array([X, Y, Z])).max(axis=0)
        near, far = self._of_body + 0.25 * self._friction + largest, self._of_other + largest

        def at_body(force: Array, share: Array | float = 1.0) -> Array:
            return _surprise(np.maximum(0.0, np.abs(force) - share * self._friction) / near)

        def at_other(force: Array) -> Array:
            return _surprise(force / far)

        body, other, strength = self._factor["body"], self._factor["other"], self._factor["drive"]
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = of_body / body + by_other / other, by_body / body + of_other / other
            shown = np.minimum(1.0, np.abs(body * other))
            costs = at_body(shown * (x - strength * Z), shown) + at_other(shown * (y - x))
        # what shows nothing says nothing, but for what it shows all the same
        costs = np.where(other == 0.0, at_body(of_body - Z) + _surprise(of_other / self._of_other), costs)
        return np.vstack([at_body(X - Z) + at_other(Y - X), costs])

    def _dead(self, parts: Array) -> Array:
        """Logarithm of the odds of this look, shape (lanes,), that the body's encoder is dead.

        Slow motions count too, for without it a body drifts: where pendulum and command agree that it is accelerated,
        and it shows nothing. A hand that leans on the pendulum parts these two, and friction is no excuse for either.
        """
        of_body, by_other, of_other, by_body, Z = parts
        X, Y = of_body + by_other, of_other + by_body
        far = self._of_other + RELATIVE * np.abs(np.array([X, Y, Z])).max(axis=0)
        free = np.maximum(0.0, np.abs(X - Z) - self._friction) / (far + 0.25 * self._friction)
        sound = _surprise(free) + _surprise((Y - X) / far)
        return sound - _surprise((Y - Z) / far) - _surprise(of_body / self._of_body)

    def speaks(self) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Whether the drive is to be switched off after the last reading, and for which suspicion, lane by lane."""
        return self._says, self._best

    def weak(self, lane: int = 0) -> bool:
        """Whether a body that shows nothing is likelier driven by too little than read by a dead encoder."""
        drive = len(self.odds) - len(STRENGTHS)
        return bool(self.odds[drive:, lane].max() > self.odds[0, lane] + LEADS)

    def likely(self, lane: int = 0) -> tuple[Suspicion, ...]:
        """What may be wrong, likeliest first, as far as one is not plainly less likely than the next; none where all
        is as likely to be sound.
        """
        if self._says[lane] and self._best[lane] == len(self.suspicions) - 1:
            return (self.suspicions[-1],)
        odds = self.odds[:, lane]
        order = np.argsort(-odds)
        best = [int(i) for i in order[:3] if odds[i] > max(math.log(10), odds[order[0]] - LEADS / 2)]
        return tuple(self.suspicions[1 + i] for i in best)

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
            alarm_raised, best = self.speaks()
            now = (sample < 0) & alarm_raised
            sample[now], which[now] = k, best[now]
        return Alarm(sample=sample, what=tuple(self.suspicions[i] for i in which.tolist()), odds=odds)


def _surprise(deviation: Array) -> Array:
    """Minus the logarithm of Student's density of a deviation in its own size, over that of none."""
    return (TAIL + 1) / 2 * np.log1p(deviation**2 / TAIL)
