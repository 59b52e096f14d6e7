"""How did the rig move? Positions, speeds, accelerations and effort, all through the same smoothing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from upright.diagnosis.case import Case
from upright.errors import BadInput
from upright.physics import Plant
from upright.records import Array
from upright.signals.smoothing import dominant_period, middle, savitzky_golay
from upright.signals.stretches import pieces
from upright.study.sensors import Grid

LOUD = 0.01
"""Share of an acceleration's variance that may be noise; smoothing reaches no further than it takes to get there."""
MOST = 800
"""Samples that equations of motion are held to; a longer record is thinned after it was smoothed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """Smoothed motion: `q`, `v`, `a` (coordinates, N), effort `u` (N,) as commanded, `t` (N,) [s].

    `rows` are the coordinates whose equations can be held to it: those that move, with every other one known.
    `fades` are speeds below which the sign of a speed is not believed.
    """

    plant: type[Plant]
    t: Array
    q: Array
    v: Array
    a: Array
    u: Array
    fades: Array
    rows: tuple[int, ...]
    samples: NDArray[np.int64]
    dt: float
    command: Array
    weights: Array

    def slides(self, i: int) -> NDArray[np.bool_]:
        """Samples (N,) at which a body moves; while it sticks, friction may hide any force."""
        still = (np.abs(self.v[i]) < self.fades[i]) & (np.abs(self.a[i]) < 0.05 * float(np.std(self.a[i])))
        return ~still if np.count_nonzero(~still) > 40 else np.ones(self.t.size, bool)


def motion_of(case: Case) -> Motion | str:
    """Motion of a record, or the reason why there is none."""
    if case.plant is None:
        return "nobody said what the rig is; name it with --rig"
    coordinates = [c.name for c in case.plant.coordinates]
    missing = [c for c in coordinates if c not in case.places and c not in case.locked]
    if case.chained and not case.parameters and case.places:
        missing = []  # a body without a column was held, or is at least not told of
    if missing:
        return f"no column measures {', '.join(missing)}"
    steps = np.diff(case.record.t)
    start, stop = pieces(steps > 5 * float(np.median(steps)))[0]  # the longest without a gap
    t = case.record.t[start:stop]
    try:
        grid = Grid.of(t)
    except BadInput as error:
        return str(error)
    y = {c: grid.outputs(p.y[start:stop]) for c, p in case.places.items()}
    u = grid.commands(case.u[start:stop]) if case.drive else np.zeros(grid.t.size)
    told = bool(case.parameters)  # what is known of the rig then tells a wrong scale from a held body
    moving = tuple(
        c
        for c in coordinates
        if c in y and np.ptp(y[c]) > 50 * told * case.places[c].quantum and (told or case.moves(c))
    )
    if not moving:
        return "nothing moves"
    n, dt = grid.t.size, float(grid.t[1] - grid.t[0])
    width = max(quiet_width(y[c], dt) for c in moving)
    if n < max(40, 4 * width):
        return "the record is too short beside its swings"
    from scipy.ndimage import correlate1d

    inner = slice(width // 2, n - width // 2, max(1, -(-n // MOST)))
    q, v, a = np.zeros((3, len(coordinates), len(range(*inner.indices(n)))))
    for i, c in enumerate(coordinates):
        if c in y:
            smooth = savitzky_golay(y[c], dt, width)
            q[i], v[i], a[i] = smooth.q[inner], smooth.v[inner], smooth.a[inner]
    return Motion(
        plant=case.plant,
        t=grid.t[inner],
        q=q,
        v=v,
        a=a,
        u=correlate1d(u, middle(width), mode="nearest")[inner],
        samples=np.arange(n)[inner],
        dt=dt,
        command=u,
        weights=middle(width),
        fades=np.maximum(0.02 * np.std(v, axis=1), 1e-9),
        rows=tuple(coordinates.index(c) for c in moving),
    )


def quiet_width(y: Array, dt: float) -> int:
    """Samples (odd) over which a signal (N,) is smoothed, so that noise is but a little of its acceleration.

    An eighth of the dominant period at least, a 15th of the record at most: what both sides of an equation lose alike
    does no harm, what noise adds to one side does.
    """
    n = y.size
    most = max(9, n // 15)
    width = int(np.clip(dominant_period(y, dt) / 8 / dt, 7, max(9, n // 80)))
    while True:
        width |= 1
        smooth = savitzky_golay(y, dt, width)
        inner = slice(width // 2, n - width // 2)
        noise = float(np.std((y - smooth.q)[inner])) * curvature(width) / dt**2
        if noise**2 < LOUD * float(np.var(smooth.a[inner])) or width >= most:
            return width
        width = min(int(1.35 * width) + 2, most)


@cache
def curvature(width: int) -> float:
    """Standard deviation of the acceleration, in units of noise per sample period squared."""
    s = np.arange(width) - width // 2
    return (
        2
        * float(np.linalg.norm(np.linalg.pinv(np.vander(s / (width // 2), 5, increasing=True))[2]))
        / (width // 2) ** 2
    )
