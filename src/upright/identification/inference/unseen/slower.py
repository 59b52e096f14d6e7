"""Which dry joints does a run move more slowly than any that was fitted, and what may friction be there?

Of a pendulum let go that is fitted while it swings fast, each swing passes all speeds, and the slow part of one decides
little; the end of its decay is nothing else. Friction that is larger close to rest (Stribeck 1902) is then seen by
nobody, and the end comes out wrong by it. So it is a considered parameter (Schmidt 1966): as uncertain as friction is
from log to log, whatever the fit says of it, while the numbers that were fitted make the best of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.covariance import Optimum
from upright.identification.inference.unseen.reach import FURTHER
from upright.identification.model.bands import SlowFriction
from upright.identification.model.grey_box import GreyBox, Parameter, neutral
from upright.identification.model.runs import Run
from upright.identification.problem.normal_equations import finite, pseudo_inverse
from upright.identification.problem.residuals import Problem
from upright.physics.equations import DryJoint
from upright.signals.smoothing import dominant_period, savitzky_golay, smoothing_width

Array = NDArray[np.float64]

SLOW = 0.1
"""Share of its largest speed: a joint that was fitted at slower swings has shown its friction at all speeds."""

ABOVE = 1.01
"""Stiction beside sliding friction where its effect is computed: at 1 it begins to act, and has half a slope."""


def considered(best: Optimum, shared: Sequence[int]) -> tuple[SlowFriction, ...]:
    """Friction below the slowest swings of the fitted runs, and how it moves the `shared` numbers when it is larger."""
    problem = best.problem
    if any(track.ahead for track in problem.tracks):
        return ()
    value = problem.shared_at(best.x)
    known = {n: replace(p, value=value.get(n, p.value)) for n, p in problem.rig.parameters.items()}
    slow: list[SlowFriction] = []
    for joint, speed in _slowest(problem.rig, [track.run for track in problem.tracks]):
        if not known[joint.coulomb].value > 0:
            continue
        stiction, fades = _beside(replace(problem.rig, parameters=known), joint, speed)
        wider = problem.beside(stiction, fades)
        z = np.append(best.x, wider.unknowns[-1].coordinate(stiction.value))
        wider.settle_steps(z)
        matrix = _matrix(wider, z)
        if not finite(matrix):
            continue
        together = np.eye(z.size)  # stiction goes with sliding friction, and what is considered is how it differs
        together[-1, [u.name == joint.coulomb for u in wider.unknowns]] = 1.0
        matrix, free = together.T @ matrix @ together, np.append(~best.pinned, False)
        follow = np.zeros(z.size)
        follow[free] = -pseudo_inverse(matrix[np.ix_(free, free)]) @ matrix[free, -1]
        natural = np.array([v if u.log else 1.0 for u, v in zip(wider.unknowns, wider.value(z), strict=True)])
        slow.append(
            SlowFriction(coulomb=joint.coulomb, speed=speed, moves=(follow * natural / natural[-1])[list(shared)])
        )
    return tuple(slow)


def _matrix(problem: Problem, x: Array) -> Array:
    """Gauss-Newton matrix (sought, sought) from central differences, infinite where a run runs away."""
    _, prior = problem.prior_rows(x)
    A = prior.T @ prior
    for index in range(len(problem.tracks)):
        rows, sought = problem.rows(index, x, central=True), problem.sought_in(index)
        if rows is None:
            return np.full_like(A, np.inf)
        J = rows[1].reshape(-1, sought.size)
        A[np.ix_(sought, sought)] += J.T @ J
    return A


def slow_friction(
    rig: GreyBox, run: Run, fitted: Sequence[SlowFriction]
) -> Iterator[tuple[SlowFriction, Parameter, Parameter]]:
    """That of each joint which swings slower than was `fitted`, its stiction and the speed at which it fades."""
    of = {slow.coulomb: slow for slow in fitted}
    for joint in _dry(rig) if of else ():
        slow = of.get(joint.coulomb)
        peaks = None if slow is None or not rig.parameters[joint.coulomb].value > 0 else _peaks(rig, joint, run)
        if slow is not None and peaks is not None and peaks.min() * FURTHER < slow.speed:
            yield slow, *_beside(rig, joint, slow.speed)


def _slowest(rig: GreyBox, runs: Sequence[Run]) -> Iterator[tuple[DryJoint, float]]:
    """Peak speed [SI] of the slowest swing of each dry joint, unless that is slow."""
    for joint in _dry(rig):
        peaks = [_peaks(rig, joint, run) for run in runs]
        each = np.concatenate([p for p in peaks if p is not None] or [np.zeros(1)])
        if each.min() > SLOW * each.max():
            yield joint, float(each.min())


def _beside(rig: GreyBox, joint: DryJoint, speed: float) -> tuple[Parameter, Parameter]:
    level, unit = rig.parameters[joint.coulomb], rig.plant.quantity(joint.stribeck_speed).unit
    return (
        Parameter(name=joint.stiction, value=ABOVE * level.value, unit=level.unit, estimate=True),
        Parameter(name=joint.stribeck_speed, value=speed, unit=unit),
    )


def _dry(rig: GreyBox) -> list[DryJoint]:
    """Joints whose dry friction is known or estimated, and the same at all speeds."""

    def idle(name: str) -> bool:
        stated = rig.parameters.get(name)
        return stated is None or (not stated.estimate and stated.value == neutral(rig.plant, name))

    return [
        j for j in rig.plant.derived().joints
        if j.coulomb in rig.parameters and j.stiction and j.stribeck_speed
        and idle(j.stiction) and idle(j.stribeck_speed)
    ]  # fmt: skip


def _peaks(rig: GreyBox, joint: DryJoint, run: Run) -> Array | None:
    """Largest speed of a joint within each period of its motion; None where it is not measured."""
    share = {c.name: d for c, d in zip(rig.plant.coordinates, joint.direction, strict=True) if d}
    if not share or not set(share) <= set(run.measured):
        return None
    y: Array = sum((d * run.y[:, run.measured.index(c)] for c, d in share.items()), np.zeros(run.t.size))
    resolution = sum(abs(d) * run.quanta[run.measured.index(c)] for c, d in share.items())
    period = dominant_period(y, run.period)
    speed = savitzky_golay(y, run.period, smoothing_width(y, run.period, period, resolution), derivatives=1).v
    each = max(1, round(period / run.period))
    whole = max(1, speed.size // each)
    return np.abs(speed[: whole * each]).reshape(whole, -1).max(axis=1)
