"""Loops in which nothing is broken but a person plays with the rig: what would have stopped them, and when.

Rigs of both makes, drawn and worn (more friction close to rest, ripple of the torque, a frame out of level, play and
encoders off centre, a delay of its own), are held upright by a law for the rig as designed. Every 3.3 s in the mean
somebody taps the pendulum or what carries it (0.3 to 1.5 rad/s, a tenth of it in m/s for a cart), pushes it with a
finger for up to 0.2 s (12 rad/s^2 at the pendulum, 3 at the body), leans on the pendulum for up to 2 s (0.6 rad/s^2) or
pushes the body for up to 2 s (2 rad/s^2); half of them are led by a slow reference meanwhile.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks.hazards.parallel import Twins
from benchmarks.hazards.story import POLES
from upright.control.dead_encoder import StillDrive, StillPendulum
from upright.control.watch import Watch
from upright.experiments.nonideal import nonideal
from upright.gains import feedback, filtered, place
from upright.laws import Law
from upright.rig import Rig
from upright.rig.makes import make_rig

MAKES = ("furuta", "linear")
FAR = {"furuta": 0.4, "linear": 0.05}
"""Sizes of references [rad, m]."""
SLOWER = {"furuta": 1.0, "linear": 0.1}
"""Speeds and accelerations of what drives the body, beside those of the arm."""
FALLEN = 0.5
"""Lean from which a pendulum is called fallen [rad]."""
Breaking = Callable[[Twins, float], None]
Push = tuple[float, float, float, float]
"""Moment and length [s], accelerations of body and pendulum."""


def played_with(make: str, rng: np.random.Generator, seconds: float, period: float) -> list[Push]:
    """What a person does to a rig."""
    slow, out, t = SLOWER[make], list[Push](), 1.0
    while True:
        t += rng.exponential(3.0) + 0.3
        if t > seconds - 1.0:
            return out
        sign = rng.choice([-1, 1])
        kind = rng.integers(6)
        if kind == 0:
            out.append((t, period, 0.0, sign * rng.uniform(0.3, 1.5) / period))
        elif kind == 1:
            out.append((t, period, slow * sign * rng.uniform(0.3, 1.5) / period, 0.0))
        elif kind == 2:
            out.append((t, rng.uniform(0.03, 0.2), slow * rng.uniform(-3, 3), rng.uniform(-12, 12)))
        elif kind == 3:
            out.append((t, rng.uniform(0.3, 2.0), 0.0, sign * rng.uniform(0.05, 0.6)))
        elif kind == 4:
            out.append((t, rng.uniform(0.2, 2.0), slow * sign * rng.uniform(0.2, 2), 0.0))
        else:
            out.append((t, rng.uniform(0.5, 3.0), slow * sign * rng.uniform(0.05, 0.5), sign * rng.uniform(0, 0.2)))


def law_for(known: Rig) -> Law:
    """Holds the rig as designed, and follows a reference."""
    model = known.linear("inverted")
    K = place(model.A, model.B, POLES).K
    return feedback(filtered(model.to_sampled(known.period, known.delay / known.period), 0.5), K, k_pf=K[0, 0])


@dataclass(eq=False)
class Lane:
    """What became of one loop: when it was stopped and why, or fell [s], and how far its body was from the middle."""

    stopped: float = math.inf
    why: str = ""
    fell: float = math.inf
    far: float = 0.0


@dataclass(eq=False)
class Played:
    """Loops of a make side by side, each with its watch, until it is stopped, falls, or the time is over."""

    make: str
    seeds: Sequence[int]
    seconds: float
    breaking: Breaking | None = None
    lanes: list[Lane] = field(init=False)

    def run(self) -> list[Lane]:
        """All of them."""
        known = make_rig(self.make)
        T, n = known.period, len(self.seeds)
        twins = Twins([nonideal(make_rig(self.make, s), s) for s in self.seeds], law_for(known), known.limit)
        rngs = [np.random.default_rng([s, 91]) for s in self.seeds]
        pushes = [played_with(self.make, rng, self.seconds, T) for rng in rngs]
        turns = np.array([rng.uniform(0.01, 0.1) for rng in rngs])
        far = np.array([FAR[self.make] * rng.uniform(0, 1) * (rng.random() < 0.5) for rng in rngs])
        twins.lift([rng.uniform(-0.02, 0.02) for rng in rngs])
        watch = Watch(known)
        stills = [(StillDrive(known, "inverted"), StillPendulum(known, "inverted")) for _ in rngs]
        self.lanes = [Lane() for _ in rngs]
        for k in range(round(self.seconds / T)):
            if self.breaking is not None:
                self.breaking(twins, k * T)
            twins.references[:] = far * np.sin(math.tau * turns * k * T)
            command = twins.command()
            watch.see(twins.away.T, command)
            self._note(k * T, twins, watch, stills, command)
            push = np.zeros((2, n))
            for i, row in enumerate(pushes):
                while row and k * T >= row[0][0] + row[0][1] - T / 2:
                    row.pop(0)
                if row and k * T >= row[0][0]:
                    push[:, i] = row[0][2] * T, row[0][3] * T
            twins.advance(command, push)
        return self.lanes

    def _note(self, t: float, twins: Twins, watch: Watch, stills: list[tuple[StillDrive, StillPendulum]],
              command: np.ndarray) -> None:  # fmt: skip
        says, best = watch.speaks()
        away, commands = twins.away.T.tolist(), command.tolist()
        place = twins.away_truly()
        for i, lane in enumerate(self.lanes):
            if math.isfinite(lane.stopped) or math.isfinite(lane.fell):
                continue
            drive, pendulum = stills[i]
            if drive.sees(away[i][0], away[i], commands[i]):
                dead = "an encoder that shows not a single count"
                lane.stopped, lane.why = t, "the drive, which moves nothing" if drive.rests else dead
            elif pendulum.sees(away[i]):
                lane.stopped, lane.why = t, "an encoder that shows not a single count"
            elif says[i]:
                lane.stopped, lane.why = t, str(watch.suspicions[int(best[i])])
            elif abs(place[1, i]) > FALLEN:
                lane.fell = t
                likely = watch.likely(i)
                lane.why = str(likely[0]) if likely else ""
            lane.far = max(lane.far, abs(float(place[0, i])))
