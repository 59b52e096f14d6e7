"""Laws that make the far body follow: state feedback by Table 2, PD on the near encoder, PD on the far one.

All are ``u = k_pf r - K x`` on differenced encoders, so that they differ in nothing but K. Body 1 is driven, body n
follows; `n` is 2 on the rigs of the laboratory.

The near PD is searched as hard as a student with a weekend would, and harder. What it cannot do follows from the
model: with the near body driven and measured, only kd damps, and the poles' real
parts add up to ``-kd/m_1``. Too stiff a kp holds the near body fast, and the far one swings on its spring.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.control.score import step_figures
from upright.control.trial import law_on_rig, steps_in_period
from upright.errors import BadInput
from upright.gains import feedback, filtered, place, prefilter
from upright.gains.loop import closed
from upright.gains.requests import Roots, conjugate_poles, poles_of
from upright.laws import Law
from upright.paper.reproduce import TABLE_2, printed_poles
from upright.records import Array
from upright.rig import Rig
from upright.simulation import simulate
from upright.systems import StateSpace, to_s

AT = "rest"
MEMORY = 0.5
"""Of the filter on differences: half a servo period late."""
SLOW = 0.3
"""Decay over a servo period up to which a pole is shown; what the filter forgets faster says nothing of the rig."""
EXTRA = -5.0
"""Pole of the sum, where there is one [1/s]: slower than the poles of Table 2, faster than a person waits."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Tracker:
    """A law that follows, designed on one rig.

    Attributes
    ----------
    K : array, shape (states,)
        Gains [command per m or rad, and per m/s or rad/s].
    k_pf : float
        Gain of the reference [command per m or rad].
    poles : array
        Poles [1/s] of the sampled loop on the rig of the design, those that die within three samples left out.
    requested : array
        Requested poles; empty for a PD.
    stiffness : float
        Static force per error, k_pf times the drive's gain [N/m or N m/rad]: how hard it pulls at rest.
    play : float
        Largest error at rest that dry friction can hold [m or rad]; 0 where a sum works against it.
    """

    name: str
    K: Array
    k_pf: float
    law: Law
    poles: Roots
    requested: Roots
    stiffness: float
    play: float

    @property
    def decay(self) -> float:
        """Rate of its slowest pole [1/s]."""
        return -float(self.poles.real.max())

    @property
    def damping(self) -> float:
        """Least damping ratio of its poles."""
        return float(np.min(-self.poles.real / np.abs(self.poles)))


def tracker(rig: Rig, name: str, K: Array, k_pf: float, *, requested: Roots | None = None) -> Tracker:
    """Gains as a law on a rig's encoders, and what it is worth there."""
    law = state_law(rig, K, k_pf)
    return Tracker(
        name=name, K=np.ravel(K), k_pf=k_pf, law=law, poles=loop_poles(rig, law),
        requested=np.zeros(0, dtype=np.complex128) if requested is None else requested, stiffness=rig.gain * k_pf,
        play=hunting_play(rig, np.ravel(K), k_pf),
    )  # fmt: skip


def state_law(rig: Rig, K: Array, k_pf: float) -> Law:
    """The matrices of gains on differenced encoders."""
    sampled = rig.linear(AT).to_sampled(rig.period, 0.0)
    return feedback(filtered(sampled, MEMORY), K, k_pf)


def by_poles(rig: Rig, name: str, wanted: Roots) -> Tracker:
    """State feedback by Ackermann's formula, with the prefilter for unit static gain to the far body."""
    model = rig.linear(AT)
    K = place(model.A, model.B, wanted).K
    return tracker(rig, name, K, prefilter(model.A, model.B, far(model), K), requested=wanted)


def check_sets(which: Sequence[int], own: Roots | None) -> None:
    """Refuse sets that Table 2 does not have, and poles that a shaft with two bodies cannot have."""
    if any(not 1 <= i <= len(TABLE_2) for i in which):
        raise BadInput(f"Table 2 has sets 1 to {len(TABLE_2)}, got {', '.join(map(str, which))}.")
    if own is not None:
        conjugate_poles(own, 4)
    elif not which:
        raise BadInput("nothing to follow with: name a set of Table 2 or poles.")


def paper_sets(rig: Rig, which: Sequence[int] = (1, 2, 3, 4), faster: float = 1.0) -> tuple[Tracker, ...]:
    """State feedback by the sets of Table 2, or by poles that are so many times as fast."""
    times = "" if faster == 1.0 else f" x{faster:.2g}"
    return tuple(by_poles(rig, f"set {i}{times}", faster * printed_poles(TABLE_2[i - 1])[0]) for i in which)


def far(model: StateSpace) -> Array:
    """Row of the output that follows, the last."""
    return model.C[-1]


def hunting_play(rig: Rig, K: Array, k_pf: float) -> float:
    """Largest error of the far body at rest that dry friction can hold, two bodies without springs to ground.

    The far body stays while ``|k (x_1 - x_2)| <= f_2``, the near one while ``|gain u - k (x_1 - x_2)| <= f_1``; with
    ``u = k_pf r - K_1 x_1 - K_3 x_2`` the error ``r - x_2`` is at most
    ``(f_1 + f_2)/(gain k_pf) + (K_1/k_pf) f_2/k``.
    """
    p = rig.plant.parameters()
    f_1, f_2 = (max(p[f"f_{i}c"], p[f"f_{i}s"]) for i in (1, 2))
    return (f_1 + f_2) / (rig.gain * k_pf) + abs(K[0]) / k_pf * f_2 / p["k_12"]


