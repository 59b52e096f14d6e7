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

SHORT = 100
"""A record with fewer samples tells of no trip."""

LEAST = 30
"""Independent stretches (record over smoothing) that a record needs before it is judged."""

STUCK = 0.02
"""Share of the largest speed below which a body may stick, where its drive cannot be judged."""

APART = 1e-2
"""Share of a column beside others, and of a target beside columns, below which squares lose digits."""

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
        """`switched` (columns, T), smoothed."""
        return np.ascontiguousarray(_smoothed(self.switched, self.weights)[self.rows].T)

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
        """What of rows (..., T) `base` does not explain."""
        flat = x.reshape(-1, x.shape[-1])
        return x - ((flat @ self._basis) @ self._basis.T).reshape(x.shape)

    def before(self, cuts: NDArray[np.int64]) -> Array:
        """`switched` (cuts, columns, T) with zeros from each of the samples `cuts` on, smoothed."""
        half = self.weights.size // 2
        out = np.where(self.rows < cuts[:, None, None], self.whole, 0.0)
        cut, row = np.nonzero(np.abs(self.rows - cuts[:, None]) <= half)
        first = self.rows[row] - half
        inside = first[:, None] + np.arange(self.weights.size) < cuts[cut, None]
        windows = np.lib.stride_tricks.sliding_window_view(self.switched, self.weights.size, axis=0)
        out[cut, :, row] = np.einsum("iw,icw->ic", self.weights * inside, windows[first])
        return out

    def explain(self, columns: Array) -> tuple[Array, Array]:
        """Share of the variance that base and `columns` (..., p, T) leave unexplained, and slopes (..., p) of these.

        By normal equations, which square what separates columns; by orthogonal rows where that, or what is left, is
        little, and digits would be lost.
        """
        C = columns.reshape(math.prod(columns.shape[:-2]), *columns.shape[-2:])
        along, pull = C @ self._basis, C @ self.rest
        whole = C @ np.swapaxes(C, 1, 2)
        G = whole - along @ np.swapaxes(along, 1, 2)
        size, alone = (np.sqrt(np.maximum(np.diagonal(M, axis1=1, axis2=2), 0.0)) for M in (whole, G))
        visible = alone > APART * size
        scale = np.where(visible, 1 / np.where(visible, alone, 1.0), 0.0)
        R = G * scale[..., None] * scale[:, None, :]
        apart = visible.all(axis=1) & (np.linalg.det(R) > APART)
        R[~apart] = np.eye(R.shape[-1])
        slopes = np.asarray(np.linalg.solve(R, (pull * scale)[..., None])[..., 0] * scale, dtype=np.float64)
        squares = float(self.rest @ self.rest)
        left = squares - np.sum(slopes * pull, axis=1)
        poor = ~(apart & (left > APART * squares))
        if poor.any():
            left[poor], slopes[poor] = self._explain_apart(C[poor])
        return np.asarray(left / self.variance).reshape(columns.shape[:-2]), slopes.reshape(columns.shape[:-1])

    def _explain_apart(self, columns: Array) -> tuple[Array, Array]:
        """What of the target's squares is left beside base and `columns` (cuts, p, T), and slopes (cuts, p)."""
        alone = self._aside(columns)
        size = _length(columns)
        acts = _length(alone) > 1e-4 * size
        scale = np.where(acts, 1 / np.where(acts, size, 1.0), 0.0)
        slopes = _slopes(alone * scale[..., None], self.rest) * scale
        left = self.rest - (slopes[..., None, :] @ alone)[..., 0, :]
        return np.einsum("...t,...t->...", left, left), slopes

    def misfit(self, cuts: NDArray[np.int64], *, late: bool, forward: bool) -> Array:
        """Shares (cuts,) of the variance left when the command acts before each of some samples only, or from it on.

        All of it when that has to be `forward` and the command would push backwards, in which case there is no trip.
        """
        early = self.before(cuts)
        left, slopes = self.explain(self.whole - early if late else early)
        if not forward:
            return left
        acting = self.switched[cuts if late else cuts - 1]
        # the force at no speed is an extrapolation unless the command has several levels
        pushed = np.sum(slopes * acting, axis=1) * acting[:, 0] > 0
        return np.where(pushed & ((slopes[:, 0] > 0) | (not self.levels)), left, 1.0)

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
            left = self.misfit(np.array(tried), late=late, forward=forward)
            costs |= dict(zip(tried, left.tolist(), strict=True))
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
    return Driven.by(t, y, others, resolution=resolution, terms=terms).trip_or_misfit(u, late=late)


