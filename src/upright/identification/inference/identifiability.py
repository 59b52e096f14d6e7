"""What can these runs not see? Combinations that change no output, and the one number that would fix each.

A free swing without a known force or inertia sees only ratios: masses, forces and frictions scale together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.covariance import Spread
from upright.identification.model.model import NOISE
from upright.identification.model.unknowns import SHARED
from upright.identification.problem.normal import NULL, pseudo_inverse
from upright.identification.problem.problem import Problem

Array = NDArray[np.float64]

PART = 0.05
"""A number takes part in a direction when its share is at least this much of the largest share."""


@dataclass(frozen=True, kw_only=True)
class Sight:
    """Singular values (largest first) and directions (rows) of the Jacobian scaled to relative changes.

    `names` are the columns, `blind` the rows of directions that the data cannot see, `effects` the columns' lengths.
    """

    names: tuple[str, ...]
    singular_values: Array
    directions: Array
    blind: Array
    effects: Array


def look(problem: Problem, x: Array, spread: Spread) -> Sight:
    """Singular values of the shared numbers' Jacobian; what differs from run to run and levels of noise eliminated."""
    free = [i for i in range(x.size) if not spread.pinned[i]]
    aside = {i for i in free if (u := problem.unknowns[i]).runs != SHARED or u.name.startswith(NOISE)}
    shared, own = [i for i in free if i not in aside], sorted(aside)
    value = problem.value(x)
    unknowns = [problem.unknowns[i] for i in shared]
    # relative to the value found, which a search along a blind direction may have carried far from its guess
    sizes = np.array(
        [
            1.0 if u.log else abs(v) if (v := float(value[i])) and abs(v) > 1e-3 * u.scale else u.scale
            for i, u in zip(shared, unknowns, strict=True)
        ]
    )
    A = spread.matrix[np.ix_(shared, shared)]
    if own:
        C = spread.matrix[np.ix_(shared, own)]
        A = A - C @ pseudo_inverse(spread.matrix[np.ix_(own, own)]) @ C.T
    S = A * sizes[:, None] * sizes
    names = tuple(problem.unknowns[i].name for i in shared)
    w, V = np.linalg.eigh(S) if shared else (np.zeros(0), np.zeros((0, 0)))
    order = np.argsort(w)[::-1]
    singular = np.sqrt(np.maximum(w[order], 0.0))
    directions = V[:, order].T
    blind = _null(S)
    return Sight(
        names=names, singular_values=singular, directions=directions,
        blind=np.array(blind).reshape(-1, len(shared)), effects=np.sqrt(np.maximum(np.diag(S), 0.0)),
    )  # fmt: skip


def _null(S: Array) -> list[Array]:
    """Directions of a scaled matrix that change nothing, judged after its columns are brought to one length."""
    d = np.sqrt(np.maximum(np.diag(S), 0.0))
    dead = d <= NULL * d.max(initial=0.0)
    found = [np.eye(d.size)[i] for i in np.flatnonzero(dead)]
    live = np.flatnonzero(~dead)
    if live.size:
        s = 1 / d[live]
        w, V = np.linalg.eigh(S[np.ix_(live, live)] * s[:, None] * s)
        for k in np.flatnonzero(w <= NULL**2 * w[-1]):
            direction = np.zeros(d.size)
            direction[live] = V[:, k] * s
            found.append(direction / np.linalg.norm(direction))
    return found


def parts(sight: Sight, direction: Array) -> list[tuple[str, float]]:
    """Numbers that take part in a direction, with their shares relative to the largest, largest first.

    A number takes part by the size of its change or by the size of its effect.
    """
    share = direction / direction[np.argmax(np.abs(direction))]
    effect = np.abs(direction * sight.effects)
    order = np.argsort(-np.abs(share))
    strong = effect >= PART * effect.max(initial=0.0)
    return [(sight.names[i], float(share[i])) for i in order if abs(share[i]) >= PART or (strong[i] and effect[i] > 0)]


def hidden(sight: Sight) -> set[str]:
    """Names of the numbers that take part in a direction the data cannot see."""
    return {n for d in sight.blind for n, _ in parts(sight, d)}


def sentences(sight: Sight, units: dict[str, str]) -> tuple[str, ...]:
    """Say which combinations cannot be seen and which one number would fix it."""
    said: list[str] = []
    for d in sight.blind:
        share = parts(sight, d)
        names = [n for n, _ in share]
        if len(names) == 1:
            said.append(
                f"The data cannot see {names[0]}: no measured output changes with it. "
                "Give its value, or add a run in which it matters."
            )
            continue
        # masses first, then forces: these are what a scale or a caliper gives
        rank = {"kg": 0, "kg m^2": 1, "m": 2}
        fix = sorted(names, key=lambda n: rank.get(units.get(n, ""), 3))
        if all(abs(s - 1) < 0.1 for _, s in share):
            what = f"{_list(names)} scale together: the data see only their ratios."
        else:
            terms = ", ".join(f"{n} by {100 * s:+.0f} %" for n, s in share)
            what = f"The data cannot see a common change of {terms}: the outputs stay the same."
        one = f"Give {fix[0]}" + (f", or any other one of them ({_list(fix[1:], 'or')})," if len(fix) > 1 else "")
        said.append(f"{what} {one} as a known value to fix it.")
    return tuple(said)


def _list(names: list[str], word: str = "and") -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {word} {names[-1]}"
