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

TRIED = 4
"""Perturbations of stiction that are tried at most, until one moves the outputs by about what others do."""

LARGER = 30.0
"""Times the usual perturbation, as slopes of second order allow: numbers that trade against each other magnify rounding
errors of a forward difference."""

ABOVE = 1.01
"""Stiction beside sliding friction where its effect is computed from both sides: at 1 it begins to act."""


def considered(best: Optimum, shared: Sequence[int]) -> tuple[SlowFriction, ...]:
    """Friction below the slowest swings of the fitted runs, and how it moves the `shared` numbers when it is larger.

    In the model that was fitted stiction goes with sliding friction, and the matrix at the optimum is known. It is
    compared with what a little more stiction changes in the same motion: in another one all slopes are others.
    """
    problem, n = best.problem, best.x.size
    if any(track.ahead for track in problem.tracks):
        return ()
    value = problem.shared_at(best.x)
    known = {name: replace(p, value=value.get(name, p.value)) for name, p in problem.rig.parameters.items()}
    joints = [
        (joint, speed)
        for joint, speed in _slowest(problem.rig, [track.run for track in problem.tracks])
        if known[joint.coulomb].value > 0
    ]
    if not joints:
        return ()
    wider = problem
    for joint, speed in joints:
        wider = wider.beside(*_beside(replace(problem.rig, parameters=known), joint, speed, above=1.0))
    numbers = wider.unknowns[n:]
    z = np.append(best.x, [u.coordinate(u.value) for u in numbers])
    together = _products(best, wider, z)
    if together is None:
        return ()
    free = ~best.pinned
    follow = np.zeros((n, len(numbers)))
    follow[free] = -pseudo_inverse(best.matrix[np.ix_(free, free)]) @ together[free]
    natural = np.array([v if u.log else 1.0 for u, v in zip(wider.unknowns, wider.value(z), strict=True)])
    moves = (follow * natural[:n, None] / natural[n:])[list(shared)]
    return tuple(
        SlowFriction(coulomb=joint.coulomb, speed=speed, moves=moves[:, k]) for k, (joint, speed) in enumerate(joints)
    )


def _products(best: Optimum, wider: Problem, z: Array) -> Array | None:
    """``J'J_k`` (n, more) of the numbers fitted and those that a problem has more; None where a run runs away.

    These act beyond `z` alone, so slopes there are ``2 J(h) - J(2 h)``, of second order.
    """
    more = np.arange(best.x.size, z.size)
    steps, near = wider.steps, _forward(best, wider, z, more)
    for _ in range(TRIED):
        if near is None or wider.resize_steps(more, near[1] / LARGER**2):
            break
        steps, near = wider.steps, _forward(best, wider, z, more)
    wider.steps = np.asarray(2 * steps)
    far = _forward(best, wider, z, more)
    return None if near is None or far is None else 2 * near[0] - far[0]


def _forward(best: Optimum, wider: Problem, z: Array, more: NDArray[np.int64]) -> tuple[Array, Array] | None:
    """``J'J_k`` (n, more) by forward differences, and the mean square that a sample's outputs change by per unit."""
    together, squares, samples = np.zeros((best.x.size, more.size)), np.zeros(more.size), 0
    for index, (_, J) in enumerate(best.rows):
        rows = wider.rows(index, z, sought=more)
        if rows is None or not finite(rows[1]):
            return None
        felt = rows[1].reshape(-1, more.size)
        together[best.problem.sought_in(index)] += J.reshape(len(felt), -1).T @ felt
        squares += np.sum(felt**2, axis=0)
        samples += len(rows[1])
    return together, squares / samples


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


def _beside(rig: GreyBox, joint: DryJoint, speed: float, above: float = ABOVE) -> tuple[Parameter, Parameter]:
    level, unit = rig.parameters[joint.coulomb], rig.plant.quantity(joint.stribeck_speed).unit
    return (
        Parameter(name=joint.stiction, value=above * level.value, unit=level.unit, estimate=True),
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