@dataclass(frozen=True, kw_only=True)
class Driven:
    """A coordinate and those that pull at it, whatever command is looked at: the first of `signals` (N,) is driven.

    Their motion is smoothed over `width` samples of `dt` seconds; `terms` say what acts.
    """

    dt: float
    signals: Sequence[Array]
    width: int
    terms: Terms = linear

    @classmethod
    def by(cls, t: Array, y: Array, others: Sequence[Array], *, resolution: float, terms: Terms = linear) -> Driven:
        """As for `find_trip`."""
        dt = float(t[-1] - t[0]) / (t.size - 1) if t.size > 1 else 0.0
        width = acceleration_width(y, dt, resolution) if t.size >= SHORT else t.size
        return cls(dt=dt, signals=[y, *others], width=width, terms=terms)

    @cached_property
    def motion(self) -> Motion:
        """Smoothed, but positions as they were read."""
        return replace(smoothed(self.signals, self.dt, self.width, order=3), q=np.array(self.signals))

    @cached_property
    def weights(self) -> Array:
        """The smoothing (width,) of positions, which all that acts goes through as well."""
        return middle(self.width, order=3)

    @cached_property
    def acting(self) -> Array:
        """What acts (N, columns) besides the command, smoothed: a constant, dry friction and the terms."""
        speed = self.motion.v[0]
        columns = [np.ones(speed.size), np.tanh(speed / (0.02 * scatter(speed))), *self.terms(self.motion)]
        return _smoothed(np.stack(columns, axis=1), self.weights)

    def regression(self, u: Array, *, late: bool, moving: bool = True) -> TripRegression | None:
        """That of the acceleration under a command (N,); None with little motion."""
        speed, acceleration = self.motion.v[0], self.motion.a[0]
        if not np.ptp(acceleration) > 0:
            return None
        # damping that is there with the command on goes with it
        switched = np.stack([u, speed * (u != 0)], axis=1)
        half = self.width // 2
        tells = np.abs(speed) > STUCK * float(np.abs(speed).max())
        # a body that sticks hides what pushes it, but under a constant command it cannot set out late
        tells |= not moving or (late and not np.ptp(u[u != 0]))
        rows = half + np.flatnonzero(tells[half : speed.size - half])
        rows = rows[:: max(1, rows.size // ROWS)]
        if rows.size < LEAST:
            return None
        return TripRegression(
            rows=rows, target=acceleration[rows], base=self.acting[rows], switched=switched, weights=self.weights
        )

    def trip_or_misfit(self, u: Array, *, late: bool) -> tuple[Trip | None, float]:
        """A trip of the command (N,), and what is left unexplained with it as logged, infinite if nobody can say."""
        nobody = None, math.inf
        live = np.flatnonzero(u)
        if u.size < SHORT or live.size < 10 or u.size < LEAST * self.width:
            return nobody
        table = self.regression(u, late=late)
        first, last = int(live[0]), int(live[-1]) + 1
        low, high = first + self.width // 4, last - self.width // 4
        if table is None or low >= high:
            return nobody
        at, costs = table.search(low, high, late=late)
        begin, end = (last, first) if late else (first, last)
        least, logged = costs[at], float(table.misfit(np.array([end]), late=late, forward=False)[0])
        speed = self.motion.v[0]
        hardly = abs(speed[at]) < SLOW * float(np.abs(speed).max()) and not late
        if not (least < CLEAR[table.levels] * logged and least < POOR) or hardly:
            return None, logged
        before, after = _accelerations(speed, self.dt, at, end, begin)
        trip = Trip(
            at=at * self.dt, error=_uncertainty(costs, at, u.size / self.width) * self.dt,
            logged=end * self.dt, late=late, before=before, after=after, unexplained=least, otherwise=logged,
        )  # fmt: skip
        return trip, logged


def _accelerations(speed: Array, dt: float, at: int, *ends: int) -> tuple[float, float]:
    """Mean acceleration on both sides of sample `at`, half way to the nearer end of the logged command."""
    reach = max(2, min(abs(at - end) for end in ends) // 2)
    low, high = max(0, at - reach), min(speed.size - 1, at + reach)
    before, after = (np.polyfit(np.arange(v.size) * dt, v, 1)[0] for v in (speed[low:at], speed[at:high]))
    return float(before), float(after)


def _length(rows: Array) -> Array:
    """Lengths (...) of rows (..., T)."""
    return np.sqrt(np.einsum("...t,...t->...", rows, rows))


def _slopes(rows: Array, target: Array) -> Array:
    """Least squares slopes (..., p) of a target (T,) on rows (..., p, T); the shortest where rows depend on others.

    Orthogonalised by Gram and Schmidt, each row twice (Giraud, Langou and Rozloznik 2005).
    """
    Q, p = rows.copy(), rows.shape[-2]
    R = np.zeros((*rows.shape[:-2], p, p))
    for i in range(p):
        for _ in range(2):
            along = Q[..., :i, :] @ Q[..., i, :, None]
            R[..., :i, i] += along[..., 0]
            Q[..., i, :] -= (np.swapaxes(along, -1, -2) @ Q[..., :i, :])[..., 0, :]
        R[..., i, i] = length = _length(Q[..., i, :])
        Q[..., i, :] /= np.where(length > 0, length, 1.0)[..., None]
    return (np.linalg.pinv(R, rcond=1e-5) @ (Q @ target)[..., None])[..., 0]


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
    driven = Driven(dt=dt, signals=[y], width=width)
    table = driven.regression(u, late=False, moving=False)
    if table is None:
        return False
    speed = driven.motion.v[0]
    push = table.whole[0]
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
