"""What does the controller see, one sample after the other, with its commands held and late?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from upright.errors import BadInput
from upright.gains.requests import Roots
from upright.laws.linear import Array

if TYPE_CHECKING:
    from upright.physics.plant import Linear


@dataclass(frozen=True, kw_only=True)
class Sampled:
    """The model at its samples, ``x[k+1] = A x[k] + B u[k], y[k] = C x[k] + D u[k]``.

    Attributes
    ----------
    A, B, C : arrays, shape (n, n), (n, m) and (p, n)
        The states are those of the model, then what a drive with lag gives, then the commands that are still on
        their way: the last, the one before.
    period : float
        Time between samples [s].
    delay : float
        How late a command acts [samples], whole or not.
    states : tuple of str
    lag : float
        Time constant of the drive [s]; 0 for none.
    D : array, shape (p, m), or None
        What of a command is read at the same sample; None for nothing.
    """

    A: Array
    B: Array
    C: Array
    period: float
    delay: float
    states: tuple[str, ...]
    lag: float = 0.0
    D: Array | None = None

    @property
    def remembered(self) -> int:
        """How many states are not the model's: what the drive gives, and commands on their way."""
        return (math.ceil(self.delay - 1e-12) + (self.lag > 0)) * self.B.shape[1]


def hold(
    model: Linear, period: float, delay: float = 0.0, lag: float = 0.0, *, D: Array | None = None, method: str = "zoh"
) -> Sampled:
    """A linear model behind a hold, exactly: one matrix exponential (two for part of a sample's delay).

    Parameters
    ----------
    model : Linear
    period : float
        Time between samples [s].
    delay : float
        How late a command acts [samples]: computation, converters, drive. Not only whole ones.
    lag : float
        Time constant with which the drive follows its command [s].
    D : array, shape (p, m), optional
        Feedthrough of the model.
    method : {"zoh", "foh"}
        Each command stays until the next, or runs straight to it, as a logged force does; the states are then
        ``x - G u`` with what a ramp of slope ``1/T`` makes of them in a sample (Franklin, Powell and Workman, Digital
        Control of Dynamic Systems, section 6.3.2).

    Raises
    ------
    BadInput
        When the period is not positive, the delay negative or beyond 1000 samples, or the lag negative.
    """
    if not (math.isfinite(period) and period > 0):
        raise BadInput(f"a sampled model needs a period above 0 s, got {period:g}; give it in seconds.")
    if not 0 <= delay <= 1000:
        raise BadInput(f"the delay must be between 0 and 1000 samples, got {delay:g}; give it in samples.")
    if not (math.isfinite(lag) and lag >= 0):
        raise BadInput(f"the drive's lag must be at least 0 s, got {lag:g}; give it in seconds.")
    if method not in ("zoh", "foh"):
        raise BadInput(f'a hold is of order zero, "zoh", or one, "foh", got {method!r}.')
    through = np.zeros((model.C.shape[0], model.B.shape[1])) if D is None else D
    if lag > 0:  # what comes through is what the drive gives
        model = _lagged(model, lag)
        model = replace(model, C=np.hstack([model.C[:, : -model.B.shape[1]], through]))
        through = through * 0
    whole = math.floor(delay + 1e-12)
    part = max(delay - whole, 0.0) if delay - whole > 1e-12 else 0.0
    if method == "foh" and part:
        raise BadInput(f'a first-order hold takes a delay of whole samples, got {delay:g}; round it, or use "zoh".')
    early, new = _held(model.A, model.B, (1 - part) * period)
    late, old = _held(model.A, model.B, part * period)
    if method == "foh":
        ramp = _ramped(model.A, model.B, period)
        new, through = new - ramp + early @ ramp, through + model.C @ ramp
    return _remembering(
        {whole: new, whole + 1: early @ old}, through, period, delay, A=early @ late, C=model.C, states=model.states,
        inputs=model.inputs, lag=lag,
    )  # fmt: skip


