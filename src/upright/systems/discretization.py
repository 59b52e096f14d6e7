"""Matrices of a linear model at its samples: commands held and late, a drive that lags; and poles in s and z."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput

Array = NDArray[np.float64]
Matrices = tuple[Array, Array, Array, Array]


def held(
    A: Array, B: Array, C: Array, D: Array, period: float, delay: float, lag: float, first_order: bool
) -> Matrices:
    """A, B, C, D of a continuous model at its samples, exactly: one matrix exponential, two for part of a delay.

    The states are those of the model, then what a drive with lag gives, then the commands that are still on their
    way: the last, the one before. Each command stays until the next; with `first_order` it runs straight to it, the
    states then being ``x - G u`` with what a ramp of slope ``1/T`` makes of them in a sample (Franklin, Powell and
    Workman, Digital Control of Dynamic Systems, section 6.3.2).
    """
    n, m = B.shape
    if lag > 0:  # lag f' + f = u for every input; what comes through is what the drive gives
        A = np.block([[A, B], [np.zeros((m, n)), -np.eye(m) / lag]])
        B, C, D = np.vstack([np.zeros((n, m)), np.eye(m) / lag]), np.hstack([C, D]), D * 0
    whole = math.floor(delay + 1e-12)
    part = max(delay - whole, 0.0) if delay - whole > 1e-12 else 0.0
    if first_order and part:
        raise BadInput(f'a first-order hold takes a delay of whole samples, got {delay:g}; round it, or use "zoh".')
    early, new = _constant(A, B, (1 - part) * period)
    late, old = _constant(A, B, part * period)
    if first_order:
        ramp = _ramp(A, B, period)
        new, D = new - ramp + early @ ramp, D + C @ ramp
    return with_past_commands(early @ late, {whole: new, whole + 1: early @ old}, C, D, delay)


def with_past_commands(A: Array, columns: Mapping[int, Array], C: Array, D: Array, delay: float) -> Matrices:
    """Matrices at the samples with what commands of so many samples ago do as `columns`, those commands as states."""
    n, m = next(iter(columns.values())).shape
    memories = math.ceil(delay - 1e-12)
    whole = np.zeros((n + memories * m, n + memories * m))
    B = np.zeros((n + memories * m, m))
    whole[:n, :n] = A
    for ago, column in columns.items():
        if ago == 0:
            B[:n] = column
        elif ago <= memories:
            whole[:n, n + (ago - 1) * m : n + ago * m] = column
    if not memories:
        return whole, B, C, D
    B[n : n + m] = np.eye(m)
    whole[n + m :, n:-m] = np.eye((memories - 1) * m)
    C = np.hstack([C, np.zeros((C.shape[0], memories * m))])
    C[:, n + (memories - 1) * m :] = D  # what acts at a sample is the oldest command on its way
    return whole, B, C, D * 0


def to_z(poles: ArrayLike, period: float) -> NDArray[np.complex128]:
    """Poles in z of poles in s [1/s]: ``z = exp(s T)``."""
    return np.exp(np.asarray(poles, dtype=np.complex128) * period)


def to_s(poles: ArrayLike, period: float) -> NDArray[np.complex128]:
    """Poles in s [1/s] of poles in z: ``s = log(z)/T``, -inf for z = 0."""
    z = np.asarray(poles, dtype=np.complex128)
    with np.errstate(divide="ignore"):
        return np.log(np.abs(z)) / period + 1j * np.angle(z) / period


def _constant(A: Array, B: Array, time: float) -> tuple[Array, Array]:
    """Transition ``e^(A time)`` and what a constant unit command adds meanwhile."""
    from scipy.linalg import expm

    n, m = B.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = A, B
    whole = np.asarray(expm(block * time), dtype=np.float64)
    return whole[:n, :n], whole[:n, n:]


def _ramp(A: Array, B: Array, time: float) -> Array:
    """What a command that rises from 0 to 1 meanwhile adds."""
    from scipy.linalg import expm

    n, m = B.shape
    block = np.zeros((n + 2 * m, n + 2 * m))
    block[:n, :n], block[:n, n : n + m], block[n : n + m, n + m :] = A, B, np.eye(m) / time
    return np.asarray(expm(block * time), dtype=np.float64)[:n, n + m :]
