"""Loops in which nothing is broken: which interlocks that know a model would have stopped them all the same?

Rigs of both makes, drawn and non-ideal (more friction close to rest, ripple of the torque, a frame out of level, play
and encoders off centre), are held upright by a law for the rig as designed, for 4 s each: at rest inside dry friction,
tapped, pushed by a finger for up to 0.2 s, and led by a reference.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.hazards.story import POLES
from upright.control.sensors import Watch
from upright.experiments.nonideal import nonideal
from upright.gains import feedback, filtered, place
from upright.laws import Law
from upright.records import Array
from upright.rig import Rig
from upright.rig.makes import make_rig
from upright.rigs import Board, Limits, TwinPort
from upright.rigs.driven import DrivenScale, StillDrive
from upright.rigs.supervisor import Duty, Supervisor

MAKES = ("furuta", "linear")
SEEDS, QUICK = range(1, 31), range(1, 2)
SECONDS = 4.0
FREE = Limits(travel=(math.inf,) * 2, speed=(math.inf,) * 2, start=(math.inf,) * 2, command=5.0, saturation=1e9)
FAR = {"furuta": 0.4, "linear": 0.05}
"""Sizes of references [rad, m]."""
SLOWER = {"furuta": 1.0, "linear": 0.1}
"""Speeds and accelerations of what drives the body, beside those of the arm."""


@dataclass(frozen=True, kw_only=True)
class Disturbed:
    """What happens to a run: where the pendulum begins [rad], what is pushed when, and where the body is to be."""

    tilt: float
    push: Callable[[float], tuple[float, float]] = lambda t: (0.0, 0.0)
    reference: Callable[[float], float] = lambda t: 0.0


def at_rest(_make: str, rng: np.random.Generator, _period: float) -> Disturbed:
    return Disturbed(tilt=rng.uniform(-0.01, 0.01))


def tapped(_make: str, rng: np.random.Generator, period: float) -> Disturbed:
    """Three taps of up to 1.5 rad/s."""
    taps = dict(zip((round(t / period) for t in (1.0, 2.0, 3.0)), rng.uniform(-1.5, 1.5, 3).tolist(), strict=True))
    return Disturbed(tilt=0.05, push=lambda t: (0.0, taps.get(round(t / period), 0.0)))


def pushed(make: str, rng: np.random.Generator, period: float) -> Disturbed:
    """By a finger, up to 12 rad/s^2 at the pendulum and 3 at what carries it."""
    body, rod = SLOWER[make] * rng.uniform(-3, 3) * period, rng.uniform(-12, 12) * period
    until = 1.0 + rng.uniform(0.03, 0.2)
    return Disturbed(tilt=0.02, push=lambda t: (body, rod) if 1.0 <= t < until else (0.0, 0.0))


def led(make: str, rng: np.random.Generator, _period: float) -> Disturbed:
    """By a sine, steps or a ramp."""
    far, f = FAR[make], rng.uniform(0.2, 0.8)
    signals = (
        lambda t: far * math.sin(math.tau * f * t),
        lambda t: far * (int(2 * t * f) % 2),
        lambda t: far * t / 2,
    )
    return Disturbed(tilt=0.02, reference=signals[rng.integers(3)])


KINDS = {"at rest in dry friction": at_rest, "tapped": tapped, "pushed by a finger": pushed, "led by a reference": led}


@dataclass(frozen=True, kw_only=True)
class Left:
    """How many runs of a kind there were, and how many of them each interlock would have stopped."""

    make: str
    kind: str
    runs: int
    filters: int
    still: int
    scale: int


def _law(known: Rig) -> Law:
    model = known.linear("inverted")
    sampled = model.to_sampled(known.period, known.delay / known.period)
    K = place(model.A, model.B, POLES).K
    return replace(feedback(filtered(sampled, 0.5), K, k_pf=K[0, 0]), period=known.period)


def all_of(make: str, kind: str, seeds: range) -> Left:
    """Every seed of a kind."""
    known = make_rig(make)
    law = _law(known)
    runs = [ran(known, law, make, kind, seed) for seed in seeds]
    away, commands = np.stack([a for a, _, _, _ in runs], axis=-1), np.column_stack([u for _, u, _, _ in runs])
    return Left(
        make=known.name, kind=kind, runs=len(runs),
        filters=int(np.sum(Watch(known).over(away, commands).sample >= 0)),
        still=sum(still for _, _, still, _ in runs), scale=sum(scale for _, _, _, scale in runs),
    )  # fmt: skip


def ran(known: Rig, law: Law, make: str, kind: str, seed: int) -> tuple[Array, Array, bool, bool]:
    """Deviations and commands of a run, and whether the body was said to show no count, or to lie about its motion."""
    disturbed = KINDS[kind](make, np.random.default_rng([seed, 83]), known.period)
    port = TwinPort(nonideal(make_rig(make, seed), seed))
    beside = Supervisor(Board(port), Duty(limits=FREE, model=known, at="inverted", zero="hanging", watch=False,
                                          lean=math.radians(30), near=math.radians(10)))  # fmt: skip
    beside.prepare()
    port.hold("inverted", [0.0, 0.0, disturbed.tilt, 0.0])
    beside.aim(law)
    beside.start()
    port.let_go()
    tick, still, scale = beside.rig.exchange(0.0), StillDrive(known, "inverted"), DrivenScale(known, "inverted")
    begun, said, away, commands = tick.time, [False, False], list[list[float]](), list[float]()
    while (t := tick.time - begun) < SECONDS:
        commands.append(beside.step(tick, disturbed.reference(t)))
        away.append([q - at for q, at in zip(beside.readings(tick), beside.target, strict=True)])
        said[0] |= still.sees(away[-1][0], away[-1], commands[-1])
        said[1] |= bool(scale.sees(away[-1], commands[-1]))
        port.push(disturbed.push(t))
        tick = beside.rig.exchange(commands[-1])
    return np.array(away), np.array(commands), said[0], said[1]
