"""Covariance of the numbers sought at an optimum, and the combinations of them that the data cannot see.

White-noise errors were found 10 to 30 times too small on real rigs, because a misfit now is a misfit a moment later.
The sandwich estimate sums the autocovariance of the scores (Newey and West 1987) over a span chosen from the data
(Andrews 1991); with several runs it is compared with the spread from run to run, the larger counts.

A wrong model pulls its numbers one way in one part of the runs and another way in the next, over spans that no
autocorrelation reaches. So every block of the runs is left out in turn (the jackknife of Quenouille and Tukey, each in
one Gauss-Newton step). What the estimates then scatter beyond the sandwich is a spread from block to block, as of
random effects (DerSimonian and Laird 1986), and the truth counts as one more block: on rigs with physics that their
models lack 93 % of the 95 % intervals held the truth, 83 % without (`python -m benchmarks misfit`).

Combinations of numbers that change no output are reported with the one number that would fix each: a free swing without
a known force or inertia sees only ratios, since masses, forces and frictions scale together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.grey_box import NOISE
from upright.identification.model.runs import LEAST_RUN
from upright.identification.problem.normal_equations import NULL, finite, pseudo_inverse
from upright.identification.problem.residuals import Problem
from upright.signals.memory import automatic_span, long_run, lost_share, memory

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """Coordinates `x` (n,) at which the cost of a problem is least, and how sure they are.

    `covariance` (n, n) has zero rows for numbers that are `pinned` (n,), held by a bound; `sandwich` (n, n) is that of
    the residuals' memory alone, in which combinations that the data see well stay as sure as they are; `white` (n,) are
    the variances that uncorrelated residuals would give, `matrix` (n, n) is Gauss-Newton's, prior knowledge included.
    One weighted residual has the `variance`; residuals have forgotten themselves after `memory` seconds
    (autocorrelation below 1/e), which leaves so many independent `samples`. `lost` are the labels of runs whose motion
    runs away at `x`, or as soon as a number is moved: then nothing is known of how sure the numbers are. `rows` are the
    residuals (T, outputs) of each run and their Jacobian (T, outputs, sought in it), from central differences.
    """

    problem: Problem
    x: Array
    covariance: Array
    sandwich: Array
    white: Array
    matrix: Array
    variance: float
    memory: float
    samples: float
    pinned: NDArray[np.bool_]
    lost: tuple[str, ...] = ()
    rows: tuple[tuple[Array, Array], ...] = ()

    @property
    def values(self) -> Array:
        """Values (n,) of the numbers."""
        return self.problem.value(self.x)

    @property
    def sigma(self) -> Array:
        """Standard errors (n,) of the coordinates."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def quantile(self) -> float:
        """Standard errors from an estimate to the end of its interval."""
        return student(self.samples - self.x.size)

    @property
    def explains_nothing(self) -> bool:
        """Whether the runs are missed by more than they vary; residuals are in units of each signal's spread."""
        return not self.variance < 1.0

    @property
    def shared(self) -> list[int]:
        """Places of the numbers that all runs share."""
        return [i for i, u in enumerate(self.problem.unknowns) if u.shared]


def student(freedom: float, share: float = 0.975) -> float:
    """Student's 97.5 % point, or that of another `share`, for this many degrees of freedom, two at least."""
    from scipy.special import stdtrit

    return float(stdtrit(max(freedom, 2.0), share))


