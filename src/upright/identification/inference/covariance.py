"""Covariance of the numbers sought at an optimum, with standard errors that survive residuals with a memory.

White-noise errors were found 10 to 30 times too small on real rigs, because a misfit now is a misfit a moment later.
The sandwich estimate sums the autocovariance of the scores (Newey and West 1987) over a span chosen from the data
(Andrews 1991); with several runs it is compared with the spread from run to run, the larger counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.problem.normal_equations import pseudo_inverse
from upright.identification.problem.residuals import Problem
from upright.signals.memory import automatic_span, long_run, lost_share, memory

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """Coordinates `x` (n,) at which the cost of a problem is least, and how sure they are.

    `covariance` (n, n) has zero rows for numbers that are `pinned` (n,), held by a bound; `white` (n,) are the
    variances that uncorrelated residuals would give, `matrix` (n, n) is Gauss-Newton's, prior knowledge included. One
    weighted residual has the `variance`; residuals have forgotten themselves after `memory` seconds (autocorrelation
    below 1/e), which leaves so many independent `samples`.
    """

    problem: Problem
    x: Array
    covariance: Array
    white: Array
    matrix: Array
    variance: float
    memory: float
    samples: float
    pinned: NDArray[np.bool_]

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
    def shared(self) -> list[int]:
        """Places of the numbers that all runs share."""
        return [i for i, u in enumerate(self.problem.unknowns) if u.shared]


def student(freedom: float) -> float:
    """Student's 97.5 % point for this many degrees of freedom, two at least."""
    from scipy.special import stdtrit

    return float(stdtrit(max(freedom, 2.0), 0.975))


def assess(problem: Problem, x: Array) -> Optimum:
    """Uncertainty at the optimum `x`, from central differences in lanes."""
    size = x.size
    A = np.zeros((size, size))
    hac, from_runs = np.zeros((size, size)), np.zeros((size, size))
    cost, count, runs, longest, independent = 0.0, 0, 0, 0.0, 0.0
    for index, track in enumerate(problem.tracks):
        rows = problem.rows(index, x, central=True)
        if rows is None:
            continue
        runs += 1
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
        cost += float(np.sum(r * r))
        count += int(np.count_nonzero(track.weights)) * r.size // track.weights.size
        longest = max(longest, memory(r, track.spacing))
        independent += r.shape[0] / span
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
    covariance = inverse @ meat @ inverse
    if runs > 1:
        spread = inverse @ (from_runs * runs / (runs - 1) + prior_meat) @ inverse
        factor = np.sqrt(np.maximum(np.diag(spread) / np.where(np.diag(covariance) > 0, np.diag(covariance), 1.0), 1.0))
        covariance = covariance * np.outer(factor, factor)
    white = np.diag(inverse) * variance
    return Optimum(
        problem=problem, x=x, covariance=covariance, white=white, matrix=A, variance=variance, memory=longest,
        samples=independent, pinned=pinned,
    )  # fmt: skip
