"""Which signs does the form of the equations fix, whatever the numbers are?

A positive force accelerates its own body forwards; a spring pulls a body towards its neighbour; gravity pulls a
pendulum down; a hinge that is accelerated throws its pendulum. Accelerations are regressed on these terms with free
coefficients, and the signs of those that matter are read off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.diagnosis.motion import Motion
from upright.physics import CartPendulum, Furuta, Pendulum
from upright.records import Array

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


def terms(motion: Motion) -> list[Term]:
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


def driven_row(motion: Motion, here: NDArray[np.bool_]) -> tuple[Array, Array] | None:
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


def _own(motion: Motion, i: int) -> list[Array]:
    """A body's own position, for a spring to ground; none when disks turn together, which shows that there is none."""
    q = motion.q
    alike = [j for j in (i - 1, i + 1) if j in motion.rows]
    together = alike and all(np.ptp(q[j] - q[i]) < 0.1 * np.ptp(q[i]) for j in alike)
    return [] if together and motion.plant.__name__.startswith("Torsional") else [q[i]]
