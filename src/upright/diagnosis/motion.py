"""How did the rig move, and which signs does the form of its equations fix, whatever the numbers are?

Positions, speeds, accelerations and effort have all gone through the same smoothing. A row of the equations of motion,
divided by the inertia of its own body, is an acceleration; it is regressed on the columns of the plant's base
parameters, all positive. A slope that comes out negative says that a convention is another: a column that is odd in
another coordinate (a spring, a hinge that is accelerated) turns its sign with that coordinate's, one that is turned by
half a turn (gravity) with what is called zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upright.diagnosis.case import Case
from upright.errors import BadInput
from upright.physics import Plant
from upright.physics.regressor import Regressor, regressor
from upright.records import Array
from upright.signals.regression import LeastSquares
from upright.signals.smoothing import dominant_period, middle, noise_gain, savitzky_golay, smoothed
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
        return "the rig is not specified; name it with --rig"
    coordinates = [c.name for c in case.plant.coordinates]
    missing = [c for c in coordinates if c not in case.places and c not in case.locked]
    if case.chained and case.rig is None and case.places:
        missing = []  # a body without a column was held, or is at least not mentioned
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
    known = case.rig is not None  # what is known of the rig then tells a wrong scale from a held body
    moving = tuple(
        c
        for c in coordinates
        if c in y and np.ptp(y[c]) > 50 * known * case.places[c].resolution and (known or case.moves(c))
    )
    if not moving:
        return "nothing moves"
    n, dt = grid.t.size, float(grid.t[1] - grid.t[0])
    width = max(quiet_width(y[c], dt) for c in moving)
    if n < max(40, 4 * width):
        return "the record is too short beside its swings"
    from scipy.ndimage import correlate1d

    inner = slice(width // 2, n - width // 2, max(1, -(-n // MOST)))
    smooth = smoothed([y.get(c, np.zeros(n)) for c in coordinates], dt, width)
    return SmoothedMotion(
        plant=case.plant,
        t=grid.t[inner],
        q=smooth.q[:, inner],
        v=smooth.v[:, inner],
        a=smooth.a[:, inner],
        u=correlate1d(u, middle(width), mode="nearest")[inner],
        samples=np.arange(n)[inner],
        dt=dt,
        command=u,
        weights=middle(width),
        fades=np.maximum(0.02 * np.std(smooth.v[:, inner], axis=1), 1e-9),
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
PLAIN, FEWER = 0.15, 0.5
"""Unexplained share up to which a plant's plain form is taken; beyond, one with every spring and dashpot that may be
missing is, where it leaves less than the second of that. Such a spring explains some of anything that goes far."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Term:
    """Answer of one term in one equation, whose coefficient is positive in the plant's own convention.

    `who` names what the term joins: ("effort", coordinate) or two coordinates; `slope` is the coefficient that was
    found, `share` what it explains of what the others leave, `total` what all leave. `target` (N,) and `alone` (N,)
    are acceleration and term with all others taken out.
    """

    who: tuple[str, str]
    text: str
    slope: float
    share: float
    total: float
    target: Array
    alone: Array
    t: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Row:
    """An acceleration (N,), the columns (N,) that push it, by whom they join and what they are, and any others."""

    target: Array
    known: dict[tuple[str, str], tuple[str, Array]]
    free: list[Array]

    def at(self, here: NDArray[np.bool_]) -> Row:
        """The same at some of the samples."""
        known = {who: (text, x[here]) for who, (text, x) in self.known.items()}
        return Row(target=self.target[here], known=known, free=[x[here] for x in self.free])

    @cached_property
    def regression(self) -> LeastSquares:
        """On what is known, then on the others."""
        return LeastSquares.of([*(x for _, x in self.known.values()), *self.free], self.target)

    @property
    def left(self) -> float:
        """Share of the acceleration's square that all columns leave."""
        return self.regression.squares / (float(self.target @ self.target) or 1.0)


def simplest(left: Sequence[float]) -> int:
    """Which of a plain and a whole form to take that leave these shares."""
    return len(left) - 1 if left[0] > PLAIN and left[-1] < FEWER * left[0] else 0


def sign_terms(motion: SmoothedMotion) -> list[Term]:
    """Terms with a known sign."""
    return [term for i in motion.rows for term in _row_terms(motion, i)]


def driven_row(motion: SmoothedMotion, here: NDArray[np.bool_]) -> list[tuple[Array, Array]]:
    """Acceleration (N,) of the driven body and all terms (N, p) of its equation but the effort, at samples `here`.

    In the plain form, then in the whole one; nothing where the body did not move or its equation cannot be written.
    """
    plant = motion.plant
    driven = [c.name for c in plant.coordinates].index(plant.inputs[0].on) if plant.inputs else -1
    rows = [row.at(here) for row in _forms(replace(motion, u=0 * motion.u), driven)] if driven in motion.rows else []
    return [(row.target, row.regression.columns) for row in rows]


def _row(motion: SmoothedMotion, i: int) -> Row | None:
    """Equation of one body, in its plain form unless the whole one explains far more; where the body slides."""
    forms = [row.at(motion.slides(i)) for row in _forms(motion, i)]
    return forms[simplest([form.left for form in forms])] if forms else None