def sampled_model(
    A: Array, B: Array, C: Array, D: Array, period: float, delay: int, *, states: tuple[str, ...],
    inputs: tuple[str, ...],
) -> Sampled:  # fmt: skip
    """A model that is known at its samples alone, its commands so many whole samples late."""
    return _remembering({delay: B}, D, period, float(delay), A=A, C=C, states=states, inputs=inputs)


def _remembering(
    columns: Mapping[int, Array], through: Array, period: float, delay: float, *, A: Array, C: Array,
    states: tuple[str, ...], inputs: tuple[str, ...], lag: float = 0.0,
) -> Sampled:  # fmt: skip
    """A sampled model with what commands of so many samples ago do as `columns`, and those commands as states."""
    n, m = A.shape[0], len(inputs)
    memories = math.ceil(delay - 1e-12)
    whole = np.zeros((n + memories * m, n + memories * m))
    B = np.zeros((n + memories * m, m))
    whole[:n, :n] = A
    for ago, column in columns.items():
        if ago == 0:
            B[:n] = column
        elif ago <= memories:
            whole[:n, n + (ago - 1) * m : n + ago * m] = column
    if memories:
        B[n : n + m] = np.eye(m)
        whole[n + m :, n:-m] = np.eye((memories - 1) * m)
    ago_names = tuple(f"{u} {k} ago" for k in range(1, memories + 1) for u in inputs)
    C = np.hstack([C, np.zeros((C.shape[0], memories * m))])
    if memories:  # what acts at a sample is the oldest command on its way
        C[:, n + (memories - 1) * m :] = through
    return Sampled(
        A=whole, B=B, C=C, period=period, delay=delay, states=(*states, *ago_names), lag=lag,
        D=through if through.any() and not memories else None,
    )  # fmt: skip


def without_feedthrough(model: Sampled, what: str) -> None:
    """Refuse a model whose readings show the command of the same sample.

    Raises
    ------
    BadInput
        When there is a D.
    """
    if model.D is not None:
        raise BadInput(
            f"{what} needs readings that the command of the same sample does not change, and D is not zero here; let "
            "the command come a sample late (hold(..., delay=1)), as a computer's does."
        )


def _ramped(A: Array, B: Array, time: float) -> Array:
    """What a command that rises from 0 to 1 meanwhile adds."""
    from scipy.linalg import expm

    n, m = B.shape
    block = np.zeros((n + 2 * m, n + 2 * m))
    block[:n, :n], block[:n, n : n + m], block[n : n + m, n + m :] = A, B, np.eye(m) / time
    return np.asarray(expm(block * time), dtype=np.float64)[:n, n + m :]


def _lagged(model: Linear, lag: float) -> Linear:
    """The model behind ``lag f' + f = u`` for every input, f its new states."""
    n, m = model.B.shape
    A = np.block([[model.A, model.B], [np.zeros((m, n)), -np.eye(m) / lag]])
    B = np.vstack([np.zeros((n, m)), np.eye(m) / lag])
    C = np.hstack([model.C, np.zeros((model.C.shape[0], m))])
    return replace(model, A=A, B=B, C=C, states=(*model.states, *(f"{u} given" for u in model.inputs)))


def to_z(poles: ArrayLike, period: float) -> Roots:
    """Poles in z of poles in s [1/s]: ``z = exp(s T)``."""
    return np.exp(np.asarray(poles, dtype=np.complex128) * period)


def to_s(poles: ArrayLike, period: float) -> Roots:
    """Poles in s [1/s] of poles in z: ``s = log(z)/T``, -inf for z = 0."""
    z = np.asarray(poles, dtype=np.complex128)
    with np.errstate(divide="ignore"):
        return np.log(np.abs(z)) / period + 1j * np.angle(z) / period


def _held(A: Array, B: Array, time: float) -> tuple[Array, Array]:
    """Transition ``e^(A time)`` and what a constant unit command adds meanwhile."""
    from scipy.linalg import expm

    n, m = B.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = A, B
    whole = np.asarray(expm(block * time), dtype=np.float64)
    return whole[:n, :n], whole[:n, n:]
