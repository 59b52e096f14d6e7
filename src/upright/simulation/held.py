"""Motion of a coordinate that is prescribed: locked, or moved along measured positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput

Array = NDArray[np.float64]


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
