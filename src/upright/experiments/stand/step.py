"""A step of a rig, put out blindly, and what a second-order reading of the swing after it gives.

Where a spring brings the driven body back, the command steps and steps back. Where nothing does, as below a pendulum,
the body is put aside instead: pushed and braked alike, and what hangs on it swings meanwhile.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.control.trial import readings, steps_in_period
from upright.errors import NotIdentifiable
from upright.experiments.stand.stand import TestStand
from upright.experiments.stand.strength import OF_TRAVEL, REACH, SHARE, STILL, swinging
from upright.records import Array
from upright.rig import Rig
from upright.signals.free_swing import Decay, decay
from upright.simulation import simulate

SWINGS, LEAST, MOST = 12, 4.0, 20.0
"""Swings that are waited for after each step, by the guesses, and the time for it at least and at most [s]."""
PUSH = 0.25
"""Length of a push, and of the brake after it, in periods of the slowest swing."""
SPRING = 1e-6
"""Least pole of a rig that comes back by itself, beside its largest one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StepSignal:
    """A step, and one back.

    Attributes
    ----------
    samples : (N,) array
        Of the command [command unit], one each `period` [s].
    spans : tuple of (int, int)
        Samples of each swing: the first, and that after the last.
    spring : bool
        Whether a spring brings the driven body back, so that the command itself steps.
    """

    samples: Array
    spans: tuple[tuple[int, int], ...]
    period: float
    spring: bool

    @property
    def seconds(self) -> float:
        """Time of all."""
        return self.samples.size * self.period


def step_signal(stand: TestStand) -> StepSignal:
    """Of a rig as its owner describes it, as strong as reach, travel and drive allow by the guesses."""
    rig, linear = stand.rig, stand.rig.linear(stand.resting)
    poles = linear.poles()
    driven = stand.names.index(rig.plant.inputs[0].on)
    reach = REACH[rig.plant.coordinates[driven].unit] if stand.make is None else stand.make.reach[driven]
    reach = min(reach, OF_TRAVEL * stand.travel)
    slowest = min(map(abs, swinging(poles.tolist())), default=2 * math.pi)
    wait = round(min(max(SWINGS * 2 * math.pi / slowest, LEAST), MOST) / rig.period)
    still = math.ceil(STILL / rig.period)
    spring = _comes_back(poles)
    if spring:
        rest = abs(float((linear.C @ np.linalg.solve(-linear.A, linear.B))[driven, 0]))
        level = min(SHARE * rig.limit, reach / rest)
        samples = np.concatenate([np.zeros(still), np.full(wait, level), np.zeros(wait)])
        spans = ((still, still + wait), (still + wait, still + 2 * wait))
        return StepSignal(samples=samples, spans=spans, period=rig.period, spring=True)
    push = max(2, round(PUSH * 2 * math.pi / slowest / rig.period))
    accelerates = abs(float((linear.C @ linear.A @ linear.B)[driven, 0]))
    level = min(SHARE * rig.limit, _breaks_away(rig) + reach / (accelerates * (push * rig.period) ** 2))
    samples = np.concatenate([np.zeros(still), np.full(push, level), np.full(push, -level), np.zeros(wait)])
    begin = still + 2 * push
    return StepSignal(samples=samples, spans=((begin, begin + wait),), period=rig.period, spring=False)


def _comes_back(poles: NDArray[np.complex128]) -> bool:
    return bool(np.abs(poles).min() > SPRING * np.abs(poles).max())


def _breaks_away(rig: Rig) -> float:
    """Command that dry friction of the driven body takes, by the guesses."""
    values, on = rig.plant.parameters(), rig.plant.inputs[0].on
    return sum(values[j.coulomb] for j in rig.plant.joints if j.on == on and j.coulomb) / abs(rig.gain)


def swing_of(rig: Rig, y: Array) -> Array:
    """What swings after a step (N,), of readings (N, n): the last body, against the driven one on a shaft."""
    coordinates = rig.plant.coordinates
    driven = [c.name for c in coordinates].index(rig.plant.inputs[0].on)
    shaft = driven != len(coordinates) - 1 and "hanging" not in rig.plant.equilibria
    return y[:, -1] - y[:, driven] if shaft else y[:, -1]


def reading(signal: StepSignal, rig: Rig, y: Array) -> Decay | None:
    """What the swing after the last step that is seen gives; None while it has not turned often enough.

    Parameters
    ----------
    y : (N, n) array
        Readings so far [rad or m].
    """
    swing = swing_of(rig, y)
    for begin, end in reversed(signal.spans):
        part = swing[begin:end]
        if part.size < 50:
            continue
        try:
            return decay(
                np.arange(part.size, dtype=np.float64) * signal.period,
                part,
                resolution=float(np.abs(rig.resolution).max()),
            )
        except NotIdentifiable:
            continue
    return None


def predicted_step(signal: StepSignal, rig: Rig, at: str) -> Array:
    """What the encoders of a rig would show (N, n) that is as it is known."""
    x = simulate(
        rig.plant, rig.drive, rig.plant.state(at), signal.samples, rig.period, samples=signal.samples.size,
        substeps=steps_in_period(rig),
    )  # fmt: skip
    return readings(rig, x[:, 0 : 2 * len(rig.per_unit) : 2, 0])


def modes(rig: Rig, at: str) -> dict[str, tuple[float, float]]:
    """Natural frequency [rad/s] and damping ratio of the slowest swing, by what the driven body does.

    It is free, or held where it is as dry friction may: then the swing is that of all else. Only the first where a
    spring brings it back.
    """
    linear = rig.linear(at)
    A, B, row = linear.A, linear.B[:, 0], 2 * [c.name for c in rig.plant.coordinates].index(rig.plant.inputs[0].on) + 1
    # what holds it acts where the drive does, with as much as leaves it no acceleration
    held = A - np.outer(B / B[row], A[row])
    matrices = {"free": A}
    if not _comes_back(linear.poles()):
        matrices["held"] = np.delete(np.delete(held, [row - 1, row], 0), [row - 1, row], 1)
    out: dict[str, tuple[float, float]] = {}
    for name, matrix in matrices.items():
        if swings := swinging(np.linalg.eigvals(matrix).tolist()):
            slowest = min(swings, key=abs)
            out[name] = (abs(slowest), -slowest.real / abs(slowest))
    return out