def _forms(motion: SmoothedMotion, i: int) -> list[Row]:
    """One row of the equations divided by the inertia of its own body, in a plain form and in a whole one.

    In the whole form springs and dashpots that may be missing have a coefficient, and a coupling's own part, its pull
    back to where the body was, has another than its pull to the neighbour. There is none where no inertia is the
    body's own, or numbers are needed to write the equation down.
    """
    equations = regressor(motion.plant, frozenset(motion.plant.optional))
    own = equations.own(i)
    if own is None:
        return []
    names = [c.name for c in motion.plant.coordinates]
    parts = _Parts.of(equations, motion.plant, i, (motion.q, motion.v, motion.a))
    effort: dict[tuple[str, str], tuple[str, Array]] = {}
    if np.ptp(motion.u) > 0 and motion.plant.inputs[0].on == names[i]:
        effort["effort", names[i]] = "effort", motion.u
    rows: list[Row] = []
    for whole in (False, True):
        target, known, free = -parts.all[own], dict(effort), _friction(motion, i)
        for k, b in enumerate(equations.base):
            free_to_split = whole and not parts.inertial[k]
            if not b.always and not free_to_split:
                continue
            j = parts.joins(k)
            column = parts.all[k]
            if k == own:  # an acceleration that is not the body's own, as of the link before, is a term of its own
                column = parts.odd[j][k] if j is not None else 0 * column
                target = target + column
            elif free_to_split and j is not None:
                column = parts.odd[j][k]
                free.append(parts.all[k] - column)
            who = names[i if j is None else j], names[i]
            turns = parts.turns(k) if j is None else j in motion.rows
            if b.positive and b.always and turns and who not in known and _size(column):
                known[who] = "gravity" if j is None else "throw" if parts.inertial[k] else "spring", column
            else:
                free.append(column)
        rows.append(Row(target=target, known=known, free=[x for x in free if _size(x)]))
    return rows


@dataclass(frozen=True, kw_only=True, eq=False)
class _Parts:
    """Columns of one row as accelerations, `all` (base parameters, N), and how they turn with conventions.

    `odd` are their parts that turn with each other coordinate, `half` what they are with the own one half a turn on,
    None where it is no angle; `inertial` tells which hold an acceleration.
    """

    all: Array
    odd: dict[int, Array]
    half: Array | None
    inertial: tuple[bool, ...]

    @classmethod
    def of(cls, equations: Regressor, plant: type[Plant], i: int, motion: tuple[Array, Array, Array]) -> _Parts:
        def columns(q: Array, v: Array, a: Array) -> Array:
            return -equations.columns(q, v, a)[:, i]

        q, v, a = motion
        n = len(q)
        own = np.arange(n)[:, None] == np.arange(n)  # one row per coordinate
        whole = columns(q, v, a)
        return cls(
            all=whole,
            odd={j: (whole - columns(*(np.where(own[j][:, None], -x, x) for x in motion))) / 2
                 for j in range(n) if j != i},
            half=columns(q + np.pi * own[i][:, None], v, a) if plant.coordinates[i].unit == "rad" else None,
            inertial=tuple(role == "inertia" for role in equations.roles(i)),
        )  # fmt: skip

    def joins(self, k: int) -> int | None:
        """The only other coordinate with which a column turns, wholly or in part."""
        least = 1e-9 * _size(self.all[k])
        joined = [j for j, part in self.odd.items() if _size(part[k]) > least]
        return joined[0] if len(joined) == 1 else None

    def turns(self, k: int) -> bool:
        """Whether a column turns with what is called zero of the own coordinate, half a turn on."""
        column = self.all[k]
        return self.half is not None and bool(np.allclose(self.half[k], -column, rtol=0, atol=1e-9 * _size(column)))


def _friction(motion: SmoothedMotion, i: int) -> list[Array]:
    """A constant, and speed and sign of the speed of each joint that acts on a body, or of the body itself."""
    directions = [np.array(j.direction([c.name for c in motion.plant.coordinates])) for j in motion.plant.joints]
    columns = [np.ones(motion.t.size)]
    for direction in [d for d in directions if d[i]] or [np.arange(len(motion.q)) == i]:
        speed = direction @ motion.v
        columns += [speed, np.tanh(speed / float(np.linalg.norm(direction * motion.fades)))]
    return columns


def _size(x: Array) -> float:
    return float(np.linalg.norm(x))


def _row_terms(motion: SmoothedMotion, i: int) -> list[Term]:
    """LeastSquares of one acceleration where the body slides."""
    row = _row(motion, i)
    if row is None or not row.known or not np.std(row.target) > 0:
        return []
    target, A = row.target, row.regression.columns
    out: list[Term] = []
    for k, (who, (text, column)) in enumerate(row.known.items()):
        Q = np.linalg.qr(np.delete(A, k, axis=1))[0]
        alone, left = (x - Q @ (Q.T @ x) for x in (column, target))
        power = float(left @ left)
        out.append(
            Term(
                who=who,
                text=text,
                slope=float(row.regression.slopes[k]),
                share=1 - row.regression.squares / power if power > 0 else 0.0,
                total=row.left,
                target=left,
                alone=alone,
                t=motion.t[motion.slides(i)],
            )
        )
    return out
