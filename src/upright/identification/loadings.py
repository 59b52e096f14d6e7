"""Experiment 1a: stiffness and bare inertia from swings with known inertias added, and which of these to add.

``1/omega_n^2 = (m_0 + a)/k`` is a line over the added inertia a: its slope is 1/k, its intercept m_0/k. A frequency
measured to a relative error e gives a point of the line to ``2 e (m_0 + a)/k``: heavy loadings are the less certain
ones. Of designs all are compared; Elfving's rule for two loadings, runs in proportion to those errors, is what the
search must find.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, NotIdentifiable
from upright.identification.model.fit import Estimate
from upright.records import Record
from upright.signals.free_swing import Decay, decay
from upright.signals.steps import smallest_step

Array = NDArray[np.float64]

NORMAL = 1.959963984540054
"""97.5 % quantile of the normal distribution."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Loaded:
    """One free swing with a known inertia added [kg or kg m^2]; `command` is the drive's meanwhile."""

    label: str
    added: float
    decay: Decay
    command: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Loadings:
    """What the line says of some swings.

    Stiffness `k` [N/m or N m/rad], inertia of the `bare` body [kg or kg m^2] and viscous friction
    ``2 sigma k/omega_n^2`` as `damping` [N s/m or N m s/rad], over all swings. `y` and `y_error` (N,) are
    ``1/omega_n^2`` [s^2] of each swing and its standard error, repeats considered; `repeat` is the relative scatter of
    `y` among swings with the same loading, NaN without repeats, `misfit` chi square per degree of freedom about the
    line, NaN with two swings.
    """

    swings: tuple[Loaded, ...]
    k: Estimate
    bare: Estimate
    damping: Estimate
    y: Array
    y_error: Array
    repeat: float
    misfit: float
    verdict: str


def swings(
    record: Record, *, added: float, label: str, signal: str, command: str = "", resolution: float | None = None
) -> tuple[Loaded, ...]:
    """Free swings of a log, one after each switch of its command; the whole log when it has none.

    Parameters
    ----------
    added : float
        Inertia added [kg or kg m^2].
    signal : str
        Column of the position, in any unit.
    command : str
        Column of the command: piecewise constant.
    resolution : float, optional
        Smallest step of the sensor, from the column when omitted.

    Raises
    ------
    NotIdentifiable
        When no stretch shows enough extremes.
    """
    x = record[signal]
    if resolution is None:
        resolution = smallest_step(x)
    cuts = [0, record.t.size]
    if command:
        cuts = [0, *(np.flatnonzero(np.diff(record[command])) + 1).tolist(), record.t.size]
        if len(cuts) > 42:
            raise BadInput(
                f"'{label}': the command '{command}' changes {len(cuts) - 2} times, and a step response needs steps;"
                " name the column that holds the steps."
            )
    loaded: list[Loaded] = []
    reason = ""
    for i, (first, last) in enumerate(pairwise(cuts)):
        part = slice(first, last)
        if last - first < 20 or np.ptp(x[part]) < max(20 * resolution, 0.05 * float(np.ptp(x))):
            continue  # at rest
        try:
            swing = decay(record.t[part], x[part], resolution=resolution)
        except NotIdentifiable as error:
            reason = str(error)
            continue
        name = label if len(cuts) == 2 else f"{label}, step {i}"
        command_before = float(record[command][first]) if command else 0.0
        loaded.append(Loaded(label=name, added=added, decay=swing, command=command_before))
    if not loaded:
        raise NotIdentifiable(f"'{label}': {reason or 'nothing moves in this log; name the column of the position.'}")
    return tuple(loaded)


