"""Which masses tell most about the spring? Designs for the line ``1/omega_n^2 = (m_0 + a)/k``, all of them compared.

A frequency measured to a relative error e gives a point of the line to ``2 e (m_0 + a)/k``: heavy loadings are the less
certain ones. Elfving's rule for two loadings, runs in proportion to those errors, is what a search must find.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput

Array = NDArray[np.float64]

MOST = 20_000
"""Designs compared for one number of runs."""


@dataclass(frozen=True, kw_only=True)
class Loading:
    """What may be bolted on: its name and its inertia [kg or kg m^2]."""

    label: str
    added: float


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Runs at each loading, and what they promise.

    Attributes
    ----------
    loadings : tuple of Loading
        Those that are used, lightest first.
    runs : tuple of int
        How often each is run.
    k, bare : float
        Relative standard errors of stiffness and bare inertia.
    both : float
        Square root of the determinant of their relative covariance: area of the ellipse that holds both.
    """

    loadings: tuple[Loading, ...]
    runs: tuple[int, ...]
    k: float
    bare: float
    both: float


def best(
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
    runs : int
    bare : float
        Inertia of the bare body, roughly [kg or kg m^2].
    error : float
        Relative standard error of a frequency from one run.
    tolerance, piece : float
        Relative standard uncertainty of one added piece, and its inertia; the same pieces serve every loading.
    levels : int
        Different loadings at least: two fix a line, the third shows whether it is one.

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
    found: list[tuple[float, float, float, tuple[int, ...], tuple[int, ...]]] = []
    for used, shares in _designs(len(differing), runs, levels):
        a = np.array([differing[i].added for i in used])
        k, m, both = _promise(a, shares, bare, error, tolerance, piece)
        for score in (k, both):
            i = int(np.argmin(score))
            found.append((float(k[i]), float(m[i]), float(both[i]), used, tuple(shares[i].tolist())))
    return (
        _plan(min(found, key=lambda f: f[0]), differing),
        _plan(min(found, key=lambda f: f[2]), differing),
    )


def _plan(found: tuple[float, float, float, tuple[int, ...], tuple[int, ...]], loadings: Sequence[Loading]) -> Plan:
    k, bare, both, used, shares = found
    return Plan(loadings=tuple(loadings[i] for i in used), runs=shares, k=k, bare=bare, both=both)


def _designs(size: int, runs: int, levels: int) -> Generator[tuple[tuple[int, ...], NDArray[np.int64]]]:
    """Every choice of loadings with every way to share the runs; exactly `levels` loadings where more are too many."""
    for used in range(levels, min(size, runs) + 1):
        if used > levels and math.comb(size, used) * math.comb(runs - 1, used - 1) > MOST:
            return
        cuts = list(combinations(range(1, runs), used - 1))
        shares = np.array([np.diff([0, *cut, runs]) for cut in cuts], dtype=np.int64)
        for chosen in combinations(range(size), used):
            yield chosen, shares


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
