"""What do the peaks of one free swing tell? Damped frequency, viscous decrement, dry friction and where it would rest.

A mass on a spring with viscous and dry friction swings about ``centre + s delta``, where ``delta = f/k`` and ``s`` is
-1 or 1 against the direction of motion, so that every half swing is linear: it takes ``pi/omega_d`` and

    x[i+1] = (1 + rho) (centre + s[i] delta) - rho x[i],    rho = exp(-pi sigma/omega_d),

with ``s = 1`` after a maximum. Dry friction bends the logarithmic decrement but leaves the period alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.errors import NotIdentifiable
from upright.signals.stretches import turning_points

Array = NDArray[np.float64]

FEWEST = 4
"""Extremes needed: one recursion has three numbers."""
WINDOW = 0.35
"""Half width of the samples that fix an extreme, as a share of a half swing."""
UNEVEN, ODD = 0.15, 0.1
"""Half swings may differ by this share of their median, and heights from the recursion by this share of the largest."""
LEAST, MOST = 0.02, 1.5
"""Bounds of what a half swing leaves; a drive can feed a swing."""
LOUDEST = 0.02
"""An extreme counts when the motion turns back by this share of the whole swing."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Decay:
    """One free swing after a step or a release; lengths in the unit of the signal.

    Attributes
    ----------
    t, x : (N,) arrays
        Times [s] and heights of the extremes, from the samples around each.
    maximum : (N,) array of bool
        Whether an extreme is a maximum.
    omega_d, omega_n : float
        Damped and undamped natural frequency [rad/s].
    sigma, rho : float
        Rate of viscous decay [1/s], and what it alone leaves of a half swing.
    centre, delta : float
        Where the body would rest without dry friction, and half the width in which dry friction can hold it.
    model : (N,) array
        Heights of the extremes as the recursion has them.
    omega_error, sigma_error, delta_error : float
        Standard errors of `omega_n`, `sigma` and `delta`.
    """

    t: Array
    x: Array
    maximum: NDArray[np.bool_]
    omega_d: float
    omega_n: float
    sigma: float
    rho: float
    centre: float
    delta: float
    model: Array
    omega_error: float
    sigma_error: float
    delta_error: float

    @property
    def zeta(self) -> float:
        """Damping ratio."""
        return self.sigma / self.omega_n

    @property
    def decrement(self) -> float:
        """Logarithmic decrement of a whole period that viscous friction alone would show."""
        return -2 * math.log(self.rho)


def decay(t: Array, x: Array, *, resolution: float = 0.0) -> Decay:
    """Frequencies and friction of one free swing.

    Parameters
    ----------
    t : (T,) array
        Time [s].
    x : (T,) array
        Position in any unit, offset and all, from where the last step of the force acted.
    resolution : float
        Smallest step of the sensor.

    Raises
    ------
    NotIdentifiable
        When fewer than four extremes can be seen, or they are not those of one decaying swing.
    """
    at = turning_points(x, max(4 * resolution, LOUDEST * float(np.ptp(x))))
    if at.size < FEWEST:
        raise NotIdentifiable(
            f"A decrement needs at least {FEWEST} extremes, and this swing shows {at.size};"
            " step harder, take off friction or log longer."
        )
    half = float(np.median(np.diff(t[at])))
    rho, omega_d = 0.9, math.pi / half
    extremes = [(float(t[i]), float(x[i]), 0.0, 0.0) for i in at]
    omega_d_error, covariance, numbers, maximum = 0.0, np.eye(4), np.zeros(4), _maxima(x, at)
    times = heights = np.zeros(0)
    for _ in range(4):  # shape and extremes improve each other; the shape is known to 1e-4 after two rounds
        sigma = -math.log(rho) * omega_d / math.pi
        extremes = [_extreme(t, x, f[0], omega_d, sigma, resolution) for f in extremes]
        times, heights, t_error, x_error = (np.array(column) for column in zip(*extremes, strict=True))
        omega_d, omega_d_error = _frequency(times, t_error)
        numbers, covariance = _heights(heights, x_error, maximum)
        rho = float(numbers[1])
    uneven = float(np.max(np.abs(np.diff(times) / float(np.median(np.diff(times))) - 1)))
    odd = float(np.max(np.abs(recursion(numbers, maximum) - heights))) / float(np.ptp(heights))
    if uneven > UNEVEN or odd > ODD or not LEAST < rho < MOST:
        raise NotIdentifiable(
            f"This is not one decaying swing: half swings differ by {100 * uneven:.0f} %, heights miss the"
            f" recursion by {100 * odd:.0f} %; name the column of the body that swings, and lock the others."
        )
    sigma = -math.log(rho) * omega_d / math.pi
    sigma_error = math.sqrt(covariance[1, 1]) / rho * omega_d / math.pi
    omega_n = math.hypot(omega_d, sigma)
    return Decay(
        t=times, x=heights, maximum=maximum,
        omega_d=omega_d, omega_n=omega_n, sigma=sigma, rho=rho,
        centre=float(numbers[2]), delta=float(numbers[3]), model=recursion(numbers, maximum),
        omega_error=math.hypot(omega_d * omega_d_error, sigma * sigma_error) / omega_n,
        sigma_error=sigma_error, delta_error=math.sqrt(covariance[3, 3]),
    )  # fmt: skip


