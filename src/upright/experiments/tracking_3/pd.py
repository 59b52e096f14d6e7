"""How good can PD control of the near encoder be? Searched as hard as a student with a weekend would, and harder.

What it cannot do follows from the model: with the near body driven and measured, only kd damps, and the poles' real
parts add up to ``-kd/m_1``. Too stiff a kp holds the near body fast, and the far one swings on its spring.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright import gains as design
from upright.control import ServoRig
from upright.control.steps import step_figures
from upright.control.trial import SUBSTEPS, at_work
from upright.errors import BadInput
from upright.experiments.tracking_3.laws import AT, MEMORY, Tracker, closed_by, state_law, tracker
from upright.laws import Law
from upright.physics import Linear
from upright.simulation import simulate

Array = NDArray[np.float64]

DWELL = 2.0
"""How long each is watched [s]."""


def near_pd(rig: ServoRig, name: str, kp: float, kd: float) -> Tracker:
    """PD on the driven body's encoder, with the reference of the far one."""
    return tracker(rig, name, _gains(rig, 0, kp, kd), kp)


def far_pd(rig: ServoRig, name: str, kp: float, kd: float) -> Tracker:
    """PD on the far body's encoder."""
    return tracker(rig, name, _gains(rig, len(rig.plant.coordinates) - 1, kp, kd), kp)


def _gains(rig: ServoRig, body: int, kp: float, kd: float) -> Array:
    K = np.zeros(2 * len(rig.plant.coordinates))
    K[2 * body : 2 * body + 2] = kp, kd
    return K


@dataclass(frozen=True, kw_only=True, eq=False)
class Search:
    """PD laws on the near encoder, tried on one rig: gains, and when the far body arrived and settled [s]."""

    kp: Array
    kd: Array
    arrival: Array
    settling: Array


def tune(rig: ServoRig, step: float, most: float) -> tuple[Tracker, Search]:
    """The PD on the near encoder that brings the far body soonest within 5 % of the reference, and keeps it there.

    Every pair of gains of a grid runs on the rig in the kernel, with friction, encoders, converter and limit; then a
    finer grid about the best. `most` is the largest command allowed, which bounds kp.
    """
    kp, rate = np.geomspace(0.03, 1.0, 18) * most / step, np.geomspace(8e-3, 0.25, 18)
    rows, best = np.empty((0, 4)), np.zeros(4)
    for _ in range(2):
        pairs = np.array([(p, p * r) for p in kp for r in rate])
        rows = np.vstack([rows, np.column_stack([pairs, tried(rig, pairs, step)])])
        order = np.lexsort((rows[:, 3], rows[:, 2]))  # where friction keeps every one away: the soonest at rest
        best = rows[order[0]]
        kp = np.minimum(best[0] * np.geomspace(0.8, 1.25, 9), most / step)
        rate = best[1] / best[0] * np.geomspace(0.8, 1.25, 9)
    found = Search(kp=rows[:, 0], kd=rows[:, 1], arrival=rows[:, 2], settling=rows[:, 3])
    return near_pd(rig, "PD, tuned", float(best[0]), float(best[1])), found


def tried(rig: ServoRig, pairs: Array, step: float) -> Array:
    """Arrival and settling to 5 % of many PD laws at once, shape (pairs, 2)."""
    c = len(rig.plant.coordinates)
    estimator = design.filtered(design.hold(rig.linear(AT), rig.period, 0.0), MEMORY)
    laws = [design.feedback(estimator, _gains(rig, 0, kp, kd), kp) for kp, kd in pairs.tolist()]
    A, B, C, D = (np.stack([getattr(law, n) for law in laws], axis=-1) for n in "ABCD")
    many = Law(A, B, C, D, references=np.array([step]))
    count = round(DWELL / rig.period)
    start = rig.plant.state(AT)
    given = at_work(rig, many, np.zeros(c))
    x = simulate(
        rig.plant, rig.drive, start, None, rig.period, samples=count, substeps=SUBSTEPS, loop=given
    )[:, 2 * c - 2]  # fmt: skip
    t, out = np.arange(count, dtype=np.float64) * rig.period, np.full((len(laws), 2), np.inf)
    for i, y in enumerate(x.T):
        try:
            found = step_figures(t, y, before=0.0, reference=step, quantum=float(rig.quantum[-1]))
        except BadInput:  # friction held it where it was
            continue
        out[i] = found.arrival, found.settling_5
    return out


def continuous(model: Linear) -> tuple[Array, Array, Array]:
    """Matrix of the loop ``A + kp P + kd D`` of PD control of the near body, without computer."""
    P, D = (-model.B @ row[None] for row in np.eye(model.A.shape[0])[:2])
    return model.A, P, D


def sampled(rig: ServoRig) -> tuple[Array, Array, Array]:
    """The same as it runs: held, late, lagging, with filtered differences."""
    A, P, D = (closed_by(rig, state_law(rig, _gains(rig, 0, *g), 0.0)) for g in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
    return A, P - A, D - A


def best_decay(loop: tuple[Array, Array, Array], kp: Array, *, period: float = 0.0, most: float = 0.3) -> Array:
    """For each kp the fastest decay [1/s] that any kd = kp times up to `most` [s] gives the slowest pole.

    `period` is that of a sampled loop; 0 for a continuous one.
    """
    A, P, D = (m[None, None] for m in loop)
    rate = np.broadcast_to(np.geomspace(4e-3, most, 60), (kp.size, 60))
    decay = np.empty(0)
    for finer in (0.11, 0.008):
        kps = kp[:, None, None, None]
        poles = np.linalg.eigvals(A + kps * (P + rate[..., None, None] * D))
        slow = poles.real.max(axis=-1) if period == 0 else np.log(np.abs(poles).max(axis=-1)) / period
        best = np.take_along_axis(rate, slow.argmin(axis=1)[:, None], axis=1)
        decay, rate = -slow.min(axis=1), best * np.exp(np.linspace(-finer, finer, 25))
    return decay


def root_locus(model: Linear, body: int, rate: float, kp: Array) -> NDArray[np.complex128]:
    """Poles of PD control of one body's position over kp, kd = kp times `rate`, shape (kp, states)."""
    K = np.zeros((kp.size, 1, model.A.shape[0]))
    K[:, 0, 2 * body], K[:, 0, 2 * body + 1] = kp, kp * rate
    return np.linalg.eigvals(model.A - model.B @ K).astype(np.complex128)
