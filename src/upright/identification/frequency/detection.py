"""Synchronous detection: what a signal holds at a known frequency, and when the rest has died away.

Least squares of sines, cosines, their harmonics and a drift over whole periods, as a frequency analyser does it, with
its errors. Where the motion turns, dry friction changes sign and bends it differently before and after; about an
extreme the position is therefore taken as a parabola on either side, with one apex and two curvatures. All periods are
laid over each other there, so that an encoder's steps average out; what a few harmonics would say errs as one over
their number.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

HARMONICS = 31
PER_PERIOD = 4
"""Samples per period that a sine needs at least."""
EDGES = 4096
"""Instants per period at which a speed's sign is looked at."""
REACH = 0.11
"""Share of a period about an extreme in which its shape is fitted."""
BINS = 120
"""Parts of that share of a period over which more samples are averaged."""
NEAR = 0.03
"""Share of a period by which an apex may lie off its first guess."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Tone:
    """What is at one frequency [rad/s] and at its harmonics, for signals in columns.

    `lines` (H, m) are peak and phase there, ``y = Re sum lines[k-1] exp(i k omega t)``, `variance` (m,) is the mean
    square error of the first line, `noise` (m,) the variance of what is left over. `t` (N,) and `y` (N, m) are time [s]
    and the signals without their drift.
    """

    omega: float
    lines: Complex
    variance: Array
    noise: Array
    t: Array
    y: Array

    @property
    def distortion(self) -> Array:
        """Root of the harmonics' power over the first line's."""
        return np.sqrt(np.sum(np.abs(self.lines[1:]) ** 2, axis=0)) / np.maximum(np.abs(self.lines[0]), 1e-300)

    @property
    def coherence(self) -> Array:
        """Share of the power, harmonics aside, that is at the frequency itself."""
        power = np.abs(self.lines[0]) ** 2 / 2
        return power / np.maximum(power + self.noise, 1e-300)

    @cached_property
    def _speed(self) -> Array:
        """Speed at `EDGES` instants of one period (EDGES, m)."""
        k = np.arange(1, self.lines.shape[0] + 1)
        spectrum = np.zeros((EDGES // 2 + 1, self.lines.shape[1]), dtype=np.complex128)
        spectrum[1 : k.size + 1] = 1j * self.omega * k[:, None] * self.lines * EDGES / 2
        return np.fft.irfft(spectrum, EDGES, axis=0)

    @property
    def still(self) -> Array:
        """Share of the period at less than a twentieth of the highest speed; 0.032 for a sine."""
        return np.mean(np.abs(self._speed) <= 0.05 * np.abs(self._speed).max(axis=0), axis=0)

    @cached_property
    def dry(self) -> Complex:
        """Viscous equivalent of unit Coulomb friction: the sign of the speed over the speed, at the first line."""
        sign = np.fft.rfft(np.sign(self._speed), axis=0)[1] * 2 / EDGES
        k = np.arange(1, self.lines.shape[0] + 1)[:, None]
        bent = np.sum(np.abs(k * self.lines)[1:] ** 2, axis=0) > 0.04 * np.abs(self.lines[0]) ** 2
        for j in np.flatnonzero(~bent):  # no parabola about an extreme where harmonics make a fifth of the speed
            turned = sign_line(self.t, self.y[:, j], self.omega, self._speed[:, j])
            sign[j] = sign[j] if turned is None else turned
        first = 1j * self.omega * self.lines[0]
        return np.where(first == 0, 0, sign / np.where(first == 0, 1, first))


def detect(t: Array, y: Array, omega: float, *, resolution: Array | float = 0.0, blocks: int = 0) -> Tone:
    """What the signals hold at `omega`.

    Parameters
    ----------
    t : (N,) array
        Time [s], whole periods of `omega`.
    y : (N, m) array
        Signals.
    omega : float
        [rad/s]
    resolution : float or (m,) array
        Resolution of the signals: rounding repeats from period to period, so that only one period averages it.
    blocks : int
        Parts whose first lines are compared for the variance; the number of whole periods, 16 at most, when 0.

    Raises
    ------
    BadInput
        When there is less than one period, or too few samples per period.
    """
    y = y[:, None] if y.ndim == 1 else y
    span = float(t[-1] - t[0]) * t.size / (t.size - 1)
    periods = span * omega / (2 * math.pi)
    per_period = t.size / periods
    if periods < 0.9 or per_period < PER_PERIOD:
        raise BadInput(
            f"A sine of {omega:.4g} rad/s needs at least one period with four samples, got {periods:.3g} periods of "
            f"{per_period:.3g} samples; log faster or longer."
        )
    count = int(max(1, min(HARMONICS, math.floor(0.45 * per_period))))
    middle = float(t.mean())
    drift = (t - middle) / max(span, 1e-300)
    waves: Complex = np.exp(1j * np.outer(t, omega * np.arange(1, count + 1)))
    columns = np.column_stack([np.ones_like(t), drift, np.real(waves), np.imag(waves)])
    solution = np.linalg.lstsq(columns, y, rcond=None)[0]
    rest = y - columns @ solution
    lines = solution[2 : 2 + count] - 1j * solution[2 + count :]
    free = max(1, t.size - columns.shape[1])
    noise = np.sum(rest**2, axis=0) / free
    variance = 4 * noise / t.size
    parts = blocks or int(min(16, math.floor(periods + 0.01)))
    if parts > 1:
        cuts = np.linspace(0, t.size, parts + 1).astype(int)
        # what each part has at the frequency beyond the whole: slow changes and beats show here
        own = np.array([2 * np.conj(waves[a:b, 0]) @ rest[a:b] / (b - a) for a, b in pairwise(cuts)])
        variance = np.maximum(variance, np.sum(np.abs(own) ** 2, axis=0) / (parts - 1) / parts)
    rounding = 4 * np.asarray(resolution) ** 2 / 12 / per_period
    return Tone(
        omega=omega,
        lines=lines,
        variance=np.maximum(variance, rounding),
        noise=noise,
        t=t,
        y=y - columns[:, :2] @ solution[:2],
    )


def overtones(tones: Sequence[Tone], most: int = 4) -> Complex:
    """Lines at 2, 3, ... times the frequency (F, m, H), as many as all tones have."""
    count = min([most, *(tone.lines.shape[0] - 1 for tone in tones)])
    return np.array([tone.lines[1 : 1 + count].T for tone in tones])


def by_period(y: Array, length: int, period: float) -> Complex:
    """First line of every whole period: `y` (N, m) with `length` samples of `period` seconds in one, drift taken out.

    Returns
    -------
    (K, m) complex array
    """
    whole = y.shape[0] // length
    phase = 2 * math.pi * np.arange(length) / length
    drift = (np.arange(length) - (length - 1) / 2) * period
    columns = np.column_stack([np.cos(phase), np.sin(phase), np.ones(length), drift])
    solve = np.linalg.pinv(columns)[:2]
    parts = np.einsum("cl,klm->kcm", solve, y[: whole * length].reshape(whole, length, -1))
    return parts[:, 0] - 1j * parts[:, 1]


def settled(lines: Complex, *, tolerance: float = 2e-3, noise: Array | float = 0.0, window: int = 5) -> int | None:
    """First period at which what remains of the transient is below `tolerance` of the line, or below `noise`.

    The differences of successive periods shrink by a common complex factor rho; ``d rho/(1 - rho)`` of them remains.

    Parameters
    ----------
    lines : (K, m) complex array
        First line of each period.
    tolerance : float
        Relative.
    noise : float or (m,) array
        Absolute: rounding shows no smaller transient.
    window : int
        Periods looked at at once.
    """
    for last in range(window, lines.shape[0] + 1):
        part = lines[last - window : last]
        steps = np.diff(part, axis=0)
        power = np.maximum(np.sum(np.abs(steps[:-1]) ** 2, axis=0), 1e-300)
        factor = np.sum(steps[1:] * np.conj(steps[:-1]), axis=0) / power
        factor *= np.minimum(1.0, 0.98 / np.maximum(np.abs(factor), 1e-300))
        scatter = np.sqrt(np.mean(np.abs(steps) ** 2, axis=0))
        remains = scatter * np.maximum(1.0, np.abs(factor / (1 - factor)))
        if np.all(remains <= np.maximum(tolerance * np.abs(part[-1]), 3 * np.asarray(noise))):
            return last
    return None


def sign_line(t: Array, y: Array, omega: float, guess: Array) -> complex | None:
    """First line of the speed's sign, from where a signal without drift turns; None when that is not clear.

    Parameters
    ----------
    t, y : (N,) arrays
        Time [s] and position, drift taken out.
    omega : float
        [rad/s]
    guess : (P,) array
        Speed at P instants of one period from phase 0 on: its two changes of sign are where the search begins.
    """
    change = np.flatnonzero(np.sign(guess) != np.sign(np.roll(guess, -1)))
    if change.size != 2:
        return None
    phase = np.mod(omega * t, 2 * math.pi)
    apexes: list[float] = []
    for k in change:
        apex = _apex(phase, y, 2 * math.pi * (k + 0.5) / guess.size)
        if apex is None:
            return None
        apexes.append(apex)
    rising = apexes if guess[(change[0] + 1) % guess.size] > 0 else apexes[::-1]
    low, high = rising  # speed above zero from the least position on to the greatest
    return complex(2 / math.pi * 1j * (np.exp(-1j * high) - np.exp(-1j * low)))


def _apex(phase: Array, y: Array, near: float) -> float | None:
    """Phase of an extreme: the best of a grid, refined; None when it lies at the end of the grid."""
    from scipy.optimize import minimize_scalar
    from scipy.stats import binned_statistic

    away = np.mod(phase - near + math.pi, 2 * math.pi) - math.pi
    reach = 2 * math.pi * (REACH + NEAR)
    there = np.abs(away) < reach
    x, z = away[there], y[there]
    if x.size > BINS:
        x, z = binned_statistic(x, [x, z], "mean", BINS, range=(-reach, reach)).statistic
        x, z = x[np.isfinite(x)], z[np.isfinite(x)]
    if x.size < 12:
        return None
    scale = 2 * math.pi * REACH

    def misfit(shift: float) -> float:
        s = (x - shift) / scale
        inside = np.abs(s) < 1
        s, w = s[inside], z[inside]
        left, right = np.where(s < 0, s, 0.0), np.where(s >= 0, s, 0.0)
        columns = np.column_stack([np.ones_like(s), left**2, right**2, left**3, right**3])
        try:
            solution = np.linalg.solve(columns.T @ columns, columns.T @ w)
        except np.linalg.LinAlgError:  # no sample on one side
            return math.inf
        return float(np.mean((w - columns @ solution) ** 2))

    grid = 2 * math.pi * NEAR * np.linspace(-1, 1, 13)
    best = int(np.argmin([misfit(float(g)) for g in grid]))
    if best in (0, grid.size - 1):
        return None
    bounds = (float(grid[best - 1]), float(grid[best + 1]))
    refined: Any = minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-6})
    return near + float(refined.x)
