"""How sure are we? Standard errors that survive residuals with a memory.

White-noise errors were found 10 to 30 times too small on real rigs (DESIGN 9), because a misfit now is a misfit
a moment later. The sandwich estimate sums the autocovariance of the scores (Newey and West 1987) over a span chosen
from the data (Andrews 1991); with several runs it is compared with the spread from run to run, the larger counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.problem.normal import Rows, pseudo_inverse
from upright.identification.problem.problem import Problem
from upright.signals.memory import automatic_span, long_run, lost_share, memory

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Uncertainty of the coordinates sought.

    Attributes
    ----------
    covariance : (n, n) array
        In the coordinates in which the numbers are sought; zero rows where a bound holds a number.
    white : (n,) array
        Variances that uncorrelated residuals would give.
    matrix : (n, n) array
        Gauss-Newton matrix, prior knowledge included.
    variance : float
        Variance of one weighted residual.
    memory : float
        Seconds after which residuals have forgotten themselves (autocorrelation below 1/e).
    samples : float
        Number of independent scores the sandwich rests on.
    pinned : (n,) array of bool
        Numbers held by a bound.
    """

    covariance: Array
    white: Array
    matrix: Array
    variance: float
    memory: float
    samples: float
    pinned: NDArray[np.bool_]


def assess(problem: Problem, x: Array, *, clusters: bool = True) -> Spread:
    """Uncertainty at the optimum `x`, from central differences in lanes."""
    size = x.size
    A = np.zeros((size, size))
    hac, from_runs = np.zeros((size, size)), np.zeros((size, size))
    cost, count, longest, independent = 0.0, 0, 0.0, 0.0
    all_rows: list[tuple[int, Rows]] = []
    for index in range(len(problem.tracks)):
        rows = problem.rows(index, x, central=True)
        if rows is not None:
            all_rows.append((index, rows))
    for index, rows in all_rows:
        r, J = rows.residual, rows.jacobian
        p = rows.sought.size
        here = np.ix_(rows.sought, rows.sought)
        flat = J.reshape(-1, p)
        A[here] += flat.T @ flat
        scores = np.einsum("tk,tkp->tp", r, J)
        span = automatic_span(scores)
        hac[here] += long_run(scores, span) / (1 - lost_share(scores, span))
        g = scores.sum(axis=0)
        from_runs[here] += np.outer(g, g)
        cost += float(np.sum(r * r))
        weights = problem.tracks[index].weights
        count += int(np.count_nonzero(weights)) * r.size // weights.size
        longest = max(longest, memory(r, problem.tracks[index].spacing))
        independent += r.shape[0] / span
    _, prior = problem.prior_rows(x)
    A = A + prior.T @ prior
    gradient = problem.normal(x).gradient if np.any(_at(problem, x)) else np.zeros(size)
    pinned = _held(problem, x, gradient)
    free = ~pinned
    inverse = np.zeros((size, size))
    inverse[np.ix_(free, free)] = pseudo_inverse(A[np.ix_(free, free)])
    variance = cost / max(count - int(free.sum()), 1)
    # the fit has made the scores smaller, by as many as it could choose of those that are independent
    hac *= independent / max(independent - float(free.sum()), independent / 2, 1e-9)
    # a prior's row is one residual of the size that one sigma is worth
    prior_meat = prior.T @ prior * problem.noise**2
    meat = hac + prior_meat
    covariance = inverse @ meat @ inverse
    runs = len(all_rows)
    if clusters and runs > 1:
        spread = inverse @ (from_runs * runs / (runs - 1) + prior_meat) @ inverse
        factor = np.sqrt(np.maximum(np.diag(spread) / np.where(np.diag(covariance) > 0, np.diag(covariance), 1.0), 1.0))
        covariance = covariance * np.outer(factor, factor)
    white = np.diag(inverse) * variance
    return Spread(
        covariance=covariance, white=white, matrix=A, variance=variance, memory=longest, samples=independent,
        pinned=pinned,
    )  # fmt: skip


def _at(problem: Problem, x: Array) -> NDArray[np.bool_]:
    return (x <= problem.lower) | (x >= problem.upper)


def _held(problem: Problem, x: Array, gradient: Array) -> NDArray[np.bool_]:
    return ((x <= problem.lower) & (gradient >= 0)) | ((x >= problem.upper) & (gradient <= 0))