def assess(problem: Problem, x: Array) -> Optimum:
    """Uncertainty at the optimum `x`, from central differences in lanes."""
    size = x.size
    A = np.zeros((size, size))
    hac, from_runs = np.zeros((size, size)), np.zeros((size, size))
    blocks: dict[int, list[tuple[Array, Array]]] = {number: [] for number in BLOCKS}
    cost, count, longest, independent = 0.0, 0, 0.0, 0.0
    every: list[tuple[Array, Array]] = []
    lost: list[str] = []
    for index, track in enumerate(problem.tracks):
        rows = problem.rows(index, x, central=True)
        if rows is None or not squared(*rows):
            lost.append(track.run.label)
            continue
        every.append(rows)
        r, J = rows
        sought = problem.sought_in(index)
        here = np.ix_(sought, sought)
        flat = J.reshape(-1, sought.size)
        A[here] += flat.T @ flat
        scores = np.einsum("tk,tkp->tp", r, J)
        span = automatic_span(scores)
        hac[here] += long_run(scores, span) / (1 - lost_share(scores, span))
        g = scores.sum(axis=0)
        from_runs[here] += np.outer(g, g)
        for number, parts in blocks.items():
            pieces = -(-number // len(problem.tracks))
            parts += _parts(r, J, pieces if track.run.t.size >= LEAST_RUN else 1, sought, size)
        cost += float(np.sum(r * r))
        count += int(np.count_nonzero(track.weights)) * r.size // track.weights.size
        longest = max(longest, memory(r, track.spacing))
        independent += r.shape[0] / span
    if lost:
        return Optimum(
            problem=problem, x=x, covariance=np.diag(np.full(size, np.inf)), sandwich=np.diag(np.full(size, np.inf)),
            white=np.full(size, np.inf), matrix=np.zeros((size, size)), variance=math.inf, memory=0.0, samples=0.0,
            pinned=np.zeros(size, dtype=bool), lost=tuple(lost),
        )  # fmt: skip
    _, prior = problem.prior_rows(x)
    A = A + prior.T @ prior
    lower, upper = x <= problem.lower, x >= problem.upper
    gradient = problem.normal(x).gradient if np.any(lower | upper) else np.zeros(size)
    pinned = (lower & (gradient >= 0)) | (upper & (gradient <= 0))
    free = ~pinned
    inverse = np.zeros((size, size))
    inverse[np.ix_(free, free)] = pseudo_inverse(A[np.ix_(free, free)])
    variance = cost / max(count - int(free.sum()), 1)
    # the fit has made the scores smaller, by as many as it could choose of those that are independent
    hac *= independent / max(independent - float(free.sum()), independent / 2, 1e-9)
    # a prior's row is one residual of the size that one sigma is worth
    prior_meat = prior.T @ prior * problem.noise**2
    meat = hac + prior_meat
    covariance = sandwich = inverse @ meat @ inverse
    runs = len(every)
    if runs > 1:
        spread = inverse @ (from_runs * runs / (runs - 1) + prior_meat) @ inverse
        covariance = covariance + _along(spread, np.maximum(np.diag(spread) - np.diag(covariance), 0.0))
    covariance = covariance + between_blocks(blocks, A, free, np.diag(covariance), independent - float(free.sum()))
    white = np.diag(inverse) * variance
    return Optimum(
        problem=problem, x=x, covariance=covariance, sandwich=sandwich, white=white, matrix=A, variance=variance,
        memory=longest, samples=independent, pinned=pinned, rows=tuple(every),
    )  # fmt: skip


def squared(r: Array, J: Array) -> bool:
    """Whether residuals (T, outputs), their Jacobian (T, outputs, numbers) and the squares of its scores are finite."""
    with np.errstate(over="ignore", invalid="ignore"):
        scores = np.einsum("tk,tkp->tp", r, J)
        return finite(r * r) and finite(J * J) and finite(np.cumsum(scores, axis=0) ** 2)


BLOCKS = (4, 8)
"""Numbers of blocks that the runs are cut into: few see what changes slowly, many what changes fast.

Each tells the spread, and their mean counts: the larger of two was 11 % wider where the model was right, and held no
more (95.4 and 95.3 % of 95 %; 91.6 and 91.0 under physics that the model lacks, before other models widen them).
"""


MOST = 0.5
"""No block tells more than this share of all, or nothing would be left to tell whether others differ from it."""


def cuts(J: Array, pieces: int) -> NDArray[np.int64]:
    """Rows of a Jacobian (T, outputs, numbers) at which so many pieces begin, the first left out.

    Pieces of one length; where one would tell most of what there is to know, as where a rig answers a step for a moment
    and then stands, pieces that tell equally much.
    """
    length = np.sqrt(np.sum(J * J, axis=(0, 1)))
    information = np.cumsum(np.sum((J / np.where(length > 0, length, np.inf)) ** 2, axis=(1, 2)))
    inside = np.arange(1, pieces)
    even = inside * len(J) // pieces
    each = np.diff(information[even - 1], prepend=0.0, append=information[-1])
    return (
        even
        if each.max() <= MOST * information[-1]
        else np.searchsorted(information, inside / pieces * information[-1], side="right")
    )


def _parts(r: Array, J: Array, pieces: int, sought: NDArray[np.int64], size: int) -> list[tuple[Array, Array]]:
    """Gradient (size,) and Gauss-Newton matrix (size, size) of each of so many pieces of a run's rows."""
    parts: list[tuple[Array, Array]] = []
    for rows in np.split(np.arange(len(r)), cuts(J, pieces)):
        flat, g, A = J[rows].reshape(-1, sought.size), np.zeros(size), np.zeros((size, size))
        g[sought], A[np.ix_(sought, sought)] = flat.T @ r[rows].reshape(-1), flat.T @ flat
        parts.append((g, A))
    return parts


def between_blocks(
    blocks: Mapping[int, list[tuple[Array, Array]]], A: Array, free: NDArray[np.bool_], known: Array, freedom: float
) -> Array:
    """What a covariance with the diagonal `known` (n,) has to be added (n, n) for the spread between blocks.

    Of a number to which block b contributes the share w of what is known, the variance without it is ``known / (1 -
    w)`` under a right model, and the number moves by the difference, in the square (Hausman 1978). Where every block
    has a value of its own, with the variance `spread` and a mean weighted by w, it moves by as much more as follows
    from one-way analysis of variance. The truth is as one more block, away from that mean by ``spread (s^2 + sum
    w^2)``, s the sum of w: 1, or less where a number was known beforehand.

    Numbers are correlated as they move together when a block is left out: widened one by one, two whose ratio every
    block agrees on would lose it.
    """
    here, together = np.ix_(free, free), np.zeros((len(known), len(known)))
    variances: list[Array] = []
    whole = np.diag(pseudo_inverse(A[here]))
    for parts in blocks.values():
        if len(parts) < min(BLOCKS):
            continue
        moved, odds = np.zeros((2, len(parts), len(known)))
        for k, (g, own) in enumerate(parts):
            without = pseudo_inverse((A - own)[here])
            moved[k, free] = without @ g[free]
            odds[k, free] = np.maximum(np.diag(without) / np.where(whole > 0, whole, np.inf) - 1, 0.0)
        share = odds / (1 + odds)
        squares = np.sum(share**2, axis=0)
        weight = np.sum(share**2 + odds**2 * (squares - share**2), axis=0)
        excess = np.maximum(np.sum(moved**2, axis=0) - known * odds.sum(axis=0), 0.0)
        spread = excess / np.where(weight > 0, weight, np.inf)
        away = np.minimum(share.sum(axis=0), 1.0) ** 2 + squares
        variances.append(spread * away * (student(len(parts) - 1) / student(freedom)) ** 2)
        steps = moved / np.sqrt(np.where(weight > 0, weight, np.inf))
        together += steps.T @ steps
    return _along(together, np.asarray(np.mean(variances or [np.zeros(len(known))], axis=0), dtype=np.float64))


def _along(like: Array, variance: Array) -> Array:
    """Covariance (n, n) with the diagonal `variance` (n,) and the correlations of another one."""
    size = np.sqrt(np.diag(like))
    scale = np.sqrt(variance) / np.where(size > 0, size, np.inf)
    return like * np.outer(scale, scale)


PART = 0.05
"""A number takes part in a direction when its share is at least this much of the largest share."""


@dataclass(frozen=True, kw_only=True)
class Identifiability:
    """Singular values (largest first) and directions (rows) of the Jacobian scaled to relative changes.

    `names` are the columns, `blind` the rows of directions that the data cannot see, `effects` the columns' lengths.
    """

    names: tuple[str, ...]
    singular_values: Array
    directions: Array
    blind: Array
    effects: Array

    @property
    def hidden(self) -> set[str]:
        """Names of the numbers that take part in a direction the data cannot see."""
        return {n for d in self.blind for n, _ in self.parts(d)}

    def parts(self, direction: Array) -> list[tuple[str, float]]:
        """Numbers that take part in a direction, with their shares relative to the largest, largest first.

        A number takes part by the size of its change or by the size of its effect.
        """
        share = direction / direction[np.argmax(np.abs(direction))]
        effect = np.abs(direction * self.effects)
        order = np.argsort(-np.abs(share))
        strong = effect >= PART * effect.max(initial=0.0)
        parts = [i for i in order if abs(share[i]) >= PART or (strong[i] and effect[i] > 0)]
        return [(self.names[i], float(share[i])) for i in parts]

    def sentences(self, units: Mapping[str, str]) -> tuple[str, ...]:
        """Say which combinations cannot be seen and which one number would fix it."""
        lines: list[str] = []
        for d in self.blind:
            share = self.parts(d)
            names = [n for n, _ in share]
            if len(names) == 1:
                felt, most = self.effects[self.names.index(names[0])], int(np.argmax(self.effects))
                if felt > 1:  # doubled it would move the outputs by more than they vary: not seen beside another alone
                    lines.append(
                        f"The data cannot see {names[0]} beside {self.names[most]}: the motion depends on that "
                        f"{self.effects[most] / felt:.0e} times as strongly, as where it is chaotic. Fit a shorter "
                        "window, or one that is restarted (horizon)."
                    )
                    continue
                lines.append(
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
            lines.append(f"{what} {one} as a known value to fix it.")
        return tuple(lines)


def identifiability(best: Optimum) -> Identifiability:
    """Singular values of the shared numbers' Jacobian; what differs from run to run and levels of noise eliminated."""
    unknowns, value, A = best.problem.unknowns, best.values, best.matrix
    free = [i for i in range(best.x.size) if not best.pinned[i]]
    shared = [i for i in free if unknowns[i].shared and not unknowns[i].name.startswith(NOISE)]
    own = [i for i in free if i not in shared]
    # relative to the value found, which a search along a blind direction may have carried far from its guess
    sizes = np.array(
        [
            1.0 if u.log else abs(v) if (v := float(value[i])) and abs(v) > 1e-3 * u.scale else u.scale
            for i, u in ((i, unknowns[i]) for i in shared)
        ]
    )
    S = A[np.ix_(shared, shared)]
    if own:
        C = A[np.ix_(shared, own)]
        S = S - C @ pseudo_inverse(A[np.ix_(own, own)]) @ C.T
    S = S * sizes[:, None] * sizes
    w, V = np.linalg.eigh(S) if shared else (np.zeros(0), np.zeros((0, 0)))
    order, blind = np.argsort(w)[::-1], _null(S)
    return Identifiability(
        names=tuple(unknowns[i].name for i in shared),
        singular_values=np.sqrt(np.maximum(w[order], 0.0)),
        directions=V[:, order].T,
        blind=np.array(blind).reshape(len(blind), len(shared)),
        effects=np.sqrt(np.maximum(np.diag(S), 0.0)),
    )


def _null(S: Array) -> list[Array]:
    """Directions of a scaled matrix that change nothing, judged after its columns are brought to one length."""
    d = np.sqrt(np.maximum(np.diag(S), 0.0))
    dead = d <= NULL * d.max(initial=0.0)
    directions = [np.eye(d.size)[i] for i in np.flatnonzero(dead)]
    live = np.flatnonzero(~dead)
    if live.size:
        s = 1 / d[live]
        w, V = np.linalg.eigh(S[np.ix_(live, live)] * s[:, None] * s)
        for k in np.flatnonzero(w <= NULL**2 * w[-1]):
            direction = np.zeros(d.size)
            direction[live] = V[:, k] * s
            directions.append(direction / np.linalg.norm(direction))
    return directions


def _list(names: list[str], word: str = "and") -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {word} {names[-1]}"
