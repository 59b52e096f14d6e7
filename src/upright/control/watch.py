"""What is wrong with a loop that holds a pendulum upright: an encoder, the drive, or nothing but a hand and friction?

Three witnesses (`control.witnesses`) say how what carries the pendulum is accelerated: X is its own encoder, Y the
pendulum on it, Z the command. A hand at the body parts Z from the others and one at the pendulum parts Y, at any moment
and as much as it likes: both are disturbances with heavy tails (Student's t), and friction as far as it is known, times
`HELD_BY`, costs nothing. A suspicion, such as "theta shows half of what is true", scales one of the three for ever. The
logarithms of the likelihood ratios add up and fade (Page's test with a memory; Lorden, Ann. Math. Stat. 42 (1971) 1897:
with independent samples of the law assumed a bound of b is passed by chance once in e^b of them). Hands and taps are
not that law, so the bounds are those of the largest of many sound runs (Gumbel), by kind of suspicion: see `BOUNDS`.
What no hand explains does not wait for that: see `control.gross`.

What is slow moves none of that: a zero that drifts makes the pendulum lean, for what it shows, without what carries it
being accelerated. ``(Y - X)/kappa``, with kappa the stiffness of theta in Y - X, is that lean; it is judged by a
cumulative sum above what a frame out of level and encoders off centre explain. A body's own encoder whose zero drifts
steadily is a frame that moves steadily: but for friction no law of motion tells the two apart, and only an index mark
does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.control.gross_faults import GrossFaults
from upright.control.trial import Trial, trial
from upright.control.witnesses import Witnesses
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
    ("body", 0.0): 8.0, ("body", -1.0): 13.0, ("body", 0.25): 7.5, ("body", 0.5): 6.0, ("body", 2.0): 20.0,
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
        body = names.index(model.plant.inputs[0].on)
        other = 1 - body
        kinds = [("body", names[body], f) for f in FACTORS] + [("other", names[other], f) for f in FACTORS]
        kinds += [("drive", "the drive", f) for f in STRENGTHS]
        slips = Suspicion(name=names[other], factor=1.0)
        self.suspicions = (Suspicion(), *(Suspicion(name=n, factor=f) for _, n, f in kinds), slips)
        self._factor = {kind: np.array([[f if k == kind else 1.0] for k, _, f in kinds]) for kind in
                        ("body", "other", "drive")}  # fmt: skip
        self._bounds = np.array([[BOUNDS[kind, f]] for kind, _, f in kinds])
        self._witnesses = Witnesses(model, at, CORNER)
        rho, rows = self._witnesses.rho, self._witnesses.rows
        self._kappa = rows[0][1] - rho * rows[1][1]
        self._look = max(1, round(_EVERY / model.period))
        step = self._look * model.period
        self._slow, self._memory = SLOWEST * step, math.exp(-step / MEMORY)
        self._weight, self._step = CORNER * step / 2, step  # independent samples in a look
        self._friction = held_by(model, at)
        self.gross = GrossFaults(model, at, self._friction)
        listed = [(s.name, s.factor) for s in self.suspicions]
        self._gross = np.array([listed.index(kind) for kind in self.gross.kinds])
        rounding = 0.3 * CORNER**2 * model.resolution
        level = abs(self._kappa) * LEVEL
        self._of_body = level + float(rounding[body])
        self._of_other = self._of_body + abs(rho) * float(rounding[other])
        self._begin(1)

    def _begin(self, lanes: int) -> None:
        """Forget all that was seen."""
        self._witnesses.begin(lanes)
        self.gross.begin(lanes)
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
        self.gross.see(y, command)
        self._witnesses.see(y, command)
        if self._witnesses.samples % self._look == 0:
            self._weigh(self._witnesses.parts(), np.abs(self._witnesses.lean))
        return self.odds.max(axis=0)

    def _weigh(self, parts: Array, lean: Array) -> None:
        self._lean((parts[2] + parts[3] - parts[0] - parts[1]) / self._kappa)
        self._mean += self._slow * (parts - self._mean)
        costs = self._costs(parts - self._mean)
        gained = costs[0] - costs[1:]
        gained[0], gained[1] = self._dead(parts), self._turned(parts)
        self.odds *= self._memory
        self.odds += self._weight * gained
        self.odds = np.maximum(self.odds, 0.0)  # a part that was sound a moment ago may be broken now
        ranked, k = np.sort(self.odds, axis=0), self._witnesses.samples
        beyond = (self.odds > self._bounds).any(axis=0)
        self._since = np.where(beyond, np.where(self._since < 0, k, self._since), -1)
        waited = (k - self._since) * self.model.period
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

    def _turned(self, parts: Array) -> Array:
        """Logarithm of the odds of this look, shape (lanes,), that the body's encoder shows the wrong way round.

        Slow motions count too, and friction is an excuse only for what it brakes: it drives nothing on.
        """
        of_body, by_other, of_other, by_body, Z = parts
        X, Y = of_body + by_other, of_other + by_body
        largest = RELATIVE * np.abs(np.array([X, Y, Z])).max(axis=0)
        near, far = self._of_body + 0.25 * self._friction + largest, self._of_other + largest
        speed = self._witnesses.speed[0]
        unsure = np.abs(speed) < (2 * np.abs(X) + self._of_body) / CORNER  # it turned a moment ago

        def cost(way: float) -> Array:
            x, y = way * of_body + by_other, of_other + way * by_body
            brakes = unsure | ((x - Z) * way * speed < 0)
            free = np.maximum(0.0, np.abs(x - Z) - np.where(brakes, self._friction, 0.0))
            return _surprise(free / near) + _surprise((y - x) / far)

        return cost(1.0) - cost(-1.0)

    def speaks(self) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Whether the drive is to be switched off after the last reading, and for which suspicion, lane by lane."""
        grossly, which = self.gross.speaks()
        return self._says | grossly, np.where(grossly, self._gross[which], self._best)

    def likely(self, lane: int = 0) -> tuple[Suspicion, ...]:
        """What may be wrong, likeliest first, as far as one is not plainly less likely than the next; none where all
        is as likely to be sound.
        """
        grossly, which = self.gross.speaks()
        if grossly[lane]:
            return (self.suspicions[self._gross[which[lane]]],)
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
