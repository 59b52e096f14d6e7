"""What would happen on many rigs, or from many starts? The same trial, side by side."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.control.rig import ServoRig
from upright.control.score import Scores, scores
from upright.control.trial import SUBSTEPS, at_work
from upright.laws import Law
from upright.simulation import simulate

Array = NDArray[np.float64]

EVERY = 4
"""Servo periods from sample to sample of what is scored."""
BLOCK = 256
"""Lanes run at once, which bounds the memory."""


def outcomes(
    rig: ServoRig,
    law: Law,
    *,
    at: str,
    starts: ArrayLike,
    seconds: float,
    parameters: Mapping[str, ArrayLike] | None = None,
) -> Scores:
    """Figures of trials side by side.

    Parameters
    ----------
    rig : ServoRig
    law : Law
    at : str
        Equilibrium to hold.
    starts : array, shape (lanes, states)
        Deviations from the equilibrium when the law is switched on.
    seconds : float
    parameters : mapping of str to array, shape (lanes,)
        Parameters of the plant, and of the drive as ``"actuator.gain"`` and so on, in which the lanes differ from the
        rig.
    """
    first = np.atleast_2d(np.asarray(starts, dtype=np.float64))
    lanes = first.shape[0]
    given = {name: np.broadcast_to(np.asarray(v, dtype=np.float64), (lanes,)) for name, v in (parameters or {}).items()}
    rows = round(seconds / rig.period / EVERY) + 1
    t = np.arange(rows, dtype=np.float64) * (rig.period * EVERY)
    point = np.array(list(rig.plant.equilibrium(at).values()))
    found: list[Scores] = []
    for begin in range(0, lanes, BLOCK):
        part = slice(begin, begin + BLOCK)
        x0 = rig.plant.state(at) + first[part]
        loop = at_work(rig, law, point)
        motion = simulate(
            rig.plant, {**rig.drive, **{n: v[part] for n, v in given.items()}}, x0, None, rig.period, samples=rows,
            substeps=SUBSTEPS, loop=loop, every=EVERY,
        )  # fmt: skip
        away = motion[:, 0 : x0.shape[1] : 2] - point[:, None]
        found.append(scores(rig, t, away, motion[:, x0.shape[1]]))
    if len(found) == 1:
        return found[0]
    return Scores(**{n: np.concatenate([getattr(s, n) for s in found], axis=-1) for n in vars(found[0])})
