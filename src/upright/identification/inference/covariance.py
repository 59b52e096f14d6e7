"""How sure are we? Standard errors that survive residuals with a memory.

White-noise errors were found 10 to 30 times too small on real rigs (DESIGN 9), because a misfit now is a misfit
a moment later. The sandwich estimate sums the autocovariance of the scores (Newey and West 1987) over a span chosen
from the data (Andrews 1991); with several runs it is compared with the spread from run to run, the larger counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.problem.normal import Rows
from upright.identification.problem.problem import Problem

Array = NDArray[np.float64]

NULL = 1e-6
"""Singular values of the scaled Jacobian below this share of the largest are zero: finite differences are no better."""


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


def long_run(scores: Array, span: int) -> Array:
    """Sum (p, p) of the autocovariances of scores (T, p), Bartlett's weights out to `span` samples."""
    pad = np.zeros((span, scores.shape[1]))
    total = np.cumsum(np.concatenate([pad, scores, pad]), axis=0)
    window = total[span:] - total[:-span]
    return window.T @ window / span


def automatic_span(scores: Array) -> int:
    """Samples out to which autocovariances count, by Andrews' rule for first-order memory, column by column."""
    n = scores.shape[0]
    rho = _first_order(scores)
    alpha = 4 * rho**2 / ((1 - rho) ** 2 * (1 + rho) ** 2)
    longest = float(np.max(alpha, initial=0.0))
    return max(1, min(int(1.1447 * (longest * n) ** (1 / 3)) + 1, n // 4))


def lost_share(scores: Array, span: int) -> float:
    """Share of the long-run sum that Bartlett's weights lose when memory is first-order, at most one half."""
    rho = float(np.max(_first_order(scores), initial=0.0))
    return min(0.5, 2 * rho / ((1 - rho**2) * span))


def _first_order(scores: Array) -> Array:
    """First-order autocorrelation of every column, between 0 and just below 1."""
    before, after = scores[:-1], scores[1:]
    power = np.einsum("tp,tp->p", before, before)
    rho = np.einsum("tp,tp->p", before, after) / np.where(power > 0, power, 1.0)
    return np.clip(rho, 0.0, 1 - 1.0 / scores.shape[0])


def memory(residual: Array, dt: float) -> float:
    """Seconds in which the autocorrelation of residuals (T, outputs) falls below 1/e, the longest over outputs."""
    longest = 0.0
    for e in residual.T:
        if not np.any(e):
            continue
        n = 1 << (2 * e.size - 1).bit_length()
        spectrum = np.abs(np.fft.rfft(e, n)) ** 2
        r = np.fft.irfft(spectrum)[: e.size]
        below = np.flatnonzero(r < r[0] / math.e)
        longest = max(longest, float(below[0] if below.size else e.size) * dt)
    return longest


def loudness(problem: Problem, x: Array) -> float:
    """Weighted residual that one independent observation carries: its deviation times the root of its memory.

    What was known beforehand is weighed against the data in this unit.
    """
    squares, samples = 0.0, 0
    for index, track in enumerate(problem.tracks):
        y = problem.simulate(index, x[:, None], track.length)[:, :, :, 0]
        e = np.moveaxis((y - track.targets(track.length)) * track.weights, 1, 0)
        e = e.reshape(len(e), -1) if track.ahead else e.reshape(-1, len(track.columns))
        alike = max(1.0, 2 * memory(e, track.spacing) / track.spacing - 1)
        squares += alike * float(np.sum(e * e))
        samples += e.shape[0] * max(1, int(np.count_nonzero(track.weights)) * (track.length if track.ahead else 1))
    return math.sqrt(squares / max(samples, 1))


def pseudo_inverse(A: Array) -> Array:
    """Inverse of a Gauss-Newton matrix in the directions that it sees; columns scaled to one first."""
    d = np.sqrt(np.maximum(np.diag(A), 0.0))
    s = np.where(d > 0, 1 / np.where(d > 0, d, 1.0), 0.0)
    w, V = np.linalg.eigh(A * s[:, None] * s)
    keep = w > NULL**2 * max(float(w[-1]), 0.0) if w.size else np.zeros(0, dtype=bool)
    inverse = (V[:, keep] / w[keep]) @ V[:, keep].T
    return inverse * s[:, None] * s


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