def fit_loadings(loaded: Sequence[Loaded], *, tolerance: float = 0.0, piece: float = 0.0) -> Loadings:
    """Stiffness and bare inertia from swings with known added inertias.

    Parameters
    ----------
    loaded : sequence of Loaded
        At least two different loadings; three show whether the line is one.
    tolerance : float
        Relative standard uncertainty of the inertia of one added piece; pieces err independently.
    piece : float
        Inertia of one piece; the smallest one added when 0.

    Raises
    ------
    NotIdentifiable
        When fewer than two loadings differ, or the period does not grow with the load.
    """
    a = np.array([s.added for s in loaded])
    levels = np.unique(a)
    if levels.size < 2:
        raise NotIdentifiable(
            f"A line needs at least two different added inertias, got {levels.size}; three also show whether it is one."
        )
    y = np.array([s.decay.omega_n**-2 for s in loaded])
    own = np.array([2 * s.decay.omega_error / s.decay.omega_n for s in loaded])
    repeat = _repeat(a, y)
    relative = np.maximum(own, repeat) if math.isfinite(repeat) else own
    error = relative * y
    piece = piece or float(levels[levels > 0][0])
    pieces = tolerance**2 * piece * np.minimum.outer(a, a)  # the same pieces serve every loading
    X = np.column_stack([np.ones_like(a), a])
    line = np.linalg.lstsq(X / error[:, None], y / error, rcond=None)[0]
    P = np.zeros((2, 2))
    chi = 0.0
    for _ in range(4):
        inverse = np.linalg.inv(np.diag(error**2) + pieces * line[1] ** 2)
        P = np.linalg.inv(X.T @ inverse @ X)
        line = P @ (X.T @ inverse @ y)
        left = y - X @ line
        chi = float(left @ inverse @ left)
    intercept, slope = float(line[0]), float(line[1])
    if slope <= 0:
        raise NotIdentifiable(
            "The period does not grow with the added inertia, so no stiffness follows; check which log has which load."
        )
    dof = a.size - 2
    width, half = _widths(chi, dof)
    stated = math.sqrt(P[1, 1]) / slope**2
    stiffness = Estimate.within(1 / slope, stated * width, stated * half)
    gradient = np.array([1 / slope, -intercept / slope**2])
    stated = math.sqrt(float(gradient @ P @ gradient))
    inertia = Estimate.within(intercept / slope, stated * width, stated * half)
    return Loadings(
        swings=tuple(loaded),
        k=stiffness,
        bare=inertia,
        damping=_damping(loaded, stiffness),
        y=y,
        y_error=error,
        repeat=repeat,
        misfit=chi / dof if dof else math.nan,
        verdict=_verdict(levels.size, dof, chi, stiffness, inertia),
    )


def _repeat(a: Array, y: Array) -> float:
    """Relative scatter of repeats, pooled over loadings."""
    squares, freedom = 0.0, 0
    for level in np.unique(a):
        same = y[a == level]
        squares += float(np.sum((same / same.mean() - 1) ** 2))
        freedom += same.size - 1
    return math.sqrt(squares / freedom) if freedom else math.nan


def _widths(chi: float, dof: int) -> tuple[float, float]:
    """Factors on a stated error that give standard error and half a 95 % interval: as stated, or as points scatter."""
    if dof == 0:
        return 1.0, NORMAL
    from scipy.stats import t

    scatter = math.sqrt(chi / dof)
    return max(1.0, scatter), max(NORMAL, float(t.ppf(0.975, dof)) * scatter)


def _damping(loaded: Sequence[Loaded], k: Estimate) -> Estimate:
    """``c = k (2 sigma/omega_n^2)``, the bracket a weighted mean over swings; both errors count."""
    square = np.array([s.decay.omega_n for s in loaded]) ** 2
    g = 2 * np.array([s.decay.sigma for s in loaded]) / square
    weight = (2 * np.array([s.decay.sigma_error for s in loaded]) / square) ** -2.0
    mean = float(np.average(g, weights=weight))
    stated, half = (w / math.sqrt(float(weight.sum())) for w in _widths(float(weight @ (g - mean) ** 2), g.size - 1))
    reach = math.hypot(k.value * half, mean * (k.interval[1] - k.value))
    stderr = math.hypot(k.value * stated, mean * k.stderr)
    return Estimate.within(k.value * mean, stderr, reach)


