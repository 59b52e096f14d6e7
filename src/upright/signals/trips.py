"""When a drive goes off, or comes on late, whatever the logged command says.

An amplifier that trips leaves the logged command where it was, and the body coasts. The acceleration of the driven
coordinate tells: it is regressed on the command, the sign of the speed (dry friction) and what else acts on it, once
with the command as logged and once with a command that ends earlier, for every moment at which it may have ended. All
have gone through the same smoothing, so the moment is sharper than the smoothing is wide. Without a model speeds and
positions act; whoever has one brings its terms along.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upright.signals.regression import LeastSquares
from upright.signals.smoothing import Motion, acceleration_width, middle, scatter, smoothed

Array = NDArray[np.float64]

CLEAR = 0.5, 0.1
"""A trip is believed when it leaves less than this share of what the logged command leaves unexplained.

First when the command has one level, then when it has several: a law's command follows the motion, and both are
then easily mistaken for each other (no closed-loop log of the ECP 205 and 210 goes below 0.17).
"""

POOR = 0.3
"""Share of the acceleration's variance that may stay unexplained with a trip; what explains less explains nothing."""

SLOW = 0.2
"""Share of the largest speed that a body needs when its drive trips; dry friction explains what stops slower."""

RESTS = 0.5
"""Seconds for which a body rests against a command that moved it before, when its drive is dead."""

LEAST = 30
"""Independent stretches (record over smoothing) that a record needs before it is judged."""

STUCK = 0.02
"""Share of the largest speed below which a body may stick, where its drive cannot be judged."""

ROWS = 800
"""Samples that enter the regression."""


@dataclass(frozen=True, kw_only=True)
class Trip:
    """A command that acted for a shorter time than was logged.

    Attributes
    ----------
    at : float
        When it really ended (or began) [s from the first sample].
    error : float
        Its standard uncertainty [s].
    logged : float
        When the log says it ended (or began) [s from the first sample].
    late : bool
        Whether the command began late instead of ending early.
    before, after : float
        Mean acceleration of the driven coordinate just before and after [SI].
    unexplained, otherwise : float
        Share of the acceleration's variance left unexplained with the trip, and with the command as logged.
    """

    at: float
    error: float
    logged: float
    late: bool
    before: float
    after: float
    unexplained: float
    otherwise: float


