"""How long does a residual resemble itself? Autocorrelation times and long-run sums of residuals and scores."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