def _verdict(levels: int, dof: int, chi: float, k: Estimate, bare: Estimate) -> str:
    if bare.interval[0] <= 0:
        return (
            "The bare body's inertia cannot be distinguished from zero: its interval reaches zero. Add less, or repeat."
        )
    if levels == 2:
        return "Two loadings fix a line but cannot show that it is one; a third would."
    from scipy.stats import chi2

    if float(chi2.sf(chi, dof)) < 0.01:
        return (
            f"The points scatter {math.sqrt(chi / dof):.1f} times as much as their errors say, and the intervals are "
            "widened by that; is an added inertia wrong, or does the spring stiffen?"
        )
    to_k, to_bare = (f"{100 * (e.interval[1] - e.value) / e.value:.2g} %" for e in (k, bare))
    return (
        f"A line explains all {levels} loadings within their errors; stiffness to {to_k}, bare inertia to {to_bare} "
        "(half of a 95 % interval)."
    )


@dataclass(frozen=True, kw_only=True)
class Loading:
    """What may be bolted on: its name and its inertia [kg or kg m^2]."""

    label: str
    added: float


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The `loadings` that are used, lightest first, the `runs` at each, and what they promise.

    `k` and `bare` are relative standard errors of stiffness and bare inertia, `both` the square root of the determinant
    of their relative covariance: area of the ellipse that holds both.
    """

    loadings: tuple[Loading, ...]
    runs: tuple[int, ...]
    k: float
    bare: float
    both: float


def plan_loadings(
    choice: Sequence[Loading],
    runs: int,
    *,
    bare: float,
    error: float,
    tolerance: float = 0.0,
    piece: float = 0.0,
    levels: int = 3,
) -> tuple[Plan, Plan]:
    """The plan with the tightest stiffness and the one with the tightest pair, among all of `runs` runs.

    Parameters
    ----------
    choice : sequence of Loading
        What could be added, nothing included.
    bare : float
        Inertia of the bare body, roughly [kg or kg m^2].
    error : float
        Relative standard error of a frequency from one run.
    tolerance, piece : float
        Relative standard uncertainty of one added piece, and its inertia; the same pieces serve every loading.
    levels : int
        Different loadings: two fix a line, the third shows whether it is one; a further one tightens nothing.

    Raises
    ------
    BadInput
        When there are fewer runs or fewer different loadings than `levels`.
    """
    differing = sorted({w.added: w for w in reversed(choice)}.values(), key=lambda w: w.added)
    if levels < 2 or runs < levels or len(differing) < levels:
        raise BadInput(
            f"A line through at least 2 different loadings is planned; got {runs} runs and {len(differing)} different"
            f" loadings for {levels} that shall differ."
        )
    if bare <= 0 or error <= 0 or tolerance < 0:
        raise BadInput("A plan needs a positive bare inertia and a positive error of one frequency, such as 0.2 %.")
    if tolerance > 0 and piece <= 0:
        raise BadInput("A tolerance of the pieces needs the inertia of one piece.")
    cuts = combinations(range(1, runs), levels - 1)
    shares = np.array([np.diff([0, *cut, runs]) for cut in cuts], dtype=np.int64)
    plans: list[Plan] = []
    for loadings in combinations(differing, levels):
        k, m, both = _promise(np.array([w.added for w in loadings]), shares, bare, error, tolerance, piece)
        for i in dict.fromkeys((int(np.argmin(k)), int(np.argmin(both)))):
            plans.append(
                Plan(loadings=loadings, runs=tuple(shares[i].tolist()), k=float(k[i]), bare=float(m[i]),
                     both=float(both[i]))
            )  # fmt: skip
    return min(plans, key=lambda plan: plan.k), min(plans, key=lambda plan: plan.both)


def _promise(
    a: Array, shares: NDArray[np.int64], bare: float, error: float, tolerance: float, piece: float
) -> tuple[Array, Array, Array]:
    """Relative errors of k and bare inertia, and of both together, for each way to share the runs; k is 1 here."""
    y = bare + a
    own = (2 * error * y) ** 2 / shares
    V = own[:, :, None] * np.eye(a.size) + tolerance**2 * piece * np.minimum.outer(a, a)
    X = np.column_stack([np.ones_like(a), a])
    P = np.linalg.inv(np.einsum("lp,nlm,mq->npq", X, np.linalg.inv(V), X))
    J = np.array([[0.0, -1.0], [1 / bare, -1.0]])  # of ln k and ln m_0 to intercept and slope
    C = J @ P @ J.T
    return np.sqrt(C[:, 0, 0]), np.sqrt(C[:, 1, 1]), np.sqrt(np.linalg.det(C))