def _maxima(x: Array, at: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether each turn is a maximum: they alternate."""
    return (np.arange(at.size) % 2 == 0) == bool(x[at[0]] > x[at[1]])


def recursion(numbers: Array, maximum: NDArray[np.bool_]) -> Array:
    """Heights (N,) of extremes from the first one, rho, centre and delta."""
    first, rho, centre, delta = (float(v) for v in numbers)
    out = np.empty(maximum.size)
    out[0] = first
    for i in range(1, maximum.size):
        side = delta if maximum[i - 1] else -delta
        out[i] = (1 + rho) * (centre + side) - rho * out[i - 1]
    return out


def _extreme(
    t: Array, x: Array, at: float, omega_d: float, sigma: float, resolution: float
) -> tuple[float, float, float, float]:
    """Time and height of an extreme and their errors: the exact shape, about a centre of its own on either side."""
    width = WINDOW * math.pi / omega_d
    near = np.abs(t - at) <= width
    time, y = t[near], x[near]
    if time.size < 8:
        raise NotIdentifiable(
            f"An extreme at {at:.4g} s rests on {time.size} samples and needs 8; log at least {12 * omega_d:.0f} Hz."
        )
    scale = (omega_d**2 + sigma**2) / omega_d
    z, J = np.zeros(4), np.zeros((time.size, 4))
    for _ in range(6):
        tau = time - at
        fade = np.exp(-sigma * tau)
        shape = 1 - fade * (np.cos(omega_d * tau) + sigma / omega_d * np.sin(omega_d * tau))
        slope = scale * fade * np.sin(omega_d * tau)
        before = tau < 0
        J = np.column_stack([np.ones_like(tau), -shape * before, -shape * ~before, np.zeros_like(tau)])
        z[:3] = np.linalg.lstsq(J[:, :3], y, rcond=None)[0]
        J[:, 3] = np.where(before, z[1], z[2]) * slope
        step = float(np.linalg.lstsq(J, y - J[:, :3] @ z[:3], rcond=None)[0][3])
        at += min(max(step, -width / 4), width / 4)
    left = y - J[:, :3] @ z[:3]
    variance = max(float(left @ left) / (time.size - 4), resolution**2 / 12)
    covariance = np.linalg.pinv(J.T @ J) * variance
    return at, float(z[0]), math.sqrt(covariance[3, 3]), math.sqrt(covariance[0, 0])


def _frequency(times: Array, error: Array) -> tuple[float, float]:
    """Damped frequency [rad/s] of extremes half a period apart, and its error: the larger of two accounts."""
    index = np.arange(times.size, dtype=np.float64)
    weight = 1 / np.maximum(error, 1e-3 * float(np.median(error)) + 1e-12) ** 2
    middle = float(np.average(index, weights=weight))
    spread = float(weight @ (index - middle) ** 2)
    half = float(weight @ ((index - middle) * times)) / spread
    left = times - np.average(times, weights=weight) - half * (index - middle)
    chi = float(weight @ left**2) / (times.size - 2)
    half_error = math.sqrt(max(1.0, chi) / spread)
    return math.pi / half, math.pi / half**2 * half_error


def _heights(x: Array, error: Array, maximum: NDArray[np.bool_]) -> tuple[Array, Array]:
    """First height, rho, centre and delta with their covariance."""
    side = np.where(maximum[:-1], 1.0, -1.0)
    rows = np.column_stack([-x[:-1], np.ones(side.size), side])
    slope, whole, jump = (float(v) for v in np.linalg.lstsq(rows, x[1:], rcond=None)[0])
    rho = min(max(slope, LEAST), MOST)
    start = np.array([x[0], rho, whole / (1 + rho), jump / (1 + rho)])
    numbers: Array = start
    J = np.eye(4)
    for _ in range(6):  # Gauss-Newton from the recursion's own line, which errors in both neighbours bias a little
        J = _sensitivity(numbers, maximum) / error[:, None]
        left = (x - recursion(numbers, maximum)) / error
        change = np.linalg.lstsq(J, left, rcond=None)[0]
        numbers = np.asarray(numbers + change, dtype=np.float64)
        numbers[1] = min(max(float(numbers[1]), LEAST), MOST)
    left = (x - recursion(numbers, maximum)) / error
    chi = float(left @ left) / (x.size - FEWEST) if x.size > FEWEST else 1.0
    inverse = np.linalg.pinv(J.T @ J)
    return numbers, np.asarray(inverse * max(1.0, chi), dtype=np.float64)


def _sensitivity(numbers: Array, maximum: NDArray[np.bool_]) -> Array:
    """Derivatives (N, 4) of the heights to first height, rho, centre and delta."""
    first, rho, centre, delta = (float(v) for v in numbers)
    J = np.zeros((maximum.size, 4))
    J[0, 0] = 1.0
    height = first
    for i in range(1, maximum.size):
        sign = 1.0 if maximum[i - 1] else -1.0
        J[i] = -rho * J[i - 1]
        J[i] += [0.0, centre + sign * delta - height, 1 + rho, sign * (1 + rho)]
        height = (1 + rho) * (centre + sign * delta) - rho * height
    return J
