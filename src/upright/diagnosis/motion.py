"""How did the rig move, and which signs does the form of its equations fix, whatever the numbers are?

Positions, speeds, accelerations and effort have all gone through the same smoothing. A positive force accelerates its
own body forwards; a spring pulls a body towards its neighbour; gravity pulls a pendulum down; a hinge that is
accelerated throws its pendulum. Accelerations are regressed on these terms with free coefficients, and the signs of
those that matter are read off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.diagnosis.case import Case
from upright.errors import BadInput
from upright.physics import CartPendulum, Furuta, Pendulum, Plant
from upright.records import Array
from upright.signals.smoothing import dominant_period, middle, noise_gain, savitzky_golay
from upright.signals.stretches import pieces
from upright.study.sensors import Grid

LOUD = 0.01
"""Share of an acceleration's variance that may be noise; smoothing reaches no further than it takes to get there."""
MOST = 800
"""Samples that equations of motion are held to; a longer record is thinned after it was smoothed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothedMotion:
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


def motion_of(case: Case) -> SmoothedMotion | str:
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
    return SmoothedMotion(
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
        noise = float(np.std((y - smooth.q)[inner])) * noise_gain(width) / dt**2
        if noise**2 < LOUD * float(np.var(smooth.a[inner])) or width >= most:
            return width
        width = min(int(1.35 * width) + 2, most)


MATTERS = 0.1
"""Share of what the other terms leave that a term must explain before its sign is believed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Term:
    """Answer of one term in one equation.

    `who` names what the term joins: ("effort", coordinate) or two coordinates; `expected` is the sign of its
    coefficient, `slope` what was found, `share` what it explains of what the others leave, `total` what all leave.
    `target` (N,) and `alone` (N,) are acceleration and term with all others taken out.
    """

    who: tuple[str, str]
    text: str
    expected: float
    slope: float
    share: float
    total: float
    target: Array
    alone: Array
    t: Array


def terms(motion: SmoothedMotion) -> list[Term]:
    """Terms with a known sign, none for a plant of the user's own, whose form is not known here."""
    plant, q, v, a = motion.plant, motion.q, motion.v, motion.a
    names = [c.name for c in plant.coordinates]
    one = np.ones(motion.t.size)
    found: list[Term] = []
    pushed = bool(np.ptp(motion.u) > 0)
    effort = {("effort", names[0]): ("effort", 1.0, motion.u)} if pushed else {}
    for i in motion.rows:
        friction = [one, v[i], np.tanh(v[i] / motion.fades[i])]
        push = effort if i == 0 else {}
        here = motion.slides(i)
        if issubclass(plant, Pendulum):
            known = {**push, (names[0], names[0]): ("gravity", -1.0, np.sin(q[0]))}
            found += _row(motion.t, names, here, a[i], known, friction)
        elif issubclass(plant, CartPendulum | Furuta):
            rotary = issubclass(plant, Furuta)
            throw = -1.0 if not rotary else 1.0
            s, c = np.sin(q[1]), np.cos(q[1])
            if i == 0:
                kick = c * a[1] - s * v[1] ** 2
                others = [s * s * a[0], 2 * s * c * v[0] * v[1]] if rotary else []
                found += _row(motion.t, names, here, a[0], push, [*friction, kick, *others])
            else:
                known = {(names[1], names[1]): ("gravity", -1.0, s)}
                if 0 in motion.rows:
                    known[names[0], names[1]] = ("throw", throw, c * a[0])
                spin = [s * c * v[0] ** 2] if rotary else []
                found += _row(motion.t, names, here, a[1], known, [*friction, *spin])
        elif plant.__name__.startswith(("Rectilinear", "Torsional")):
            known = dict(push)
            for j in (i - 1, i + 1):
                if 0 <= j < len(names) and j in motion.rows:
                    known[names[j], names[i]] = ("spring", 1.0, q[j] if _own(motion, i) else q[j] - q[i])
            found += _row(motion.t, names, here, a[i], known, [*friction, *_own(motion, i)])
        else:
            return []
    return found


def _row(
    t: Array,
    names: list[str],
    here: NDArray[np.bool_],
    target: Array,
    known: dict[tuple[str, str], tuple[str, float, Array]],
    free: list[Array],
) -> list[Term]:
    """Regression of one acceleration where the body slides."""
    target, free = target[here], [x[here] for x in free]
    known = {who: (text, sign, x[here]) for who, (text, sign, x) in known.items()}
    scale = float(np.std(target))
    columns = [*(entry[2] for entry in known.values()), *free]
    columns = [c / (float(np.linalg.norm(c)) or 1.0) for c in columns]
    if scale == 0 or not known:
        return []
    A = np.column_stack(columns)
    coefficients, *_ = np.linalg.lstsq(A, target, rcond=1e-10)
    rest = target - A @ coefficients
    total = float(rest @ rest) / float(target @ target)
    out: list[Term] = []
    for k, (who, (text, expected, column)) in enumerate(known.items()):
        others = np.delete(A, k, axis=1)
        Q = np.linalg.qr(others)[0]
        alone, left = (x - Q @ (Q.T @ x) for x in (column, target))
        power = float(left @ left)
        share = 1 - float(rest @ rest) / power if power > 0 else 0.0
        out.append(
            Term(
                who=who,
                text=text,
                expected=expected,
                slope=float(coefficients[k]) / (float(np.linalg.norm(column)) or 1.0),
                share=share,
                total=total,
                target=left,
                alone=alone,
                t=t[here],
            )
        )
    return out


def driven_row(motion: SmoothedMotion, here: NDArray[np.bool_]) -> tuple[Array, Array] | None:
    """Acceleration (N,) of the driven body and all terms (N, p) of its equation but the effort, at samples `here`."""
    q, v, a = motion.q, motion.v, motion.a
    if 0 not in motion.rows:
        return None
    columns = [np.ones(motion.t.size), v[0], np.tanh(v[0] / motion.fades[0])]
    if issubclass(motion.plant, Pendulum):
        columns += [np.sin(q[0])]
    elif issubclass(motion.plant, CartPendulum | Furuta):
        s, c = np.sin(q[1]), np.cos(q[1])
        columns += [c * a[1] - s * v[1] ** 2, s * s * a[0], 2 * s * c * v[0] * v[1]]
    else:
        others = [q[i] for i in motion.rows if 0 < i < 2]
        columns += [q[0], *others] if _own(motion, 0) else [x - q[0] for x in others]
    return a[0][here], np.column_stack([c / (float(np.linalg.norm(c)) or 1.0) for c in columns])[here]


def _own(motion: SmoothedMotion, i: int) -> list[Array]:
    """A body's own position, for a spring to ground; none when disks turn together, which shows that there is none."""
    q = motion.q
    alike = [j for j in (i - 1, i + 1) if j in motion.rows]
    together = alike and all(np.ptp(q[j] - q[i]) < 0.1 * np.ptp(q[i]) for j in alike)
    return [] if together and motion.plant.__name__.startswith("Torsional") else [q[i]]