@dataclass(frozen=True, kw_only=True)
class TripRegression:
    """What an acceleration (or force) is explained by, when the command may have acted for a part of the time only.

    Attributes
    ----------
    rows : (T,) array
        Samples that enter.
    target : (T,) array
        To be explained there.
    base : (T, columns) array
        What a trip leaves as it is, smoothed.
    switched : (N, columns) array
        What a trip cuts off: the command first, then what goes with it; not smoothed yet.
    weights : (width,) array
        The smoothing.
    """

    rows: NDArray[np.int64]
    target: Array
    base: Array
    switched: Array
    weights: Array

    @cached_property
    def whole(self) -> Array:
        """`switched` (T, columns), smoothed."""
        return _smoothed(self.switched, self.weights)[self.rows]

    @cached_property
    def _basis(self) -> Array:
        size = np.linalg.norm(self.base, axis=0)
        U, s, _ = np.linalg.svd(self.base[:, size > 0] / size[size > 0], full_matrices=False)
        return U[:, s > 1e-5 * s[0]]

    @cached_property
    def rest(self) -> Array:
        """What of the target (T,) `base` does not explain."""
        return self._aside(self.target)

    @cached_property
    def variance(self) -> float:
        """Sum of squares of the target about its mean."""
        away = self.target - self.target.mean()
        return float(away @ away)

    def _aside(self, x: Array) -> Array:
        return x - self._basis @ (self._basis.T @ x)

    def before(self, m: int) -> Array:
        """`switched` (T, columns) with zeros from sample `m` on, smoothed."""
        half = self.weights.size // 2
        out = np.where((self.rows < m)[:, None], self.whole, 0.0)
        for i in np.flatnonzero(np.abs(self.rows - m) <= half):
            here = self.rows[i]
            inside = np.arange(here - half, here + half + 1) < m
            out[i] = (self.weights * inside) @ self.switched[here - half : here + half + 1]
        return out

    def explain(self, columns: Array) -> tuple[float, Array]:
        """Share of the variance that base and `columns` (T, p) leave unexplained, and the slopes (p,) of the latter."""
        alone = self._aside(columns)
        size = np.linalg.norm(columns, axis=0)
        acts = np.linalg.norm(alone, axis=0) > 1e-4 * size
        slopes = np.zeros(size.size)
        slopes[acts] = np.linalg.lstsq(alone[:, acts] / size[acts], self.rest, rcond=1e-5)[0] / size[acts]
        left = self.rest - alone @ slopes
        return float(left @ left) / self.variance, slopes

    def misfit(self, m: int, *, late: bool, forward: bool) -> float:
        """Share of the variance left when the command acts before sample `m` only, or from there on.

        All of it when that has to be `forward` and the command would push backwards, in which case there is no trip.
        """
        early = self.before(m)
        left, slopes = self.explain(self.whole - early if late else early)
        if not forward:
            return left
        acting = self.switched[m if late else m - 1]
        # the force at no speed is an extrapolation unless the command has several levels
        pushed = float(slopes @ acting) * float(acting[0]) > 0 and (float(slopes[0]) > 0 or not self.levels)
        return left if pushed else 1.0

    @cached_property
    def levels(self) -> bool:
        """Whether the command has more than one level besides zero; what a resampled step passes is none."""
        u = self.switched[:, 0]
        held = u[1:][np.diff(u) == 0]
        held = held if np.any(held) else u
        return bool(np.ptp(held[held != 0]))

    def search(self, low: int, high: int, *, late: bool = False, forward: bool = True) -> tuple[int, dict[int, float]]:
        """Sample between two at which the command most likely ended (or began), and the misfit of all that were tried.

        Three combs, each ten times finer than the one before.
        """
        costs: dict[int, float] = {}
        at, step = 0, high - low
        while step > 1:
            step = max(1, step // (10 if costs else 100))
            tried = (
                range(max(low, at - 10 * step), min(high, at + 10 * step), step) if costs else range(low, high, step)
            )
            costs |= {m: self.misfit(m, late=late, forward=forward) for m in tried}
            at = min(costs, key=lambda m: costs[m])
        return at, costs


Terms = Callable[[Motion], Sequence[Array]]
"""Columns (N,) that act on the first coordinate of a motion, whose positions are as they were read."""


def linear(motion: Motion) -> list[Array]:
    """What acts where nobody knows better: every position and speed."""
    return [*motion.v, *(motion.q - motion.q[:, :1])]


def find_trip(
    t: Array,
    u: Array,
    y: Array,
    others: Sequence[Array] = (),
    *,
    resolution: float = 0.0,
    late: bool = False,
    terms: Terms = linear,
) -> Trip | None:
    """Early end, or late begin, of the effect of a command, None when the motion shows none.

    Parameters
    ----------
    t, u, y : (N,) arrays
        Uniform time [s], logged command, measured coordinate that it drives; a positive command pushes it up.
    others : sequence of (N,) arrays
        Coordinates that pull at it.
    resolution : float
        Resolution of `y`.
    late : bool
        Ask for a late begin instead of an early end.
    terms : callable, optional
        What acts on `y`, from the motion of `y` and `others`.
    """
    return trip_or_misfit(t, u, y, others, resolution=resolution, late=late, terms=terms)[0]


def trip_or_misfit(
    t: Array, u: Array, y: Array, others: Sequence[Array], *, resolution: float, late: bool, terms: Terms = linear
) -> tuple[Trip | None, float]:
    """What `find_trip` says, and what is left unexplained with the command as logged, infinite if nobody can say."""
    nobody = None, math.inf
    live = np.flatnonzero(u)
    if t.size < 100 or live.size < 10:
        return nobody
    dt = float(t[-1] - t[0]) / (t.size - 1)
    width = acceleration_width(y, dt, resolution)
    if t.size < LEAST * width:
        return nobody
    speed, table = _regression(u, [y, *others], dt, width, late=late, terms=terms)
    first, last = int(live[0]), int(live[-1]) + 1
    low, high = first + width // 4, last - width // 4
    if table is None or low >= high:
        return nobody
    at, costs = table.search(low, high, late=late)
    begin, end = (last, first) if late else (first, last)
    least, logged = costs[at], table.misfit(end, late=late, forward=False)
    hardly = abs(speed[at]) < SLOW * float(np.abs(speed).max()) and not late
    if not (least < CLEAR[table.levels] * logged and least < POOR) or hardly:
        return None, logged
    before, after = _accelerations(speed, dt, at, end, begin)
    trip = Trip(
        at=at * dt, error=_uncertainty(costs, at, t.size / width) * dt,
        logged=end * dt, late=late, before=before, after=after, unexplained=least, otherwise=logged,
    )  # fmt: skip
    return trip, logged


def _regression(
    u: Array, signals: Sequence[Array], dt: float, width: int, *, late: bool, terms: Terms, moving: bool = True
) -> tuple[Array, TripRegression | None]:
    """Speed (N,) of the first signal, and the regression of its acceleration; None with little motion."""
    motion = replace(smoothed(signals, dt, width, order=3), q=np.array(signals))
    speed, acceleration = motion.v[0], motion.a[0]
    if not np.ptp(acceleration) > 0:
        return speed, None
    weights = middle(width, order=3)
    columns = [np.ones(speed.size), np.tanh(speed / (0.02 * scatter(speed))), *terms(motion)]
    # damping that is there with the command on goes with it
    switched = np.stack([u, speed * (u != 0)], axis=1)
    half = width // 2
    tells = np.abs(speed) > STUCK * float(np.abs(speed).max())
    # a body that sticks hides what pushes it, but under a constant command it cannot set out late
    tells |= not moving or (late and not np.ptp(u[u != 0]))
    rows = half + np.flatnonzero(tells[half : speed.size - half])
    rows = rows[:: max(1, rows.size // ROWS)]
    if rows.size < LEAST:
        return speed, None
    base = _smoothed(np.stack(columns, axis=1), weights)[rows]
    return speed, TripRegression(rows=rows, target=acceleration[rows], base=base, switched=switched, weights=weights)


def _accelerations(speed: Array, dt: float, at: int, *ends: int) -> tuple[float, float]:
    """Mean acceleration on both sides of sample `at`, half way to the nearer end of the logged command."""
    reach = max(2, min(abs(at - end) for end in ends) // 2)
    low, high = max(0, at - reach), min(speed.size - 1, at + reach)
    before, after = (np.polyfit(np.arange(v.size) * dt, v, 1)[0] for v in (speed[low:at], speed[at:high]))
    return float(before), float(after)


def _smoothed(columns: Array, weights: Array) -> Array:
    from scipy.ndimage import correlate1d

    return correlate1d(columns, weights, axis=0, mode="nearest")


def _uncertainty(costs: Mapping[int, float], at: int, independent: float) -> float:
    """Samples within which the misfit is no larger than chance allows, half the range of two deviations."""
    inside = [abs(m - at) for m, cost in costs.items() if cost < costs[at] * (1 + 4 / independent)]
    return max(1.0, float(max(inside))) / 2


def goes_dead(t: Array, u: Array, y: Array, at: int) -> bool:
    """Whether a drive no longer answers after sample `at`, judged by how it answered before.

    Where the body moves afterwards, or rests against a command that moved it before, either the command explains it
    or it does not. `u` and `y` (N,) are the command and what it drives.
    """
    dt = float(t[-1] - t[0]) / (t.size - 1)
    width = max(7, int(0.06 / dt) | 1)
    speed, table = _regression(u, [y], dt, width, late=False, terms=linear, moving=False)
    if table is None:
        return False
    push = table.whole[:, 0]
    columns = np.column_stack([push, table.base])
    fast = np.abs(speed[table.rows]) > 0.05 * float(np.abs(speed).max())
    before, after = table.rows < at - width // 2, table.rows >= at + width // 2
    apart = dt * float(np.median(np.diff(table.rows)))
    enough = 3 * width * dt / apart
    if np.count_nonzero(before & fast) < enough or not after.any():
        return False
    slopes = LeastSquares.of(columns[before & fast], table.target[before & fast]).slopes
    force, _, dry, _, spring = slopes
    if force == 0:
        return False
    pull = push + spring / force * table.base[:, 3]
    against = np.abs(pull) > 2 * abs(dry / force) + 0.1 * np.ptp(push[after])
    if apart * np.count_nonzero(after & ~fast & against) > RESTS:
        return True
    alive = table.target[after & fast] - columns[after & fast] @ slopes
    dead = alive + force * push[after & fast]
    return dead.size > enough and float(dead @ dead) < 0.5 * float(alive @ alive)
