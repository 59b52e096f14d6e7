"""How fast was it moving? Speeds, accelerations and periods out of sampled angles, without a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class State:
    """Measured first state: `x` (states,) in the paper's order, its standard `error`, and each state's `spread`."""

    x: Array
    spread: Array
    error: Array


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Position, speed and acceleration of one coordinate, each (N,), and how far the ends are unreliable.

    Of several coordinates that went through the same smoothing each is (coordinates, N).
    """

    q: Array
    v: Array
    a: Array
    edge: int

    @property
    def fades(self) -> Array:
        """Speeds (coordinates,) below which the sign of a speed is not believed; zero of what does not move."""
        return 0.02 * np.std(self.v, axis=-1)


def dominant_period(y: Array, dt: float) -> float:
    """Period [s] of the root-mean-square frequency of a signal (N,), its slowest 99 % of power counted.

    A signal without motion has the length of the record as its period.
    """
    n = y.size
    whole = n * dt
    ramp = np.linspace(-1.0, 1.0, n)
    z = y - y.mean()
    z = z - ramp * (np.sum(ramp * z) / np.sum(ramp * ramp))
    power = np.abs(np.fft.rfft(z * np.hanning(n))) ** 2
    total = power.sum()
    if not total > 0:
        return whole
    last = int(np.searchsorted(np.cumsum(power), 0.99 * total)) + 1
    f = np.fft.rfftfreq(n, dt)[:last]
    mean_square = float(np.sum(f * f * power[:last]) / power[:last].sum())
    return whole if mean_square <= 0 else min(whole, 1.0 / np.sqrt(mean_square))


def savitzky_golay(y: Array, dt: float, width: int, *, order: int = 4, derivatives: int = 2) -> Motion:
    """Least-squares polynomials over a sliding window of `width` samples (made odd), fitted one-sided at the ends.

    The acceleration is zero when only one of the `derivatives` is requested.
    """
    from scipy.ndimage import correlate1d

    n = y.size
    width = min(max(order + 2, width), n)
    width -= 1 - width % 2
    if width <= order:
        order = max(1, width - 1)
    if order < 2:
        v = np.gradient(y, dt) if n > 1 else np.zeros(n)
        return Motion(q=y + 0.0, v=np.asarray(v, dtype=np.float64), a=np.zeros(n), edge=0)
    half = width // 2
    fit, powers = _polynomials(width, order)
    parts: list[Array] = []
    for d in range(derivatives + 1):
        # the middle of the window: the d-th coefficient times d!
        part = correlate1d(y, fit[d] * (1.0, 1.0, 2.0)[d], mode="nearest")
        part[:half] = powers[d, :half] @ (fit @ y[:width])
        part[n - half :] = powers[d, half + 1 :] @ (fit @ y[n - width :])
        parts.append(part / dt**d)
    return Motion(q=parts[0], v=parts[1], a=parts[2] if derivatives > 1 else np.zeros(n), edge=half)


def smoothed(signals: Sequence[Array], dt: float, width: int, *, order: int = 4) -> Motion:
    """Motion of coordinates (N,) that were sampled together, through the same smoothing; exactly none of a constant."""
    none = np.zeros(len(signals[0]))
    parts = [
        savitzky_golay(y, dt, width, order=order) if np.ptp(y) else Motion(q=y + none, v=none, a=none, edge=0)
        for y in signals
    ]
    q, v, a = (np.array([getattr(part, name) for part in parts]) for name in ("q", "v", "a"))
    return Motion(q=q, v=v, a=a, edge=max(part.edge for part in parts))


def middle(width: int, *, order: int = 4) -> Array:
    """Weights (width,) that give a polynomial's value at the middle of an odd number of samples."""
    return _polynomials(width, min(order, width - 1))[0][0]


@cache
def _polynomials(width: int, order: int) -> tuple[Array, Array]:
    """Coefficients (order + 1, width) of the fitted polynomial per sample, and derivatives 0 to 2 at the samples."""
    s = np.arange(width) - width // 2
    scale = float(width // 2)
    V = np.vander(s / scale, order + 1, increasing=True)
    unit = scale ** -np.arange(order + 1.0)
    fit = np.linalg.pinv(V) * unit[:, None]
    k = np.arange(order + 1)
    powers = np.zeros((3, width, order + 1))
    for d in range(3):
        factor = np.prod([k - j for j in range(d)], axis=0) if d else np.ones(order + 1)
        powers[d] = np.where(k >= d, factor * s[:, None].astype(float) ** np.maximum(k - d, 0), 0.0)
    return fit, powers


def end_errors(y: Array, q: Array, dt: float, width: int, *, order: int = 4) -> tuple[float, float]:
    """Standard errors of position and speed at the end of a signal (N,) that polynomials smoothed to `q`."""
    m = max(order + 2, min(width, y.size))
    noise = float(np.std(y - q)) * np.sqrt(m / max(m - order - 1, 1))
    V = np.vander(np.linspace(0.0, 1.0, m), order + 1, increasing=True)
    C = np.linalg.pinv(V.T @ V)
    return noise * float(np.sqrt(C[0, 0])), noise * float(np.sqrt(C[1, 1])) / ((m - 1) * dt)


ROUGH = 0.1
"""Noise of a smoothed acceleration as a share of its spread, at most; the smoothing is as narrow as this allows."""


def acceleration_width(y: Array, dt: float, resolution: float) -> int:
    """Samples over which a cubic gives an acceleration that counts and noise do not drown; odd."""
    rough = float(np.median(np.abs(np.diff(y, 2)))) / (0.6745 * np.sqrt(6))
    noise = max(resolution / np.sqrt(12), rough)
    width = 9
    while width < y.size // 8:
        a = savitzky_golay(y, dt, width, order=3).a
        if noise * noise_gain(width, order=3) / dt**2 < ROUGH * float(np.std(a)):
            break
        width = int(width * 1.3) | 1
    return width


def white_noise(y: Array) -> float:
    """Standard deviation of white noise on a signal (N,) that is smooth over some samples, from fourth differences."""
    differences = np.diff(y, 4)  # variance 70 times that of the noise; what is not noise is rarely its median
    return float(np.median(np.abs(differences))) / (0.6745 * np.sqrt(70.0)) if differences.size else 0.0


def noise_gain(width: int, *, order: int = 4) -> float:
    """Standard deviation of the acceleration in the middle of a window, in units of noise per sample period squared."""
    return 2 * float(np.linalg.norm(_polynomials(width, order)[0][2]))


def gaussian_noise_gain(sigma: float) -> float:
    """The same of the second derivative of a Gaussian of standard deviation `sigma` [samples], some wide."""
    return float(np.sqrt(3 / (8 * np.sqrt(np.pi)))) * sigma**-2.5


def smoothing_width(y: Array, dt: float, period: float, resolution: float) -> int:
    """Samples over which a polynomial of order 4 may be fitted: an eighth of a period, at least 15 steps of motion."""
    width = int(round(period / 8 / dt))
    if resolution > 0:
        speed = float(np.std(y)) * 2 * np.pi / period
        if speed > 0:
            width = max(width, min(int(round(15 * resolution / (speed * dt))), 2 * width))
    return max(7, width)


def scatter(y: Array) -> float:
    """Standard deviation of a signal, never zero."""
    s = float(np.std(y))
    return s if s > 0 else 1.0
