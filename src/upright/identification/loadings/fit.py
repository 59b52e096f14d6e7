"""How stiff is the spring and how heavy the bare body? Step responses with known added inertias.

``1/omega_n^2 = (m_0 + a)/k`` is a line over the added inertia a: its slope is 1/k, its intercept m_0/k.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, NotIdentifiable
from upright.records import Record
from upright.signals.free_swing import Decay, decay

Array = NDArray[np.float64]

NORMAL = 1.959963984540054
"""97.5 % quantile of the normal distribution."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Loaded:
    """One free swing with a known inertia added [kg or kg m^2]; `command` is what the drive was told meanwhile."""

    label: str
    added: float
    decay: Decay
    command: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Weighed:
    """A number with its standard error and 95 % interval."""

    value: float
    stderr: float
    interval: tuple[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Loadings:
    """What the line says.

    Attributes
    ----------
    swings : tuple of Loaded
    k, bare : Weighed
        Stiffness [N/m or N m/rad] and inertia of the bare body [kg or kg m^2].
    damping : Weighed
        Viscous friction ``2 sigma k/omega_n^2`` [N s/m or N m s/rad], over all swings.
    y, y_error : (N,) arrays
        ``1/omega_n^2`` [s^2] of each swing and its standard error, repeats considered.
    repeat : float
        Relative scatter of `y` among swings with the same loading; NaN without repeats.
    misfit : float
        Chi square per degree of freedom about the line; NaN with two swings.
    verdict : str
    """

    swings: tuple[Loaded, ...]
    k: Weighed
    bare: Weighed
    damping: Weighed
    y: Array
    y_error: Array
    repeat: float
    misfit: float
    verdict: str


def swings(
    record: Record, *, added: float, label: str, signal: str, command: str = "", quantum: float | None = None
) -> tuple[Loaded, ...]:
    """Free swings of a log, one after each switch of its command; the whole log when it has none.

    Parameters
    ----------
    record : Record
    added : float
        Inertia added [kg or kg m^2].
    label : str
    signal : str
        Column of the position, in any unit.
    command : str
        Column of the command: piecewise constant.
    quantum : float, optional
        Smallest step of the sensor, told from the column when omitted.

    Raises
    ------
    NotIdentifiable
        When no stretch shows enough extremes.
    """
    x = record[signal]
    if quantum is None:
        steps = np.abs(np.diff(np.unique(x)))
        quantum = float(steps.min()) if steps.size else 0.0
    cuts = [0, record.t.size]
    if command:
        cuts = [0, *(np.flatnonzero(np.diff(record[command])) + 1).tolist(), record.t.size]
        if len(cuts) > 42:
            raise BadInput(
                f"'{label}': the command '{command}' changes {len(cuts) - 2} times, and a step response needs steps;"
                " name the column that holds the steps."
            )
    found: list[Loaded] = []
    reason = ""
    for i, (first, last) in enumerate(pairwise(cuts)):
        part = slice(first, last)
        if last - first < 20 or np.ptp(x[part]) < max(20 * quantum, 0.05 * float(np.ptp(x))):
            continue  # at rest
        try:
            swing = decay(record.t[part], x[part], quantum=quantum)
        except NotIdentifiable as error:
            reason = str(error)
            continue
        name = label if len(cuts) == 2 else f"{label}, step {i}"
        told = float(record[command][first]) if command else 0.0
        found.append(Loaded(label=name, added=added, decay=swing, command=told))
    if not found:
        raise NotIdentifiable(f"'{label}': {reason or 'nothing moves in this log; name the column of the position.'}")
    return tuple(found)


def weigh(loaded: Sequence[Loaded], *, tolerance: float = 0.0, piece: float = 0.0) -> Loadings:
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
    widths = _widths(chi, dof)
    stiffness = _about(1 / slope, math.sqrt(P[1, 1]) / slope**2, widths)
    bare = intercept / slope
    gradient = np.array([1 / slope, -intercept / slope**2])
    inertia = _about(bare, math.sqrt(float(gradient @ P @ gradient)), widths)
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


def _about(value: float, stated: float, widths: tuple[float, float]) -> Weighed:
    half = stated * widths[1]
    return Weighed(value=value, stderr=stated * widths[0], interval=(value - half, value + half))


def _damping(loaded: Sequence[Loaded], k: Weighed) -> Weighed:
    """``c = k (2 sigma/omega_n^2)``, the bracket a weighted mean over swings; both errors count."""
    square = np.array([s.decay.omega_n for s in loaded]) ** 2
    g = 2 * np.array([s.decay.sigma for s in loaded]) / square
    weight = (2 * np.array([s.decay.sigma_error for s in loaded]) / square) ** -2.0
    mean = float(np.average(g, weights=weight))
    stated, half = (w / math.sqrt(float(weight.sum())) for w in _widths(float(weight @ (g - mean) ** 2), g.size - 1))
    reach = math.hypot(k.value * half, mean * (k.interval[1] - k.value))
    stderr = math.hypot(k.value * stated, mean * k.stderr)
    return Weighed(value=k.value * mean, stderr=stderr, interval=(k.value * mean - reach, k.value * mean + reach))


def _verdict(levels: int, dof: int, chi: float, k: Weighed, bare: Weighed) -> str:
    if bare.interval[0] <= 0:
        return "The bare body's inertia cannot be told from nothing: its interval reaches zero. Add less, or repeat."
    if levels == 2:
        return "Two loadings fix a line but cannot show that it is one; a third would."
    from scipy.stats import chi2

    if float(chi2.sf(chi, dof)) < 0.01:
        return (
            f"The points scatter {math.sqrt(chi / dof):.1f} times as much as their errors say, and the intervals are "
            "widened by that; is an added inertia wrong, or does the spring stiffen?"
        )
    return (
        f"A line explains all {levels} loadings within their errors; stiffness to {_share(k)}, bare inertia to "
        f"{_share(bare)} (half of a 95 % interval)."
    )


def _share(w: Weighed) -> str:
    return f"{100 * (w.interval[1] - w.value) / w.value:.2g} %"
