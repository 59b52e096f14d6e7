"""How fast is it, when only positions are measured? Differences, filtered differences, an observer: one form for all.

An estimator is a sampled linear law from encoder readings (and, for an observer, its own command) to states.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upright.errors import BadInput
from upright.gains.placement import place
from upright.gains.requests import conjugate_poles, lost_modes, written
from upright.laws.linear import Array, differences
from upright.systems import StateSpace, to_s


@dataclass(frozen=True, kw_only=True)
class Estimator:
    """``z[k+1] = A z[k] + B y[k] + E u[k]``, ``x[k] = C z[k] + D y[k]``.

    y are the positions as deviations from the equilibrium, x the states in the model's order, u the command.
    ``begin @ y`` is the state z to switch on with, the rig at rest at y: no jump is then taken for a speed.
    """

    A: Array
    B: Array
    E: Array
    C: Array
    D: Array
    begin: Array
    period: float
    name: str

    def noise(self, resolution: ArrayLike) -> Array:
        """Standard deviation of each estimated state [its unit] from the rounding of the encoders alone, shape (n,).

        Parameters
        ----------
        resolution : float or array, shape (p,)
            Step of each encoder [rad or m]; its rounding is white with variance ``resolution^2/12`` (Widrow), true for
            a body that crosses several steps between samples.
        """
        variance = np.broadcast_to(np.asarray(resolution, dtype=np.float64) ** 2 / 12, (self.B.shape[1],))
        spread = stationary(self.A, self.B * np.sqrt(variance))
        return np.sqrt(np.diag(self.C @ spread @ self.C.T + (self.D * variance) @ self.D.T))


def difference(model: StateSpace) -> Estimator:
    """Plain difference of two readings, ``v[k] = (y[k] - y[k-1])/T``; its noise is ``resolution/(T sqrt 6)``."""
    return filtered(model, 0.0)


def filtered(model: StateSpace, memory: float) -> Estimator:
    """Difference through a low pass, ``v[k] = a v[k-1] + (1 - a) (y[k] - y[k-1])/T``.

    Its noise has the variance ``resolution^2/12 * 2 (1 - a)^2/((1 + a) T^2)``; it is late by about ``a/(1 - a)``
    samples more than the half of one that every difference is.

    Parameters
    ----------
    model : StateSpace
        Whose outputs are every second state: positions, each followed by its velocity.
    memory : float
        a, from 0 (plain difference) to below 1.
    """
    without_feedthrough(model, "a difference of readings")
    p = model.C.shape[0]
    if not np.array_equal(model.C[:, : 2 * p], np.kron(np.eye(p), [1.0, 0.0])):
        raise BadInput("differences need every position measured and followed by its velocity; use an observer.")
    A, B, C, D = differences(p, model.period, memory)
    name = f"filtered difference, a = {memory:g}" if memory else "plain difference"
    E = np.zeros((A.shape[0], model.B.shape[1]))
    return Estimator(A=A, B=B, E=E, C=C, D=D, begin=np.eye(A.shape[0], p), period=model.period, name=name)


def observer(model: StateSpace, gain: ArrayLike, name: str = "observer") -> Estimator:
    """Observer that corrects with the newest reading: ``x = x_p + L (y - C x_p)``, ``x_p[k+1] = A x[k] + B u[k]``.

    Parameters
    ----------
    gain : array, shape (n, p)
        L, for instance from `kalman`.
    """
    without_feedthrough(model, "an observer")
    L = np.asarray(gain, dtype=np.float64)
    if L.shape != model.C.T.shape:
        raise BadInput(f"an observer of this model needs a gain of shape {model.C.T.shape}, got {L.shape}.")
    remaining = np.eye(model.A.shape[0]) - L @ model.C
    begin: Array = np.linalg.pinv(model.C).astype(np.float64)
    return Estimator(
        A=model.A @ remaining, B=model.A @ L, E=model.B, C=remaining, D=L, begin=begin, period=model.period,
        name=name,
    )  # fmt: skip


def placed_observer(model: StateSpace, poles: ArrayLike) -> Estimator:
    """Observer whose error dies out with the `poles` asked [z]; drive and commands on their way need no correction.

    A model in which something dies out within one sample is corrected by the reading of the sample before, since its
    transition cannot be undone.

    Parameters
    ----------
    poles : array, shape (n,)
        In conjugate pairs; n without drive and commands on their way.

    Raises
    ------
    BadInput
        When the outputs do not show a mode, or the poles cannot be had.
    """
    without_feedthrough(model, "an observer")
    n, T = model.A.shape[0] - model.remembered, model.period
    A, C = model.A[:n, :n], model.C[:, :n]
    z = conjugate_poles(poles, n)
    slope = (A - np.eye(n)) / T  # (z - 1)/T spreads poles that crowd at 1
    unseen = np.array(lost_modes(slope.T, C.T))
    if unseen.size:
        raise BadInput(
            f"the outputs do not show the mode at {written(to_s(1 + T * unseen, T))} 1/s, so no observer finds the "
            "states; measure another output, or leave that mode out of the model."
        )
    newest = float(np.abs(np.linalg.eigvals(A)).min()) > 1e-9
    gain = place(slope.T, ((C @ A) if newest else C).T / T, (z - 1) / T).K.T  # duality
    L = np.vstack([gain, np.zeros((model.remembered, gain.shape[1]))])
    begin: Array = np.zeros_like(L)
    begin[:n] = np.linalg.pinv(C)
    if newest:
        return replace(observer(model, L), begin=begin)
    return Estimator(
        A=model.A - L @ model.C, B=L, E=model.B, C=np.eye(model.A.shape[0]), D=np.zeros_like(L),
        begin=begin, period=T, name="observer, a sample late",
    )  # fmt: skip


def read_off(model: StateSpace) -> Estimator:
    """States read off the outputs, of which there are enough: nothing is estimated."""
    without_feedthrough(model, "reading states off the outputs")
    n = model.A.shape[0] - model.remembered
    C, (p, m) = model.C[:, :n], (model.C.shape[0], model.B.shape[1])
    if np.linalg.matrix_rank(C) < n or model.C[:, n:].any():
        raise BadInput("the outputs do not tell every state by themselves; use an observer.")
    return Estimator(
        A=np.zeros((0, 0)), B=np.zeros((0, p)), E=np.zeros((0, m)), C=np.zeros((n, 0)),
        D=np.linalg.pinv(C).astype(np.float64), begin=np.zeros((0, p)), period=model.period, name="states as measured",
    )  # fmt: skip


def kalman(model: StateSpace, process: ArrayLike, noise: ArrayLike) -> Estimator:
    """Steady Kalman filter, the observer with the least variance.

    Parameters
    ----------
    process : float or array, shape (n, n)
        What shakes the states from sample to sample: a covariance, or one number, the standard deviation of a white
        force held over a period [the input's unit].
    noise : float or array, shape (p,)
        Standard deviation of each reading; ``resolution/sqrt(12)`` for an encoder.

    Raises
    ------
    BadInput
        When a reading is taken as exact, or the filter does not exist (a mode that the outputs do not show).
    """
    from scipy.linalg import solve_discrete_are

    W = np.asarray(process, dtype=np.float64)
    W = model.B @ model.B.T * float(W) ** 2 if W.ndim == 0 else W
    p = model.C.shape[0]
    V = np.diag(np.broadcast_to(np.asarray(noise, dtype=np.float64) ** 2, (p,)))
    if not np.all(np.diag(V) > 0):
        raise BadInput("a Kalman filter needs readings with noise above 0; give resolution/sqrt(12) for an encoder.")
    try:
        solve: Any = solve_discrete_are
        P = np.asarray(solve(model.A.T, model.C.T, W, V), dtype=np.float64)
    except (np.linalg.LinAlgError, ValueError):
        raise BadInput(
            "there is no steady Kalman filter: a mode that grows or stays is not shown by the outputs, or nothing "
            "shakes it; measure another coordinate or give a process noise on every state."
        ) from None
    gain = np.linalg.solve(model.C @ P @ model.C.T + V, model.C @ P).T
    return observer(model, gain, "Kalman filter")


def process_noise(model: StateSpace, accelerations: ArrayLike) -> Array:
    """Covariance of what shakes every coordinate by itself, for `kalman`: a white acceleration held over a period.

    A force that enters like the command alone is a poor guess where bodies are also pushed by hands and dry friction:
    the filter then corrects a push on the pendulum no faster than the plant's own zeros let it.

    Parameters
    ----------
    model : StateSpace
        Whose first states are coordinates, each followed by its velocity.
    accelerations : float or array, shape (p,)
        Standard deviation of the acceleration of each coordinate [m/s^2 or rad/s^2].
    """
    p = model.C.shape[0]
    Q = np.zeros_like(model.A)
    for i, a in enumerate(np.broadcast_to(np.asarray(accelerations, dtype=np.float64), (p,)).tolist()):
        moved = np.zeros(Q.shape[0])
        moved[2 * i : 2 * i + 2] = model.period**2 / 2, model.period
        Q += a**2 * np.outer(moved, moved)
    return Q


def stationary(A: Array, B: Array) -> Array:
    """Covariance that unit white noise keeps up, ``P = A P A' + B B'``, by doubling; A must be stable.

    Doubling sums ``A^k B B' A'^k``: it subtracts nothing, so states of very different size do not disturb each other.
    """
    if np.abs(np.linalg.eigvals(A)).max(initial=0.0) >= 1:
        raise BadInput("noise has no stationary level in a loop that is not stable; stabilize it first.")
    P, power = B @ B.T, A
    for _ in range(60):
        P, power = P + power @ P @ power.T, power @ power
        if np.abs(power).max(initial=0.0) < 1e-20:
            break
    return P


def without_feedthrough(model: StateSpace, what: str) -> None:
    """Refuse a model whose readings show the command of the same sample.

    Raises
    ------
    BadInput
        When D is not zero.
    """
    if model.D.any():
        raise BadInput(
            f"{what} needs readings that the command of the same sample does not change, and D is not zero here; let "
            "the command come a sample late (hold(..., delay=1)), as a computer's does."
        )