def with_sum(rig: Rig, base: Tracker, name: str) -> Tracker:
    """The same poles and one more, EXTRA, for the sum of the error: what friction holds and what pushes is made up for.

    With ``k_pf = k_i/|EXTRA|`` the zero of the reference's way in lies on the added pole, so that the step is followed
    as without it; only disturbances see the sum, which stands still while the command is at its limit.
    """
    model = rig.linear(AT)
    n, c = model.A.shape[0], len(rig.plant.coordinates)
    A = np.zeros((n + 1, n + 1))
    A[:n, :n], A[n, :n] = model.A, -far(model)
    K = place(A, np.vstack([model.B, np.zeros((1, 1))]), np.append(base.requested, EXTRA)).K[0]
    k_pf = K[n] / EXTRA  # the sum's gain is -K[n]
    plain = tracker(rig, name, K[:n], k_pf, requested=np.append(base.requested, EXTRA))
    law = state_law(rig, K[:n], k_pf)
    z = law.A.shape[0]
    inner = np.zeros((z + 1, z + 1))
    inner[:z, :z], inner[z, z] = law.A, 1.0
    into = np.zeros((z + 1, c + 1))
    into[:z], into[z, c - 1], into[z, c] = law.B, -rig.period, rig.period
    begin = None if law.begin is None else np.vstack([law.begin, np.zeros((1, c))])
    summed = replace(law, A=inner, B=into, C=np.hstack([law.C, [[-K[n]]]]), begin=begin, windup="hold")
    return replace(plain, law=summed, poles=loop_poles(rig, summed), play=0.0)


def closed_by(rig: Rig, law: Law) -> Array:
    """Matrix of the sampled loop of a law on a rig, about rest; dry friction and rounding left out."""
    return closed(rig.linear(AT).to_sampled(rig.period, rig.delay / rig.period, rig.lag), law)


def loop_poles(rig: Rig, law: Law) -> Roots:
    """Poles [1/s] of that loop, those that die within three samples left out."""
    s = to_s(poles_of(closed_by(rig, law)), rig.period)
    return s[s.real > -SLOW / rig.period]


DWELL = 2.0
"""How long each is watched [s]."""


def near_pd(rig: Rig, name: str, kp: float, kd: float) -> Tracker:
    """PD on the driven body's encoder, with the reference of the far one."""
    return tracker(rig, name, _gains(rig, 0, kp, kd), kp)


def far_pd(rig: Rig, name: str, kp: float, kd: float) -> Tracker:
    """PD on the far body's encoder."""
    return tracker(rig, name, _gains(rig, len(rig.plant.coordinates) - 1, kp, kd), kp)


def _gains(rig: Rig, body: int, kp: float, kd: float) -> Array:
    K = np.zeros(2 * len(rig.plant.coordinates))
    K[2 * body : 2 * body + 2] = kp, kd
    return K


@dataclass(frozen=True, kw_only=True, eq=False)
class GainSearch:
    """PD laws on the near encoder, tried on one rig: gains, and when the far body arrived and settled [s]."""

    kp: Array
    kd: Array
    arrival: Array
    settling: Array


def tune(rig: Rig, step: float, most: float) -> tuple[Tracker, GainSearch]:
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
    searched = GainSearch(kp=rows[:, 0], kd=rows[:, 1], arrival=rows[:, 2], settling=rows[:, 3])
    return near_pd(rig, "PD, tuned", float(best[0]), float(best[1])), searched


def tried(rig: Rig, pairs: Array, step: float) -> Array:
    """Arrival and settling to 5 % of many PD laws at once, shape (pairs, 2)."""
    c = len(rig.plant.coordinates)
    estimator = filtered(rig.linear(AT).to_sampled(rig.period, 0.0), MEMORY)
    laws = [feedback(estimator, _gains(rig, 0, kp, kd), kp) for kp, kd in pairs.tolist()]
    A, B, C, D = (np.stack([getattr(law, n) for law in laws], axis=-1) for n in "ABCD")
    many = Law(A, B, C, D, references=np.array([step]))
    count = round(DWELL / rig.period)
    start = rig.plant.state(AT)
    loop = law_on_rig(rig, many, np.zeros(c))
    x = simulate(
        rig.plant, rig.drive, start, None, rig.period, samples=count, substeps=steps_in_period(rig), loop=loop
    )[:, 2 * c - 2]  # fmt: skip
    t, out = np.arange(count, dtype=np.float64) * rig.period, np.full((len(laws), 2), np.inf)
    for i, y in enumerate(x.T):
        try:
            figures = step_figures(t, y, before=0.0, reference=step, resolution=float(rig.resolution[-1]))
        except BadInput:  # friction held it where it was
            continue
        out[i] = figures.arrival, figures.settling_5
    return out


def continuous(model: StateSpace) -> tuple[Array, Array, Array]:
    """Matrix of the loop ``A + kp P + kd D`` of PD control of the near body, without computer."""
    P, D = (-model.B @ row[None] for row in np.eye(model.A.shape[0])[:2])
    return model.A, P, D


def sampled(rig: Rig) -> tuple[Array, Array, Array]:
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


def root_locus(model: StateSpace, body: int, rate: float, kp: Array) -> NDArray[np.complex128]:
    """Poles of PD control of one body's position over kp, kd = kp times `rate`, shape (kp, states)."""
    K = np.zeros((kp.size, 1, model.A.shape[0]))
    K[:, 0, 2 * body], K[:, 0, 2 * body + 1] = kp, kp * rate
    return np.linalg.eigvals(model.A - model.B @ K).astype(np.complex128)
