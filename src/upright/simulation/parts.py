"""What closes the loop, and what is moved by hand?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.law.linear import shared

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Loop:
    """Sampled controller between encoders and actuator, evaluated at every sample, its output held until the next.

    ``u[k] = u_ff[k] + k_pf r[k] - K . [y - target, velocity]``, limited to the actuator's limit, where
    ``velocity[k] = alpha velocity[k-1] + (1 - alpha) (y[k] - y[k-1]) / dt`` starts from zero.

    Attributes
    ----------
    K : array, shape (states,), (inputs, states) or (inputs, states, lanes)
        Gains in the order of the states: coordinate, its velocity, next coordinate, ...
    target : float or array, shape (coordinates,) or (coordinates, lanes)
        Set point of each coordinate [rad or m].
    k_pf : float or array, shape (lanes,)
        Gain on the reference.
    reference : array, shape (T,), optional
        Reference signal at the samples; its last value is held.
    quantum : float or array, shape (coordinates,)
        Resolution of each encoder [rad or m], ``y = floor(q/quantum + 1/2) quantum``; 0 for none.
    alpha : float
        Memory of the differentiator's filter, 0 for plain differences.
    delay : float
        Computational delay in samples, whole or not; the output is zero before the first one arrives.
    velocity : {"difference", "true"}
        Velocities from the differentiator or from the states themselves.
    """

    K: ArrayLike
    target: ArrayLike = 0.0
    k_pf: ArrayLike = 0.0
    reference: ArrayLike | None = None
    quantum: ArrayLike = 0.0
    alpha: float = 0.0
    delay: float = 0.0
    velocity: Literal["difference", "true"] = "difference"

    def __post_init__(self) -> None:
        if not 0.0 <= self.alpha < 1.0:
            raise BadInput(f"alpha must lie in [0, 1), got {self.alpha:g}; 0 means plain differences.")
        if not 0.0 <= self.delay < 1e4:
            raise BadInput(f"the loop's delay must be at least 0 samples, got {self.delay:g}; give it in samples.")
        if np.any(np.asarray(self.quantum) < 0.0):
            raise BadInput("an encoder's quantum must be at least 0, which means no rounding.")

    def widths(self) -> dict[str, int]:
        """Lanes that each array is given for."""
        K, target = np.shape(self.K), np.shape(self.target)
        return {
            "K": K[2] if len(K) == 3 else 1,
            "target": target[1] if len(target) == 2 else 1,
            "k_pf": np.size(self.k_pf),
        }

    def scalars(self, n: int, nu: int) -> Array:
        """What all lanes share, as the kernel reads it: quanta, alpha, whether speeds are the states', delay, ..."""
        return shared(self.quantum, 0.0, n, nu, (self.alpha, float(self.velocity == "true"), self.delay))

    def rows(self, n: int, nu: int, lanes: int) -> Array:
        """Gains, targets and prefilter as the kernel reads them, shape (nu*2n + n + 1, lanes)."""
        K: Array = np.asarray(self.K, dtype=np.float64)
        K = K.reshape(1, -1) if K.ndim == 1 else K
        K = K[:, :, None] if K.ndim == 2 else K
        if K.shape[:2] != (nu, 2 * n) or K.shape[2] not in (1, lanes):
            raise BadInput(f"K needs shape ({nu}, {2 * n}) or ({nu}, {2 * n}, {lanes}), got {np.shape(self.K)}.")
        target = np.asarray(self.target, dtype=np.float64)
        target = target[:, None] if target.ndim == 1 else target
        if target.ndim == 2 and (target.shape[0] != n or target.shape[1] not in (1, lanes)):
            raise BadInput(f"target needs shape ({n},) or ({n}, {lanes}), got {np.shape(self.target)}.")
        k_pf = np.asarray(self.k_pf, dtype=np.float64)
        if k_pf.ndim > 1 or (k_pf.ndim == 1 and k_pf.size not in (1, lanes)):
            raise BadInput(f"k_pf needs one value or {lanes}, got shape {k_pf.shape}.")
        out = np.empty((nu * 2 * n + n + 1, lanes))
        out[: nu * 2 * n] = K.reshape(nu * 2 * n, -1)
        out[nu * 2 * n : -1] = target
        out[-1] = k_pf
        return out

    def signal(self) -> Array:
        """Reference as an array, empty when there is none."""
        r = np.zeros(0) if self.reference is None else np.ascontiguousarray(self.reference, dtype=np.float64)
        if r.ndim != 1:
            raise BadInput(f"the reference needs shape (T,), got {r.shape}.")
        return r


@dataclass(frozen=True, kw_only=True, eq=False)
class Held:
    """A coordinate whose motion is prescribed; the others feel its acceleration.

    ``Held()`` locks the coordinate where it starts. ``Held(q=...)`` takes its positions at the samples, shape (T,),
    and runs a cubic spline with continuous acceleration through them: smooth a rough measurement first.
    With `v` and `a` all three are given at every half substep, shape (2 substeps (T-1) + 1,), and used as they are.
    """

    q: ArrayLike | None = None
    v: ArrayLike | None = None
    a: ArrayLike | None = None

    @property
    def locked(self) -> bool:
        """Whether the coordinate stays where it starts."""
        return self.q is None

    def grid(self, dt: float, substeps: int) -> Array:
        """Position, velocity and acceleration at every half substep, shape (., 3).

        Raises
        ------
        BadInput
            When the arrays are too short, of different lengths or not finite.
        """
        if self.q is None:
            return np.zeros((1, 3))
        q = np.asarray(self.q, dtype=np.float64)
        if q.ndim != 1 or q.size < 2 or not np.all(np.isfinite(q)):
            raise BadInput(f"a held coordinate needs at least two finite positions in one array, got shape {q.shape}.")
        if self.v is not None and self.a is not None:
            v, a = np.asarray(self.v, dtype=np.float64), np.asarray(self.a, dtype=np.float64)
            if v.shape != q.shape or a.shape != q.shape:
                raise BadInput(f"held q, v and a need one length, got {q.shape}, {v.shape} and {a.shape}.")
            return np.stack([q, v, a], axis=1)
        if q.size < 4:
            return _parabola(q, dt, substeps)
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(np.arange(q.size) * dt, q)
        t = np.arange(2 * substeps * (q.size - 1) + 1) * (0.5 * dt / substeps)
        return np.stack([spline(t), spline(t, 1), spline(t, 2)], axis=1)


def _parabola(q: Array, dt: float, substeps: int) -> Array:
    t = np.arange(2 * substeps * (q.size - 1) + 1) * (0.5 * dt / substeps)
    c = np.polynomial.Polynomial.fit(np.arange(q.size) * dt, q, q.size - 1)
    return np.stack([c(t), c.deriv(1)(t), c.deriv(2)(t)], axis=1)
